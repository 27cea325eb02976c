"""A pole costs what the equator costs, for 50 headings over an octave of heights; poles_all.py has more."""
# label: slow
# timeout: 1800
import json
import statistics
import unittest

from _common import ARCTIC, BLUE_MARBLE, ETOPO5, Case

POLE, EQUATOR = (89.95, 20.0), (0.05, -150.0)


class PoleCase(Case):
    size = "640x360"
    poses = 50
    octave_from = 1e6  # metres

    def stats(self, world, place, height, heading, pitch):
        file = self.folder / "stats.json"
        self.render(world, (*place, height, heading, pitch), "--size", self.size, "--stats", file)
        return json.loads(file.read_text())

    def pairs(self, world, count):
        """Figures at pole and equator, in turns, for headings all round and heights over an octave."""
        for i in range(count):
            heading, height = 360.0 * i / count, self.octave_from * 2.0 ** ((i * 7 % count) / count)
            yield [self.stats(world, place, height, heading, -35.0 - 5.0 * (i % 5)) for place in (POLE, EQUATOR)]

    def ratio_of_medians(self, pairs, name):
        pole, equator = (statistics.median(pair[side][name] for pair in pairs) for side in (0, 1))
        print(f"{name}: median {pole:g} at the pole, {equator:g} at the equator, ratio {pole / equator:.3f}")
        return pole / equator

    def check_cost(self):
        world = self.world("even", ("height", ETOPO5), ("color", BLUE_MARBLE))
        pairs = list(self.pairs(world, self.poses))
        worst = max(pole["tiles_selected"] / equator["tiles_selected"] for pole, equator in pairs)
        print(f"tiles_selected: {worst:.2f} times as many at worst")
        self.assertLessEqual(self.ratio_of_medians(pairs, "tiles_selected"), 1.1)
        self.assertLessEqual(worst, 1.5)
        self.assertLessEqual(self.ratio_of_medians(pairs, "triangles"), 1.25)
        self.assertLessEqual(self.ratio_of_medians(pairs, "frame_ms_median"), 1.25)

    def check_loading_in_a_polar_projection(self, count):
        world = self.world("polar", ("height", ETOPO5), ("height", ARCTIC), ("color", BLUE_MARBLE))
        pairs = list(self.pairs(world, count))[1:]  # the first makes the error tables
        self.assertLessEqual(self.ratio_of_medians(pairs, "load_ms"), 1.25)


class Poles(PoleCase):
    def test_the_pole_costs_what_the_equator_costs(self):
        self.check_cost()

    def test_data_in_a_polar_projection_load_as_fast(self):
        self.check_loading_in_a_polar_projection(20)


if __name__ == "__main__":
    unittest.main()
