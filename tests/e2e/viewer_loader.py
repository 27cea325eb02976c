#!/usr/bin/env python3
# label: slow
# timeout: 600
"""What the window says of the network and of whom data are owed to (on a display in memory)."""
import os
import unittest

import numpy as np

from _common import read_picture
from _servers import NIGHT, TileServer
from viewer import SIZE, WindowTest, run_on_display_in_memory

FAR = (30, 30, 12000000, 0, -90)


def share_of(screen, colour, within=40):
    return float((np.abs(screen - np.array(colour)).max(axis=-1) < within).mean())


class Loader(WindowTest):
    def world(self, server, more=""):
        path = self.folder / "world.toml"
        path.write_text(f'[[layer]]\nname = "night"\ngroup = "color"\n{more}source = {{ type = "xyz", url = "{server.url(NIGHT)}/{{z}}/{{x}}/{{-y}}.png", max_level = 4 }}\n')
        return (path,)

    def test_the_statistics_tell_of_the_network_and_of_failures(self):
        error_red = (255, 140, 115)
        with TileServer() as server:
            viewer = self.open(FAR, world=self.world(server))
            viewer.key("F2")
            good = self.whole_screen(viewer)
            self.assertLess(share_of(good, error_red), 1e-4)
            self.assertGreater(viewer.figures()["bytes_fetched"], 0)
            viewer.close()
        # Every tile of zoom 3 is refused: the layer's line names it.
        with TileServer(lambda path, times: 403 if "/3/" in path else None) as server:
            viewer = self.open_unfinished(server)
            viewer.do("key", "F2", "sleep", "3", "mousemove", "480", "300", "click", "--repeat", "60", "--delay", "20", "5", "sleep", "1")
            viewer.screen("refused")
            self.assertGreater(share_of(self.whole_screen(viewer), error_red), 5e-4)

    def open_unfinished(self, server):
        """A view that never gets complete; the first frames are enough."""
        settle = self.viewer.__class__.settle
        self.viewer.__class__.settle = lambda viewer, timeout=120: None
        self.addCleanup(setattr, self.viewer.__class__, "settle", settle)
        return self.open(FAR, "--disk-cache", self.folder / "refused-cache", world=self.world(server))

    def test_a_line_for_whom_data_are_owed_to(self):
        def credits_width(more):
            """How far to the left the credits reach."""
            with TileServer() as server:
                viewer = self.open((30, 30, 40000000, 0, -90), "--no-atmosphere", world=self.world(server, more))
                right = self.whole_screen(viewer)[:, SIZE[0] * 3 // 5:].min(axis=-1) > 90  # letters are light
                viewer.close()
            # Above the status line where both do not fit into one; else beside it, and what it says ends to the left of this.
            above, beside = right[SIZE[1] - 66:SIZE[1] - 42], right[SIZE[1] - 36:SIZE[1] - 12]
            inside = np.argwhere((above if above.any() else beside).any(axis=0))
            return right.shape[1] - inside.min()

        short = credits_width("")
        long = credits_width('attribution = "Night lights: NASA Earth Observatory"\n')
        self.assertGreater(long, short + 150)

    def whole_screen(self, viewer):
        viewer.screen("whole")
        return read_picture(self.folder / "whole.png").astype(int)


if __name__ == "__main__":
    if "TELLURION_ON_XVFB" not in os.environ:
        run_on_display_in_memory()
    unittest.main(verbosity=2)
