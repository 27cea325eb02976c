"""No pixel shows the background through the surface, finished or loading: 200 views."""
# label: slow
# timeout: 3600
import unittest

from no_holes import HolesCase


class NoHolesAll(HolesCase):
    def test_two_hundred_random_views(self):
        self.check(200, seed=2)


if __name__ == "__main__":
    unittest.main()
