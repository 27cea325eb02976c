"""A pole costs what the equator costs: 50 headings over an octave of heights."""
# label: slow
# timeout: 1800
import unittest

from poles import PoleCase


class PolesAll(PoleCase):
    size = "1280x720"
    poses = 50

    def test_the_pole_costs_what_the_equator_costs(self):
        self.check_cost()

    def test_the_pole_costs_what_the_equator_costs_from_nearer(self):
        self.octave_from = 200e3
        self.check_cost()

    def test_data_in_a_polar_projection_load_as_fast(self):
        self.check_loading_in_a_polar_projection(20)


if __name__ == "__main__":
    unittest.main()
