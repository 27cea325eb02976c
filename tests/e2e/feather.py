"""Rasters that fade in from their edges: what is shown against opacities worked out here from each pixel's place in the raster."""
# label: slow
# timeout: 300
import json
import subprocess
import unittest

import numpy as np
from osgeo import gdal, osr

from _common import Case, PROGRAM, read_geo, read_picture

SIZE = (480, 300)
TAN = np.tan(np.radians(22.5))


class Raster:
    """White (or `grey`) with a void or without, written to a file; and how opaque it ought to be at places."""

    def __init__(self, file, size, transform, system, grey=255, void=None):
        self.file, self.size, self.transform, self.grey, self.void = file, size, transform, grey, void
        data = gdal.GetDriverByName("GTiff").Create(str(file), *size, 3 if void is None else 4, gdal.GDT_Byte, ["TILED=YES"])
        data.SetGeoTransform(transform)
        own, places = osr.SpatialReference(), osr.SpatialReference()
        own.ImportFromEPSG(system)
        places.ImportFromEPSG(4326)
        for crs in (own, places):
            crs.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        data.SetProjection(own.ExportToWkt())
        for band in (1, 2, 3):
            data.GetRasterBand(band).Fill(grey)
        if void is not None:
            alpha = np.full(size[::-1], 255, np.uint8)
            alpha[void[1]:void[3], void[0]:void[2]] = 0
            data.GetRasterBand(4).SetColorInterpretation(gdal.GCI_AlphaBand)
            data.GetRasterBand(4).WriteArray(alpha)
        self.way = osr.CoordinateTransformation(places, own)

    def pixels(self, lat, lon):
        points = np.array(self.way.TransformPoints(np.stack([lon.ravel(), lat.ravel()], axis=1).tolist()))
        x, y = ((points[:, i].reshape(lat.shape) - self.transform[3 * i]) / self.transform[5 * i or 1] for i in (0, 1))
        return x, y

    def opacity(self, lat, lon, feather):
        x, y = self.pixels(lat, lon)
        inside = np.minimum(np.minimum(x, self.size[0] - x), np.minimum(y, self.size[1] - y))
        if self.void is not None:
            west, north, east, south = self.void
            inside = np.minimum(inside, np.hypot(np.maximum(np.maximum(west - x, x - east), 0), np.maximum(np.maximum(north - y, y - south), 0)))
        return np.clip(inside / feather, 0.0, 1.0)


class Feather(Case):
    def raster(self, name, *arguments, **more):
        return Raster(self.folder / f"{name}.tif", *arguments, **more)

    def black(self):
        return self.raster("black", (64, 32), (-180, 360 / 64, 0, 90, 0, -180 / 32), 4326, grey=0).file

    def show(self, world, pose, name):
        geo = self.folder / "geo.tif"
        picture = read_picture(self.render(world, pose, "--size", "{}x{}".format(*SIZE), "--no-lighting", "--no-atmosphere", "--geo", geo, name=name)).astype(float)
        lat, lon, *_ = read_geo(geo)
        self.assertTrue(np.isfinite(lat).all())
        return picture[..., 0], lat, lon

    def world_of(self, name, *layers):
        text = "".join(f'\n[[layer]]\ngroup = "color"\nsource = {source}\n{more}\n' for source, more in layers)
        file = self.folder / f"{name}.toml"
        file.write_text(text)
        return file

    def source(self, path):
        return f"{{ path = {json.dumps(str(path))} }}"

    def agree(self, name, picture, expected, mean=0.5, most=2.0):
        apart = np.abs(picture - expected)
        partly = (expected > 0.05 * expected.max()) & (expected < 0.95 * expected.max())
        print(f"{name}: {partly.sum()} pixels on the way, mean {apart[partly].mean():.2f} of 255, at most {apart.max():.2f}")
        self.assertGreater(partly.sum(), 2000)
        self.assertLess(apart[partly].mean(), mean)
        self.assertLessEqual(apart.max(), most)
        return apart

    CASES = {
        "geographic": ((1000, 800), (10.0, 0.002, 0, 47.0, 0, -0.002), 4326, 222.4),
        "utm": ((1000, 800), (400e3, 200.0, 0, 5300e3, 0, -200.0), 32632, 200.0),
    }
    FEATHER = 150

    def places(self, raster):
        """Poses over the middle of the west edge, a corner and the middle of the south edge."""
        size, transform = raster.size, raster.transform
        back = raster.way.GetInverse()
        for name, (x, y) in {"edge": (0.08, 0.5), "corner": (0.08, 0.1), "south": (0.5, 0.95)}.items():
            lon, lat, _ = back.TransformPoint(transform[0] + x * size[0] * transform[1], transform[3] + y * size[1] * transform[5])
            yield name, lat, lon

    def test_from_the_border_inwards(self):
        for system, (size, transform, code, metres) in self.CASES.items():
            raster = self.raster(system, size, transform, code)
            for opacity in (1.0, 0.5):
                world = self.world_of(f"{system}-{opacity}", (self.source(self.black()), ""), (self.source(raster.file), f"feather = {self.FEATHER}\nopacity = {opacity}"))
                for where, lat, lon in self.places(raster):
                    for ratio in (0.5, 1.5):
                        with self.subTest(system, where=where, ratio=ratio):
                            picture, lats, lons = self.show(world, (lat, lon, ratio * metres * SIZE[1] / (2 * TAN)), "edge")
                            weight = raster.opacity(lats, lons, self.FEATHER)
                            self.agree(f"{system}, {where}, {ratio} source pixels a pixel, opacity {opacity}", picture, 255.0 * opacity * weight)
                            beyond = weight == 0.0
                            self.assertGreater(beyond.sum(), 100)
                            self.assertLessEqual(picture[beyond].max(), 1.0)
                            if where == "edge":
                                self.assertTrue((np.diff(picture[SIZE[1] // 2]) >= 0).all(), "brighter from pixel to pixel")
                                steepest = np.diff(255.0 * opacity * weight[SIZE[1] // 2]).max()
                                self.assertLessEqual(np.diff(picture[SIZE[1] // 2]).max(), steepest + 1.5, "no step")
                            # The check itself: a width that is off by a tenth is told.
                            wrong = 255.0 * opacity * raster.opacity(lats, lons, 1.1 * self.FEATHER)
                            self.assertGreater(np.abs(picture - wrong).max(), 4.0 * opacity)

    def test_without_the_key_nothing_changes(self):
        raster = self.raster("plain", *self.CASES["utm"][:3])
        pictures = []
        for name, more in (("none", ""), ("zero", "feather = 0")):
            world = self.world_of(name, (self.source(self.black()), ""), (self.source(raster.file), more))
            _, lat, lon = next(self.places(raster))
            pictures.append(self.show(world, (lat, lon, 50e3), name)[0])
        self.assertTrue((pictures[0] == pictures[1]).all())

    def test_from_voids(self):
        raster = self.raster("void", *self.CASES["utm"][:3], void=(420, 330, 560, 440))
        world = self.world_of("voids", (self.source(self.black()), ""), (self.source(raster.file), f"feather = {self.FEATHER / 3}"))
        back = raster.way.GetInverse()
        lon, lat, _ = back.TransformPoint(raster.transform[0] + 490 * 200.0, raster.transform[3] - 385 * 200.0)
        for ratio in (0.6, 1.5):
            picture, lats, lons = self.show(world, (lat, lon, ratio * 200.0 * SIZE[1] / (2 * TAN)), "void")
            self.agree(f"void, {ratio} source pixels a pixel", picture, 255.0 * raster.opacity(lats, lons, self.FEATHER / 3), mean=1.0, most=6.0)

    def test_rasters_of_a_catalogue(self):
        """Two that overlap, in two projections: each fades over what lies below it, the other one too."""
        first = self.raster("first", (900, 700), (400e3, 200.0, 0, 5300e3, 0, -200.0), 32632, grey=255)
        second = self.raster("second", (900, 700), (8.4, 0.002, 0, 47.4, 0, -0.002), 4326, grey=100)
        files = json.dumps([str(first.file), str(second.file)])
        world = self.world_of("catalogue", (self.source(self.black()), ""), (f'{{ type = "catalogue", order = "listed", files = {files} }}', "feather = 100"))
        pictures = []
        for lat, lon in ((47.35, 8.5), (47.3, 9.0), (46.2, 9.5)):
            picture, lats, lons = self.show(world, (lat, lon, 250.0 * SIZE[1] / (2 * TAN)), "catalogue")
            lower, upper = first.opacity(lats, lons, 100), second.opacity(lats, lons, 100)
            expected = 255.0 * lower * (1.0 - upper) + 100.0 * upper
            both = (lower > 0.1) & (upper > 0.1) & (upper < 0.9)
            print(f"catalogue at {lat} {lon}: {both.sum()} pixels of both")
            pictures.append(both.sum())
            self.agree(f"catalogue at {lat} {lon}", picture, expected)
        self.assertGreater(max(pictures), 3000)

    def test_heights(self):
        """A regional mesa over a low globe, and two of a catalogue: profiles of heights, and of the ground that is drawn."""
        low = self.heights("low", 100.0, (64, 32), (-180, 360 / 64, 0, 90, 0, -180 / 32), 4326)
        first = self.heights("mesa", 900.0, *self.CASES["utm"][:3])
        second = self.heights("plateau", 1400.0, (900, 700), (8.4, 0.002, 0, 47.4, 0, -0.002), 4326)
        for name, sources, rasters in (("one", self.source(first.file), [(first, 900.0)]),
                                       ("two", f'{{ type = "catalogue", order = "listed", files = {json.dumps([str(first.file), str(second.file)])} }}', [(first, 900.0), (second, 1400.0)])):
            world = self.folder / f"heights-{name}.toml"
            world.write_text("".join(f'[[layer]]\ngroup = "height"\n{more}source = {source}\n' for source, more in ((self.source(low.file), ""), (sources, f"feather = {self.FEATHER}\n"))))

            def expected_at(lat, lon):
                metres = np.full(lat.shape, 100.0)
                for raster, own in rasters:
                    metres += (own - metres) * raster.opacity(lat, lon, self.FEATHER)
                return metres

            lat, lon = np.linspace(46.2, 47.9, 60), np.linspace(7.6, 9.4, 60)
            points = "".join(f"{a:.6f} {b:.6f}\n" for a, b in zip(lat, lon))
            done = subprocess.run([PROGRAM, "height", str(world)], input=points, capture_output=True, text=True, check=True)
            found = np.array([float(line.split()[2]) for line in done.stdout.strip().splitlines()[-60:]])
            expected = expected_at(lat, lon)
            print(f"{name}: heights from {expected.min():.0f} to {expected.max():.0f} m, at most {np.abs(found - expected).max():.4f} m off")
            self.assertLess(np.abs(found - expected).max(), 0.01)
            self.assertGreater(((expected > 150) & (expected < 850)).sum(), 10)
            geo = self.folder / "heights.tif"
            self.render(world, (46.9, 8.2, 60000, 40, -35), "--size", "{}x{}".format(*SIZE), "--geo", geo, name=f"heights-{name}")
            lats, lons, metres, distance = read_geo(geo)
            seen = np.isfinite(metres)
            off = np.abs(metres - expected_at(np.where(seen, lats, 0.0), np.where(seen, lons, 0.0)))[seen] / (distance[seen] * 2 * TAN / SIZE[1])
            print(f"{name}: drawn ground {np.percentile(off, 99):.2f} pixels off for 99 %, at most {off.max():.2f}")
            self.assertLess(np.percentile(off, 99), 1.0)

    def heights(self, name, metres, size, transform, system):
        raster = self.raster(name, size, transform, system)
        data = gdal.GetDriverByName("GTiff").Create(str(raster.file), *size, 1, gdal.GDT_Float32, ["TILED=YES"])
        data.SetGeoTransform(transform)
        crs = osr.SpatialReference()
        crs.ImportFromEPSG(system)
        data.SetProjection(crs.ExportToWkt())
        data.GetRasterBand(1).Fill(metres)
        return raster

    def test_mistakes_are_told(self):
        raster = self.raster("mistaken", *self.CASES["utm"][:3])
        for group, value, what in (("color", "-3", "`feather` must be a number from 0"), ("color", '"wide"', "`feather` must be a number")):
            file = self.folder / "mistake.toml"
            file.write_text(f'[[layer]]\ngroup = "{group}"\nfeather = {value}\nsource = {self.source(raster.file)}\n')
            out = self.folder / "none.png"
            done = subprocess.run([PROGRAM, "render", str(file), "--out", str(out), "--camera", "0,0,1e7"], capture_output=True, text=True)
            self.assertEqual(done.returncode, 1)
            self.assertIn("mistake.toml:3: ", done.stderr)
            self.assertIn(what, done.stderr)


if __name__ == "__main__":
    unittest.main()
