"""Every pixel of --geo lies on the elevation: all worlds, near the ground, at 10 km and from space, exaggerated or not."""
# label: long
# timeout: 36000
import unittest

from geometry_true import EVEREST_SOUTH, RAINIER_SOUTH, GeometryCase

SPOTS = [("rainier over etopo5", RAINIER_SOUTH), ("rainier", (46.95, -121.80)), ("everest over etopo5", EVEREST_SOUTH),
         ("everest", (27.60, 86.40)), ("etopo5", (46.0, 8.0)), ("etopo5", (-17.0, 179.99)), ("etopo5", (89.99, 30.0)),
         ("etopo5", (-78.5, -85.0)), ("etopo5", (-20.0, -68.0))]


class GeometryTrueAll(GeometryCase):
    size = (1280, 720)
    exaggerations = [1, 10, 100]

    def test_near_the_ground(self):
        self.check([(*spot, 50.0, look) for spot in SPOTS for look in ((0.0, -5.0), (135.0, -30.0))], self.exaggerations)

    def test_from_10_km(self):
        self.check([(*spot, 10e3, look) for spot in SPOTS for look in ((300.0, -10.0), (90.0, -50.0))], self.exaggerations)

    def test_from_space(self):
        self.check([(*spot, 2e6, look) for spot in SPOTS if "etopo5" in spot[0] for look in ((0.0, -90.0), (60.0, -50.0))],
                   self.exaggerations)
        self.check([(*spot, 150e3, (0.0, -90.0)) for spot in SPOTS if "etopo5" not in spot[0]], self.exaggerations)


if __name__ == "__main__":
    unittest.main()
