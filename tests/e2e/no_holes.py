"""No pixel shows the background through the surface, finished or loading: 200 views."""
# label: slow
# timeout: 1800
import random
import unittest

import numpy as np

from _common import (ARCTIC, BLUE_MARBLE, EARTH, ETOPO5, EVEREST, RAINIER, Camera, Case, Ellipsoid, GeographicRaster,
                     elevation, read_picture, shared)

SIZE = (320, 180)
DEEPEST = -10700.0  # metres, in all of the elevation data
CLEAR = (255, 0, 255)
OPTIONS = ["--size", "{}x{}".format(*SIZE), "--clear", "{:02X}{:02X}{:02X}".format(*CLEAR), "--no-atmosphere"]
LAYERS = [("height", ETOPO5), ("height", ARCTIC), ("height", EVEREST), ("height", RAINIER), ("color", BLUE_MARBLE)]
PLACES = [(46.85, -121.76), (27.99, 86.93), (90.0, 0.0), (-90.0, 0.0), (0.0, 180.0), (35.2644, 45.0), (0.0, 45.0),
          (47.0, -121.5)]


class Views:
    """Random views whose frame lies wholly inside the planet's outline, whatever the ground: all rays through the frame's
    corners meet the ellipsoid that lies as deep as the deepest sea floor, and the outline has no dents."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.rasters = [GeographicRaster(shared(path)) for path in (ETOPO5, EVEREST, RAINIER)]

    def place(self):
        if self.random.random() < 0.5:  # round places where something ends or meets
            lat, lon = self.random.choice(PLACES)
            return min(90.0, max(-90.0, lat + self.random.gauss(0.0, 0.3))), lon + self.random.gauss(0.0, 0.3)
        return float(np.degrees(np.arcsin(self.random.uniform(-1.0, 1.0)))), self.random.uniform(-180.0, 180.0)

    def next(self):
        while True:
            exaggeration = self.random.choice([1, 10, 100])
            place = self.place()
            ground = exaggeration * float(elevation(self.rasters, *np.array(place)))
            if np.isnan(ground):
                continue
            height = ground + 10.0 ** self.random.uniform(1.7, 7.3)
            look = [self.random.uniform(*limits) for limits in ((0.0, 360.0), (-90.0, 0.0), (-180.0, 180.0))]
            pose = (*place, height, *look)
            camera = Camera(EARTH, pose, SIZE)
            depth = exaggeration * DEEPEST
            inner = Ellipsoid(EARTH.a + depth, EARTH.b + depth)
            corners = camera.rays([0.0, SIZE[0], 0.0, SIZE[0]], [0.0, 0.0, SIZE[1], SIZE[1]])
            if np.all(np.isfinite(inner.hit_distance(camera.eye, corners))):
                return pose, exaggeration


class NoHoles(Case):
    def test_two_hundred_random_views(self):
        world, views = self.world("world", *LAYERS), Views(seed=2)
        for number in range(200):
            pose, exaggeration = views.next()
            after = [[], ["--after", 0], ["--after", 50], ["--after", 200]][number % 4]
            with self.subTest(number=number, pose=pose, exaggeration=exaggeration, after=after):
                picture = read_picture(self.render(world, pose, *OPTIONS, "--exaggeration", exaggeration, "--workers", 2,
                                                   *after, name=f"hole-{number}"))
                holes = np.argwhere(np.all(picture == CLEAR, axis=-1))
                self.assertEqual(len(holes), 0, f"holes at (row, column) {holes[:5].tolist()} of hole-{number}.png")


    def test_the_check_itself_sees_the_background_where_it_is(self):
        picture = read_picture(self.render(self.world("world", *LAYERS), (0.0, 0.0, 2e7), *OPTIONS, name="space"))
        share = np.mean(np.all(picture == CLEAR, axis=-1))
        camera = Camera(EARTH, (0.0, 0.0, 2e7), SIZE)
        sky = np.mean(np.isnan(EARTH.hit_distance(camera.eye, camera.pixel_rays())))
        self.assertAlmostEqual(share, sky, delta=0.01)

    def test_while_a_flight_loads(self):
        flight = self.folder / "flight.csv"
        # Never so high or so level that the limb comes into view.
        flight.write_text("time,lat,lon,height,heading,pitch,roll\n0,46.7,-121.7,900000,0,-85,0\n2,46.8,-121.76,20000,0,-75,0\n"
                          "4,40,-110,300000,0,-85,0\n6,36,-100,30000,0,-75,0\n")
        out = self.folder / "flight"
        self.tellurion("fly", self.world("world", *LAYERS), flight, "--out", out, "--realtime", "--fps", 10, *OPTIONS)
        files = sorted(out.glob("*.png"))
        self.assertGreater(len(files), 10)
        for file in files:
            with self.subTest(file=file.name):
                self.assertFalse(np.any(np.all(read_picture(file) == CLEAR, axis=-1)), "shows the background")


if __name__ == "__main__":
    unittest.main()
