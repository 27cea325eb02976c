#!/usr/bin/env python3
# label: slow
# timeout: 1800
"""The window, driven by real mouse and key events on a display in memory (Xvfb).

What the camera does is read from --camera-log and held against the mathematics of _common.py; what is drawn is read back
from the screen.
"""
import os
import re
import shutil
import subprocess
import sys
import time
import unittest

import numpy as np
from osgeo import gdal

from _common import EARTH, PROGRAM, ROOT, Camera, Case, GeographicRaster, angle_between, camera_text, read_picture, read_trace
from _x11 import ask_to_close, drop_files

SIZE = (640, 480)
MIDDLE = (SIZE[0] / 2, SIZE[1] / 2)
SEEN = slice(50, -65)  # rows without the toolbar, the status line and the credits above it
ALPS = (45.5, 8.0, 250e3, 30.0, -55.0)
HELD = "0.15"  # seconds; shorter clicks could fall between two frames


def run_on_display_in_memory():
    """Starts this script again under xvfb-run. Exit status 77 (skipped) if that is not installed."""
    missing = [tool for tool in ("xvfb-run", "xdotool", "import") if not shutil.which(tool)]
    if missing:
        print(f"skipped: {', '.join(missing)} missing (tools/setup.sh --test installs them)")
        sys.exit(77)
    os.environ["TELLURION_ON_XVFB"] = "1"
    os.execvp("xvfb-run", ["xvfb-run", "-a", "-s", "-screen 0 1280x800x24 -nolisten tcp -noreset -r", sys.executable, *sys.argv])


class Viewer:
    """The program with its window. Positions are pixels of the window."""

    def __init__(self, folder, camera, *options, world=()):
        self.folder, self.trace, self.log = folder, folder / "trace.csv", folder / "camera.csv"
        for file in (self.trace, self.log):
            file.unlink(missing_ok=True)
        command = [PROGRAM, "view", *world, "--camera", camera_text(camera), "--size", f"{SIZE[0]}x{SIZE[1]}",
                   "--trace", self.trace, "--camera-log", self.log, *options]
        self.process = subprocess.Popen(list(map(str, command)), cwd=folder, stderr=subprocess.PIPE, text=True,
                                        env=os.environ | {"XDG_CACHE_HOME": str(folder / "cache")})
        self.window = self.wait_for_window()
        self.do("windowfocus", self.window)
        self.settle()

    def wait_for_window(self, timeout=120):
        search = ["xdotool", "search", "--onlyvisible", "--pid", str(self.process.pid), "--name", "Tellurion"]
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            self.assert_runs()
            found = subprocess.run(search, capture_output=True, text=True, timeout=60).stdout.split()
            if found:
                return int(found[0])
            time.sleep(0.1)
        self.process.kill()
        raise AssertionError(f"no window after {timeout} s")

    def assert_runs(self):
        if self.process.poll() is not None:
            raise AssertionError(f"ended with status {self.process.returncode}: {self.process.stderr.read()}")

    def do(self, *words):
        """Runs words of xdotool."""
        self.frames_before = self.frames()
        subprocess.run(["xdotool", *map(str, words)], check=True, timeout=60)

    def at(self, point):
        return ["mousemove", "--window", self.window, round(point[0]), round(point[1])]

    def drag(self, button, start, end, hold_key=None):
        path = [np.add(start, np.subtract(end, start) * part) for part in np.linspace(0.0, 1.0, 9)[1:]]
        words = [*self.at(start), "sleep", HELD]
        words += ["keydown", hold_key] if hold_key else []
        words += ["mousedown", button, "sleep", HELD]
        for point in path:
            words += [*self.at(point), "sleep", "0.03"]
        words += ["sleep", "0.3", "mouseup", button]  # resting before letting go: nothing is thrown
        words += ["keyup", hold_key] if hold_key else []
        self.do(*words)
        self.settle()

    def wheel(self, steps, point):
        self.do(*self.at(point), "sleep", HELD, *["click", 4 if steps > 0 else 5, "sleep", "0.05"] * abs(steps))
        self.settle()

    def key(self, *names):
        self.do(*(word for name in names for word in ("key", name, "sleep", "0.05")))
        self.settle()

    def hold(self, key, seconds):
        self.do("keydown", key, "sleep", seconds, "keyup", key)
        self.settle()

    def drop(self, *files):
        """Drops files on the window's middle; all that comes of it is drawn when this ends."""
        self.frames_before = self.frames()
        drop_files(self.window, files, MIDDLE)
        self.settle()

    def frames(self):
        return max(len(self.log.read_text().splitlines()) - 1, 0) if self.log.exists() else 0

    def settle(self, timeout=120):
        """Waits until the picture is complete and no more frames are drawn; at least one must come after the last action."""
        end = time.monotonic() + timeout
        count, since = self.frames_before, time.monotonic()
        while time.monotonic() < end:
            self.assert_runs()
            now = self.frames()
            if now != count:
                count, since = now, time.monotonic()
            elif now > self.frames_before and self.figures()["complete"] == 1.0:
                if time.monotonic() - since > max(0.7, 5e-3 * self.figures()["frame_ms"]):
                    return
            time.sleep(0.05)
        raise AssertionError(f"still not at rest after {timeout} s: {self.figures()}")

    def figures(self):
        return read_trace(self.trace)[-1]

    def pose(self):
        return tuple(map(float, self.log.read_text().splitlines()[-1].split(",")[1:]))

    def camera(self):
        return Camera(EARTH, self.pose(), SIZE)

    def screen(self, name):
        """What the window shows, of the rows SEEN."""
        file = self.folder / f"{name}.png"
        subprocess.run(["import", "-window", str(self.window), f"png24:{file}"], check=True, timeout=60)
        return read_picture(file)[SEEN].astype(int)

    def close(self, key="Escape"):
        self.do("key", key)
        return self.process.wait(30)


def ground_at(elevation, camera, pixel):
    """Where the ray through `pixel` meets the ground: latitude and longitude follow from ever better heights."""
    ray = camera.rays(*pixel)
    height = 0.0
    for _ in range(60):
        raised = type(EARTH)(EARTH.a + height, EARTH.b + height)
        point = camera.eye + ray * raised.hit_distance(camera.eye, ray)
        lat, lon = place_of(point)
        height += 0.5 * (float(elevation.bilinear(lat, lon)) - height)
    return point


def place_of(point):
    """Latitude and longitude in degrees (Bowring's iteration)."""
    x, y, z = point
    p = np.hypot(x, y)
    phi = np.arctan2(z, p * (1.0 - EARTH.e2))
    for _ in range(10):
        n = EARTH.a / np.sqrt(1.0 - EARTH.e2 * np.sin(phi) ** 2)
        phi = np.arctan2(z + EARTH.e2 * n * np.sin(phi), p)
    return np.degrees(phi), np.degrees(np.arctan2(y, x))


def pixels_off(camera, pixel, point):
    """How far from `pixel` the camera sees `point`."""
    return float(angle_between(camera.rays(*pixel), point - camera.eye)) / camera.pixel_angle


class WindowTest(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.elevation = GeographicRaster(ROOT / "data/earth/elevation.tif")

    def open(self, camera, *options, **more):
        viewer = Viewer(self.folder, camera, *options, **more)
        self.addCleanup(viewer.process.stderr.close)
        self.addCleanup(viewer.process.wait)
        self.addCleanup(viewer.process.kill)
        self.viewer = viewer
        return viewer

    def ground(self, camera, pixel):
        return ground_at(self.elevation, camera, pixel)

    def assert_sees(self, pixel, point, within=2.0):
        self.assertLess(pixels_off(self.viewer.camera(), pixel, point), within)


class Picture(WindowTest):
    def test_the_window_shows_what_render_draws_and_then_rests(self):
        viewer = self.open(ALPS)
        shown = viewer.screen("window")
        drawn = read_picture(self.render(ROOT / "data/earth/world.toml", ALPS, "--size", f"{SIZE[0]}x{SIZE[1]}"))
        far = np.abs(shown - drawn[SEEN]).max(axis=-1) > 12
        self.assertLess(far.mean(), 0.01)
        frames, ticks = viewer.frames(), self.processor_ticks()
        time.sleep(3.0)
        self.assertLessEqual(viewer.frames() - frames, 1)
        self.assertLess((self.processor_ticks() - ticks) / os.sysconf("SC_CLK_TCK"), 0.3, "seconds of processor time in 3 s of rest")
        self.assertEqual(viewer.close(), 0)

    def processor_ticks(self):
        with open(f"/proc/{self.viewer.process.pid}/stat") as stat:
            return sum(map(int, stat.read().rsplit(")", 1)[1].split()[11:13]))

    def test_keys_switch_parts_of_the_picture_and_back(self):
        viewer = self.open(ALPS)
        before = viewer.screen("before")
        for key, least_share in (("l", 0.05), ("o", 0.05), ("f", 0.1), ("b", 0.002), ("t", 0.002)):
            viewer.key(key)
            changed = np.abs(viewer.screen(f"key_{key}") - before).max(axis=-1) > 8
            self.assertGreater(changed.mean(), least_share, f"{key} changes the picture")
            viewer.key(key)
            self.assertLess((np.abs(viewer.screen("again") - before).max(axis=-1) > 2).mean(), 1e-3, f"{key} again undoes it")

    def test_exaggeration_lifts_the_ground_and_comes_back(self):
        viewer = self.open((45.9, 7.0, 6000.0, 90.0, -10.0))
        def sky(name):
            return (viewer.screen(name).sum(axis=-1) == 0).mean()
        viewer.key("o")  # without atmosphere the sky is black
        before = sky("flat")
        viewer.key(*["bracketright"] * 4)
        self.assertLess(sky("lifted"), before - 0.01)
        time.sleep(4.5)  # the notice goes
        viewer.key(*["bracketleft"] * 4)
        self.assertAlmostEqual(sky("flat_again"), before, delta=0.002)

    def test_frozen_tiles_stay_while_the_camera_moves(self):
        viewer = self.open(ALPS)
        viewer.key("c")
        before = viewer.figures()["tiles_drawn_by_level"]
        viewer.wheel(8, MIDDLE)
        self.assertEqual(viewer.figures()["tiles_drawn_by_level"], before)
        viewer.key("c")
        self.assertNotEqual(viewer.figures()["tiles_drawn_by_level"], before)

    def test_panels_open_and_close(self):
        viewer = self.open(ALPS)
        before = viewer.screen("no_panels")
        for key in ("F1", "F2", "F3", "F4"):
            viewer.key(key)
            self.assertGreater((viewer.screen(f"panel_{key}") != before).any(axis=-1).mean(), 0.1, key)
            viewer.key(key)
            self.assertLess((np.abs(viewer.screen("closed") - before).max(axis=-1) > 2).mean(), 1e-3, key)

    def test_layers_are_switched_faded_and_saved(self):
        file = self.folder / "mine.toml"
        text = ('# My world.\n[[layer]]\ngroup = "color"  # below\nsource = { path = "%s" }\n\n# Above.\n[[layer]]\nname = "Lights"\ngroup = "color"\nsource = { path = "%s" }\n'
                % (ROOT / "data/earth/blue_marble.tif", ROOT / "data/earth/night_lights.tif"))
        file.write_text(text)
        viewer = self.open(ALPS, world=[file])
        viewer.key("F3")  # the panel covers the left; its first layer is the uppermost
        beside = np.s_[:, 440:]
        switch, fade, save, down = (33, 138), (80, 167), (88, 92), (95, 138)

        def click(point):
            viewer.do(*viewer.at(point), "sleep", HELD, "mousedown", 1, "sleep", HELD, "mouseup", 1)
            viewer.settle()

        def shown(name):
            return viewer.screen(name)[beside]

        lights = shown("lights")
        click(switch)
        marble = shown("marble")
        self.assertGreater((np.abs(lights - marble).max(axis=-1) > 16).mean(), 0.2)
        click(switch)
        self.assertLess((np.abs(shown("again") - lights).max(axis=-1) > 2).mean(), 1e-3)
        click(fade)
        share = float((80 - 27) / (290 - 27))  # of the slider's way
        mixed = np.abs(shown("mixed") - (share * lights + (1 - share) * marble))
        self.assertLess(np.median(mixed), 12)
        click(save)
        saved = file.read_text()
        self.assertRegex(saved, r'# Above\.\n\[\[layer\]\]\nopacity = 0\.\d+\nname = "Lights"')
        self.assertEqual("".join(line for line in saved.splitlines(True) if not line.startswith("opacity")), text)
        click(down)
        self.assertLess((np.abs(shown("below") - marble).max(axis=-1) > 2).mean(), 1e-3)
        click(save)
        self.assertLess(file.read_text().index("Lights"), file.read_text().index("# below"))
        self.assertEqual(viewer.close(), 0)

    def raster(self, name, *bands, kind=gdal.GDT_Byte):
        """Samples, the same in all places or 64 x 64, of 6 to 10 degrees east and 44 to 47 north."""
        file = self.folder / name
        file.parent.mkdir(exist_ok=True)
        data = gdal.GetDriverByName("GTiff").Create(str(file), 64, 64, len(bands), kind)
        data.SetGeoTransform((6.0, 4 / 64, 0.0, 47.0, 0.0, -3 / 64))
        data.SetProjection("EPSG:4326")
        for number, samples in enumerate(bands, 1):
            data.GetRasterBand(number).WriteArray(np.full((64, 64), samples, float))
        return file

    def test_dropped_files_become_layers_for_this_run_or_are_kept(self):
        text = '# My world.\n[[layer]]\nname = "Marble"\ngroup = "color"\nsource = { path = "%s" }\n' % (ROOT / "data/earth/blue_marble.tif")
        file = self.folder / "dropped.toml"
        file.write_text(text)
        red = self.raster("red.tif", 200, 30, 30)
        hills = self.raster("hills.tif", 3000 + 2900 * np.sin(np.arange(64) / 4), kind=gdal.GDT_Int16)
        self.raster("many/green.tif", 30, 200, 30)
        bad = self.folder / "bad.tif"
        bad.write_text("no raster")
        viewer = self.open(ALPS, world=[file])
        beside = np.s_[:, 440:]  # of the panel of layers
        remove, fly, save = (120, 279), (52, 279), (88, 92)

        def click(point):
            viewer.do(*viewer.at(point), "sleep", HELD, "mousedown", 1, "sleep", HELD, "mouseup", 1)
            viewer.settle()

        def share_of(colour, picture):
            others = np.delete(picture, colour, axis=-1).max(axis=-1)
            return (picture[..., colour] > 1.8 * others).mean()

        start = viewer.screen("before_drop")
        self.assertLess(share_of(0, start), 0.01)
        viewer.drop(red)
        self.assertGreater(share_of(0, viewer.screen("dropped_red")), 0.3)
        viewer.drop(hills, bad, file, self.folder / "many")
        viewer.key("F3")
        viewer.key("l", "l")  # redrawn
        self.assertGreater(share_of(1, viewer.screen("dropped_folder")[beside]), 0.1)
        self.assertEqual(file.read_text(), text)
        click(save)
        time.sleep(12.5)  # what is told of them goes
        viewer.key("l", "l")
        shown = viewer.screen("dropped_all")[beside]
        self.assertTrue(file.read_text().startswith(text))
        listed = self.tellurion("world", "list", file).stdout
        for line in (r"1  color +Marble\n", r"height +hills.tif\n", r"color +red.tif\n", r"color +many\n +catalogue "):
            self.assertRegex(listed, line)
        self.assertNotIn("bad.tif", listed)
        drawn = read_picture(self.render(file, ALPS, "--size", f"{SIZE[0]}x{SIZE[1]}"))[SEEN][beside]
        self.assertLess((np.abs(shown - drawn)[100:].max(axis=-1) > 12).mean(), 0.01)  # of the rows below the hint
        click(remove)  # the uppermost: the folder
        self.assertGreater(share_of(0, viewer.screen("removed_folder")[beside]), 0.1)
        click(remove)
        self.assertLess(share_of(0, viewer.screen("removed_red")[beside]), 0.01)
        click(save)
        listed = self.tellurion("world", "list", file).stdout
        self.assertNotIn("red.tif", listed)
        self.assertNotIn("many", listed)
        viewer.drop(red)
        before = viewer.pose()
        click(fly)
        time.sleep(3.0)
        viewer.settle()
        self.assertAlmostEqual(viewer.pose()[0], 45.5, delta=0.1)
        self.assertAlmostEqual(viewer.pose()[1], 8.0, delta=0.1)
        self.assertNotEqual(viewer.pose()[2], before[2])
        self.assertEqual(viewer.close(), 0)
        told = viewer.process.stderr.read()
        self.assertEqual(len(re.findall(r"^tellurion: .*(bad\.tif: no raster|dropped\.toml: a world file)", told, re.M)), 2, told)
        self.assertNotIn("red.tif", self.tellurion("world", "list", file).stdout)

    def test_opengl_es_shows_the_same(self):
        pictures = []
        for api in ("core", "es"):
            viewer = self.open(ALPS, "--gl", api)
            pictures.append(viewer.screen(api))
            self.assertEqual(viewer.close(), 0)
        self.assertLess((np.abs(pictures[0] - pictures[1]).max(axis=-1) > 8).mean(), 1e-3)


class Motion(WindowTest):
    def test_dragging_keeps_the_ground_under_the_cursor(self):
        viewer = self.open(ALPS)
        for start, end in (((200, 300), (420, 260)), ((420, 260), (330, 400))):
            before = viewer.camera()
            place, height = self.ground(before, start), viewer.pose()[2]
            viewer.drag(1, start, end)
            self.assert_sees(end, place)
            self.assertAlmostEqual(viewer.pose()[2], height, delta=1e-3 * height)

    def test_a_thrown_globe_slides_on_and_comes_to_rest(self):
        viewer = self.open((10.0, 20.0, 4e6))
        words = [*viewer.at((250, 240)), "sleep", HELD, "mousedown", 1, "sleep", HELD]
        for x in range(260, 401, 10):
            words += [*viewer.at((x, 240)), "sleep", "0.01"]
        place = self.ground(viewer.camera(), (250, 240))
        viewer.do(*words, "mouseup", 1)
        viewer.settle()
        self.assertGreater(pixels_off(viewer.camera(), (400, 240), place), 10.0)

    def test_the_wheel_takes_a_tenth_of_the_distance_a_step_and_keeps_the_place(self):
        viewer = self.open((20.0, 0.0, 3e6))
        cursor = (230, 150)
        before = viewer.camera()
        place = self.ground(before, cursor)
        for steps in (1, 4, -3):
            distance = np.linalg.norm(place - viewer.camera().eye)
            viewer.wheel(steps, cursor)
            self.assert_sees(cursor, place)
            self.assertAlmostEqual(np.linalg.norm(place - viewer.camera().eye) / distance / 0.9 ** steps, 1.0, delta=2e-3)
        height = viewer.pose()[2]
        viewer.wheel(5, MIDDLE)
        self.assertLess(viewer.pose()[2], 0.62 * height)

    def test_zooming_out_turns_back_to_the_middle_with_north_up(self):
        viewer = self.open((45.0, 8.0, 1e6, 70.0, -40.0))
        for _ in range(4):
            viewer.wheel(-10, MIDDLE)
        lat, lon, height, *_ = viewer.pose()
        self.assertGreater(height, 1e7)
        camera, level = viewer.camera(), Camera(EARTH, (lat, lon, height, 0.0, 0.0), SIZE)
        self.assertLess(np.degrees(angle_between(camera.forward, -level.up)), 2.0)
        self.assertLess(np.degrees(angle_between(camera.up, level.forward)), 2.0)

    def test_the_right_button_tilts_about_the_place_under_the_cursor(self):
        viewer = self.open((45.5, 8.0, 250e3, 0.0, -80.0))
        for button, key in ((3, None), (1, "ctrl")):
            pivot, before = (300, 250), viewer.camera()
            place, (_, _, _, heading, pitch, _) = self.ground(before, pivot), viewer.pose()
            viewer.drag(button, pivot, (pivot[0] + 40, pivot[1] - 60), key)
            after = viewer.camera()
            self.assertGreater(viewer.pose()[4], pitch + 10.0)
            self.assertGreater(abs(viewer.pose()[3] - heading), 5.0)
            self.assert_sees(pivot, place)
            self.assertAlmostEqual(np.linalg.norm(place - after.eye) / np.linalg.norm(place - before.eye), 1.0, delta=2e-3)

    def test_tilting_ends_before_the_ground_is_passed(self):
        viewer = self.open((20.0, 0.0, 50e3, 0.0, -60.0))
        viewer.drag(3, (320, 400), (320, 20))
        self.assertLess(viewer.pose()[4], 10.0)
        self.assertGreater(viewer.pose()[2], 100.0)

    def test_the_middle_button_looks_around_in_place(self):
        viewer = self.open((45.5, 8.0, 20e3, 30.0, -10.0))
        for button, key in ((2, None), (1, "shift")):
            before, pose = viewer.camera(), viewer.pose()
            viewer.drag(button, (300, 240), (400, 200), key)
            self.assertLess(np.linalg.norm(viewer.camera().eye - before.eye), 0.01)
            self.assertLess(viewer.pose()[3], pose[3] - 3.0)
            self.assertLess(viewer.pose()[4], pose[4] - 1.0)

    def test_a_double_click_flies_to_the_place(self):
        viewer = self.open(ALPS)
        before = viewer.camera()
        place = self.ground(before, (420, 300))
        viewer.do(*viewer.at((420, 300)), "sleep", HELD, "click", "--repeat", 2, "--delay", 120, 1)
        time.sleep(1.0)
        viewer.settle()
        self.assert_sees(MIDDLE, place, within=4.0)
        self.assertAlmostEqual(np.linalg.norm(place - viewer.camera().eye) / np.linalg.norm(place - before.eye), 0.35, delta=0.02)

    def test_keys_move_turn_and_zoom(self):
        viewer = self.open((20.0, 0.0, 300e3, 0.0, -60.0))
        start = viewer.pose()
        viewer.hold("d", 0.5)
        east = viewer.pose()
        self.assertGreater(east[1], start[1] + 0.05)
        self.assertAlmostEqual(east[2] / start[2], 1.0, delta=1e-3)
        viewer.hold("Up", 0.5)
        self.assertGreater(viewer.pose()[0], east[0] + 0.05)
        height = viewer.pose()[2]
        viewer.hold("q", 0.4)
        self.assertLess(viewer.pose()[2], 0.95 * height)
        height = viewer.pose()[2]
        viewer.key("plus", "plus")
        self.assertLess(viewer.pose()[2], 0.85 * height)

    def test_keys_turn_north_up_and_level_and_home(self):
        viewer = self.open((45.5, 8.0, 250e3, 110.0, -50.0))
        viewer.key("n")
        self.assertLess(abs((viewer.pose()[3] + 180.0) % 360.0 - 180.0), 0.2)
        self.assertAlmostEqual(viewer.pose()[4], -50.0, delta=2.5)
        viewer.key("r")
        self.assertLess(viewer.pose()[4], -89.8)
        viewer.key("h")
        self.assertGreater(viewer.pose()[2], 3e6)

    def test_the_eye_stays_above_the_ground(self):
        viewer = self.open((45.97, 7.66, 9000.0, 0.0, -20.0))
        viewer.hold("q", 8.0)
        time.sleep(1.0)
        lat, lon, height, *_ = viewer.pose()
        ground = float(self.elevation.bilinear(lat, lon))
        self.assertGreater(ground, 1000.0)
        self.assertGreater(height, ground + 2.5)
        self.assertLess(height, ground + 300.0)
        viewer.key(*["bracketright"] * 4)
        time.sleep(1.0)
        viewer.settle()
        self.assertGreater(viewer.pose()[2], 2.0 * ground + 2.5)

    def test_a_flight_is_recorded_replayed_and_appended(self):
        viewer = self.open(ALPS, "--flight", self.folder / "flight.csv")
        viewer.key("k")
        viewer.drag(1, (200, 300), (420, 260))
        viewer.wheel(3, MIDDLE)
        viewer.key("k")
        end = viewer.pose()
        flight = (self.folder / "flight.csv").read_text().splitlines()
        self.assertEqual(flight[0], "time,lat,lon,height,heading,pitch,roll")
        self.assertGreater(len(flight), 5)
        np.testing.assert_allclose([float(v) for v in flight[1].split(",")[1:]], [*ALPS, 0.0], atol=1e-5)
        viewer.key("h")
        viewer.key("j")
        time.sleep(float(flight[-1].split(",")[0]))
        viewer.settle()
        np.testing.assert_allclose(viewer.pose()[:3], end[:3], rtol=1e-6)
        viewer.key("k")
        viewer.wheel(2, MIDDLE)
        viewer.key("k")
        self.assertGreater(len((self.folder / "flight.csv").read_text().splitlines()), len(flight))


class Ending(WindowTest):
    def test_closed_by_the_window_manager_it_ends_well(self):
        viewer = self.open(ALPS)
        ask_to_close(viewer.window)
        self.assertEqual(viewer.process.wait(30), 0)
        self.assertEqual(viewer.process.stderr.read(), "")

    def test_a_screenshot_is_saved_under_the_next_free_number(self):
        viewer = self.open(ALPS)
        viewer.key("p", "p")
        for number in (1, 2):
            self.assertEqual(read_picture(self.folder / f"tellurion-{number:03}.png").shape, (SIZE[1], SIZE[0], 3))
        self.assertEqual(viewer.close(), 0)

    def test_without_a_display_it_says_what_to_do(self):
        done = self.tellurion("view", status=1)
        self.assertRegex(done.stderr, r"^tellurion: no window can be opened \(.+\): use tellurion render .*\n$")


if __name__ == "__main__":
    if "TELLURION_ON_XVFB" not in os.environ:
        run_on_display_in_memory()
    unittest.main(verbosity=2)
