"""The same picture, byte for byte, over 20 runs of each view, whatever the workers, the caches and the day."""
# label: slow
# timeout: 1800
import itertools
import unittest

from _common import BLUE_MARBLE, ETOPO5, EVEREST, RAINIER, Case

VIEWS = {"rainier": (46.70, -121.76, 6500.0, 0.0, -10.0), "pole": (89.95, 0.0, 300e3, 40.0, -40.0),
         "space": (28.0, 86.0, 8e6, 0.0, -90.0)}


class Determinism(Case):
    size = "640x360"

    def check(self, view, runs=20):
        """With 1, 2 and 8 workers in turn; a fourth of the runs makes its tables, the others have those of an earlier one."""
        world = self.world("world", *(("height", path) for path in (ETOPO5, EVEREST, RAINIER)), ("color", BLUE_MARBLE))
        kept = self.folder / f"kept-{view}"
        pictures = {}
        for run, workers in zip(range(runs), itertools.cycle([1, 2, 8])):
            folder = kept if run % 4 else self.folder / f"new-{view}-{run}"
            file = self.render(world, VIEWS[view], "--size", self.size, "--workers", workers, "--disk-cache", folder,
                               name=f"{view}-{run}")
            pictures.setdefault(file.read_bytes(), []).append(f"{file.name} ({workers} workers, {folder.name})")
        self.assertEqual(len(pictures), 1, f"different pictures: {list(pictures.values())}")

    def test_rainier(self):
        self.check("rainier")

    def test_pole(self):
        self.check("pole")

    def test_space(self):
        self.check("space")

    def test_without_threads_and_with_small_caches(self):
        world = self.world("world", ("height", ETOPO5), ("height", RAINIER), ("color", BLUE_MARBLE))
        usual = self.render(world, VIEWS["rainier"], "--size", self.size, name="usual").read_bytes()
        for options in (["--workers", 0], ["--memory-cache", 64]):
            with self.subTest(options):
                other = self.render(world, VIEWS["rainier"], "--size", self.size, *options, name="other").read_bytes()
                self.assertTrue(other == usual, "the picture differs")


if __name__ == "__main__":
    unittest.main()
