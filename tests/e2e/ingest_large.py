"""`tellurion ingest` of 60,000 x 60,000 samples into a file of more than 4 GB: within the memory that it was given, and true."""
# label: long
# timeout: 1800
import re
import shutil
import subprocess
import unittest

import numpy as np
from osgeo import gdal
from osgeo_utils.samples import validate_cloud_optimized_geotiff as validator

from _common import PROGRAM, Case

SIDE, PART = 60_000, 3_000
ROOM = 12 << 30  # of the disk: the chunks and the output
MEMORY_MB = 256


class Large(Case):
    def setUp(self):
        if shutil.disk_usage(self.folder).free < ROOM:
            self.skipTest(f"needs {ROOM >> 30} GB in {self.folder}")

    def write_input(self):
        """A raster that holds one of 3000 x 3000 samples in every place, but a few that stay void."""
        values = np.random.default_rng(1).integers(1, 256, (PART, PART)).astype(np.uint8)
        gdal.GetDriverByName("GTiff").Create(str(self.folder / "part.tif"), PART, PART, 1, gdal.GDT_Byte, ["TILED=YES"]).WriteArray(values)
        rows = SIDE // PART
        places = [(column, row) for row in range(rows) for column in range(rows) if (column, row) not in self.voids]
        sources = "".join(f'<SimpleSource><SourceFilename relativeToVRT="1">part.tif</SourceFilename><SourceBand>1</SourceBand><SrcRect xOff="0" yOff="0" xSize="{PART}" ySize="{PART}"/>'
                          f'<DstRect xOff="{PART * column}" yOff="{PART * row}" xSize="{PART}" ySize="{PART}"/></SimpleSource>' for column, row in places)
        file = self.folder / "large.vrt"
        file.write_text(f'<VRTDataset rasterXSize="{SIDE}" rasterYSize="{SIDE}"><SRS>EPSG:4326</SRS><GeoTransform>10, 0.0001, 0, 50, 0, -0.0001</GeoTransform>'
                        f'<VRTRasterBand dataType="Byte" band="1"><NoDataValue>0</NoDataValue>{sources}</VRTRasterBand></VRTDataset>')
        return file, values

    voids = {(7, 3), (8, 3), (19, 19)}

    def test_a_file_past_4_gigabytes_is_true_and_takes_little_memory(self):
        source, values = self.write_input()
        out = self.folder / "large.tif"
        script = "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True); print('kB', resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
        done = subprocess.run(["/usr/bin/python3", "-c", script, PROGRAM, "ingest", str(source), "--out", str(out), "--kind", "height", "--compress", "none",
                               "--memory", str(MEMORY_MB), "--error-table", "no", "--remove-work"], check=True, capture_output=True, text=True)
        self.assertLess(int(re.search(r"kB (\d+)", done.stdout).group(1)), MEMORY_MB * 1024)
        self.assertGreater(out.stat().st_size, 1 << 32)
        with out.open("rb") as file:
            self.assertEqual(file.read(4), b"II\x2b\0")  # BigTIFF
        warnings, errors, _ = validator.validate(str(out), full_check=False)
        self.assertEqual((warnings, errors), ([], []))
        raster = gdal.Open(str(out))
        band = raster.GetRasterBand(1)
        self.assertEqual((raster.RasterXSize, raster.RasterYSize, band.GetNoDataValue(), band.GetOverviewCount()), (SIDE, SIDE, 0, 7))
        self.assertEqual((band.GetMinimum(), band.GetMaximum()), (1, 255))
        self.assertAlmostEqual(float(band.GetMetadataItem("STATISTICS_MEAN")), values.mean(), places=6)
        random = np.random.default_rng(2)
        places = [(0, 0), (SIDE - 500, 0), (0, SIDE - 500), (SIDE - 500, SIDE - 500), (7 * PART - 200, 3 * PART - 200), *random.integers(0, SIDE - 500, (20, 2))]
        for x, y in places:
            x, y = int(x) // 2 * 2, int(y) // 2 * 2
            columns, rows = np.arange(x, x + 500), np.arange(y, y + 500)
            expected = values[np.ix_(rows % PART, columns % PART)].copy()
            for column, row in self.voids:
                expected[np.ix_(rows // PART == row, columns // PART == column)] = 0
            np.testing.assert_array_equal(band.ReadAsArray(x, y, 500, 500), expected)
            sums = np.where(expected == 0, 0, expected.astype(int)).reshape(250, 2, 250, 2).sum((1, 3))
            counts = (expected != 0).reshape(250, 2, 250, 2).sum((1, 3))
            means = np.where(counts > 0, np.floor(sums / np.maximum(counts, 1) + 0.5), 0)
            np.testing.assert_array_equal(band.GetOverview(0).ReadAsArray(x // 2, y // 2, 250, 250), means)
        self.assertTrue((band.GetOverview(6).ReadAsArray() != 0).mean() > 0.98)


if __name__ == "__main__":
    unittest.main()
