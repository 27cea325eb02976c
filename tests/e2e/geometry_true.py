"""Every pixel of --geo lies on the elevation: a few views at a small size; geometry_true_all.py has the rest."""
# label: slow
# timeout: 1500
import unittest

import numpy as np

from _common import (EARTH, ETOPO5, EVEREST, RAINIER, Camera, Case, GeographicRaster, angle_between, elevation, read_geo,
                     shared)

WORLDS = {"etopo5": [ETOPO5], "rainier": [RAINIER], "everest": [EVEREST],
          "rainier over etopo5": [ETOPO5, RAINIER], "everest over etopo5": [ETOPO5, EVEREST]}

# Least share of the picture that must be measurable, so that no view passes for want of pixels.
LEAST_MEASURED = 0.15


class Figures:
    """How far what a picture shows lies from the elevation, at pixels where the elevation is beyond doubt (see
    _common.elevation: next to voids and borders of a raster there is no telling)."""

    def __init__(self, geo, camera, rasters, exaggeration):
        lat, lon, height, distance = geo
        expected = exaggeration * elevation(rasters, lat, lon)
        errors = np.abs(height - expected) / (distance * camera.pixel_angle)
        errors = errors[np.isfinite(errors)]
        self.measured = errors.size / height.size
        self.share_within_1px = np.mean(errors < 1.0) if errors.size else 0.0
        self.largest_px = errors.max(initial=0.0)
        shown = np.isfinite(height)
        to_place = EARTH.ecef(lat[shown], lon[shown], height[shown]) - camera.eye
        self.direction_px = np.max(angle_between(to_place, camera.pixel_rays()[shown]), initial=0.0) / camera.pixel_angle

    def good(self):
        return (self.measured >= LEAST_MEASURED and self.share_within_1px >= 0.999 and self.largest_px < 2.0
                and self.direction_px < 0.05)

    def __str__(self):
        return (f"{self.share_within_1px:.5%} of the pixels within 1 px (wanted: 99.9 %), largest {self.largest_px:.2f} px "
                f"(2), direction {self.direction_px:.4f} px (0.05), {self.measured:.0%} of the picture measured")


class GeometryCase(Case):
    size = (640, 360)

    def setUp(self):
        self.rasters = {path: GeographicRaster(shared(path)) for path in (ETOPO5, RAINIER, EVEREST)}

    def figures(self, world, place, above_ground, look, exaggeration):
        """Of a view from `above_ground` metres over the displayed ground at `place`, looking at (heading, pitch)."""
        rasters = [self.rasters[path] for path in WORLDS[world]]
        ground = exaggeration * float(elevation(rasters, *np.array(place, float)))
        pose = (*place, ground + above_ground, *look)
        geo = self.folder / "geo.tif"
        file = self.world("world", *(("height", path) for path in WORLDS[world]))
        # Near walls of a hundred times their height thousands of tiles are wanted, a gigabyte of them.
        room = ["--gpu-cache", 2048, "--timeout", 600] if exaggeration >= 100 else []
        self.render(file, pose, "--size", "{}x{}".format(*self.size), "--exaggeration", exaggeration, "--geo", geo, *room)
        self.geo, self.camera, self.shown = read_geo(geo), Camera(EARTH, pose, self.size), rasters
        return Figures(self.geo, self.camera, rasters, exaggeration)

    def check(self, views, exaggerations):
        for world, place, above_ground, look in views:
            for exaggeration in exaggerations:
                with self.subTest(world=world, place=place, above_ground=above_ground, look=look, exaggeration=exaggeration):
                    figures = self.figures(world, place, above_ground, look, exaggeration)
                    print(f"{world} {place} +{above_ground} m {look} x{exaggeration}: {figures}")
                    self.assertTrue(figures.good(), str(figures))


RAINIER_SOUTH, EVEREST_SOUTH = (46.70, -121.76), (27.80, 86.90)


class GeometryTrue(GeometryCase):
    def test_near_the_ground_and_from_10_km(self):
        self.check([("rainier over etopo5", RAINIER_SOUTH, 50.0, (0.0, -5.0)),
                    ("everest over etopo5", EVEREST_SOUTH, 10e3, (20.0, -20.0)),
                    ("rainier", RAINIER_SOUTH, 10e3, (0.0, -45.0))], [1])

    def test_from_space(self):
        self.check([("etopo5", (46.0, 8.0), 3e6, (0.0, -90.0))], [1, 100])

    def test_exaggerated(self):
        self.check([("rainier over etopo5", RAINIER_SOUTH, 10e3, (0.0, -30.0))], [10, 100])

    def test_the_check_itself_finds_a_ground_that_is_moved(self):
        self.assertTrue(self.figures("rainier", RAINIER_SOUTH, 10e3, (0.0, -45.0), 1).good())
        lat, lon, height, distance = self.geo
        wrong = {"a thousandth of the ground, by 1.5 px": (lat, lon, height.copy(), distance),
                 "one pixel, by 2.5 px": (lat, lon, height.copy(), distance),
                 "all of it, by half a sample to the north": (lat + 0.5 / 1200, lon, height, distance)}
        wrong["a thousandth of the ground, by 1.5 px"][2].flat[::900] += 1.5 * distance.flat[::900] * self.camera.pixel_angle
        wrong["one pixel, by 2.5 px"][2][180, 320] += 2.5 * distance[180, 320] * self.camera.pixel_angle
        for what, geo in wrong.items():
            with self.subTest(what):
                self.assertFalse(Figures(np.array(geo), self.camera, self.shown, 1).good())


if __name__ == "__main__":
    unittest.main()
