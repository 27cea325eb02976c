"""Layers of many rasters: a mosaic shows what its whole shows, lists of every kind, what is wrong is named and the rest is shown."""
# label: slow
# timeout: 600
import json
import subprocess
import unittest

import numpy as np

from _common import BLUE_MARBLE, ETOPO5, Case, read_picture, shared

SPACE = (20, 60, 9000000, 0, -90)
BARE = ("--size", "480x300", "--no-atmosphere", "--no-lighting")


class Catalogue(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        # The whole with the same overviews: those that GDAL finds in a JPEG are others.
        cls.whole = cls.folder / "whole.tif"
        subprocess.run(["gdal_translate", "-q", "-a_srs", "EPSG:4326", "-co", "TILED=YES", str(shared(BLUE_MARBLE)), str(cls.whole)], check=True)
        subprocess.run(["gdaladdo", "-q", "-r", "average", str(cls.whole), "2"], check=True)
        cls.tiles = cls.folder / "tiles"
        cls.tiles.mkdir()
        for column in range(8):
            for row in range(4):
                file = cls.tiles / f"t_{column}_{row}.tif"
                edges = (-180 + 45 * column, 90 - 45 * row, -135 + 45 * column, 45 - 45 * row)
                subprocess.run(["gdal_translate", "-q", "-a_srs", "EPSG:4326", "-srcwin", *map(str, (512 * column, 512 * row, 512, 512)),
                                "-a_ullr", *map(str, edges), "-co", "TILED=YES", str(shared(BLUE_MARBLE)), str(file)], check=True)
                subprocess.run(["gdaladdo", "-q", "-r", "average", str(file), "2"], check=True)

    def catalogue(self, name, **source):
        keys = ", ".join(f"{key} = {json.dumps(value)}" for key, value in ({"type": "catalogue"} | source).items())
        file = self.folder / f"{name}.toml"
        file.write_text(f'[planet]\nname = "Earth"\n[[layer]]\nname = "Mosaic"\ngroup = "color"\nsource = {{ {keys} }}\n')
        return file

    def picture(self, world, name, status=0):
        return read_picture(self.render(world, SPACE, *BARE, name=name, status=status)).astype(int)

    def test_a_mosaic_shows_what_its_whole_shows(self):
        whole = self.picture(self.world("whole", ("color", BLUE_MARBLE, {"path": str(self.whole)})), "whole")
        vrt, index = self.folder / "tiles.vrt", self.folder / "tiles.gpkg"
        files = sorted(map(str, self.tiles.glob("*.tif")))
        subprocess.run(["gdalbuildvrt", "-q", str(vrt), *files], check=True)
        subprocess.run(["gdaltindex", "-f", "GPKG", str(index), *files], check=True, capture_output=True)
        for name, source in (("folder", {"path": str(self.tiles)}), ("vrt", {"path": str(vrt)}), ("index", {"path": str(index)}), ("files", {"files": files})):
            with self.subTest(name):
                mosaic = self.picture(self.catalogue(name, **source), name)
                difference = np.abs(mosaic - whole).max(axis=2)
                print(f"{name}: mean {difference.mean():.3f}, beyond 4: {(difference > 4).mean():.5f}, at most {difference.max()}")
                self.assertGreater(whole.std(), 20, "there is something to see")
                self.assertLess(difference.mean(), 0.5)
                self.assertLess((difference > 4).mean(), 0.002)

    def test_the_later_of_a_list_lies_over_the_earlier(self):
        colours = {}
        for name, colour in (("red", (255, 0, 0)), ("blue", (0, 0, 255))):
            colours[name] = self.folder / f"{name}.tif"
            subprocess.run(["gdal_create", "-q", "-of", "GTiff", "-outsize", "64", "32", "-bands", "3", *(word for value in colour for word in ("-burn", str(value))),
                            "-a_srs", "EPSG:4326", "-a_ullr", "-180", "90", "180", "-90", str(colours[name])], check=True)
        for top, below, channel in (("red", "blue", 0), ("blue", "red", 2)):
            world = self.catalogue(f"over_{top}", files=[str(colours[below]), str(colours[top])], order="listed")
            middle = self.picture(world, f"over_{top}")[150, 240]
            self.assertGreater(middle[channel], 200)
            self.assertLess(middle[2 - channel], 50)

    def test_what_cannot_be_read_is_named_and_the_rest_is_shown(self):
        bad = self.folder / "bad.tif"
        bad.write_text("no raster")
        files = [*sorted(map(str, self.tiles.glob("*.tif"))), str(bad), str(self.folder / "gone.tif")]
        done = self.tellurion("render", self.catalogue("some", files=files), "--out", self.folder / "some.png", "--camera", ",".join(map(str, SPACE)), *BARE, status=3)
        self.assertIn("bad.tif", done.stderr)
        self.assertIn("gone.tif", done.stderr)
        difference = np.abs(read_picture(self.folder / "some.png").astype(int) - self.picture(self.world("whole", ("color", BLUE_MARBLE, {"path": str(self.whole)})), "whole"))
        self.assertLess(difference.mean(), 0.5)

    def test_wrong_world_files(self):
        for source, words in (({}, "a catalogue needs a `path`"), ({"files": "a.tif"}, "`files` is a list"), ({"files": ["a.tif"], "order": "best"}, "`order` is"),
                              ({"files": ["a.tif"], "bounds": [0, 0, 1, 1]}, "no key `bounds`")):
            done = self.tellurion("info", self.catalogue("wrong", **source), status=1)
            self.assertIn("wrong.toml:6: ", done.stderr)
            self.assertIn(words, done.stderr)

    def test_heights_of_a_mosaic_are_those_of_its_whole(self):
        pieces = self.folder / "heights"
        pieces.mkdir()
        for column in range(4):
            for row in range(2):
                subprocess.run(["gdal_translate", "-q", "-srcwin", *map(str, (1080 * column, 1080 * row, 1080, 1080)), str(shared(ETOPO5)), str(pieces / f"{column}_{row}.tif")], check=True)
        world = self.folder / "heights.toml"
        world.write_text(f'[planet]\nname = "Earth"\n[[layer]]\ngroup = "height"\nsource = {{ type = "catalogue", path = "{pieces}", vertical = "ellipsoid" }}\n')
        rng = np.random.default_rng(20261123)
        # Away from the pieces' borders, where the samples of both sides are mixed in the whole and not here.
        places = [(lat, lon) for lat, lon in zip(rng.uniform(-85, 85, 400), rng.uniform(-175, 175, 400)) if abs(lat) > 0.2 and abs((lon + 180) % 90 - 45) < 44.8]
        text = "".join(f"{lat:.6f} {lon:.6f}\n" for lat, lon in places)
        heights = [np.array([line.split()[2:3] for line in self.tellurion("height", file, text=text).stdout.splitlines()], float)
                   for file in (world, self.world("whole_heights", ("height", ETOPO5)))]
        self.assertEqual(heights[0].shape, (len(places), 1))
        self.assertLess(np.abs(heights[0] - heights[1]).max(), 1e-3)


if __name__ == "__main__":
    unittest.main()
