"""The guide's commands that make tiles and archives with GDAL: what they write shows what they were given."""
# label: slow
# timeout: 600
import re
import subprocess
import unittest

import numpy as np
from osgeo import gdal

from _common import BLUE_MARBLE, ETOPO5, ROOT, Case, read_picture, shared
from _servers import NOT_FOUND, Reply, Server

GUIDE = (ROOT / "docs/tiles-and-services.md").read_text()
WEST, NORTH, EAST, SOUTH = -132, 54, -108, 36   # of what the tiles are made of
LOOK = (45, -120, 1_200_000, 0, -90)            # wholly inside
MERCATOR_TOP = 20037508.342789244


class FolderServer(Server):
    def __init__(self, folder):
        self.folder = folder
        super().__init__()

    def answer(self, path, headers):
        file = self.folder / path.split("?")[0].lstrip("/")
        kinds = {".png": "image/png", ".xml": "text/xml"}
        return Reply(200, file.read_bytes(), {"Content-Type": kinds[file.suffix]}) if file.is_file() else NOT_FOUND


class MakingTiles(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        window = dict(projWin=[WEST, NORTH, EAST, SOUTH])
        globe = gdal.Translate("", str(shared(BLUE_MARBLE)), format="MEM", outputSRS="EPSG:4326", outputBounds=[-180, 90, 180, -90])
        # As fine as zoom 6, where the tiles end: gdal2tiles enlarges by repeating pixels.
        gdal.Translate(str(cls.folder / "picture.tif"), globe, **window, widthPct=400, heightPct=400, resampleAlg="cubic").FlushCache()
        gdal.Translate(str(cls.folder / "dem.tif"), str(shared(ETOPO5)), **window).FlushCache()

    def run_all(self, commands):
        """In the test's folder, one after the other."""
        done = subprocess.run(["bash", "-c", "set -e\n" + "\n".join(commands)], cwd=self.folder, capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stdout[-2000:] + done.stderr[-2000:])

    def picture_of(self, name, source):
        world = self.folder / f"{name}.toml"
        world.write_text(f'[[layer]]\ngroup = "color"\nsource = {{ {source} }}\n')
        return read_picture(self.render(world, LOOK, "--no-lighting", "--no-atmosphere", "--size", "640x360", name=name)).astype(int)

    def check(self, name, source, mean, most):
        """Tiles are resampled, and may be JPEG: alike to `mean` of 255, a hundredth of the pixels to `most`; shifted, they are less so."""
        wanted, shown = self.wanted, self.picture_of(name, source)
        differences = np.abs(shown - wanted)
        far = np.percentile(differences, 99)
        print(f"{name}: mean difference {differences.mean():.2f} of 255, 99 % within {far:.0f}")
        with self.subTest(name):
            self.assertLessEqual(differences.mean(), mean)
            self.assertLessEqual(far, most)
            for dx, dy in ((4, 0), (-4, 0), (0, 4), (0, -4)):
                self.assertGreater(np.abs(np.roll(shown, (dy, dx), (0, 1)) - wanted)[8:-8, 8:-8].mean(), differences[8:-8, 8:-8].mean(), "shifted")

    @property
    def wanted(self):
        return self.picture_of("wanted", f'type = "gdal", path = "{self.folder}/picture.tif"')

    def test_archives(self):
        table = [row for row in GUIDE.splitlines() if row.startswith("|") and "`gdal_translate" in row]
        self.assertEqual(len(table), 3)
        for row, kind, ending in zip(table, ("gdal", "mbtiles", "geopackage"), ("tif", "mbtiles", "gpkg")):
            commands = [command.replace("IN.tif", "picture.tif") for command in re.findall(r"`(gdal[^`]*)`", row)]
            self.run_all(commands)
            self.check(ending, f'type = "{kind}", path = "{self.folder}/OUT.{ending}"', 3, 16)

    def test_gridded_heights(self):
        (row,) = [row for row in GUIDE.splitlines() if "`gdal_translate -of GPKG" in row]
        commands = [command.replace("IN.tif", "dem.tif").replace("OUT", "heights") for command in re.findall(r"`(gdal[^`]*)`", row)]
        self.run_all(commands)
        self.check_heights("geopackage", f'type = "geopackage", path = "{self.folder}/heights.gpkg"', "dem.tif", 0.001)

    def test_folders_of_tiles(self):
        section = GUIDE[GUIDE.index("## Making tiles with GDAL"):GUIDE.index("## When it does not work")]
        commands = [line.strip() for line in section.splitlines() if line.startswith("    ")]
        self.assertEqual(len(commands), 9)
        self.run_all(commands)
        with FolderServer(self.folder) as server:
            self.check("tiles", f'type = "xyz", url = "{server.url("tiles")}/{{z}}/{{x}}/{{y}}.png", max_level = 6', 3, 16)
            self.check("tms", f'type = "tms", url = "{server.url("tms")}/tilemapresource.xml"', 3, 16)
            self.check_heights("terrarium", f'type = "xyz", url = "{server.url("dem")}/{{z}}/{{x}}/{{y}}.png", encoding = "terrarium", max_level = 6', "heights.tif", 1 / 256)
        self.check("cog", f'type = "gdal", path = "{self.folder}/picture_cog.tif"', 3, 16)

    def check_heights(self, name, source, raster, tolerance):
        """Against the raster's own samples, bilinear; beyond it the layer has none."""
        world = self.folder / f"{name}.toml"
        world.write_text(f'[[layer]]\ngroup = "height"\nsource = {{ {source}, vertical = "ellipsoid" }}\n')
        random = np.random.default_rng(3)
        lat, lon = random.uniform(38, 52, 500), random.uniform(-130, -110, 500)
        places = "".join(f"{a!r} {o!r}\n" for a, o in zip(map(float, lat), map(float, lon)))
        answers = np.array([[float(word) for word in line.split()] for line in self.tellurion("height", world, text=places).stdout.splitlines()])
        data = gdal.Open(str(self.folder / raster))
        samples = data.ReadAsArray().astype(float)
        x0, dx, _, y0, _, dy = data.GetGeoTransform()
        x, y = lon, lat
        if "3857" in data.GetProjection():
            x = lon / 180 * MERCATOR_TOP
            y = np.log(np.tan(np.pi / 4 + np.radians(lat) / 2)) / np.pi * MERCATOR_TOP
        column, row = (x - x0) / dx - 0.5, (y - y0) / dy - 0.5
        i, j = np.floor(column).astype(int), np.floor(row).astype(int)
        u, v = column - i, row - j
        expected = ((samples[j, i] * (1 - u) + samples[j, i + 1] * u) * (1 - v) + (samples[j + 1, i] * (1 - u) + samples[j + 1, i + 1] * u) * v)
        differences = np.abs(answers[:, 2] - expected)
        if "3857" in data.GetProjection():
            # gdal2tiles may shift the tiles that the data fill in part.
            tile = 256 * dx
            whole = np.ones(lat.size, bool)
            for at, first, count in ((x + MERCATOR_TOP, x0 + MERCATOR_TOP, data.RasterXSize), (MERCATOR_TOP - y, MERCATOR_TOP - y0, data.RasterYSize)):
                before = np.floor((at - 2 * dx) / tile) * tile
                after = np.ceil((at + 2 * dx) / tile) * tile
                whole &= (before >= first - 1) & (after <= first + count * dx + 1)
            self.assertGreater(whole.sum(), 200)
            differences = differences[whole]
        print(f"{name}: heights differ by at most {differences.max():.4f} m")
        self.assertLessEqual(differences.max(), tolerance)
        self.assertGreater(expected.std(), 300)
        beyond = self.tellurion("height", world, text="45 -100\n").stdout.split()
        self.assertEqual(float(beyond[3]), -1, "nothing is said of where the raster has ended")


if __name__ == "__main__":
    unittest.main()
