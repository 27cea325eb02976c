"""The disk cache under the worst: programs killed while they write, many at once, a disk that is full."""
# label: slow
# timeout: 900
import os
import random
import resource
import signal
import subprocess
import time
import unittest

from _common import PROGRAM, Case, camera_text
from _servers import NIGHT, TileServer

KILLS = 200
VIEW = (30, 30, 15000000, 0, -90)


class CacheSurvives(Case):
    def night(self, server):
        path = self.folder / "night.toml"
        path.write_text(f'[[layer]]\ngroup = "color"\nsource = {{ type = "xyz", url = "{server.url(NIGHT)}/{{z}}/{{x}}/{{-y}}.png", max_level = 4 }}\n')
        return path

    def start(self, world, camera, cache, out, **more):
        environment = os.environ | {"XDG_CACHE_HOME": str(self.folder / "unused")}
        return subprocess.Popen([PROGRAM, "render", world, "--out", out, "--camera", camera_text(camera), "--size", "320x240", "--disk-cache", cache],
                                stderr=subprocess.PIPE, text=True, env=environment, **more)

    def verify(self, cache):
        folder = str(cache).split(",")[0]
        self.assertIn("every file", self.tellurion("cache", "verify", "--disk-cache", folder).stdout)
        self.assertEqual([name for name in os.listdir(folder) if "damaged" in name], [])

    def test_two_hundred_kills_leave_no_wrong_byte(self):
        kept = self.folder / "killed"
        random.seed(17)
        with TileServer() as server:
            world = self.night(server)
            good = self.render(world, VIEW, "--size", "320x240", "--disk-cache", self.folder / "good", name="good")
            killed = 0
            for _ in range(KILLS):
                # A budget of 1 MB is soon full, so that there is always something to write and to drop.
                camera = (random.uniform(-80, 80), random.uniform(-180, 180), random.choice([1e6, 4e6, 15e6]), 0, -90)
                program = self.start(world, camera, f"{kept},1", self.folder / "x.png")
                time.sleep(random.uniform(0.1, 0.9))
                killed += program.poll() is None
                program.kill()
                program.communicate()
            self.assertGreater(killed, KILLS // 2, "most were killed at work")
            self.verify(kept)
            again = self.render(world, VIEW, "--size", "320x240", "--disk-cache", kept, name="again")
        self.assertEqual(good.read_bytes(), again.read_bytes())
        self.assertIn("files", self.tellurion("cache", "info", "--disk-cache", kept).stdout)

    def test_many_programs_share_a_cache(self):
        kept = self.folder / "shared"
        with TileServer() as server:
            world = self.night(server)
            good = self.render(world, VIEW, "--size", "320x240", "--disk-cache", self.folder / "alone", name="alone")
            programs = [self.start(world, VIEW, kept, self.folder / f"{i}.png") for i in range(5)]
            for i, program in enumerate(programs):
                errors = program.communicate(timeout=200)[1]
                self.assertEqual(program.returncode, 0, errors)
                self.assertEqual((self.folder / f"{i}.png").read_bytes(), good.read_bytes())
            self.verify(kept)

    def test_a_full_disk_costs_the_cache_and_nothing_else(self):
        kept = self.folder / "full"

        def no_large_files():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # writing fails, as on a full disk, and does not kill
            resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))

        with TileServer() as server:
            world = self.night(server)
            good = self.render(world, VIEW, "--size", "320x240", "--disk-cache", self.folder / "roomy", name="roomy")
            for _ in range(2):
                program = self.start(world, VIEW, kept, self.folder / "full.png", preexec_fn=no_large_files)
                errors = program.communicate(timeout=200)[1]
                self.assertEqual(program.returncode, 0, errors)
                self.assertEqual((self.folder / "full.png").read_bytes(), good.read_bytes())
                self.assertLessEqual(len(errors.splitlines()), 2, errors)
            self.assertLess(sum(file.stat().st_size for file in kept.iterdir()), 800_000)
            self.verify(kept)


if __name__ == "__main__":
    unittest.main()
