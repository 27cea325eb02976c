"""What is fetched ahead: exactly the tiles of a region, or all that a flight needs."""
# label: slow
# timeout: 1200
import math
import os
import signal
import subprocess
import time
import unittest

from _common import ETOPO5, PROGRAM, SHARED, Case, shared
from _servers import NIGHT, RAINIER_TILES, TERRARIUM, TileServer


def columns_and_rows(west, south, east, north, zoom):
    """Tiles of Web Mercator that a region touches, by the formulas of OpenStreetMap's "Slippy map tilenames"."""
    side = 2 ** zoom

    def row(latitude):
        radians = math.radians(max(min(latitude, 85.0511), -85.0511))
        return min(max(int((1 - math.asinh(math.tan(radians)) / math.pi) / 2 * side), 0), side - 1)

    def column(longitude):
        return min(int((longitude + 180) / 360 * side), side - 1)

    across = range(column(west), column(east) + 1) if west < east else [*range(column(west), side), *range(0, column(east) + 1)]
    return {(zoom, x, y) for x in across for y in range(row(north), row(south) + 1)}


class Prefetch(Case):
    def world(self, name, *layers):
        path = self.folder / f"{name}.toml"
        path.write_text(f'[[layer]]\ngroup = "height"\nsource = {{ path = "{shared(ETOPO5)}", vertical = "ellipsoid" }}\n' +
                        "".join(f'[[layer]]\nname = "{name}{i}"\ngroup = "{group}"\nsource = {{ {source} }}\n' for i, (group, source) in enumerate(layers)))
        return path

    def night(self, server):
        return self.world("night", ("color", f'type = "xyz", url = "{server.url(NIGHT)}/{{z}}/{{x}}/{{-y}}.png", max_level = 4'))

    def prefetch(self, world, cache, *options, status=0):
        return self.tellurion("cache", "prefetch", world, "--disk-cache", cache, *options, status=status)

    def tiles_asked(self, server):
        """By zoom, column and row from the north; the server counts rows from the south."""
        found = set()
        for path in server.asked:
            zoom, column, row = (int(part.split(".")[0]) for part in path.split("/")[-3:])
            found.add((zoom, column, 2 ** zoom - 1 - row))
        return found

    view = (30, 30, 15000000, 0, -90)

    def test_all_of_a_planet_once_and_then_no_network(self):
        with TileServer() as server:
            world = self.night(server)
            online = self.render(world, self.view, "--disk-cache", self.folder / "other", name="online")
            server.asked.clear()
            done = self.prefetch(world, self.folder / "all", "--bounds", "-180,-90,180,90", "--levels", "0-4")
            self.assertIn("night0: levels 0 to 4, 341 tiles", done.stdout)
            self.assertEqual(self.tiles_asked(server), set().union(*(columns_and_rows(-180, -90, 180, 90, zoom) for zoom in range(5))))
            self.assertEqual(set(server.asked.values()), {1}, "no tile is asked for twice")
            server.asked.clear()
            self.prefetch(world, self.folder / "all", "--bounds", "-180,-90,180,90", "--levels", "0-4")
            self.assertFalse(server.asked, "what is there is not asked for again")
        offline = self.render(world, self.view, "--disk-cache", self.folder / "all", "--offline", name="offline")
        self.assertEqual(online.read_bytes(), offline.read_bytes())

    def test_a_region_and_one_across_longitude_180(self):
        for name, bounds, zooms in [("europe", (-10.5, 35.2, 30.1, 60.7), (2, 4)), ("pacific", (170, -20, -170, 15), (3, 4)), ("pole", (100, 60, 120, 90), (0, 3))]:
            with TileServer() as server:
                self.prefetch(self.night(server), self.folder / name, "--bounds", ",".join(map(str, bounds)), "--levels", "{}-{}".format(*zooms))
                wanted = set().union(*(columns_and_rows(*bounds, zoom) for zoom in range(zooms[0], zooms[1] + 1)))
                self.assertEqual(self.tiles_asked(server), wanted, name)
        # 20 km a pixel at the equator is between zoom 2 (39 km) and zoom 3.
        with TileServer() as server:
            self.prefetch(self.night(server), self.folder / "coarse", "--bounds", "-180,-85,180,85", "--resolution", "20000")
            self.assertEqual({tile[0] for tile in self.tiles_asked(server)}, {0, 1, 2, 3})

    def test_zooms_of_services_are_those_of_web_mercator_wherever_their_data_lie(self):
        for south, north in ((-10, 10), (50, 62), (70, 80)):
            with TileServer() as server:
                world = self.world("north", ("color", f'type = "tms", url = "{server.url(NIGHT)}/tilemapresource.xml", max_level = 4, bounds = [0, {south}, 40, {north}]'))
                self.prefetch(world, self.folder / f"north{south}", "--bounds", "0,-85,40,85", "--levels", "3-4")
                server.asked = {path: count for path, count in server.asked.items() if path.endswith(".png")}
                self.assertEqual(self.tiles_asked(server), columns_and_rows(0, south, 40, north, 3) | columns_and_rows(0, south, 40, north, 4))

    def test_it_goes_on_where_it_was_stopped(self):
        with TileServer(lambda path, times: time.sleep(0.1)) as server:
            world, cache = self.night(server), self.folder / "stopped"
            command = [PROGRAM, "cache", "prefetch", world, "--disk-cache", cache, "--bounds", "-180,-90,180,90", "--levels", "0-4"]
            running = subprocess.Popen(list(map(str, command)), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True,
                                       env=os.environ | {"XDG_CACHE_HOME": str(self.folder / "cache")})
            end = time.monotonic() + 60
            while len(server.asked) < 100 and time.monotonic() < end:
                time.sleep(0.02)
            running.send_signal(signal.SIGINT)
            said = running.communicate(timeout=60)[1]
            self.assertEqual(running.returncode, 1, said)
            self.assertIn("goes on from there", said)
            before = len(server.asked)
            self.assertLess(before, 341)
            self.prefetch(world, cache, "--bounds", "-180,-90,180,90", "--levels", "0-4")
            self.assertEqual(len(server.asked), 341)
            twice = sum(1 for count in server.asked.values() if count > 1)
            self.assertLessEqual(twice, 32, "only what was on its way is asked for again")

    def test_missing_tiles_are_remembered(self):
        with TileServer() as server:
            world = self.world("rainier", ("height", f'type = "xyz", url = "{server.url(RAINIER_TILES)}/{{z}}/{{x}}/{{y}}.webp", encoding = "terrain-rgb", '
                                           'min_level = 9, max_level = 11, bounds = [-122, 46, -121, 47], vertical = "ellipsoid"'))
            self.prefetch(world, self.folder / "rainier", "--bounds", "-123,45,-120,48", "--levels", "0-20")
            missing = [path for path in server.asked if not (SHARED / path.lstrip("/")).exists()]
            self.assertGreater(len(missing), 5, "the rim has gaps")
            self.assertEqual(set(server.asked.values()), {1})
            server.asked.clear()
            self.prefetch(world, self.folder / "rainier", "--bounds", "-123,45,-120,48", "--levels", "0-20")
            self.assertFalse(server.asked)

    def test_more_than_fits_is_said_before_anything_is_fetched(self):
        with TileServer() as server:
            world, cache = self.night(server), f"{self.folder / 'small'},1"
            done = self.prefetch(world, cache, "--bounds", "-180,-90,180,90", "--levels", "0-4", status=1)
            self.assertIn("341 tiles", done.stdout)
            self.assertIn("--anyway", done.stderr)
            self.assertFalse(server.asked)
            self.prefetch(world, cache, "--bounds", "-180,-90,180,90", "--levels", "0-1", "--anyway")
            self.assertEqual(len(server.asked), 5)

    def test_what_cannot_be_had_is_said(self):
        with TileServer(lambda path, times: 403 if "/4/" in path else None) as server:
            world = self.night(server)
            done = self.prefetch(world, self.folder / "refused", "--bounds", "0,0,90,60", "--levels", "3-4", status=3)
            self.assertIn("could not be had", done.stderr)
            self.assertIn("check the key", done.stderr)
        done = self.prefetch(world, self.folder / "refused", "--bounds", "0,0,90,60", "--levels", "4", status=2)
        self.assertIn("--levels", done.stderr)
        done = self.prefetch(world, self.folder / "refused", "--levels", "0-4", status=2)
        self.assertIn("--bounds", done.stderr)
        for option in (("--size", "640x480"), ("--fps", 10), ("--sse", 2)):
            done = self.prefetch(world, self.folder / "refused", "--bounds", "0,0,90,60", "--levels", "0-1", *option, status=2)
            self.assertIn(f"{option[0]}: is an option of flights", done.stderr)
        self.assertIn("--flight", done.stderr)
        done = self.prefetch(shared(ETOPO5), self.folder / "local", "--bounds", "0,0,90,60", "--levels", "0-4")
        self.assertIn("no layer", done.stdout)

    def test_a_layer_that_cannot_be_opened_is_no_success(self):
        with TileServer() as server:
            world = self.world("partly", ("color", f'type = "xyz", url = "{server.url(NIGHT)}/{{z}}/{{x}}/{{-y}}.png", max_level = 4'),
                               ("color", f'type = "wmts", url = "{server.url("none")}", layer = "none"'))
            done = self.prefetch(world, self.folder / "partly", "--bounds", "-180,-90,180,90", "--levels", "0-1", status=3)
            self.assertIn("5 tiles", done.stdout)
            self.assertEqual(sum(NIGHT in path for path in server.asked), 5)
            self.assertIn("could not be opened", done.stderr)

    def test_a_cache_that_keeps_nothing_is_a_failure(self):
        (self.folder / "file").write_text("no folder\n")
        with TileServer(lambda path, times: time.sleep(0.05)) as server:
            done = self.prefetch(self.night(server), self.folder / "file", "--bounds", "-180,-90,180,90", "--levels", "0-4", status=1)
            self.assertIn("could not be kept", done.stderr)
            self.assertIn(str(self.folder / "file"), done.stderr)
            self.assertLess(len(server.asked), 341, "no more are fetched in vain")

    def test_a_flight_fetched_ahead_is_the_same_without_a_network(self):
        flight = self.folder / "flight.csv"
        flight.write_text("time,lat,lon,height,heading,pitch,roll\n0,46.85,-121.76,12000000,0,-90,0\n1,46.85,-121.76,300000,20,-70,0\n2,46.80,-121.80,15000,40,-35,0\n")
        options = ("--fps", 2, "--size", "480x270", "--time", "2024-06-20T20:00Z")
        with TileServer() as server:
            world = self.world(
                "flown", ("height", f'type = "xyz", url = "{server.url(TERRARIUM)}/{{z}}/{{x}}/{{y}}.png", encoding = "terrarium", max_level = 3, vertical = "ellipsoid"'),
                ("height", f'type = "xyz", url = "{server.url(RAINIER_TILES)}/{{z}}/{{x}}/{{y}}.webp", encoding = "terrain-rgb", '
                           'min_level = 9, max_level = 11, bounds = [-122, 46, -121, 47], vertical = "ellipsoid"'),
                ("color", f'type = "xyz", url = "{server.url(NIGHT)}/{{z}}/{{x}}/{{-y}}.png", max_level = 4'))
            self.tellurion("fly", world, flight, "--out", self.folder / "online", "--disk-cache", self.folder / "online-cache", *options)
            self.prefetch(world, self.folder / "ahead", "--flight", flight, *options)
        self.tellurion("fly", world, flight, "--out", self.folder / "offline", "--disk-cache", self.folder / "ahead", "--offline", *options)
        frames = sorted((self.folder / "online").glob("*.png"))
        self.assertEqual(len(frames), 5)
        for frame in frames:
            self.assertEqual(frame.read_bytes(), (self.folder / "offline" / frame.name).read_bytes(), frame.name)


if __name__ == "__main__":
    unittest.main()
