"""A pole costs what the equator costs: in large pictures, and from nearer, too."""
# label: long
# timeout: 1800
import unittest

from poles import PoleCase


class PolesAll(PoleCase):
    size = "1280x720"

    def test_the_pole_costs_what_the_equator_costs(self):
        self.check_cost()

    def test_the_pole_costs_what_the_equator_costs_from_nearer(self):
        self.octave_from = 200e3
        self.check_cost()


if __name__ == "__main__":
    unittest.main()
