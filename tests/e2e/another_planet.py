"""Other bodies and other projections: the guide's world files and commands, heights against the rasters' own samples."""
# label: slow
# timeout: 300
import re
import subprocess
import unittest

import numpy as np
from osgeo import gdal, osr

from _common import PROGRAM, RAINIER, ROOT, Case, shared

MOLA, MOLA_NORTH, LOLA = "mars/mola_4ppd.tif", "mars/mola_north_polar_stereo_10km.tif", "moon/lola_ldem4_4ppd_scale0.5.tif"
MARS = (3396190.0, 3376200.0)


def planetographic(lat):
    """The latitude on Mars's ellipsoid of the meridian's point seen from the centre at `lat`, in degrees."""
    return np.degrees(np.arctan(np.tan(np.radians(lat)) * (MARS[0] / MARS[1]) ** 2))


def crs(text):
    system = osr.SpatialReference()
    system.SetFromUserInput(text)
    system.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    return system


def bilinear(path, lat, lon, places):
    """The raster's value at places in `places` (a CRS), bilinear between its samples; NaN where one of the four is missing."""
    data = gdal.Open(str(path))
    band = data.GetRasterBand(1)
    samples = band.ReadAsArray().astype(float)
    if band.GetNoDataValue() is not None:
        samples[samples == band.GetNoDataValue()] = np.nan
    samples = samples * (band.GetScale() or 1.0) + (band.GetOffset() or 0.0)
    target = osr.SpatialReference(wkt=data.GetProjection())
    target.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    points = np.array(osr.CoordinateTransformation(places, target).TransformPoints(np.stack([lon, lat], axis=1).tolist()))
    x0, dx, _, y0, _, dy = data.GetGeoTransform()
    x, y = (points[:, 0] - x0) / dx - 0.5, (points[:, 1] - y0) / dy - 0.5
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    u, v = x - column, y - row
    inside = (column >= 0) & (row >= 0) & (column < data.RasterXSize - 1) & (row < data.RasterYSize - 1)
    column, row = np.where(inside, column, 0), np.where(inside, row, 0)
    value = ((samples[row, column] * (1 - u) + samples[row, column + 1] * u) * (1 - v)
             + (samples[row + 1, column] * (1 - u) + samples[row + 1, column + 1] * u) * v)
    return np.where(inside, value, np.nan)


class Bodies(Case):
    def heights(self, world, lat, lon, *options):
        places = "".join(f"{a!r} {o!r}\n" for a, o in zip(map(float, lat), map(float, lon)))
        lines = self.tellurion("height", world, *options, text=places).stdout.splitlines()
        answers = np.array([[float(word) for word in line.split()] for line in lines])
        self.assertTrue((answers[:, 3] > 0).all(), "everywhere are data")
        return answers[:, 2]

    def warped(self, source, name, system, **options):
        """The raster in another projection."""
        file = self.folder / f"{name}.tif"
        gdal.Warp(str(file), str(source), dstSRS=system, resampleAlg="bilinear", dstNodata=-32768, outputType=gdal.GDT_Float32, errorThreshold=0.0, **options)
        return file


class Guide(Case):
    """docs/another-planet.md: its world files, its commands in their order, and what it says that they print."""

    def test_the_guide(self):
        guide = (ROOT / "docs/another-planet.md").read_text()
        (self.folder / "data").symlink_to(shared(".").resolve())
        worlds = re.findall(r"```toml\n# (\S+)\n(.*?)```", guide, re.S)
        self.assertGreater(len(worlds), 5)
        for name, text in worlds:
            (self.folder / name).write_text(text)
        commands = [line.strip() for block in re.findall(r"(?:^    .*\n)+", guide, re.M) for line in block.splitlines()]
        self.assertGreater(len(commands), 15)
        script = "set -eo pipefail\ntellurion() { \"$PROGRAM\" \"$@\"; }\n" + "\n".join(commands)
        done = subprocess.run(["bash", "-c", script], cwd=self.folder, capture_output=True, text=True, timeout=250,
                              env={"PROGRAM": str(PROGRAM), "PATH": "/usr/bin:/bin", "XDG_CACHE_HOME": str(self.folder / "cache")})
        self.assertEqual(done.returncode, 0, done.stderr[-2000:])
        answers = [line for block in re.findall(r"```text\n(.*?)```", guide, re.S) for line in block.splitlines()]
        self.assertGreater(len(answers), 7)
        for answer in answers:
            self.assertIn(answer, done.stdout + done.stderr)
        for picture in re.findall(r"--out (\S+\.png)", guide):
            pixels = gdal.Open(str(self.folder / picture)).ReadAsArray()
            self.assertGreater(pixels.std(), 5, f"{picture} shows something")


class Heights(Bodies):
    def setUp(self):
        self.random = np.random.default_rng(4)

    def test_known_places_have_the_heights_of_the_samples(self):
        mars = self.world("mars", ("height", MOLA), planet="Mars")
        np.testing.assert_allclose(self.heights(mars, [planetographic(17.375)], [-133.125]), 21134.0, atol=0.01)
        moon = self.world("moon", ("height", LOLA), planet="Moon")
        np.testing.assert_allclose(self.heights(moon, [5.375, -70.375], [-158.625, -172.375]), [10504.0, -8878.5], atol=0.01)
        np.testing.assert_allclose(self.heights(moon, [5.4, -70.4], [201.4, 187.6], "--nearest"), [10504.0, -8878.5], atol=0.01)
        # The same from the label that describes the planet's radius.
        np.testing.assert_allclose(self.heights(shared("moon/LDEM_4.LBL"), [5.375, -70.375], [201.375, 187.625]), [10504.0, -8878.5], atol=2.0)

    def test_mola_in_other_projections_has_the_same_heights(self):
        sphere, degree = crs("IAU_2015:49900"), 3396190.0 * np.pi / 180
        lat = np.degrees(np.arcsin(self.random.uniform(-0.99, 0.99, 2000)))
        lon = self.random.uniform(-179.0, 179.0, 2000)
        original = self.heights(self.world("original", ("height", MOLA), planet="Mars"), planetographic(lat), lon)
        np.testing.assert_allclose(original, bilinear(shared(MOLA), lat, lon, sphere), atol=0.01)
        whole = {"xRes": degree / 16, "yRes": degree / 16}
        cap = {"xRes": degree / 32, "yRes": degree / 32, "outputBounds": (-1.6e6, -1.6e6, 1.6e6, 1.6e6)}
        for name, system, options, where in (
                ("sinusoidal", "+proj=sinu +R=3396190", whole, np.abs(lat) < 81),
                ("equirectangular", "+proj=eqc +lat_ts=30 +lon_0=180 +R=3396190", whole, np.abs(lon) > 1),
                ("stereographic", "+proj=stere +lat_0=90 +R=3396190", cap, (lat > 70) & (lat < 82)),
                ("south", "+proj=stere +lat_0=-90 +R=3396190", cap, (lat < -70) & (lat > -82))):
            with self.subTest(name):
                file = self.warped(shared(MOLA), name, system, **options)
                found = self.heights(self.world(name, ("height", MOLA, {"path": str(file)}), planet="Mars"), planetographic(lat[where]), lon[where])
                own = np.abs(found - bilinear(file, lat[where], lon[where], sphere))
                apart = np.abs(found - original[where])
                print(f"{name}: {where.sum()} places; from GDAL's value in its own grid at most {own.max():.4f} m; from the original "
                      f"mean {apart.mean():.2f} m, 99 % within {np.quantile(apart, 0.99):.1f} m")
                self.assertGreater(where.sum(), 30)
                self.assertLess(own.max(), 0.05)
                # What resampling to a quarter or an eighth of the spacing costs.
                self.assertLess(apart.mean(), 4.0)
                self.assertLess(np.quantile(apart, 0.99), 60.0)

    def test_a_polar_raster_of_another_body_over_the_whole(self):
        """Both layers at once: near the pole the upper one's own samples."""
        world = self.world("both", ("height", MOLA), ("height", MOLA_NORTH), planet="Mars")
        lat, lon = np.append(self.random.uniform(70, 89.9, 300), 90.0), np.append(self.random.uniform(-180, 180, 300), 0.0)
        found = self.heights(world, planetographic(lat), lon)
        np.testing.assert_allclose(found, bilinear(shared(MOLA_NORTH), lat, lon, crs("IAU_2015:49900")), atol=0.05)

    def test_a_raster_in_utm_has_the_same_heights(self):
        """Rainier, between its voids."""
        lat, lon = self.random.uniform(46.05, 46.95, 3000), self.random.uniform(-121.95, -121.05, 3000)
        wgs84 = crs("EPSG:4326")
        there = np.isfinite(bilinear(shared(RAINIER), lat, lon, wgs84))
        file = self.warped(shared(RAINIER), "utm", "EPSG:32610", xRes=20.0, yRes=20.0)
        own = bilinear(file, lat, lon, wgs84)
        there &= np.isfinite(own)
        lat, lon, own = lat[there], lon[there], own[there]
        found = self.heights(self.world("utm", ("height", RAINIER, {"path": str(file)})), lat, lon)
        original = self.heights(self.world("degrees", ("height", RAINIER)), lat, lon)
        apart = np.abs(found - original)
        print(f"utm: {len(lat)} places; from GDAL's value in its own grid at most {np.abs(found - own).max():.4f} m; from the original mean {apart.mean():.2f} m, "
              f"99 % within {np.quantile(apart, 0.99):.1f} m")
        self.assertGreater(len(lat), 2000)
        self.assertLess(np.abs(found - own).max(), 0.05)
        self.assertLess(apart.mean(), 1.0)

    def test_heights_above_a_geoid_are_higher_or_lower_by_its_undulation(self):
        """Against PROJ; the raster's samples lie on those of PROJ's grid of EGM96, between which it is bilinear too."""
        file = self.folder / "flat.tif"
        subprocess.run(["gdal_create", "-q", "-ot", "Float32", "-outsize", "1440", "721", "-bands", "1", "-burn", "50", "-a_srs", "EPSG:4326",
                        "-a_ullr", "-180.125", "90.125", "179.875", "-90.125", str(file)], check=True)
        lat, lon = self.random.uniform(-88, 88, 500), self.random.uniform(-179, 179, 500)
        to_ellipsoid = osr.CoordinateTransformation(crs("EPSG:4326+5773"), crs("EPSG:4979"))
        expected = np.array(to_ellipsoid.TransformPoints([(o, a, 50.0) for a, o in zip(lat, lon)]))[:, 2]
        if np.abs(expected - 50.0).max() < 1.0:
            self.skipTest("PROJ has no grid of EGM96 here")
        worlds = {datum: self.world(datum.replace(":", ""), ("height", RAINIER, {"path": str(file), "vertical": datum}))
                  for datum in ("ellipsoid", "egm96", "EPSG:5773")}
        np.testing.assert_allclose(self.heights(worlds["ellipsoid"], lat, lon), 50.0, atol=0.001)
        for datum in ("egm96", "EPSG:5773"):
            found = self.heights(worlds[datum], lat, lon)
            print(f"{datum}: undulations {found.min() - 50:.2f} .. {found.max() - 50:.2f} m, from PROJ's at most {np.abs(found - expected).max():.4f} m")
            np.testing.assert_allclose(found, expected, atol=0.01)
        # Found in the file itself.
        declared = self.folder / "declared.tif"
        gdal.Translate(str(declared), str(file), outputSRS="EPSG:4326+5773")
        done = self.tellurion("info", declared)
        self.assertRegex(done.stdout, r"heights +above EGM96 height")
        np.testing.assert_allclose(self.heights(declared, lat, lon), expected, atol=0.01)

    def test_heights_above_a_sphere(self):
        """At the poles the ellipsoid lies 19,990 m inside the sphere, at the equator on it; radii are such heights too."""
        plain = self.world("above-ellipsoid", ("height", MOLA), planet="Mars")
        sphere = self.world("above-sphere", ("height", MOLA, {"vertical": "sphere"}), planet="Mars")
        lat, lon = [0.0, 45.0, 89.8], [20.0, 20.0, 20.0]
        added = self.heights(sphere, lat, lon) - self.heights(plain, lat, lon)
        print("a sphere over Mars:", added)
        self.assertLess(abs(added[0]), 0.2)  # samples lie an eighth of a degree off the equator
        self.assertTrue(9000 < added[1] < 11000)
        self.assertAlmostEqual(added[2], 19990.0, delta=1.0)
        radii = self.folder / "radii.tif"
        gdal.Translate(str(radii), str(shared(MOLA)))
        data = gdal.Open(str(radii), gdal.GA_Update)
        data.GetRasterBand(1).SetOffset(3396190.0)
        del data
        world = self.folder / "radii.toml"
        world.write_text(f'[planet]\nname = "Mars"\n[[layer]]\ngroup = "height"\nsource = {{ path = "{radii}" }}\n')
        np.testing.assert_allclose(self.heights(world, lat, lon), self.heights(sphere, lat, lon), atol=0.01)

    def test_declared_coordinate_systems(self):
        """A raster without any; the planetocentric one of the ellipsoid, and one that counts to the west, which GeoTIFFs cannot hold."""
        data = gdal.Open(str(shared(MOLA)))
        for name, samples, system, lat in (("east", data.ReadAsArray(), "IAU_2015:49900", planetographic(17.375)), ("centric", data.ReadAsArray(), "IAU_2015:49902", planetographic(17.375)),
                                           ("west", data.ReadAsArray()[:, ::-1], "IAU_2015:49901", 17.375)):
            with self.subTest(name):
                file = self.folder / f"{name}.tif"
                made = gdal.GetDriverByName("GTiff").Create(str(file), 1440, 720, 1, gdal.GDT_Int16)
                made.SetGeoTransform(data.GetGeoTransform())
                made.GetRasterBand(1).WriteArray(samples)
                del made
                world = self.world(name, ("height", MOLA, {"path": str(file), "crs": system}), planet="Mars")
                np.testing.assert_allclose(self.heights(world, [lat], [226.875]), 21134.0, atol=0.01)

    def test_a_raster_of_another_body_is_named_and_left_out(self):
        world = self.world("mixed", ("height", MOLA), ("color", "moon/moon_4k.jpg"), ("height", RAINIER), planet="Mars")
        done = self.tellurion("info", world, status=3)
        self.assertRegex(done.stderr, r"moon_4k\.jpg: its CRS .* is of the Moon \(radius 1737400 m\), the world is Mars \(radius 3396190 m\)")
        self.assertRegex(done.stderr, r"mt_rainier_90m\.tif: its CRS .* is of Earth \(radius 6378137 m\), the world is Mars")
        told = self.tellurion("height", world, text=f"{planetographic(17.375)} -133.125\n", status=3)
        self.assertAlmostEqual(float(told.stdout.split()[2]), 21134.0, places=1)


if __name__ == "__main__":
    unittest.main()
