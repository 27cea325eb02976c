"""The same picture, byte for byte, over 20 runs of each view."""
# label: slow
# timeout: 1800
import unittest

from determinism import VIEWS, SamePictureCase


class DeterminismAll(SamePictureCase):
    size = "1280x720"

    def test_twenty_runs(self):
        for view in VIEWS:
            with self.subTest(view):
                self.check(view, 20)


if __name__ == "__main__":
    unittest.main()
