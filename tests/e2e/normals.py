"""Normal maps shade coarse ground as the elevation that they were made of would; where the elevation is as fine, it does."""
# label: slow
# timeout: 300
import subprocess
import sys
import unittest

import numpy as np
from osgeo import gdal

from _common import EARTH, RAINIER, ROOT, Case, read_picture, shared

VIEW = (46.5, -121.5, 400_000, 0, -90)  # from so far that what is drawn too low or too high is not seen aside
COARSER = 40  # of the heights that are drawn, in samples of the real ones


def write(file, like, bands, dtype):
    data = gdal.GetDriverByName("GTiff").Create(str(file), bands.shape[2], bands.shape[1], bands.shape[0], dtype, ["COMPRESS=DEFLATE"])
    data.SetProjection(like.GetProjection())
    x0, dx, rx, y0, ry, dy = like.GetGeoTransform()
    step = like.RasterXSize // bands.shape[2]
    data.SetGeoTransform((x0, dx * step, rx, y0, ry, dy * step))
    data.WriteArray(bands)
    data.FlushCache()


def east_north_normals(data, heights):
    """Unit normals of the ground in the frame of east, north and up, from differences of points in space (ECEF)."""
    x0, dx, _, y0, _, dy = data.GetGeoTransform()
    lat = np.radians(y0 + (np.arange(heights.shape[0]) + 0.5) * dy)[:, None] * np.ones_like(heights)
    lon = np.radians(x0 + (np.arange(heights.shape[1]) + 0.5) * dx)[None, :] * np.ones_like(heights)
    # Of the prime vertical and the meridian, as any textbook of geodesy has them.
    w = np.sqrt(1 - EARTH.e2 * np.sin(lat) ** 2)
    metres_east = EARTH.a / w * np.cos(lat) * np.radians(dx)
    metres_north = EARTH.a * (1 - EARTH.e2) / w ** 3 * np.radians(-dy)
    north_slope, east_slope = np.gradient(heights)
    normal = np.stack([-east_slope / metres_east, north_slope / metres_north, np.ones_like(heights)])
    return normal / np.linalg.norm(normal, axis=0)


def turned(normals):
    """With east and north exchanged: a wrong frame."""
    return normals[[1, 0, 2]]


class Normals(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        real = gdal.Open(str(shared(RAINIER)))
        heights = real.ReadAsArray()[:1200, :1200].astype(float)
        normals = east_north_normals(real, heights)
        half = COARSER // 2  # finer than the coarse heights
        blocks = turned(normals).reshape(3, 1200 // half, half, 1200 // half, half).mean(axis=(2, 4))
        for name, made in (("normals", normals), ("turned", turned(normals)), ("coarse_normals", blocks)):
            write(cls.folder / f"{name}.tif", real, np.round((made + 1) / 2 * 255).astype(np.uint8), gdal.GDT_Byte)
        coarse = heights.reshape(1200 // COARSER, COARSER, 1200 // COARSER, COARSER).mean(axis=(1, 3))
        write(cls.folder / "coarse.tif", real, coarse[None].astype(np.float32), gdal.GDT_Float32)

    def world(self, name, heights, *more):
        file = self.folder / f"{name}.toml"
        layers = "".join(f'[[layer]]\ngroup = "normal"\n{keys}source = {{ path = "{self.folder}/{path}.tif" }}\n' for path, keys in more)
        file.write_text(f'[[layer]]\ngroup = "height"\nsource = {{ path = "{heights}", vertical = "ellipsoid" }}\n{layers}')
        return file

    def picture(self, name, heights, *more, options=()):
        return read_picture(self.render(self.world(name, heights, *more), VIEW, "--no-atmosphere", "--vfov", 7, "--size", "640x480", *options, name=name)).astype(float)

    def check(self, options):
        fine = self.picture("fine", shared(RAINIER), options=options)
        coarse = self.picture("coarse", self.folder / "coarse.tif", options=options)
        mapped = self.picture("mapped", self.folder / "coarse.tif", ("normals", ""), options=options)
        wrong = self.picture("wrong", self.folder / "coarse.tif", ("turned", ""), options=options)
        without, with_map, in_wrong_frame = (np.abs(picture - fine).mean() for picture in (coarse, mapped, wrong))
        print(f"{' '.join(options) or 'as it is'}: from the picture of the fine heights: coarse {without:.2f}, with normals {with_map:.2f}, in a wrong frame {in_wrong_frame:.2f} of 255")
        self.assertGreater(without, 8, "there is something to be seen")
        self.assertLess(with_map, 0.25 * without)
        self.assertGreater(in_wrong_frame, without)
        return fine, coarse, mapped

    def test_the_ground_is_shaded_as_the_heights_of_which_the_normals_were_made_would_be(self):
        self.check(())

    def test_exaggeration_steepens_them_as_it_does_slopes(self):
        self.check(("--exaggeration", "3"))

    def test_the_sun_lights_them_from_where_it_stands(self):
        self.check(("--time", "2026-06-21T15:00:00Z"))

    def test_opacity_mixes_them_with_the_slopes(self):
        coarse = self.picture("none", self.folder / "coarse.tif")
        self.assertLessEqual(np.abs(self.picture("clear", self.folder / "coarse.tif", ("normals", "opacity = 0.0\n")) - coarse).max(), 1)
        full = self.picture("full", self.folder / "coarse.tif", ("normals", ""))
        half = self.picture("half", self.folder / "coarse.tif", ("normals", "opacity = 0.5\n"))
        self.assertLess(np.abs(half - (coarse + full) / 2).mean(), 0.35 * np.abs(full - coarse).mean())

    def test_finer_heights_shade_themselves(self):
        fine = self.picture("own", shared(RAINIER))
        self.assertLessEqual(np.abs(self.picture("unused", shared(RAINIER), ("coarse_normals", "")) - fine).max(), 1)
        coarse = self.picture("own_coarse", self.folder / "coarse.tif")
        self.assertGreater(np.abs(self.picture("used", self.folder / "coarse.tif", ("coarse_normals", "")) - coarse).max(), 20)

    def test_without_light_they_change_nothing(self):
        options = ("--no-lighting",)
        self.assertLessEqual(np.abs(self.picture("dark", self.folder / "coarse.tif", ("normals", ""), options=options)
                                - self.picture("dark_coarse", self.folder / "coarse.tif", options=options)).max(), 1)

    def test_the_guides_recipe(self):
        """What docs/world-file.md says makes a normal map, of a DEM in UTM."""
        guide = (ROOT / "docs/world-file.md").read_text()
        recipe = guide[guide.index("**Normals.**"):].split("```python\n")[1].split("```")[0]
        folder = self.folder / "recipe"
        folder.mkdir()
        gdal.Warp(str(folder / "dem.tif"), str(shared(RAINIER)), dstSRS="EPSG:32610", xRes=90, yRes=90, resampleAlg="bilinear", dstNodata=-32768).FlushCache()
        subprocess.run([sys.executable, "-c", recipe], cwd=folder, check=True)
        fine, coarse = self.picture("fine_too", shared(RAINIER)), self.picture("coarse_too", self.folder / "coarse.tif")
        mapped = self.picture("recipe", self.folder / "coarse.tif", ("recipe/normals", ""))
        print(f"recipe: {np.abs(mapped - fine).mean():.2f} of 255 from the picture of the fine heights")
        self.assertLess(np.abs(mapped - fine).mean(), 0.35 * np.abs(coarse - fine).mean())

    def test_what_is_no_normal_map_is_told(self):
        world = self.world("heights", self.folder / "coarse.tif", ("coarse", ""))
        said = self.tellurion("render", world, "--out", self.folder / "heights.png", "--size", "64x64", status=3).stderr
        self.assertIn("coarse.tif: has 1 band of Float32; normals are three of Byte", said)
        world = self.world("gamma", self.folder / "coarse.tif", ("normals", "gamma = 2.0\n"))
        said = self.tellurion("render", world, "--out", self.folder / "gamma.png", status=1).stderr
        self.assertIn("gamma.toml:6: normals have no `gamma`", said)


if __name__ == "__main__":
    unittest.main()
