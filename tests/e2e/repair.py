"""`tellurion ingest` mends what inputs lack: on real data with holes cut where the truth is known."""
# label: slow
# timeout: 600
import pathlib
import re
import subprocess
import unittest

import numpy as np
from osgeo import gdal

from _common import BLUE_MARBLE, EVEREST, PROGRAM, RAINIER, Case, shared

DONE, FAILED, WRONG_USAGE = 0, 1, 2
VOID = -32768


def copy_with(file, source, bands):
    """The raster `source` with other samples."""
    raster = gdal.GetDriverByName("GTiff").CreateCopy(str(file), gdal.Open(str(source)), options=["TILED=YES", "BLOCKXSIZE=256", "BLOCKYSIZE=256"])
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
        """Workers, shards and the bound of memory change no byte. Gives the file."""
        out, _ = self.ingest(*arguments, "--workers", 2, out="two.tif")
        one, _ = self.ingest(*arguments, "--workers", 1, "--memory", 512, out="one.tif")
        self.assertEqual(out.read_bytes(), one.read_bytes())
        for shard in (2, 1):
            self.ingest(*arguments, "--shard", f"{shard}/2", out="shards.tif")
        self.tellurion("ingest", "merge", "--out", self.folder / "shards.tif")
        self.assertEqual(out.read_bytes(), (self.folder / "shards.tif").read_bytes())
        return out


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
        four = self.write("memory.tif", np.block([[h, h[:, ::-1]], [h[::-1], h[::-1, ::-1]]]))
        command = [PROGRAM, "ingest", str(four), "--fill-voids", "300", "--out", str(self.folder / "bounded.tif"), "--memory", "320", "--workers", "2"]
        script = "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True); print('kB', resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
        done = subprocess.run(["/usr/bin/python3", "-c", script, *command], check=True, capture_output=True, text=True)
        self.assertLess(int(done.stdout.split("kB")[1]), 320 * 1024)

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


if __name__ == "__main__":
    unittest.main()
