"""Imagery lies where it belongs: the picture against the raster's colours at the places that --geo names."""
# label: slow
# timeout: 600
import unittest

import numpy as np
from osgeo import gdal

from _common import BLUE_MARBLE, Case, GeographicRaster, read_geo, read_picture, shared, write_picture

SIZE = (640, 360)

# Near enough for a texel to cover a pixel or more, so that bilinear is what should be seen: a coast from aslant, both poles,
# the antimeridian, a corner and an edge of the cube's faces, and the middle of the ocean of data.
VIEWS = {"alps": (43.0, 9.0, 500e3, 0.0, -45.0), "north pole": (89.9, 0.0, 1.5e6, 20.0, -60.0),
         "south pole": (-89.9, 0.0, 1.5e6, 20.0, -60.0), "antimeridian": (-17.0, 179.9, 900e3, 0.0, -75.0),
         "corner": (35.26, 45.0, 1e6, 10.0, -70.0), "edge": (0.0, 45.0, 2e6, 0.0, -90.0), "rolled": (20.0, 10.0, 1e6, 80.0, -60.0, 40.0)}


class ImageryTrue(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.bands = [GeographicRaster(shared(BLUE_MARBLE), band) for band in (1, 2, 3)]

    def figures(self, picture, expected):
        """Mean difference, and the largest displacement in pixels of a quarter of the picture: the multiple of the expected
        picture's gradient that explains most of the difference."""
        known = np.isfinite(expected).all(axis=-1)
        difference = (picture - expected).mean(axis=-1)
        down, right = np.gradient(expected.mean(axis=-1))
        known &= np.isfinite(down) & np.isfinite(right)
        shifts = []
        for rows in (slice(0, SIZE[1] // 2), slice(SIZE[1] // 2, None)):
            for columns in (slice(0, SIZE[0] // 2), slice(SIZE[0] // 2, None)):
                part = known[rows, columns]
                slopes = [slope[rows, columns][part] for slope in (right, down)]
                shift, *_ = np.linalg.lstsq(np.stack([*slopes, np.ones(part.sum())], axis=1), difference[rows, columns][part],
                                            rcond=None)
                shifts.append(np.hypot(*shift[:2]))
        return np.mean(np.abs(difference[known])), max(shifts)

    def test_blue_marble_from_everywhere(self):
        world = self.world("marble", ("color", BLUE_MARBLE))
        for name, pose in VIEWS.items():
            with self.subTest(name):
                geo = self.folder / "geo.tif"
                picture = read_picture(self.render(world, pose, "--size", "{}x{}".format(*SIZE), "--no-lighting",
                                                   "--no-atmosphere", "--geo", geo, name=name)).astype(float)
                lat, lon, *_ = read_geo(geo)
                expected = np.stack([band.bilinear(lat, lon) for band in self.bands], axis=-1)
                mean, shift = self.figures(picture, expected)
                print(f"{name}: mean difference {mean:.2f}/255, displaced by {shift:.3f} px")
                if mean > 2.5 or shift > 0.25:
                    write_picture(self.folder / f"{name}-expected.png", np.nan_to_num(expected))
                self.assertLess(mean, 2.5)
                self.assertLess(shift, 0.25)
                # The check itself: a picture moved by half a pixel, or mirrored, is told apart.
                self.assertGreater(self.figures(0.5 * (picture + np.roll(picture, 1, axis=1)), expected)[1], 0.25)
                self.assertGreater(self.figures(picture[:, ::-1], expected)[0], 2.5)

    def test_a_raster_in_utm_lies_on_blue_marble_where_its_own_projection_says(self):
        """The inset of Boston, resampled by GDAL to longitude and latitude, against the picture."""
        inset = self.folder / "boston.tif"
        gdal.Warp(str(inset), str(shared("earth/regional/boston-inset.tif")), dstSRS="EPSG:4326", resampleAlg="bilinear",
                  xRes=0.002, yRes=0.0015, dstAlpha=True)
        bands = [GeographicRaster(inset, band) for band in (1, 2, 3, 4)]
        world = self.world("boston", ("color", BLUE_MARBLE), ("color", "earth/regional/boston-inset.tif"))
        geo = self.folder / "geo.tif"
        picture = read_picture(self.render(world, (42.3, -71.07, 60e3), "--size", "{}x{}".format(*SIZE), "--no-lighting",
                                           "--no-atmosphere", "--geo", geo, name="boston")).astype(float)
        lat, lon, *_ = read_geo(geo)
        colours = np.stack([band.bilinear(lat, lon) for band in bands], axis=-1)
        expected = np.where(colours[..., 3:] == 255.0, colours[..., :3], np.nan)
        mean, shift = self.figures(picture, expected)
        print(f"boston: mean difference {mean:.2f}/255, displaced by {shift:.3f} px")
        self.assertLess(mean, 6.0)
        self.assertLess(shift, 0.25)


if __name__ == "__main__":
    unittest.main()
