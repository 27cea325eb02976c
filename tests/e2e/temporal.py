"""Layers with times: what is shown is what the step's own file or tiles show."""
# label: slow
# timeout: 900
import re
import unittest

import numpy as np
from osgeo import gdal

from _common import Case, shared
from _servers import Reply, Server, picture_bytes

LANDSAT = "earth/temporal"
YEARS = ["1985", "1995", "2005", "2015", "2020"]


def pixels(file):
    return gdal.Open(str(file)).ReadAsArray()


class Temporal(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        scene = gdal.Open(str(shared(f"{LANDSAT}/landsat_1985.tif")))
        transform = gdal.Info(scene, format="json")["wgs84Extent"]["coordinates"][0]
        lon, lat = np.mean(transform[:4], axis=0)
        width = (max(p[0] for p in transform) - min(p[0] for p in transform)) * 111e3 * np.cos(np.radians(lat))
        cls.view = (lat, lon, width, 0, -90)
        cls.small = ("--size", "320x240", "--no-lighting", "--no-atmosphere")

    def world(self, name, source):
        path = self.folder / f"{name}.toml"
        path.write_text(f'[[layer]]\ngroup = "color"\nsource = {source}\n')
        return path

    def test_each_time_shows_its_own_file(self):
        values = ", ".join(f'"{year}"' for year in YEARS)
        timed = self.world("timed", f'{{ path = "{shared(LANDSAT)}/landsat_{{time}}.tif", time = {{ values = [{values}], format = "%Y" }} }}')
        pictures = {}
        for time, year in [("1970-05-05", "1985"), ("2004-12-31T23:59:59Z", "1995"), ("2005-01-01", "2005"), ("2030-01-01", "2020"), (None, "2020")]:
            plain = self.world(f"plain{year}", f'{{ path = "{shared(LANDSAT)}/landsat_{year}.tif" }}')
            at = ("--time", time) if time else ()
            shown = self.render(timed, self.view, *self.small, *at, name=f"timed-{time}")
            wanted = self.render(plain, self.view, *self.small, *at, name=f"plain-{year}")
            self.assertEqual(shown.read_bytes(), wanted.read_bytes(), f"{time} is not as {year}")
            pictures[year] = pixels(shown).astype(float)
        for a, b in zip(["1985", "1995", "2005"], ["1995", "2005", "2020"]):
            self.assertGreater(np.mean(np.abs(pictures[a] - pictures[b])), 1, f"{a} and {b} look alike")

    def test_a_flight_through_the_years_shows_each_in_turn(self):
        timed = self.world("years", f'{{ path = "{shared(LANDSAT)}/landsat_{{time}}.tif", time = {{ values = ["1985", "1995", "2005"], format = "%Y" }} }}')
        lat, lon, height = self.view[:3]
        flight = self.folder / "flight.csv"
        flight.write_text("time,lat,lon,height,heading,pitch,roll\n" + "".join(f"{s},{lat},{lon},{height},0,-90,0\n" for s in (0, 2)))
        # Ten years a second, three frames; and back again.
        rate = 10 * 365.25 * 86400
        for start, step, order in [("1985-06-01", rate, ["1985", "1995", "2005"]), ("2005-06-01", -rate, ["2005", "1995", "1985"])]:
            frames = self.folder / f"frames{start}"
            self.tellurion("fly", timed, flight, "--out", frames, "--fps", 1, "--time", start, "--clock-rate", f"{step:.0f}", *self.small)
            for frame, year in enumerate(order):
                alone = self.render(timed, self.view, *self.small, "--time", f"{year}-06-01", name=f"alone-{year}")
                self.assertEqual((frames / f"{frame:06}.png").read_bytes(), alone.read_bytes(), f"frame {frame} is not {year}")

    def test_tiles_of_a_step_are_asked_for_by_its_time(self):
        asked = []

        class Daily(Server):
            def answer(self, path, headers):
                day = int(re.match(r"/(\d+)-\d+-(\d+)/", path).group(2))
                with self.lock:
                    asked.append(path)
                return Reply(200, picture_bytes([np.full((256, 256), value) for value in (day * 20, 40, 40)]))

        with Daily() as server:
            world = self.world("daily", f'{{ type = "xyz", url = "{server.base}/{{time}}/{{z}}/{{x}}/{{y}}.png", max_level = 3, '
                                        'time = { format = "%Y-%m-%d", start = "2020-01-01", end = "2020-01-10", step = "P1D" } }')
            for day in (3, 7):
                asked.clear()
                picture = self.render(world, (0, 0, 20e6, 0, -90), *self.small, "--time", f"2020-01-{day:02}T12:00Z", name=f"day{day}")
                self.assertEqual({path.split("/")[1] for path in asked}, {f"2020-01-{day:02}"})
                self.assertEqual(pixels(picture)[0, 120, 160], day * 20)

    def test_the_next_step_is_fetched_before_it_is_shown(self):
        asked = []

        class Daily(Server):
            def answer(self, path, headers):
                with self.lock:
                    asked.append(path.split("/")[1])
                return Reply(200, picture_bytes(np.full((3, 256, 256), 90)))

        flight = self.folder / "stand.csv"
        flight.write_text("time,lat,lon,height,heading,pitch,roll\n0,0,0,20000000,0,-90,0\n5,0,0,20000000,0,-90,0\n")
        with Daily() as server:
            world = self.world("ahead", f'{{ type = "xyz", url = "{server.base}/{{time}}/{{z}}/{{x}}/{{y}}.png", max_level = 3, '
                                        'time = { format = "%Y-%m-%d", start = "2020-01-01", end = "2020-01-10", step = "P1D" } }')
            # Three hours a second: after five seconds it is still the third.
            self.tellurion("fly", world, flight, "--realtime", "--stats", self.folder / "ahead.json", *self.small, "--time", "2020-01-03T00:00Z", "--clock-rate", 10800)
            self.assertEqual(set(asked), {"2020-01-03"})
            asked.clear()
            self.tellurion("fly", world, flight, "--realtime", "--stats", self.folder / "ahead.json", *self.small, "--time", "2020-01-03T07:00Z", "--clock-rate", 10800)
        self.assertEqual(set(asked), {"2020-01-04"}, "the third is in the cache, the fourth comes before it is shown")

    def test_a_step_whose_file_is_missing_is_said(self):
        world = self.world("gap", f'{{ path = "{shared(LANDSAT)}/landsat_{{time}}.tif", time = {{ values = ["1985", "1990"], format = "%Y" }} }}')
        self.render(world, self.view, *self.small, "--time", "1986-01-01", name="there")
        done = self.tellurion("render", world, "--out", self.folder / "gap.png", *self.small, "--time", "1991-01-01", status=3)
        self.assertIn("landsat_1990.tif", done.stderr)

    def test_what_is_wrong_is_said(self):
        for time, word in [('{ values = ["1985"], format = "%Y-%m" }', "1985"), ('{ start = "2020-01-01", end = "2020-02-01", step = "1 day" }', "1 day"),
                           ('{ values = ["1985"], format = "%q" }', "%q")]:
            world = self.world("wrong", f'{{ path = "a_{{time}}.tif", time = {time} }}')
            done = self.tellurion("render", world, "--out", self.folder / "x.png", status=1)
            self.assertIn("wrong.toml:3", done.stderr)
            self.assertIn(word, done.stderr)
        done = self.tellurion("render", self.world("none", '{ path = "a.tif", time = { values = ["1985"], format = "%Y" } }'), "--out", self.folder / "x.png", status=1)
        self.assertIn("{time}", done.stderr)


if __name__ == "__main__":
    unittest.main()
