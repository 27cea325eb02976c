"""The bare ellipsoid in --geo against the intersection of rays with it; and a camera that creeps a millimetre a frame."""
# label: slow
# timeout: 600
import unittest

import numpy as np
from osgeo import gdal, osr

from _common import BLUE_MARBLE, EARTH, Camera, Case, Ellipsoid, angle_between, grown, read_geo, read_picture, shared

SIZE = (640, 360)
MOON = Ellipsoid(1737400.0, 1737400.0)
MARS = Ellipsoid(3396190.0, 3376200.0)

POSES = [(0.0, 0.0, 2.0, 0.0, -10.0), (47.3, 179.999, 2.0, 90.0, -90.0), (90.0, 0.0, 2.0, 45.0, -5.0),
         (-33.0, 18.0, 40.0, 200.0, 0.0), (35.2643897, 45.0, 500.0, 30.0, -20.0, 30.0), (89.9, -120.0, 10e3, 270.0, -2.0),
         (0.0, -45.0, 100e3, 10.0, -15.0), (-60.0, 100.0, 1e6, 120.0, -60.0, -45.0), (10.0, -170.0, 1e7, 0.0, -90.0),
         (70.0, 20.0, 1e7, 77.0, -75.0)]


class BareEllipsoid(Case):
    def check(self, planet, ellipsoid, pose):
        geo = self.folder / "geo.tif"
        self.render(self.world(planet, planet=planet), pose, "--size", "{}x{}".format(*SIZE), "--geo", geo)
        camera = Camera(ellipsoid, pose, SIZE)
        lat, lon, height, distance = read_geo(geo)
        rays = camera.pixel_rays()
        hit = ellipsoid.hit_distance(camera.eye, rays)
        shown, expected = np.isfinite(height), np.isfinite(hit)
        limb = grown(expected, 2) & grown(~expected, 2)
        self.assertFalse(np.any((shown != expected) & ~limb), "sky and ground where they should be")
        inside = shown & ~limb
        self.assertGreater(np.mean(inside), 0.1)
        allowed = distance[inside] * camera.pixel_angle + 1e-3
        self.assertLess(np.max(np.abs(height[inside]) / allowed), 1.0, "height, of the allowed error")
        direction = angle_between(ellipsoid.ecef(lat, lon, height)[inside] - camera.eye, rays[inside]) / camera.pixel_angle
        self.assertLess(direction.max(), 0.05, "direction in pixels")
        # The height's error moves the point along its ray by height / sin(grazing angle); leave the flattest rays out.
        up = ellipsoid.ecef(lat, lon, height + 1.0)[inside] - ellipsoid.ecef(lat, lon, height)[inside]
        sine = -np.sum(up * rays[inside], axis=-1)
        steep = sine > 0.05
        off = np.abs(distance[inside] - hit[inside])[steep] / (allowed / sine)[steep]
        self.assertLess(off.max(initial=0.0), 1.0, "distance, of the allowed error")

    def test_from_2_metres_to_10000_km(self):
        for pose in POSES:
            with self.subTest(pose=pose):
                self.check("Earth", EARTH, pose)

    def test_on_the_moon_and_mars(self):
        self.check("Moon", MOON, (20.0, 30.0, 5e3, 60.0, -15.0))
        self.check("Mars", MARS, (-60.0, -120.0, 2e6, 0.0, -70.0))


class NoJitter(Case):
    """A flight of a millimetre a frame, 2 m over the ground: the picture changes smoothly."""

    frames = 60

    def creep(self, world, pitch):
        metre = 1.0 / (np.pi / 180.0 * EARTH.a)  # in degrees
        lat, lon = 47.3, 8.5
        rows = [f"{i / 30.0!r},{lat + i * 1e-3 * metre!r},{lon + i * 0.5e-3 * metre!r},2.0,20,{pitch},0"
                for i in range(0, self.frames + 1, 5)]
        flight = self.folder / "flight.csv"
        flight.write_text("\n".join(["time,lat,lon,height,heading,pitch,roll", *rows]) + "\n")
        out = self.folder / f"frames-{world.stem}{pitch}"
        self.tellurion("fly", world, flight, "--out", out, "--size", "320x180", "--no-atmosphere")
        pictures = np.array([read_picture(file) for file in sorted(out.glob("*.png"))], float)
        self.assertGreaterEqual(len(pictures), self.frames)
        return pictures, self.edges(pitch)

    @staticmethod
    def edges(pitch):
        """Pixels within 1 px of the horizon; the ground is the bare ellipsoid."""
        camera = Camera(EARTH, (47.3, 8.5, 2.0, 20.0, pitch), (320, 180))
        ground = np.isfinite(EARTH.hit_distance(camera.eye, camera.pixel_rays()))
        return grown(ground, 1) & grown(~ground, 1)

    def check_smooth(self, pictures, edges):
        jumps = np.abs(pictures[1:-1] - 0.5 * (pictures[:-2] + pictures[2:]))
        jumps[:, edges] = 0.0
        frame = int(np.argmax(jumps.max(axis=(1, 2, 3))))
        self.assertLessEqual(jumps.max(), 3.0, f"frame {frame + 1} jumps at {np.argwhere(jumps[frame] > 3.0)[:5].tolist()}")

    def test_over_blue_marble(self):
        self.check_smooth(*self.creep(self.world("marble", ("color", BLUE_MARBLE)), -10))

    def waves(self):
        """A picture of waves half a metre long, 20 m across, 2.5 cm a pixel: a millimetre changes it by up to 1.5/255."""
        side, metres = 800, 0.025
        dlat = metres / (np.pi / 180.0 * EARTH.a)
        x, y = np.meshgrid(np.arange(side), np.arange(side))
        values = np.stack([127.5 + 120.0 * np.sin(2 * np.pi * metres * a / 0.5) for a in (x, y, x + y)]).round()
        file = self.folder / "waves.tif"
        raster = gdal.GetDriverByName("GTiff").Create(str(file), side, side, 3, gdal.GDT_Byte)
        raster.SetGeoTransform([8.5 - side / 2 * dlat, dlat, 0, 47.3 + side / 2 * dlat, 0, -dlat])
        wgs84 = osr.SpatialReference()
        wgs84.ImportFromEPSG(4326)
        raster.SetProjection(wgs84.ExportToWkt())
        raster.WriteArray(values)
        return file

    def test_over_waves_of_half_a_metre(self):
        world = self.world("waves", ("color", self.waves()))
        pictures, edges = self.creep(world, -60)
        self.assertGreater(pictures[0].std(), 40.0, "the waves are to be seen")
        self.assertGreater(np.abs(pictures[-1] - pictures[0]).max(), 30.0, "and they move")
        self.check_smooth(pictures, edges)

    def test_the_check_itself_finds_a_frame_out_of_place(self):
        x = np.linspace(0.0, 6.28, 320)
        pictures = np.array([np.tile(127 + 100 * np.sin(10 * x + 0.01 * i)[None, :, None], (180, 1, 3)) for i in range(9)])
        self.check_smooth(pictures, self.edges(-60))
        pictures[4] = np.roll(pictures[4], 1, axis=1)
        with self.assertRaises(AssertionError):
            self.check_smooth(pictures, self.edges(-60))


if __name__ == "__main__":
    unittest.main()
