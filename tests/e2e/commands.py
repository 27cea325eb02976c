"""Every command of the contract, used rightly and wrongly: what it prints, writes, and ends with."""
# label: slow
# timeout: 900
import json
import math
import random
import subprocess
import unittest

import numpy as np
from osgeo import gdal

from _common import (BLUE_MARBLE, EARTH, ETOPO5, PROGRAM, RAINIER, Camera, Case, GeographicRaster, elevation, read_geo,
                     read_picture, read_trace, shared)

FIGURES = """frame, time, frame_ms, select_ms, upload_ms, draw_ms, tiles_visited, tiles_selected, tiles_selected_by_level,
tiles_drawn, tiles_drawn_by_level, tiles_waiting, triangles, draws, requests, requests_cancelled, bytes_fetched,
bytes_uploaded, memory_cache_bytes, gpu_cache_bytes, disk_cache_bytes, resident_bytes, max_error_px, frames_over_budget,
complete""".replace("\n", " ").replace(" ", "").split(",")
SUMMARY = ["load_ms", "frame_ms_median", "frame_ms_p99", "frame_ms_max"]
SMALL = ["--size", "160x90"]
WRONG_OPTIONS = [
    ["--no-such-option"], ["--camera", "1,2"], ["--camera", "91,0,1000"], ["--camera", "a,b,c"],
    ["--camera", "0,0,1000,0,0,0,0"], ["--size", "100"], ["--size", "0x100"], ["--size", "-1x5"], ["--vfov", "0"],
    ["--vfov", "180"], ["--sse", "0"], ["--sse", "nan"], ["--exaggeration", "x"], ["--exaggeration", "nan"], ["--vfov", "nan"],
    ["--time", "yesterday"],
    ["--workers", "-2"],
    ["--lod", "best"], ["--clear", "red"], ["--gpu-cache", "-5"], ["--memory-cache", "1.5e400"], ["--after", "-1"],
    ["--timeout", "x"]]
DONE, FAILED, WRONG_USAGE, DATA_MISSING = 0, 1, 2, 3
MOLA, MOON = "mars/mola_4ppd.tif", "moon/moon_1024x512.tif"


class CommandCase(Case):
    def setUp(self):
        self.out = self.folder / "picture.png"
        self.out.unlink(missing_ok=True)
        self.earth = self.world("earth", ("height", ETOPO5), ("height", RAINIER), ("color", BLUE_MARBLE))

    def refused(self, *arguments, naming, status=FAILED, text=None):
        """The program fails and names the culprit in the first line on standard error; if the work failed, the only one."""
        done = self.tellurion(*arguments, status=status, text=text)
        lines = done.stderr.strip().splitlines()
        self.assertIn(str(naming), lines[0])
        self.assertEqual(lines[1:] if status == FAILED else [], [])
        self.assertEqual(done.stdout, "")


class Render(CommandCase):
    def test_without_a_world_the_default_one_is_drawn(self):
        self.tellurion("render", "--out", self.out, *SMALL)
        self.assertGreater(read_picture(self.out).std(), 20.0)

    def test_the_size_is_the_one_asked_for_and_1280x720_without(self):
        self.assertEqual(read_picture(self.render(self.earth, (0, 0, 1e7), "--size", "123x77")).shape, (77, 123, 3))
        self.assertEqual(read_picture(self.render(self.earth, (0, 0, 1e7))).shape, (720, 1280, 3))

    def test_a_raster_is_a_world_on_its_own_body(self):
        for path, radius in ((MOLA, 3396190.0), (MOON, 1737400.0), (RAINIER, EARTH.a)):
            with self.subTest(path):
                geo = self.folder / "geo.tif"
                self.render(shared(path), (46.9, -121.8, 2.0 * radius), *SMALL, "--geo", geo)
                nearest = np.nanmin(read_geo(geo)[3])
                self.assertAlmostEqual(nearest / radius, 2.0, delta=0.02)

    def test_the_camera_looks_straight_down_unless_told_otherwise(self):
        geo = self.folder / "geo.tif"
        self.render(self.earth, (30.0, 20.0, 1e6), "--size", "161x91", "--geo", geo)
        lat, lon, *_ = read_geo(geo)[:, 45, 80]
        self.assertAlmostEqual(lat, 30.0, places=5)
        self.assertAlmostEqual(lon, 20.0, places=5)
        north = read_geo(geo)[0]
        self.assertGreater(north[0, 80], north[90, 80], "north is on top")
        self.assertGreater(read_geo(geo)[1][45, 160], read_geo(geo)[1][45, 0], "and east on the right")

    def test_geo_is_of_the_pictures_size_and_empty_where_there_is_sky(self):
        geo = self.folder / "geo.tif"
        self.render(self.earth, (0.0, 0.0, 3e7), *SMALL, "--geo", geo)
        data = read_geo(geo)
        self.assertEqual(data.shape, (4, 90, 160))
        camera = Camera(EARTH, (0.0, 0.0, 3e7), (160, 90))
        sky = np.isnan(EARTH.hit_distance(camera.eye, camera.pixel_rays()))
        self.assertLess(np.mean(sky != np.isnan(data[0])), 0.01)
        self.assertTrue(np.array_equal(np.isnan(data[0]), np.isnan(data).any(axis=0)), "all four bands are empty together")

    def test_every_common_option_is_taken(self):
        self.render(self.earth, (46.7, -121.76, 6500, 0, -10, 0), *SMALL, "--vfov", 60, "--sse", 2, "--exaggeration", 1.5,
                    "--time", "2024-06-20T20:00:00Z", "--workers", 1, "--lod", "sse", "--gpu-cache", 256,
                    "--memory-cache", 256, "--disk-cache", f"{self.folder / 'kept'},64", "--offline", "--timeout", 60,
                    "--clear", "102030")
        for option in (["--lod", "distance"], ["--lod", "solid-angle"], ["--no-atmosphere"], ["--no-lighting"],
                       ["--wireframe"], ["--bounds"], ["--tile-borders"], ["--after", 10], ["--workers", 0]):
            with self.subTest(option):
                self.render(self.earth, (46.7, -121.76, 6500, 0, -10), *SMALL, *option)

    def test_each_switch_changes_the_picture(self):
        view = (46.7, -121.76, 6500, 0, -10)
        plain = read_picture(self.render(self.earth, view, *SMALL)).astype(int)
        for option in (["--no-lighting"], ["--wireframe"], ["--bounds"], ["--tile-borders"], ["--exaggeration", 2],
                       ["--vfov", 30], ["--time", "2024-06-20T08:00:00Z"], ["--no-atmosphere", "--clear", "FF0000"]):
            with self.subTest(option):
                other = read_picture(self.render(self.earth, view, *SMALL, *option)).astype(int)
                self.assertGreater(np.mean(np.abs(other - plain) > 8), 0.005)

    def test_the_clear_colour_fills_the_sky(self):
        picture = read_picture(self.render(self.earth, (0.0, 0.0, 3e7), *SMALL, "--no-atmosphere", "--clear", "0a141E"))
        self.assertEqual(picture[0, 0].tolist(), [10, 20, 30])

    def test_stats_and_trace_have_every_figure(self):
        stats, trace = self.folder / "stats.json", self.folder / "trace.csv"
        self.render(self.earth, (46.7, -121.76, 6500, 0, -10), *SMALL, "--stats", stats, "--trace", trace)
        figures = json.loads(stats.read_text())
        self.assertEqual([name for name in FIGURES + SUMMARY + ["sources"] if name not in figures], [])
        self.assertTrue(figures["complete"])
        for name in ("frame_ms", "tiles_selected", "tiles_drawn", "triangles", "draws", "requests", "bytes_uploaded",
                     "memory_cache_bytes", "gpu_cache_bytes", "resident_bytes", "load_ms", "frame_ms_median"):
            self.assertGreater(figures[name], 0, name)
        self.assertEqual(sum(figures["tiles_selected_by_level"]), figures["tiles_selected"])
        self.assertEqual(sum(figures["tiles_drawn_by_level"]), figures["tiles_drawn"])
        self.assertLessEqual(figures["frame_ms_median"], figures["frame_ms_p99"])
        self.assertLessEqual(figures["frame_ms_p99"], figures["frame_ms_max"])
        self.assertLessEqual(figures["max_error_px"], 1.0)
        self.assertEqual(len(figures["sources"]), 3)
        for source in figures["sources"]:
            self.assertEqual(set(source) - {"name", "requests", "bytes", "errors", "last_error"}, set())
            self.assertGreater(source["bytes"], 0, source["name"])
        self.assertEqual(trace.read_text().splitlines()[0].split(","), FIGURES)
        lines = read_trace(trace)
        self.assertGreaterEqual(len(lines), 20)
        for line in lines:
            by_level = str(line["tiles_selected_by_level"]).split(";")
            self.assertEqual(sum(float(number) for number in by_level), line["tiles_selected"])

    def test_a_layer_that_is_not_there_is_named_and_the_picture_written_all_the_same(self):
        world = self.world("missing", ("height", ETOPO5), ("color", BLUE_MARBLE))
        with world.open("a") as file:
            file.write('[[layer]]\ngroup = "color"\nsource = { type = "gdal", path = "not-there.tif" }\n')
        done = self.tellurion("render", world, "--out", self.out, *SMALL, status=DATA_MISSING)
        self.assertIn("not-there.tif", done.stderr)
        self.assertGreater(read_picture(self.out).std(), 20.0)

    def test_a_raster_of_another_body_is_no_layer_of_this_one(self):
        world = self.world("mixed", ("height", ETOPO5), ("height", MOLA))
        done = self.tellurion("render", world, "--out", self.out, *SMALL, status=DATA_MISSING)
        self.assertIn("mola_4ppd.tif", done.stderr)

    def test_a_truncated_raster_is_named(self):
        cut = self.folder / "cut.tif"
        cut.write_bytes(shared(RAINIER).read_bytes()[:1_000_000])
        world = self.world("cut", ("height", ETOPO5), ("height", cut))
        done = self.tellurion("render", world, "--out", self.out, *SMALL, "--camera", "46.7,-121.76,6500,0,-10",
                              status=DATA_MISSING)
        self.assertIn("cut.tif", done.stderr)
        self.assertTrue(self.out.exists())

    def test_a_raster_without_georeferencing_is_refused_with_advice(self):
        plain = self.folder / "plain.png"
        gdal.GetDriverByName("PNG").CreateCopy(str(plain), gdal.GetDriverByName("MEM").Create("", 8, 8, 3))
        self.refused("render", plain, "--out", self.out, naming=plain)
        self.assertFalse(self.out.exists())

    def test_heights_without_a_vertical_datum_give_a_hint(self):
        done = self.tellurion("render", shared(RAINIER), "--out", self.out, *SMALL)
        self.assertIn("mt_rainier_90m.tif", done.stderr)
        self.assertIn("vertical", done.stderr)

    def test_what_cannot_be_read_or_written_is_named(self):
        self.refused("render", self.folder / "none.toml", "--out", self.out, naming="none.toml")
        self.refused("render", self.folder / "none.tif", "--out", self.out, naming="none.tif")
        self.refused("render", self.earth, *SMALL, "--out", self.folder / "no/such/folder.png", naming="no/such/folder.png")
        for option in ("--stats", "--trace", "--geo"):
            self.refused("render", self.earth, *SMALL, "--out", self.out, option, self.folder / "no/such/file",
                         naming="no/such/file")
        done = self.tellurion("render", "ftp://me:sesame@host/a?key=sesame", "--out", self.out, status=FAILED)
        self.assertIn("ftp://host/a: ", done.stderr)
        self.assertNotIn("sesame", done.stderr)
        text = self.folder / "text.tif"
        text.write_text("no raster\n")
        self.refused("render", text, "--out", self.out, naming=text)

    def test_a_mistake_in_a_world_file_is_named_with_its_line(self):
        world = self.folder / "wrong.toml"
        for text, line in (('[planet]\nname = "Earht"\n', 2), ('[planet\n', 1),
                           ('[planet]\nname = "Earth"\n\n[[layer]]\ngroup = "colour"\n', 5),
                           ('[[layer]]\ngroup = "color"\nsource = { type = "gdal", pth = "x.tif" }\n', 3),
                           ('[[layer]]\ngroup = "color"\nopacity = 7\nsource = { type = "gdal", path = "x.tif" }\n', 3)):
            with self.subTest(text):
                world.write_text(text)
                self.refused("render", world, "--out", self.out, naming=f"wrong.toml:{line}")

    def test_wrong_usage(self):
        for arguments in ([], ["no-such-command"], ["render"], ["render", "--out"], ["fly", "--out", self.folder / "x"], ["fly", self.folder / "flight.csv"],
                          ["height", self.earth, "extra"], ["bench", "no-such-benchmark"],
                          *(["render", "--out", self.out, *wrong] for wrong in WRONG_OPTIONS)):
            with self.subTest(arguments=arguments):
                self.refused(*arguments, naming="tellurion", status=WRONG_USAGE)
        self.assertFalse(self.out.exists())

    def test_help_is_no_failure(self):
        self.assertIn("render", self.tellurion("--help").stdout)
        for command in ("view", "render", "fly", "height", "info", "bench"):
            self.assertIn("--help", self.tellurion(command, "--help").stdout)


class Fly(CommandCase):
    header = "time,lat,lon,height,heading,pitch,roll"

    def flight(self, *rows, header=header):
        file = self.folder / "flight.csv"
        file.write_text("\n".join([header, *rows]) + "\n")
        return file

    def test_a_folder_of_numbered_pictures_with_stats_and_trace(self):
        flight = self.flight("0,46,8,200000,0,-60,0", "1,46.5,8.5,150000,20,-50,0")
        out, stats, trace = self.folder / "frames", self.folder / "stats.json", self.folder / "trace.csv"
        self.tellurion("fly", self.earth, flight, "--out", out, "--fps", 5, *SMALL, "--stats", stats, "--trace", trace)
        pictures = sorted(out.glob("*.png"))
        self.assertEqual(len(pictures), 6)
        lines = read_trace(trace)
        self.assertEqual([line["frame"] for line in lines], list(range(6)))
        self.assertTrue(np.allclose([line["time"] for line in lines], np.arange(6) / 5))
        self.assertTrue(all(line["complete"] == 1 and line["max_error_px"] <= 1.0 for line in lines))
        self.assertIn("frame_ms_p99", json.loads(stats.read_text()))
        still = read_picture(self.render(self.earth, (46, 8, 200000, 0, -60), *SMALL)).astype(int)
        first = read_picture(pictures[0]).astype(int)
        self.assertLessEqual(np.abs(still - first).max(), 0, "the first frame is the still picture of its pose")

    def test_a_video(self):
        flight = self.flight("0,46,8,200000,0,-60,0", "1,46.5,8.5,150000,20,-50,0")
        video = self.folder / "flight.mp4"
        self.tellurion("fly", self.earth, flight, "--out", video, "--fps", 10, "--size", "320x180")
        probe = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-select_streams", "v", "-show_entries",
                                "stream=width,height,nb_read_frames", "-of", "json", video], capture_output=True, check=True)
        self.assertEqual(json.loads(probe.stdout)["streams"], [{"width": 320, "height": 180, "nb_read_frames": "11"}])

    def test_in_real_time_it_takes_as_long_as_it_lasts_and_may_drop_frames(self):
        flight = self.flight("0,46,8,200000,0,-60,0", "2,46.5,8.5,150000,20,-50,0")
        out = self.folder / "realtime"
        self.tellurion("fly", self.earth, flight, "--out", out, "--fps", 10, *SMALL, "--realtime", "--clock-rate", 60,
                       "--time", "2024-06-20T10:00:00Z")
        self.assertTrue(3 <= len(list(out.glob("*.png"))) <= 21)

    def test_a_flight_may_be_measured_without_pictures(self):
        flight = self.flight("0,46,8,200000,0,-60,0", "1,46.5,8.5,150000,20,-50,0")
        trace, before = self.folder / "alone.csv", set(self.folder.iterdir())
        self.tellurion("fly", self.earth, flight, "--fps", 2, *SMALL, "--trace", trace)
        self.assertEqual(set(self.folder.iterdir()) - before - {self.folder / "cache"}, {trace})
        frames = read_trace(trace)
        self.assertEqual(len(frames), 3)
        for frame in frames:
            self.assertGreaterEqual(frame["frame_ms"], frame["draw_ms"])

    def test_a_flight_measured_without_all_data_says_so(self):
        world = self.world("missing", ("height", ETOPO5))
        with world.open("a") as file:
            file.write('[[layer]]\ngroup = "color"\nsource = { type = "gdal", path = "not-there.tif" }\n')
        done = self.tellurion("fly", world, self.flight("0,46,8,200000,0,-60,0", "1,46,8,200000,0,-60,0"), "--fps", 1, *SMALL,
                              "--trace", self.folder / "missing.csv", status=DATA_MISSING)
        self.assertIn("tellurion: the figures are written, but some frames lack data", done.stderr)

    def test_the_clock_rate_turns_the_sun(self):
        flight = self.flight("0,46,8,5000000,0,-90,0", "1,46,8,5000000,0,-90,0")
        out = self.folder / "day"
        self.tellurion("fly", self.earth, flight, "--out", out, "--fps", 1, *SMALL, "--clock-rate", 6 * 3600,
                       "--time", "2024-06-20T11:00:00Z")
        noon, evening = (read_picture(file).mean() for file in sorted(out.glob("*.png")))
        self.assertGreater(noon, evening * 1.3)

    def test_wrong_flights_are_named_with_their_line(self):
        good = "0,46,8,200000,0,-60,0"
        for rows, header, line in (([good, "1,46,x,1000,0,0,0"], self.header, 3), ([good, "1,46,8"], self.header, 3),
                                   ([good, "0,46,8,1000,0,0,0"], self.header, 3), ([good], "time,lat,lon", 1)):
            with self.subTest(rows=rows, header=header):
                self.refused("fly", self.earth, self.flight(*rows, header=header), "--out", self.folder / "none",
                             naming=f"flight.csv:{line}")
        self.refused("fly", self.earth, self.folder / "none.csv", "--out", self.folder / "none", naming="none.csv")


class Height(CommandCase):
    def heights(self, world, places, *options):
        text = "".join(f"{lat!r} {lon!r}\n" for lat, lon in places)
        lines = self.tellurion("height", world, *options, text=text).stdout.splitlines()
        rows = np.array([line.split() for line in lines], float)
        self.assertTrue(np.allclose(rows[:, :2], places, atol=1e-9), "the places come back as asked")
        return rows[:, 2], rows[:, 3]

    def test_they_are_the_rasters_own_bilinear_heights(self):
        rng = random.Random(7)
        rasters = [GeographicRaster(shared(ETOPO5)), GeographicRaster(shared(RAINIER))]
        places = [(rng.uniform(46.0, 47.0), rng.uniform(-122.0, -121.0)) for _ in range(300)]
        places += [(rng.uniform(-90.0, 90.0), rng.uniform(-180.0, 180.0)) for _ in range(300)]
        places += [(90.0, 12.0), (-90.0, 77.0), (0.0, 180.0), (0.0, -180.0), (10.0, 179.99), (46.5, -121.5),
                   (46.0 + 1 / 1200, -121.5)]
        height, level = self.heights(self.earth, places)
        lat, lon = np.array(places).T
        expected = elevation(rasters, lat, lon)
        known = np.isfinite(expected)
        self.assertGreater(known.sum(), 500)
        self.assertLess(np.abs(height - expected)[known].max(), 1e-3)
        fine = known & ~rasters[1].absent(lat, lon)
        self.assertTrue(np.allclose(level[fine], math.log2(180 * 1200), atol=0.02), level[fine][:5])
        self.assertTrue(np.allclose(level[known & ~fine], math.log2(180 * 12), atol=0.02), level[known & ~fine][:5])

    def test_they_are_gdals(self):
        rng = random.Random(8)
        places = [(rng.uniform(46.1, 46.9), rng.uniform(-121.9, -121.1)) for _ in range(20)]
        d = 1e-7
        expected = [gdal.Warp("", str(shared(RAINIER)), format="MEM", outputBounds=[lon - d, lat - d, lon + d, lat + d],
                              width=1, height=1, resampleAlg="bilinear", outputType=gdal.GDT_Float64).ReadAsArray().item()
                    for lat, lon in places]
        height, _ = self.heights(self.world("rainier", ("height", RAINIER)), places)
        self.assertLess(np.abs(height - expected).max(), 1e-3)

    def test_the_default_world_answers_too(self):
        done = self.tellurion("height", text="27.9881 86.9250\n")
        self.assertGreater(float(done.stdout.split()[2]), 5000.0)

    def test_bad_lines_are_named_and_the_good_ones_answered(self):
        done = self.tellurion("height", self.earth, text="46.5 -121.5\nnorth pole\n91 0\n46.5\n46.6 -121.5\n", status=FAILED)
        self.assertEqual(len(done.stdout.splitlines()), 2)
        self.assertEqual([f"line {number}" in done.stderr for number in range(1, 6)], [False, True, True, True, False])

    def test_an_unreadable_world_is_named(self):
        self.refused("height", self.folder / "none.toml", naming="none.toml", text="0 0\n")


class Info(CommandCase):
    def test_of_a_world_every_layer_with_size_and_crs(self):
        told = self.tellurion("info", self.earth).stdout
        for word in ("Earth", "6378137", "etopo5.tif", "mt_rainier_90m.tif", "blue_marble_4096.jpg", "4320 x 2161",
                     "1201 x 1201", "4096 x 2048", "WGS 84"):
            self.assertIn(word, told)

    def test_of_the_default_world(self):
        told = self.tellurion("info").stdout
        for word in ("elevation.tif", "blue_marble.tif", "night_lights.tif", "water_mask.tif"):
            self.assertIn(word, told)

    def test_of_rasters_on_any_body(self):
        for path, words in ((MOLA, ("Mars", "1440 x 720", "3396190")), (MOON, ("Moon", "1024 x 512", "1737400")),
                            ("earth/regional/boston-inset.tif", ("UTM zone 19N", "380 x 342", "200"))):
            told = self.tellurion("info", shared(path)).stdout
            for word in words:
                self.assertIn(word, told)

    def test_statistics_are_those_of_the_samples(self):
        told = self.tellurion("info", shared(RAINIER)).stdout
        samples = gdal.Open(str(shared(RAINIER))).ReadAsArray().astype(float)
        there = samples[samples != -32768]
        for number in (f"{there.min():g} .. {there.max():g} m", f"mean {there.mean():.6g}", f"deviation {there.std():.6g}",
                       f"{100 * there.size / samples.size:.4g} % of the samples", "no-data -32768"):
            self.assertIn(number, told)

    def test_a_picture_of_where_it_lies(self):
        out = self.folder / "where.png"
        self.tellurion("info", shared("earth/regional/antarctica_etopo5_epsg3031_10km.tif"), "--picture", out)
        picture = read_picture(out).astype(int)
        yellow = (picture[..., 0] > 180) & (picture[..., 1] > 130) & (picture[..., 2] < 60)
        # The raster's corners are 52.3 degrees south: a square with the pole in the middle, half as wide as the picture.
        rows, columns = np.nonzero(yellow)
        for low, high in ((rows.min(), rows.max()), (columns.min(), columns.max())):
            self.assertAlmostEqual((low + high) / 2, 399.5, delta=3)
            self.assertTrue(400 < high - low < 480, f"{low} to {high}")
        nowhere = self.folder / "no/such/folder.png"
        self.assertIn(str(nowhere), self.tellurion("info", shared(BLUE_MARBLE), "--picture", nowhere, status=1).stderr)

    def test_of_what_is_not_there(self):
        self.refused("info", self.folder / "none.tif", naming="none.tif")
        self.refused("info", self.folder / "none.toml", naming="none.toml")


class Bench(CommandCase):
    def test_the_list_names_benchmarks_and_one_runs_into_json(self):
        names = [line.split()[0] for line in self.tellurion("bench", "--list").stdout.splitlines() if line.strip()]
        self.assertGreater(len(names), 3)
        file = self.folder / "bench.json"
        quick = next(name for name in names if "select" in name or "height" in name or "rtin" in name or "mesh" in name)
        self.tellurion("bench", quick, "--json", file)
        results = json.loads(file.read_text())
        self.assertGreater(len(results), 0)
        for result in results:
            self.assertLessEqual({"name", "value", "unit", "goal", "note"}, set(result))
            self.assertIsInstance(result["value"], (int, float))


class Program(CommandCase):
    def test_it_works_from_any_folder_and_without_a_home(self):
        where = self.folder / "elsewhere"
        where.mkdir()
        subprocess.run([PROGRAM, "render", "--out", "p.png", *SMALL], cwd=where, env={"PATH": "/usr/bin"}, check=True,
                       timeout=300)
        self.assertTrue((where / "p.png").exists())


if __name__ == "__main__":
    unittest.main()
