"""`tellurion ingest` mends what inputs lack: on real data with holes cut where the truth is known."""
# label: slow
# timeout: 600
import pathlib
import re
import subprocess
import time
import unittest

import numpy as np
from osgeo import gdal, ogr, osr

from _common import ARCTIC, BLUE_MARBLE, ETOPO5, EVEREST, PROGRAM, RAINIER, Case, shared

DONE, FAILED, WRONG_USAGE = 0, 1, 2
VOID = -32768


def copy_with(file, source, bands):
    """The raster `source` with other samples."""
    raster = gdal.GetDriverByName("GTiff").CreateCopy(str(file), source if isinstance(source, gdal.Dataset) else gdal.Open(str(source)), options=["TILED=YES", "BLOCKXSIZE=256", "BLOCKYSIZE=256"])
    raster.WriteArray(bands)
    raster = None
    return file


def rms(values):
    return float(np.sqrt(np.mean(np.square(values.astype(float)))))


class RepairCase(Case):
    def ingest(self, *arguments, out="out.tif"):
        out = self.folder / out
        return out, self.tellurion("ingest", *arguments, "--out", out)

    def refused(self, *arguments, naming, status=FAILED):
        done = self.tellurion("ingest", *arguments, "--out", self.folder / "refused.tif", status=status)
        self.assertIn(str(naming), done.stderr.strip().splitlines()[-1])

    def same_however_made(self, *arguments):
        """Workers, shards, a kill and the bound of memory change no byte. Gives the file."""
        out, _ = self.ingest(*arguments, "--workers", 2, out="two.tif")
        one, _ = self.ingest(*arguments, "--workers", 1, "--memory", 768, out="one.tif")
        self.assertEqual(out.read_bytes(), one.read_bytes())
        program = subprocess.Popen([PROGRAM, "ingest", *map(str, arguments), "--out", str(self.folder / "killed.tif"), "--workers", "1"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(1.0)
        program.kill()
        program.wait()
        self.assertEqual(out.read_bytes(), self.ingest(*arguments, out="killed.tif")[0].read_bytes())
        for shard in (2, 1):
            self.ingest(*arguments, "--shard", f"{shard}/2", out="shards.tif")
        self.tellurion("ingest", "merge", "--out", self.folder / "shards.tif")
        self.assertEqual(out.read_bytes(), (self.folder / "shards.tif").read_bytes())
        return out

    def stays_within(self, megabytes, *arguments):
        """The memory that the program takes."""
        command = [PROGRAM, "ingest", *map(str, arguments), "--out", str(self.folder / "bounded.tif"), "--memory", str(megabytes), "--workers", "2"]
        script = "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True); print('kB', resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
        done = subprocess.run(["/usr/bin/python3", "-c", script, *command], check=True, capture_output=True, text=True)
        self.assertLess(int(done.stdout.split("kB")[1]), megabytes * 1024)


def read(file):
    return gdal.Open(str(file)).ReadAsArray()


class Voids(RepairCase):
    """Voids of real shapes, those of SRTM around Everest, cut into the ground around Mount Rainier."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.truth = read(shared(RAINIER))
        shapes = read(shared(EVEREST)) == VOID
        cls.cut = np.zeros(cls.truth.shape, bool)
        for (top, bottom, left, right), (y, x) in (((145, 368, 583, 797), (600, 300)), ((365, 447, 1018, 1141), (250, 700)), ((44, 169, 1126, 1201), (250, 300)),
                                                   ((365, 447, 1018, 1141), (100, 900))):
            cls.cut[y:y + bottom - top, x:x + right - left] |= shapes[top:bottom, left:right]
        cls.known = cls.cut & (cls.truth != VOID)
        cls.holed = np.where(cls.cut, VOID, cls.truth).astype(np.int16)
        cls.source = copy_with(cls.folder / "holed.tif", shared(RAINIER), cls.holed)

    def test_voids_are_filled_nearer_to_the_truth_than_gdal_fillnodata_does(self):
        out, _ = self.ingest(self.source, "--fill-voids", 300)
        filled = read(out)
        self.assertEqual((filled == VOID).sum(), 0)
        there = self.holed != VOID
        np.testing.assert_array_equal(filled[there], self.holed[there])
        other = gdal.GetDriverByName("MEM").CreateCopy("", gdal.Open(str(self.source)))
        gdal.FillNodata(other.GetRasterBand(1), None, 300, 0)
        ours, theirs = rms((filled - self.truth)[self.known]), rms((other.ReadAsArray() - self.truth)[self.known])
        print(f"{self.known.sum()} samples, deviation of the ground there {self.truth[self.known].std():.1f} m: RMS error {ours:.1f} m, gdal_fillnodata {theirs:.1f} m")
        self.assertLess(ours, 0.75 * theirs)

    def test_voids_that_are_too_large_stay(self):
        out, _ = self.ingest(self.source, "--fill-voids", 60, out="small.tif")
        filled = read(out)
        left = filled == VOID
        self.assertGreater(left.sum(), 1000)
        self.assertTrue(np.all(self.holed[left] == VOID))
        self.assertLess(left.sum(), (self.holed == VOID).sum())

    def test_voids_across_chunks_are_filled_as_in_a_crop_and_the_same_however_made(self):
        h = self.holed
        four = self.write("four.tif", np.block([[h, h[:, ::-1]], [h[::-1], h[::-1, ::-1]]]))
        whole = read(self.same_however_made(four, "--fill-voids", 300))
        self.assertEqual((whole == VOID).sum(), 0)
        for top, left in ((450, 1850), (1950, 200)):  # a void of each lies on the border of chunks, 2048
            crop, _ = self.ingest(self.write("crop.tif", read(four)[top:top + 500, left:left + 500]), "--fill-voids", 300, out="cropped.tif")
            inner = np.s_[100:400, 100:400]
            np.testing.assert_array_equal(read(crop)[inner], whole[top:top + 500, left:left + 500][inner])

    def test_a_changed_input_costs_what_the_margin_reaches(self):
        heights = np.tile(self.truth, (2, 4))[:2000]
        place = lambda column: (10 + 0.01 * column, 0.01, 0, 50, 0, -0.01)
        parts = [self.write("left.tif", heights[:, :2200], place(0)), self.write("right.tif", heights[:, 2200:], place(2200))]
        for options, touched in (([], 2), (["--fill-voids", 200], 3)):  # chunks end at columns 2048, 4096, 4804
            with self.subTest(options):
                self.write("right.tif", heights[:, 2200:], place(2200))
                self.ingest(*parts, *options, out="parts.tif")
                self.write("right.tif", heights[:, 2200:] // 2, place(2200))
                again, told = self.ingest(*parts, *options, out="parts.tif")
                self.assertEqual(re.search(r"(\d+) of (\d+) chunks made", told.stdout).groups(), (str(touched), "3"))
                fresh, _ = self.ingest(*parts, *options, out="fresh.tif")
                self.assertEqual(again.read_bytes(), fresh.read_bytes())

    def test_another_option_makes_all_anew(self):
        self.ingest(self.source, out="options.tif")
        filled, told = self.ingest(self.source, "--fill-voids", 300, out="options.tif")
        self.assertIn("1 of 1 chunks made", told.stdout)
        self.assertEqual((read(filled) == VOID).sum(), 0)
        self.assertIn("up to date", self.ingest(self.source, "--fill-voids", 300, out="options.tif")[1].stdout)

    def test_memory_stays_within_its_bound(self):
        h = self.holed
        self.stays_within(320, self.write("memory.tif", np.block([[h, h[:, ::-1]], [h[::-1], h[::-1, ::-1]]])), "--fill-voids", 300)

    def test_pictures_have_no_such_voids(self):
        self.refused(shared(BLUE_MARBLE), "--fill-voids", 10, naming="--fill-voids")
        self.refused(self.source, "--fill-voids", 0, naming="tellurion", status=WRONG_USAGE)

    def write(self, name, heights, place=(10, 0.01, 0, 50, 0, -0.01)):
        raster = gdal.GetDriverByName("GTiff").Create(str(self.folder / name), heights.shape[1], heights.shape[0], 1, gdal.GDT_Int16, ["TILED=YES"])
        raster.SetProjection('GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433],AUTHORITY["EPSG","4326"]]')
        raster.SetGeoTransform(place)
        raster.GetRasterBand(1).SetNoDataValue(VOID)
        raster.WriteArray(heights)
        return self.folder / name


def turned_squares(rows, columns, places, half_width, half_height):
    """Where scenes are missing: rectangles about (x, y), each turned otherwise."""
    y, x = np.mgrid[0:rows, 0:columns]
    missing = np.zeros((rows, columns), bool)
    for angle, (left, top) in enumerate(places, 1):
        along, across = (x - left) * np.cos(angle) + (y - top) * np.sin(angle), (y - top) * np.cos(angle) - (x - left) * np.sin(angle)
        missing |= (abs(along) < half_width) & (abs(across) < half_height)
    return missing


def steps_across(border_of, bands):
    """The mean difference of neighbours of which one is in the mask and one is not."""
    down, right = border_of[:-1] != border_of[1:], border_of[:, :-1] != border_of[:, 1:]
    return float(np.concatenate([np.abs(np.diff(bands.astype(int), axis=1))[:, down].ravel(), np.abs(np.diff(bands.astype(int), axis=2))[:, right].ravel()]).mean())


class Base(RepairCase):
    """Holes in Blue Marble, filled from another picture of the Earth: Blue Marble Next Generation, of another month and half as fine."""

    BASE = "earth/imagery/bmng_200405_2048.jpg"
    HOLES = ((2250, 700), (2500, 1150), (1000, 1100), (3300, 600), (900, 500), (3700, 1300), (2150, 850), (2048, 400))

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.truth = read(shared(BLUE_MARBLE))
        cls.missing = turned_squares(*cls.truth.shape[1:], cls.HOLES, 90, 60)
        cls.source = cls.with_holes("holes.tif", cls.missing)

    @classmethod
    def with_holes(cls, name, missing):
        file = cls.folder / name
        raster = gdal.GetDriverByName("GTiff").Create(str(file), missing.shape[1], missing.shape[0], 4, gdal.GDT_Byte, ["TILED=YES", "ALPHA=YES"])
        like = gdal.Open(str(shared(BLUE_MARBLE)))
        raster.SetProjection(like.GetProjection())
        raster.SetGeoTransform(like.GetGeoTransform())
        raster.WriteArray(np.concatenate([np.where(missing, 0, cls.truth), np.where(missing, 0, 255)[np.newaxis]]).astype(np.uint8))
        return file

    def test_no_seam_shows_and_the_colours_are_nearer_to_the_truth_than_the_base_s(self):
        filled = read(self.same_however_made(self.source, "--fill-from", shared(self.BASE), "--compress", "deflate"))
        self.assertTrue(np.all(filled[3] == 255))
        np.testing.assert_array_equal(filled[:3][:, ~self.missing], self.truth[:, ~self.missing])
        like = self.truth.shape
        base = gdal.Warp("", str(shared(self.BASE)), format="MEM", width=like[2], height=like[1], resampleAlg="bilinear").ReadAsArray()
        pasted = np.where(self.missing, base, self.truth)
        error = lambda bands: float(np.abs(bands.astype(int) - self.truth)[:, self.missing].mean())
        steps = {name: steps_across(self.missing, bands) for name, bands in (("truth", self.truth), ("pasted", pasted), ("filled", filled[:3]))}
        print(f"mean difference from the truth: base as it is {error(pasted):.2f}, fitted {error(filled[:3]):.2f}; "
              f"step across the border: truth {steps['truth']:.2f}, base as it is {steps['pasted']:.2f}, fitted {steps['filled']:.2f}")
        self.assertLess(error(filled[:3]), 0.7 * error(pasted))
        self.assertLess(steps["filled"], steps["truth"])

    def test_a_base_of_other_tint_gives_the_truth_again(self):
        tinted = copy_with(self.folder / "tinted.tif", shared(BLUE_MARBLE), np.floor(self.truth * np.array([0.7, 0.8, 0.9])[:, None, None] + np.array([40, 20, 5])[:, None, None]).astype(np.uint8))
        out, _ = self.ingest(self.source, "--fill-from", tinted, "--compress", "deflate", out="untinted.tif")
        error = np.abs(read(out)[:3].astype(int) - self.truth)[:, self.missing].mean()
        before = np.abs(read(tinted).astype(int) - self.truth)[:, self.missing].mean()
        print(f"a base that differs by {before:.1f} on average: what is filled differs by {error:.2f}")
        self.assertLess(error, 0.05 * before)

    def test_where_no_input_lies_there_is_the_base(self):
        left = gdal.Translate(str(self.folder / "left.tif"), str(shared(BLUE_MARBLE)), srcWin=[0, 0, 600, 300])
        right = gdal.Translate(str(self.folder / "right.tif"), str(shared(BLUE_MARBLE)), srcWin=[3400, 1700, 600, 300])
        left = right = None
        out, _ = self.ingest(self.folder / "left.tif", self.folder / "right.tif", "--fill-from", shared(BLUE_MARBLE), "--compress", "deflate", out="corners.tif")
        filled = read(out)
        self.assertTrue(np.all(filled[3] == 255))
        np.testing.assert_array_equal(filled[:3], self.truth[:, :2000, :4000])

    def test_a_changed_base_makes_all_anew(self):
        base = self.folder / "base.jpg"
        base.write_bytes(shared(self.BASE).read_bytes())
        (self.folder / "base.jpg.aux.xml").write_bytes(pathlib.Path(f"{shared(self.BASE)}.aux.xml").read_bytes())
        self.ingest(self.source, "--fill-from", base, out="changed.tif")
        self.assertIn("up to date", self.ingest(self.source, "--fill-from", base, out="changed.tif")[1].stdout)
        base.write_bytes(base.read_bytes() + b"\0")
        self.assertIn("2 of 2 chunks made", self.ingest(self.source, "--fill-from", base, out="changed.tif")[1].stdout)

    def test_memory_stays_within_its_bound(self):
        self.stays_within(512, self.source, "--fill-from", shared(self.BASE))

    def test_bad_bases_are_named(self):
        text = self.folder / "text.txt"
        text.write_text("no raster")
        for base in (text, self.folder / "nothing.tif", shared(RAINIER)):
            with self.subTest(str(base)):
                self.refused(self.source, "--fill-from", base, naming=base)


class BaseOfHeights(RepairCase):
    def test_a_coarse_model_on_its_own_datum_fills_without_a_step(self):
        truth = read(self.ingest(shared(RAINIER), "--fill-voids", 100, out="truth.tif")[0])
        missing = turned_squares(*truth.shape, ((400, 700), (800, 400)), 110, 90)
        holed = copy_with(self.folder / "holed.tif", shared(RAINIER), np.where(missing, VOID, truth).astype(np.int16))
        coarse = self.folder / "coarse.tif"
        gdal.Warp(str(coarse), str(self.folder / "truth.tif"), xRes=0.01, yRes=0.01, resampleAlg="average", outputType=gdal.GDT_Float32)
        raster = gdal.Open(str(coarse), gdal.GA_Update)
        raster.WriteArray(raster.ReadAsArray() + 25)  # another datum
        raster = None
        filled = read(self.ingest(holed, "--fill-from", coarse)[0])
        self.assertEqual((filled == VOID).sum(), 0)
        plain = gdal.Warp("", str(coarse), format="MEM", width=1201, height=1201, outputBounds=self.bounds(holed), resampleAlg="bilinear").ReadAsArray()
        pasted = np.where(missing, plain, truth)
        smooth = read(self.ingest(holed, "--fill-voids", 400, out="smooth.tif")[0])
        errors = {name: rms((heights - truth)[missing]) for name, heights in (("pasted", pasted), ("smooth", smooth), ("filled", filled))}
        steps = {name: steps_across(missing, heights[np.newaxis]) for name, heights in (("truth", truth), ("pasted", pasted), ("filled", filled))}
        print(f"RMS error: base as it is {errors['pasted']:.1f} m, --fill-voids {errors['smooth']:.1f} m, fitted {errors['filled']:.1f} m; "
              f"step across the border: truth {steps['truth']:.1f} m, base as it is {steps['pasted']:.1f} m, fitted {steps['filled']:.1f} m")
        self.assertLess(errors["filled"], 0.95 * errors["pasted"])
        self.assertLess(steps["filled"], 1.3 * steps["truth"])

    @staticmethod
    def bounds(file):
        raster = gdal.Open(str(file))
        t = raster.GetGeoTransform()
        return (t[0], t[3] + raster.RasterYSize * t[5], t[0] + raster.RasterXSize * t[1], t[3])


def on_ellipsoid(latitude, longitude):
    """Metres from the centre of WGS 84; degrees in."""
    a, e2 = 6378137.0, 0.0066943799901413165
    latitude, longitude = np.radians(latitude), np.radians(longitude)
    n = a / np.sqrt(1 - e2 * np.sin(latitude) ** 2)
    return np.stack([n * np.cos(latitude) * np.cos(longitude), n * np.cos(latitude) * np.sin(longitude), n * (1 - e2) * np.sin(latitude)], axis=-1)


class Sea(RepairCase):
    """Land from the real mask of water, as polygons. That a pixel goes is held against its distance from all points of the coast."""

    MASK = "earth/imagery/water_mask_1600.png"

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        mask = gdal.Open(str(shared(cls.MASK)))
        cls.land = mask.GetRasterBand(1).ReadAsArray() < 128
        raster = gdal.GetDriverByName("MEM").Create("", *cls.land.shape[::-1], 1)
        raster.SetGeoTransform(mask.GetGeoTransform())
        raster.SetProjection(mask.GetProjection())
        raster.WriteArray(cls.land.astype(np.uint8))
        cls.coast = cls.folder / "land.gpkg"
        vector = ogr.GetDriverByName("GPKG").CreateDataSource(str(cls.coast))
        layer = vector.CreateLayer("land", mask.GetSpatialRef(), ogr.wkbPolygon)
        gdal.Polygonize(raster.GetRasterBand(1), raster.GetRasterBand(1), layer, -1)
        t = mask.GetGeoTransform()
        # The coast is where neighbours differ: points along these edges of pixels, three for each.
        rows, columns = np.nonzero(cls.land[1:] != cls.land[:-1])
        share = (np.arange(3) + 0.5) / 3
        flat = np.stack([np.repeat(t[3] + t[5] * (rows + 1), 3), (t[0] + t[1] * (columns[:, None] + share)).ravel()], axis=1)
        rows, columns = np.nonzero(cls.land[:, 1:] != cls.land[:, :-1])
        upright = np.stack([(t[3] + t[5] * (rows[:, None] + share)).ravel(), np.repeat(t[0] + t[1] * (columns + 1), 3)], axis=1)
        cls.points = on_ellipsoid(*np.concatenate([flat, upright]).T)

    def check(self, kept, latitude, longitude, metres, tolerance):
        """`kept` of pixels at places, which are few."""
        t = gdal.Open(str(shared(self.MASK))).GetGeoTransform()
        on_land = self.land[((latitude - t[3]) / t[5]).astype(int).clip(0, self.land.shape[0] - 1), ((longitude - t[0]) / t[1]).astype(int).clip(0, self.land.shape[1] - 1)]
        places = on_ellipsoid(latitude, longitude)
        chord = np.array([np.sqrt(((self.points - place) ** 2).sum(axis=1).min()) for place in places])
        way = 2 * 6371e3 * np.arcsin(chord / (2 * 6371e3))
        sure = (np.abs(way - metres) > tolerance) | on_land
        self.assertGreater(sure.mean(), 0.9)
        self.assertGreater((~kept[sure]).sum(), 100)
        np.testing.assert_array_equal(kept[sure], (on_land | (way < metres))[sure])
        return int(sure.sum())

    def test_pictures_are_transparent_beyond_the_distance(self):
        out = self.same_however_made(shared(BLUE_MARBLE), "--coast", self.coast, "--sea-beyond", 200e3, "--compress", "deflate")
        bands = read(out)
        random = np.random.default_rng(5)
        rows, columns = random.integers(0, 2048, 1000), random.integers(0, 4096, 1000)
        compared = self.check(bands[3][rows, columns] == 255, 90 - (rows + 0.5) * 180 / 2048, (columns + 0.5) * 360 / 4096 - 180, 200e3, 3e3)
        np.testing.assert_array_equal(bands[:3][:, bands[3] == 255], read(shared(BLUE_MARBLE))[:, bands[3] == 255])
        print(f"{compared} pixels are cut or kept as their distances say; {(bands[3] == 0).mean():.1%} of all are cut")

    def test_heights_are_void_and_distances_those_on_the_body_in_any_projection(self):
        for source, crs in ((ARCTIC, "EPSG:3995"), (ETOPO5, "EPSG:3395")):
            with self.subTest(crs):
                extra = [] if crs == "EPSG:3995" else ["--crs", crs, "--resolution", 20000]
                if extra:
                    source = self.folder / "middle.tif"
                    gdal.Translate(str(source), str(shared(ETOPO5)), projWin=[-170, 70, 170, -70])
                heights, _ = self.ingest(source if extra else shared(source), *extra, "--coast", self.coast, "--sea-beyond", 150e3, out=f"{crs[5:]}.tif")
                raster = gdal.Open(str(heights))
                data, t = raster.ReadAsArray(), raster.GetGeoTransform()
                void = raster.GetRasterBand(1).GetNoDataValue()
                random = np.random.default_rng(6)
                rows, columns = random.integers(0, data.shape[0], 800), random.integers(0, data.shape[1], 800)
                to_degrees = osr.CoordinateTransformation(raster.GetSpatialRef(), self.degrees())
                places = np.array(to_degrees.TransformPoints(np.stack([t[0] + t[1] * (columns + 0.5), t[3] + t[5] * (rows + 0.5)], axis=1)))
                whole, _ = self.ingest(source if extra else shared(source), *extra, out=f"whole-{crs[5:]}.tif")
                there = read(whole)[rows, columns] != void
                self.check((data[rows, columns] != void)[there], places[there, 1], places[there, 0], 150e3, 5e3)

    @staticmethod
    def degrees():
        crs = osr.SpatialReference()
        crs.ImportFromEPSG(4326)
        crs.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        return crs

    def test_a_coast_is_part_of_the_plan(self):
        small = self.folder / "small.tif"
        gdal.Translate(str(small), str(shared(BLUE_MARBLE)), width=600, height=300)
        options = [small, "--coast", self.coast, "--sea-beyond"]
        self.ingest(*options, 1e5, out="planned.tif")
        self.assertIn("up to date", self.ingest(*options, 1e5, out="planned.tif")[1].stdout)
        self.assertIn("1 of 1 chunks made", self.ingest(*options, 2e5, out="planned.tif")[1].stdout)

    def test_several_lands_are_one(self):
        small = self.folder / "few.tif"
        gdal.Translate(str(small), str(shared(BLUE_MARBLE)), width=600, height=300)
        halves = [self.folder / "west.geojson", self.folder / "east.geojson"]
        for half, bounds in zip(halves, ((-181, -91, 20, 91), (-10, -91, 181, 91))):  # which overlap
            subprocess.run(["ogr2ogr", str(half), str(self.coast), "-spat", *map(str, bounds)], check=True)
        one, _ = self.ingest("--coast", self.coast, small, "--sea-beyond", 2e5, "--compress", "deflate", out="land.tif")
        two, _ = self.ingest("--coast", halves[0], "--coast", halves[1], small, "--sea-beyond", 2e5, "--compress", "deflate", out="lands.tif")
        self.assertEqual(one.read_bytes(), two.read_bytes())

    def test_bad_coasts_are_named(self):
        text = self.folder / "text.txt"
        text.write_text("no polygons")
        lost = self.folder / "lost.csv"
        lost.write_text('WKT\n"POLYGON ((0 0, 0 9, 9 9, 0 0))"\n')
        for coast in (text, lost, self.folder / "nothing.shp", shared(RAINIER), shared("earth/archives/cities.gpkg")):
            with self.subTest(str(coast)):
                self.refused(shared(RAINIER), "--coast", coast, "--sea-beyond", 1000, naming=coast)
        self.refused(shared(RAINIER), "--coast", self.coast, naming="--sea-beyond", status=WRONG_USAGE)
        self.refused(shared(RAINIER), "--sea-beyond", 1000, naming="--coast", status=WRONG_USAGE)


class Gshhg(RepairCase):
    """The land of GSHHG as GMT packs it. Expected is what the segments of the file say one by one: how far the nearest is, and how many lie between a place and the north pole."""

    FOLDER = pathlib.Path("/usr/share/gmt-gshhg")
    COAST = FOLDER / "binned_GSHHS_l.nc"
    STEP = 0.04  # degrees between points of the coast: 4.4 km, with which a distance of 100 km is at most (2.2 km)² / 200 km = 25 m too long
    TOLERANCE = 100  # metres

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        group = gdal.OpenEx(str(cls.COAST), gdal.OF_MULTIDIM_RASTER).GetRootGroup()
        arrays = [group.OpenMDArray(name).ReadAsArray() for name in (
            "Bin_size_in_minutes", "Id_of_first_segment_in_a_bin", "N_segments_in_a_bin", "Embedded_npts_levels_exit_entry_for_a_segment",
            "Id_of_first_point_in_a_segment", "Relative_longitude_from_SW_corner_of_bin", "Relative_latitude_from_SW_corner_of_bin")]
        side, firsts, counts, about, first_points, east, north = arrays
        side = side[0] / 60
        columns = round(360 / side)
        edges = []
        for bin_, (first, count) in enumerate(zip(firsts, counts)):
            for segment in range(first, first + count):
                if about[segment] >> 6 & 7 != 1:  # level
                    continue
                points = slice(first_points[segment], first_points[segment] + (about[segment] >> 9))
                longitude = side * (bin_ % columns + east[points].astype(np.uint16) / 65535)
                latitude = 90 - side * (bin_ // columns + 1 - north[points].astype(np.uint16) / 65535)
                edges.append(np.stack([latitude[:-1], longitude[:-1], latitude[1:], longitude[1:]], axis=1))
        cls.edges = np.concatenate(edges)
        steps = np.ceil(np.abs(cls.edges[:, 2:] - cls.edges[:, :2]).max(axis=1) / cls.STEP).astype(int).clip(1)
        which = np.repeat(np.arange(len(steps)), steps)
        share = ((np.arange(len(which)) - np.repeat(np.cumsum(steps) - steps, steps)) / steps[which])[:, None]
        cls.points = on_ellipsoid(*(cls.edges[which, :2] * (1 - share) + cls.edges[which, 2:] * share).T)

    def is_land(self, latitude, longitude):
        south, west, north, east = self.edges.T
        across = (west <= longitude % 360) != (east <= longitude % 360)
        share = (longitude % 360 - west[across]) / (east - west)[across]
        return np.count_nonzero(south[across] + share * (north - south)[across] > latitude) % 2 == 1

    def check(self, kept, latitude, longitude, metres):
        """`kept` of pixels at places, which are few."""
        on_land = np.array([self.is_land(*place) for place in zip(latitude, longitude)])
        chord = np.array([np.sqrt(((self.points - place) ** 2).sum(axis=1).min()) for place in on_ellipsoid(latitude, longitude)])
        way = 2 * 6371e3 * np.arcsin(chord / (2 * 6371e3))
        sure = (np.abs(way - metres) > self.TOLERANCE) | on_land
        self.assertGreater(sure.mean(), 0.98)
        for some in (on_land, ~on_land & kept, ~kept):
            self.assertGreater(some.sum(), 20)
        np.testing.assert_array_equal(kept[sure], (on_land | (way < metres))[sure])
        print(f"{sure.sum()} pixels are cut or kept as the file's lines say, {on_land.sum()} of them land")

    def test_pictures_are_cut_as_the_lines_of_the_file_say(self):
        out, _ = self.ingest(shared(BLUE_MARBLE), "--coast", self.COAST, "--sea-beyond", 100e3, "--compress", "deflate", out="whole.tif")
        random = np.random.default_rng(7)
        rows, columns = random.integers(0, 2048, 1000), random.integers(0, 4096, 1000)
        columns[:60] = [0, 4095, 2047, 2048] * 15  # along 180 and 0 degrees
        self.check(read(out)[3][rows, columns] == 255, 90 - (rows + 0.5) * 180 / 2048, (columns + 0.5) * 360 / 4096 - 180, 100e3)

    def test_heights_around_the_poles_are_cut_so_too(self):
        for source in (ARCTIC, "earth/regional/antarctica_etopo5_epsg3031_10km.tif"):
            with self.subTest(source):
                heights, _ = self.ingest(shared(source), "--coast", self.COAST, "--sea-beyond", 100e3, out="pole.tif")
                whole, _ = self.ingest(shared(source), out="whole-pole.tif")
                raster = gdal.Open(str(heights))
                data, t, void = raster.ReadAsArray(), raster.GetGeoTransform(), raster.GetRasterBand(1).GetNoDataValue()
                rows, columns = np.random.default_rng(8).integers(0, min(data.shape), (2, 600))
                rows[:20], columns[:20] = data.shape[0] // 2 + np.arange(20) // 5 - 2, data.shape[1] // 2 + np.arange(20) % 5 - 2
                there = read(whole)[rows, columns] != void
                rows, columns = rows[there], columns[there]
                crs = osr.SpatialReference()
                crs.SetFromUserInput("OGC:CRS84")
                places = np.array(osr.CoordinateTransformation(raster.GetSpatialRef(), crs).TransformPoints(np.stack([t[0] + t[1] * (columns + 0.5), t[3] + t[5] * (rows + 0.5)], axis=1)))
                self.check(data[rows, columns] != void, places[:, 1], places[:, 0], 100e3)

    def test_land_is_where_it_is_known_to_be_in_every_resolution_and_datum(self):
        land = {"Sahara": (23, 10), "Amazon": (-5, -60), "Greenland": (75, -40), "Australia": (-25, 135), "the Caspian Sea, a lake": (42, 51), "Lake Superior": (47.7, -87.5), "Ghana": (8, 0.1), "west of Ghana": (8, -0.1),
                "Chukotka": (67.5, 179.9), "east of Chukotka": (67.5, -179.9), "Antarctica": (-80, 90), "its west": (-80, -120), "Ross Ice Shelf": (-80, 179.9), "east of there": (-80, -179.9), "the south pole": (-89.9, 179.9)}
        sea = {"Pacific": (0, -150), "at 180 degrees": (-30, 179.9), "east of it": (-30, -179.9), "Gulf of Guinea": (0, 0.1), "west of it": (0, -0.1), "Ross Sea": (-74, 179.9), "east of that": (-74, -179.9), "the north pole": (89.9, 0.1)}
        small = self.folder / "small.tif"
        gdal.Translate(str(small), str(shared(BLUE_MARBLE)), width=1800, height=900, outputSRS="EPSG:4326")
        for resolution, crs in (("c", "EPSG:4326"), ("l", "EPSG:4326"), ("i", "EPSG:4326"), ("i", "EPSG:4301"), ("i", "EPSG:4267")):  # Tokyo lies 460 m off, NAD27 100 m
            out, _ = self.ingest(small, "--crs", crs, "--coast", self.FOLDER / f"binned_GSHHS_{resolution}.nc", "--sea-beyond", 5000, "--compress", "deflate", out=f"{resolution}-{crs[5:]}.tif")
            kept = read(out)[3] == 255
            self.assertEqual(kept.shape, (900, 1800))
            for places, expected in ((land, True), (sea, False)):
                for name, (latitude, longitude) in places.items():
                    with self.subTest(name, resolution=resolution, crs=crs):
                        self.assertEqual(kept[int((90 - latitude) * 5), int((longitude + 180) * 5)], expected)

    def test_what_is_damaged_or_no_shoreline_is_named(self):
        data = self.COAST.read_bytes()
        files = [self.FOLDER / "binned_river_c.nc"]
        for share in (0.01, 0.5, 0.99):
            files.append(self.folder / f"{share}.nc")
            files[-1].write_bytes(data[:int(share * len(data))])
        for file in files:
            with self.subTest(str(file)):
                self.refused(shared(RAINIER), "--coast", file, "--sea-beyond", 1000, naming=file)
        self.refused(shared("mars/mola_4ppd.tif"), "--coast", self.COAST, "--sea-beyond", 1000, naming=self.COAST)


class Clouds(RepairCase):
    """Real clouds, the thicker ones, painted over Blue Marble between 50 degrees south and north; the base is of another month and half as fine."""

    BASE = "earth/imagery/bmng_200405_2048.jpg"
    WINDOW = [1500, 460, 2300, 1120]  # columns and rows of Blue Marble

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        left, top, width, height = cls.WINDOW
        picture = gdal.Translate("", str(shared(BLUE_MARBLE)), format="MEM", srcWin=cls.WINDOW)
        cls.truth = picture.ReadAsArray()
        clouds = gdal.Translate("", str(shared("earth/imagery/clouds_4096.png")), format="MEM", rgbExpand="rgba", srcWin=cls.WINDOW).ReadAsArray()[3] / 255
        cls.opacity = np.where(clouds > 0.4, (clouds - 0.4) / 0.6, 0)
        cls.painted = np.floor(cls.truth * (1 - cls.opacity) + 255 * cls.opacity + 0.5).astype(np.uint8)
        cls.source = copy_with(cls.folder / "cloudy.tif", picture, cls.painted)

    def test_clouds_go_and_the_ground_stays(self):
        cleared = read(self.same_however_made(self.source, "--fill-from", shared(self.BASE), "--clouds", 30, "--compress", "deflate"))
        cloud, clear = self.opacity > 0.15, self.opacity == 0
        error = lambda bands, where: float(np.abs(bands.astype(int) - self.truth)[:, where].mean())
        found = np.any(cleared != self.painted, axis=0)[cloud].mean()
        print(f"clouds on {cloud.mean():.1%}, of which {found:.2%} found; mean difference from the truth under them {error(self.painted, cloud):.1f} before and {error(cleared, cloud):.1f} after, "
              f"beside them 0 and {error(cleared, clear):.2f}; of the whole {error(self.painted, cloud | ~cloud):.2f} and {error(cleared, cloud | ~cloud):.2f}")
        self.assertGreater(found, 0.99)
        self.assertLess(error(cleared, cloud), 0.05 * error(self.painted, cloud))
        self.assertLess(error(cleared, clear), 1.0)

    def test_memory_stays_within_its_bound(self):
        self.stays_within(700, self.source, "--fill-from", shared(self.BASE), "--clouds", 30)

    def test_clouds_need_a_base_and_a_picture(self):
        self.refused(self.source, "--clouds", 30, naming="--fill-from", status=WRONG_USAGE)
        self.refused(shared(RAINIER), "--fill-from", shared(RAINIER), "--clouds", 30, naming="--clouds")


if __name__ == "__main__":
    unittest.main()
