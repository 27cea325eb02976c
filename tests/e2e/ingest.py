"""`tellurion ingest`: what it writes is what GDAL would, and the same whatever happened on the way."""
# label: slow
# timeout: 900
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import time
import unittest

import numpy as np
from osgeo import gdal, osr
from osgeo_utils.samples import validate_cloud_optimized_geotiff as validator

from _common import ARCTIC, BLUE_MARBLE, ETOPO5, EVEREST, PROGRAM, RAINIER, ROOT, Case, shared

DONE, FAILED, WRONG_USAGE = 0, 1, 2


def halve(values, void):
    """The mean of the up to four samples under each, voids left out."""
    rows, columns = values.shape
    padded = np.full((rows + rows % 2, columns + columns % 2), np.nan)
    padded[:rows, :columns] = np.where(values == void, np.nan, values)
    four = np.stack([padded[j::2, i::2] for j in (0, 1) for i in (0, 1)])
    count = np.sum(~np.isnan(four), axis=0)
    with np.errstate(invalid="ignore"):
        mean = np.nansum(four, axis=0) / count
    if np.issubdtype(values.dtype, np.integer):
        mean = np.floor(mean + 0.5)
    return np.where(count == 0, void, mean).astype(values.dtype)


def write_raster(file, bands, transform=(10, 0.01, 0, 50, 0, -0.01), crs=4326, no_data=None, **options):
    bands = np.atleast_3d(bands) if bands.ndim == 3 else bands[np.newaxis]
    types = {"uint8": gdal.GDT_Byte, "uint16": gdal.GDT_UInt16, "int16": gdal.GDT_Int16, "float32": gdal.GDT_Float32, "float64": gdal.GDT_Float64}
    raster = gdal.GetDriverByName("GTiff").Create(str(file), bands.shape[2], bands.shape[1], bands.shape[0], types[str(bands.dtype)],
                                                  [f"{key}={value}" for key, value in options.items()])
    if crs:
        system = osr.SpatialReference()
        system.ImportFromEPSG(crs)
        raster.SetProjection(system.ExportToWkt())
    if transform:
        raster.SetGeoTransform(transform)
    if no_data is not None:
        raster.GetRasterBand(1).SetNoDataValue(no_data)
    raster.WriteArray(bands)
    return file


def hills(rows, columns, seed=1):
    y, x = np.mgrid[0:rows, 0:columns]
    noise = np.random.default_rng(seed).standard_normal((rows, columns))
    return (1000 + 500 * np.sin(x / 211) * np.cos(y / 173) + noise).astype(np.float32)


class IngestCase(Case):
    def ingest(self, *arguments, out=None, status=DONE):
        out = self.folder / out if out else self.folder / "out.tif"
        return out, self.tellurion("ingest", *arguments, "--out", out, status=status)

    def check_cog(self, file):
        warnings, errors, _ = validator.validate(str(file), full_check=True)
        self.assertEqual((warnings, errors), ([], []))

    def refused(self, *arguments, naming, status=FAILED):
        done = self.tellurion("ingest", *arguments, "--out", self.folder / "refused.tif", status=status)
        lines = done.stderr.strip().splitlines()
        self.assertIn(str(naming), lines[-1])
        self.assertFalse((self.folder / "refused.tif").exists())


class Content(IngestCase):
    def test_heights_are_those_of_the_input_and_overviews_their_means(self):
        for path in (EVEREST, ETOPO5, ARCTIC, "mars/mola_4ppd.tif"):
            with self.subTest(path):
                out, _ = self.ingest(shared(path), out=pathlib.Path(path).name)
                self.check_cog(out)
                before, after = gdal.Open(str(shared(path))), gdal.Open(str(out))
                band, own = after.GetRasterBand(1), before.GetRasterBand(1)
                self.assertEqual(after.GetGeoTransform(), before.GetGeoTransform())
                self.assertTrue(after.GetSpatialRef().IsSame(before.GetSpatialRef()))
                self.assertEqual((band.GetScale() or 1, band.GetOffset() or 0, band.GetUnitType()), (own.GetScale() or 1, own.GetOffset() or 0, own.GetUnitType()))
                if own.GetNoDataValue() is not None:
                    self.assertEqual(band.GetNoDataValue(), own.GetNoDataValue())
                values = own.ReadAsArray()
                np.testing.assert_array_equal(band.ReadAsArray(), values)
                void = band.GetNoDataValue()
                valid = values if void is None else values[values != void]
                self.assertEqual((band.GetMinimum(), band.GetMaximum()), (valid.min(), valid.max()))
                for i in range(band.GetOverviewCount()):
                    values = halve(values, void if void is not None else -1e30)
                    np.testing.assert_allclose(band.GetOverview(i).ReadAsArray(), values, rtol=2e-7)

    def test_many_chunks_are_one_raster(self):
        heights = hills(5000, 4500)
        heights[2000:2300, 100:900] = -9999
        source = write_raster(self.folder / "hills.tif", heights, no_data=-9999)
        out, _ = self.ingest(source, "--compress", "zstd", "--level", 1)
        self.check_cog(out)
        after = gdal.Open(str(out))
        band = after.GetRasterBand(1)
        np.testing.assert_array_equal(band.ReadAsArray(), heights)
        self.assertEqual(band.GetOverviewCount(), 4)
        for i in range(4):
            heights = halve(heights, -9999)
            np.testing.assert_allclose(band.GetOverview(i).ReadAsArray(), heights, rtol=3e-7)

    def test_pictures_are_near_the_input(self):
        source = gdal.Open(str(shared(BLUE_MARBLE))).ReadAsArray().astype(float)
        for options, most in ((["--compress", "deflate"], 0.0), ([], 3.0), (["--compress", "webp", "--quality", "90"], 3.0)):
            with self.subTest(options):
                out, _ = self.ingest(shared(BLUE_MARBLE), *options, out="marble.tif")
                self.check_cog(out)
                self.assertLessEqual(np.abs(gdal.Open(str(out)).ReadAsArray() - source).mean(), most)

    def test_tiles_of_a_folder_are_put_together(self):
        heights = hills(700, 1500)
        parts = self.folder / "parts"
        parts.mkdir()
        for column in range(3):
            write_raster(parts / f"{column}.tif", heights[:, 500 * column:500 * column + 500], transform=(10 + 5 * column, 0.01, 0, 50, 0, -0.01))
        (parts / "readme.txt").write_text("no raster")
        out, _ = self.ingest(parts)
        self.check_cog(out)
        after = gdal.Open(str(out))
        self.assertIsNone(after.GetRasterBand(1).GetNoDataValue())  # nothing is missing
        np.testing.assert_array_equal(after.ReadAsArray(), heights)

    def test_gaps_of_a_mosaic_are_void_and_of_pictures_transparent(self):
        for name, values in (("h", hills(300, 300)), ("p", np.full((3, 300, 300), 200, np.uint8))):
            with self.subTest(name):
                files = [write_raster(self.folder / f"{name}{i}.tif", values, transform=(10 + 6 * i, 0.01, 0, 50, 0, -0.01)) for i in (0, 1)]
                out, _ = self.ingest(*files, out=f"gap-{name}.tif")
                self.check_cog(out)
                after = gdal.Open(str(out))
                data = after.ReadAsArray()
                if name == "h":
                    self.assertTrue(np.all(data[:, 300:600] == after.GetRasterBand(1).GetNoDataValue()))
                    np.testing.assert_array_equal(data[:, 600:], values)
                else:
                    self.assertEqual(after.GetRasterBand(4).GetColorInterpretation(), gdal.GCI_AlphaBand)
                    self.assertEqual((data[3, :, :300].min(), data[3, :, 300:600].max(), data[3, :, 600:].min()), (255, 0, 255))

    def test_another_crs_is_warped_as_gdalwarp_does(self):
        out, _ = self.ingest(shared(RAINIER), "--crs", "EPSG:32610", "--resolution", 90)
        self.check_cog(out)
        after = gdal.Open(str(out))
        t, columns, rows = after.GetGeoTransform(), after.RasterXSize, after.RasterYSize
        self.assertEqual((t[1], t[5]), (90, -90))
        own = gdal.AutoCreateWarpedVRT(gdal.Open(str(shared(RAINIER))), None, after.GetProjection()).GetGeoTransform()[1]
        expected = gdal.Warp("", str(shared(RAINIER)), format="MEM", dstSRS="EPSG:32610", resampleAlg="bilinear", width=columns, height=rows,
                             outputBounds=(t[0], t[3] + rows * t[5], t[0] + columns * t[1], t[3]), dstNodata=after.GetRasterBand(1).GetNoDataValue(), errorThreshold=0,
                             warpOptions=[f"XSCALE={own / 90}", f"YSCALE={own / 90}"])
        difference = np.abs(after.ReadAsArray().astype(float) - expected.ReadAsArray())
        self.assertLess((difference > 1).mean(), 1e-3)

    def test_vertical_datums_are_declared(self):
        out, _ = self.ingest(shared(RAINIER), "--vertical", "egm96")
        self.assertIn("EGM96", gdal.Open(str(out)).GetSpatialRef().ExportToWkt())
        lines = self.tellurion("info", out).stdout
        self.assertIn("egm96", lines.lower())


class Restart(IngestCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.parts = [write_raster(cls.folder / f"part{i}.tif", hills(4200, 2200, i), transform=(10 + 22 * i, 0.01, 0, 50, 0, -0.01), no_data=-9999, TILED="YES") for i in (0, 1)]
        cls.whole = cls.folder / "whole.tif"
        subprocess.run([PROGRAM, "ingest", *map(str, cls.parts), "--out", str(cls.whole), "--workers", "2"], check=True, capture_output=True)

    def same(self, file):
        self.assertEqual(file.read_bytes(), self.whole.read_bytes())

    def test_a_second_run_does_nothing(self):
        out, first = self.ingest(*self.parts, out="second.tif")
        time_before = out.stat().st_mtime_ns
        _, second = self.ingest(*self.parts, out="second.tif")
        self.assertIn("up to date", second.stdout)
        self.assertEqual(out.stat().st_mtime_ns, time_before)

    def test_workers_change_nothing(self):
        for workers in (1, 3):
            out, _ = self.ingest(*self.parts, "--workers", workers, out=f"workers{workers}.tif")
            self.same(out)

    def test_after_kills_it_goes_on_and_writes_the_same(self):
        out = self.folder / "killed.tif"
        work = pathlib.Path(f"{out}.work")
        command = [PROGRAM, "ingest", *map(str, self.parts), "--out", str(out), "--workers", "1"]
        kills = 0
        kept = set()
        for delay in (0.5, 1.0, 1.5, 2.0, 0.7, 1.2):
            program = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(delay)
            if program.poll() is None:
                kills += 1
            program.send_signal(signal.SIGKILL)
            program.wait()
            now = {(file.name, file.stat().st_mtime_ns) for file in work.glob("*.blocks")} if work.exists() else set()
            self.assertLessEqual(kept, now)  # nothing that was done is done again
            kept = now
        self.assertGreater(kills, 0)
        self.ingest(*self.parts, "--workers", 1, out="killed.tif")
        self.same(out)
        self.assertEqual(list(work.glob("*.part")), [])

    def test_a_second_run_on_the_same_output_is_refused_while_the_first_works(self):
        out = self.folder / "twice.tif"
        first = subprocess.Popen([PROGRAM, "ingest", *map(str, self.parts), "--out", str(out), "--workers", "1"], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        self.addCleanup(first.wait)
        self.addCleanup(first.kill)
        while first.poll() is None and not (self.folder / "twice.tif.work/plan.json").exists():
            time.sleep(0.001)
        first.send_signal(signal.SIGSTOP)
        self.assertIsNone(first.poll(), "it was done too soon")
        said = self.tellurion("ingest", *self.parts, "--out", out, status=FAILED).stderr
        self.assertIn("twice.tif.work: another `tellurion ingest` is at work there", said)
        first.kill()
        first.wait()
        self.ingest(*self.parts, out="twice.tif")

    def test_shards_merge_to_the_same(self):
        out = self.folder / "shards.tif"
        for shard in (3, 1, 2):
            _, done = self.ingest(*self.parts, "--shard", f"{shard}/3", out="shards.tif")
            self.assertFalse(out.exists())
            if shard == 3:
                failed = self.tellurion("ingest", "merge", "--out", out, status=FAILED)
                self.assertIn("not there", failed.stderr)
        self.tellurion("ingest", "merge", "--out", out)
        self.same(out)

    def test_shards_of_several_folders_merge_to_the_same(self):
        for shard in (1, 2):
            (self.folder / f"machine{shard}").mkdir()
            self.ingest(*self.parts, "--shard", f"{shard}/2", out=f"machine{shard}/x.tif")
        self.tellurion("ingest", "merge", self.folder / "machine1/x.tif.work", self.folder / "machine2/x.tif.work", "--out", self.folder / "merged.tif")
        self.same(self.folder / "merged.tif")

    def test_a_changed_input_costs_what_it_touches(self):
        parts = [shutil.copy(part, self.folder / f"changing{i}.tif") for i, part in enumerate(self.parts)]
        out, _ = self.ingest(*parts, out="changing.tif")
        values = hills(4200, 2200, 7)
        write_raster(parts[1], values, transform=(32, 0.01, 0, 50, 0, -0.01), no_data=-9999, TILED="YES")
        _, again = self.ingest(*parts, out="changing.tif")
        made, all_chunks = map(int, re.search(r"(\d+) of (\d+) chunks made", again.stdout).groups())
        self.assertEqual((made, all_chunks), (6, 9))  # the left one of three columns is the other part's alone
        np.testing.assert_array_equal(gdal.Open(str(out)).ReadAsArray()[:, 2200:], values)

    def test_memory_stays_within_its_bound(self):
        out = self.folder / "bounded.tif"
        command = [PROGRAM, "ingest", *map(str, self.parts), "--out", str(out), "--memory", "256", "--workers", "2"]
        script = "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True); print('kB', resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
        done = subprocess.run(["/usr/bin/python3", "-c", script, *command], check=True, capture_output=True, text=True)
        self.assertLess(int(done.stdout.split("kB")[1]), 256 * 1024)
        self.same(out)


class ErrorTable(IngestCase):
    """FILE.tif.errors: a raster that has one is shown without being read as a whole first."""
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.out = cls.folder / "table.tif"
        cls.table = cls.folder / "table.tif.errors"
        cls.source = write_raster(cls.folder / "ground.tif", hills(2600, 2600), transform=(10, 0.001, 0, 50, 0, -0.001))
        subprocess.run([PROGRAM, "ingest", str(cls.source), "--out", str(cls.out), "--vertical", "ellipsoid", "--error-table", "yes"], check=True, capture_output=True)
        cls.world = cls.folder / "table.toml"
        cls.world.write_text('[planet]\nname = "Earth"\n[[layer]]\nname = "ground"\ngroup = "height"\nsource = { type = "gdal", path = "table.tif" }\n')

    def shown(self, name):
        """The picture, what was read for it, what was told, and the tables that were kept."""
        picture, stats, cache = (self.folder / f"{name}{ending}" for ending in (".png", ".json", ".cache"))
        done = self.tellurion("render", self.world, "--out", picture, "--camera", "48.4,11.3,60000,0,-40", "--size", "320x180", "--disk-cache", cache, "--stats", stats)
        source, = json.loads(stats.read_text())["sources"]
        return picture.read_bytes(), source["bytes"], done.stderr, list(cache.glob("tables/*"))

    def test_the_picture_is_the_same_and_only_what_it_shows_is_read(self):
        with_table, few, told, kept = self.shown("with")
        self.assertEqual((told, kept), ("", []))
        hidden = self.table.rename(self.folder / "hidden")
        try:
            without, all_bytes, told, kept = self.shown("without")
        finally:
            hidden.rename(self.table)
        self.assertEqual((told, len(kept)), ("", 1))  # it was scanned
        self.assertEqual(with_table, without)
        self.assertGreater(all_bytes, 4 * 2600 * 2600)
        self.assertLess(few, all_bytes / 2)

    def test_a_table_of_other_data_is_told_of_and_left_out(self):
        right = self.table.read_bytes()
        picture = self.shown("right")[0]
        for wrong in (right[:-1], right[:len(right) // 2] + b"?" + right[len(right) // 2 + 1:], b""):
            self.table.write_bytes(wrong)
            try:
                as_scanned, _, told, kept = self.shown(f"wrong{len(wrong)}")
            finally:
                self.table.write_bytes(right)
            self.assertIn("table.tif.errors is not used", told)
            self.assertIn("--error-table yes", told)
            self.assertEqual((as_scanned, len(kept)), (picture, 1))

    def test_it_goes_with_the_file_and_ends_with_it(self):
        there = self.folder / "there"
        there.mkdir()
        for file in (self.out, self.table):
            shutil.copy(file, there / file.name)
        world, self.world = self.world, there / "table.toml"
        shutil.copy(world, self.world)
        try:
            self.assertEqual(self.shown("copied")[2:], ("", []))
            # GDAL changes one sample in place.
            raster = gdal.OpenEx(str(there / "table.tif"), gdal.OF_RASTER | gdal.OF_UPDATE, open_options=["IGNORE_COG_LAYOUT_BREAK=YES"])
            raster.GetRasterBand(1).WriteArray(np.full((1, 1), 4000, np.float32), 1300, 1300)
            raster = None
            self.assertIn("is not used", self.shown("changed")[2])
        finally:
            self.world = world

    def test_a_kill_while_it_is_made_changes_nothing(self):
        out = self.folder / "killed-table.tif"
        command = [PROGRAM, "ingest", str(self.source), "--out", str(out), "--vertical", "ellipsoid", "--error-table", "yes", "--workers", "1"]
        program = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for _ in range(3000):
            if len(list(pathlib.Path(f"{out}.work").glob("*.scan"))) > 10 or program.poll() is not None:
                break
            time.sleep(0.02)
        self.assertIsNone(program.poll())
        program.send_signal(signal.SIGKILL)
        program.wait()
        self.assertFalse(pathlib.Path(f"{out}.errors").exists())
        kept = {file.name: file.stat().st_mtime_ns for file in pathlib.Path(f"{out}.work").glob("*.scan")}
        subprocess.run(command, check=True, capture_output=True)
        for file in pathlib.Path(f"{out}.work").glob("*.scan"):
            self.assertEqual(kept.get(file.name, file.stat().st_mtime_ns), file.stat().st_mtime_ns)
        self.assertEqual(pathlib.Path(f"{out}.errors").read_bytes(), self.table.read_bytes())

    def test_memory_stays_within_its_bound_while_it_is_made(self):
        script = "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True); print('kB', resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
        done = subprocess.run(["/usr/bin/python3", "-c", script, PROGRAM, "ingest", str(self.source), "--out", str(self.folder / "small-memory.tif"), "--vertical", "ellipsoid",
                               "--error-table", "yes", "--memory", "192", "--workers", "2"], check=True, capture_output=True, text=True)
        self.assertLess(int(done.stdout.split("kB")[1]), 192 * 1024)
        self.assertEqual((self.folder / "small-memory.tif.errors").read_bytes(), self.table.read_bytes())

    def test_pictures_have_none(self):
        picture = write_raster(self.folder / "picture.tif", np.zeros((3, 64, 64), np.uint8))
        done = self.tellurion("ingest", picture, "--out", self.folder / "no-table.tif", "--error-table", "yes", status=FAILED)
        self.assertIn("picture", done.stderr.strip().splitlines()[-1])


class BadInput(IngestCase):
    def test_what_cannot_be_prepared_is_named(self):
        heights = hills(64, 64)
        no_crs = write_raster(self.folder / "no_crs.tif", heights, crs=None)
        no_place = write_raster(self.folder / "no_place.tif", heights, transform=None)
        whole = write_raster(self.folder / "whole.tif", hills(2000, 2000), COMPRESS="DEFLATE")
        cut = self.folder / "cut.tif"
        cut.write_bytes(whole.read_bytes()[:whole.stat().st_size // 2])
        picture = write_raster(self.folder / "picture.tif", np.zeros((3, 64, 64), np.uint8))
        text = self.folder / "text.txt"
        text.write_text("no raster")
        (self.folder / "empty").mkdir()
        for arguments, naming in (([no_crs], no_crs), ([no_place], no_place), ([cut], "cut.tif"), ([text], text), ([self.folder / "nothing.tif"], "nothing.tif"),
                                  ([self.folder / "empty"], "empty"), ([whole, picture], picture), ([whole, "--crs", "EPSG:99999999"], "EPSG:99999999"),
                                  ([whole, "--vertical", "EPSG:4326"], "EPSG:4326"), ([whole, "--compress", "jpeg"], "--compress"), ([whole, "--memory", "64"], "--memory"),
                                  ([whole, "--resolution", "1e-11"], "--resolution")):
            with self.subTest(str(arguments)):
                self.refused(*arguments, naming=naming)

    def test_wrong_usage_is_told(self):
        source = shared(EVEREST)
        for arguments in ([], [source, "--shard", "0/3"], [source, "--shard", "4/3"], [source, "--shard", "x"], [source, "--block", "100"], [source, "--compress", "best"],
                          [source, "--level", "99"], [source, "--quality", "0"], [source, "--memory", "1"], [source, "--workers", "0"], [source, "--kind", "sound"]):
            with self.subTest(str(arguments)):
                self.refused(*arguments, naming="tellurion", status=WRONG_USAGE)
        self.tellurion("ingest", source, status=WRONG_USAGE)
        self.tellurion("ingest", source, "--out", self.folder / "x.png", status=WRONG_USAGE)

    def test_the_input_is_never_the_output(self):
        source = write_raster(self.folder / "self.tif", hills(64, 64))
        done = self.tellurion("ingest", source, "--out", source, status=FAILED)
        self.assertIn("output", done.stderr)

    def test_an_output_that_cannot_be_written_is_named(self):
        done = self.tellurion("ingest", shared(EVEREST), "--out", "/proc/nowhere/x.tif", status=FAILED)
        self.assertIn("/proc/nowhere", done.stderr)

    @unittest.skipUnless(os.path.exists("/dev/full"), "needs /dev/full")
    def test_a_file_size_limit_is_a_full_disk(self):
        source = write_raster(self.folder / "large.tif", hills(2500, 2500))
        out = self.folder / "full.tif"

        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (2 << 20, 2 << 20))

        done = subprocess.run([PROGRAM, "ingest", str(source), "--out", str(out)], preexec_fn=limit, capture_output=True, text=True)
        self.assertEqual(done.returncode, FAILED)
        self.assertIn("cannot be written", done.stderr)
        self.assertFalse(out.exists())
        self.ingest(source, out="full.tif")
        np.testing.assert_array_equal(gdal.Open(str(out)).ReadAsArray(), hills(2500, 2500))

    def test_nan_and_infinities_are_void(self):
        heights = hills(300, 300)
        heights[:20] = np.nan
        heights[20:40] = np.inf
        for no_data in (None, -9999):
            out, _ = self.ingest(write_raster(self.folder / "nan.tif", heights, no_data=no_data), out=f"nan{no_data}.tif")
            data = gdal.Open(str(out)).ReadAsArray()
            self.assertTrue(np.all(np.isnan(data[:40])) if no_data is None else np.all(data[:40] == no_data))
            np.testing.assert_array_equal(data[40:], heights[40:])

    def test_8_bit_heights_16_bit_colours_palettes_and_rotation(self):
        low = (np.arange(90000) % 251).astype(np.uint8).reshape(300, 300)
        out, _ = self.ingest(write_raster(self.folder / "low.tif", low), "--kind", "height", out="low-out.tif")
        np.testing.assert_array_equal(gdal.Open(str(out)).ReadAsArray(), low)
        deep = np.random.default_rng(1).integers(0, 65536, (3, 300, 300)).astype(np.uint16)
        out, _ = self.ingest(write_raster(self.folder / "deep.tif", deep), out="deep-out.tif")
        self.check_cog(out)
        np.testing.assert_array_equal(gdal.Open(str(out)).ReadAsArray(), deep)
        source = write_raster(self.folder / "palette.tif", low)
        raster = gdal.Open(str(source), gdal.GA_Update)
        table = gdal.ColorTable()
        for i in range(256):
            table.SetColorEntry(i, (i, 255 - i, i // 2, 255))
        raster.GetRasterBand(1).SetColorTable(table)
        raster = None
        out, _ = self.ingest(source, out="palette-out.tif")
        np.testing.assert_array_equal(gdal.Open(str(out)).ReadAsArray(), np.stack([low, 255 - low, low // 2]))
        turned = write_raster(self.folder / "turned.tif", hills(300, 300), transform=(10, 0.01, 0.005, 50, 0.005, -0.01))
        out, _ = self.ingest(turned, out="turned-out.tif")
        self.check_cog(out)
        self.assertEqual(gdal.Open(str(out)).GetGeoTransform()[2], 0)


class Guide(IngestCase):
    def test_the_guide_s_commands_do_what_it_says(self):
        text = (ROOT / "docs/preparing-data.md").read_text()
        commands = [line.strip() for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL) for line in block.splitlines()]
        self.assertGreater(len(commands), 3)
        folder = self.folder / "guide"
        (folder / "dem").mkdir(parents=True)
        write_raster(folder / "dem/a.tif", hills(600, 600))
        write_raster(folder / "dem/b.tif", hills(600, 600), transform=(16, 0.01, 0, 50, 0, -0.01))
        write_raster(folder / "picture.tif", np.random.default_rng(1).integers(0, 256, (3, 600, 600)).astype(np.uint8))
        write_raster(folder / "base.tif", np.random.default_rng(2).integers(0, 256, (3, 300, 300)).astype(np.uint8), transform=(9, 0.03, 0, 51, 0, -0.03))
        (folder / "land.geojson").write_text('{"type": "Polygon", "coordinates": [[[11, 45], [12, 45], [12, 49], [11, 49], [11, 45]]]}')
        for command in commands:
            with self.subTest(command):
                subprocess.run(["bash", "-ec", f'tellurion() {{ "{PROGRAM}" "$@"; }}; {command}'], cwd=folder, check=True, capture_output=True)


if __name__ == "__main__":
    unittest.main()
