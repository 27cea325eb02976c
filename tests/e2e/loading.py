"""Loading from a slow server: no hole meanwhile, nothing asked for in vain, budgets kept."""
# label: slow
# timeout: 1200
import json
import random
import time
import unittest

import numpy as np

from _common import SHARED, Case, read_picture, read_trace
from _servers import NIGHT, RAINIER_TILES, TERRARIUM, TileServer

MB = 1 << 20
RAINIER = (46.85, -121.95, 7000, 90, -20)
CLEAR = "ff00ff"


class Loading(Case):
    def world(self, server, name):
        layers = [("height", f'type = "xyz", url = "{server.url(TERRARIUM)}/{{z}}/{{x}}/{{y}}.png", encoding = "terrarium", max_level = 3, vertical = "ellipsoid"'),
                  ("height", f'type = "xyz", url = "{server.url(RAINIER_TILES)}/{{z}}/{{x}}/{{y}}.webp", encoding = "terrain-rgb", min_level = 9, '
                             'max_level = 11, bounds = [-122, 46, -121, 47], vertical = "ellipsoid"'),
                  ("color", f'type = "xyz", url = "{server.url(NIGHT)}/{{z}}/{{x}}/{{-y}}.png", max_level = 4')]
        path = self.folder / f"{name}.toml"
        path.write_text("".join(f'[[layer]]\ngroup = "{group}"\nsource = {{ {source} }}\n' for group, source in layers))
        return path

    def slow_server(self, latency_s, bytes_per_second=None):
        def wait(path, _):
            file = SHARED / path.lstrip("/")
            size = file.stat().st_size if file.is_file() else 0
            time.sleep(latency_s + (size / bytes_per_second if bytes_per_second else 0))
        return TileServer(wait)

    def test_there_is_ground_from_the_first_picture_on(self):
        # Straight down and along the ground: where the finished picture shows ground, away from its outline, there is some all the time.
        for number, (latency_s, speed) in enumerate([(0, None), (0.02, None), (0.2, None), (0.05, 60_000)]):
            for camera in ((46.85, -121.76, 12000, 0, -90), RAINIER):
                for after_ms in (0, 150, 600, 1500, 4000):
                    with self.subTest(latency=latency_s, camera=camera, after=after_ms), self.slow_server(latency_s, speed) as server:
                        cache = self.folder / f"cache_{number}_{after_ms}_{camera[4]}"
                        picture = read_picture(self.render(
                            self.world(server, "slow"), camera, "--after", after_ms, "--clear", CLEAR, "--no-atmosphere", "--no-lighting",
                            "--size", "320x180", "--disk-cache", cache, name="early")).astype(int)
                        sky = (picture == [255, 0, 255]).all(axis=2)
                        if camera[4] == -90:
                            self.assertEqual(sky.sum(), 0, "a hole")
                        else:
                            # Ground has one upper edge: below the first ground of a column there is no sky.
                            self.assertFalse((np.diff(sky.astype(int), axis=0) > 0).any(), "sky below ground")
                            self.assertGreater((~sky).mean(), 0.3)

    def test_a_teleport_asks_for_little_more_than_the_picture_needs(self):
        with self.slow_server(0.02) as server:
            world = self.world(server, "cold")
            first = self.render(world, RAINIER, "--disk-cache", self.folder / "kept", name="cold")
            asked = {path: count for path, count in server.asked.items()}
            self.assertEqual(set(asked.values()), {1}, "nothing is asked for twice")
            again = self.render(world, RAINIER, "--disk-cache", self.folder / "kept", name="warm")
            self.assertEqual(dict(server.asked), asked, "a warm cache needs no request")
            self.assertEqual(first.read_bytes(), again.read_bytes())
        # The same with a server that answers at once: what is asked for follows from the picture, not from the latency.
        with TileServer() as server:
            self.render(self.world(server, "fast"), RAINIER, "--disk-cache", self.folder / "fast", name="fast")
            self.assertLessEqual(len(asked), 1.25 * len(server.asked))
            self.assertLessEqual(len(server.asked), 1.25 * len(asked))

    def test_budgets_hold_over_a_random_flight(self):
        random.seed(5)
        flight, trace = self.folder / "random.csv", self.folder / "trace.csv"
        rows, lon = [], 0
        for i in range(120):
            lon = (lon + random.uniform(-100, 100) + 180) % 360 - 180
            rows.append(f"{i},{random.uniform(-60, 60)},{lon},{10 ** random.uniform(3.5, 7)},{random.uniform(0, 360)},{random.uniform(-90, -10)},0")
        flight.write_text("\n".join(["time,lat,lon,height,heading,pitch,roll", *rows]) + "\n")
        with TileServer() as server:
            self.tellurion("fly", self.world(server, "flight"), flight, "--out", self.folder / "frames", "--fps", 2, "--size", "480x270",
                           "--memory-cache", 32, "--gpu-cache", 64, "--disk-cache", f"{self.folder / 'small'},2", "--trace", trace, timeout=900)
        lines = read_trace(trace)
        self.assertEqual(len(lines), 239)
        self.assertTrue(all(line["complete"] == 1 for line in lines))
        for name, budget, tile in (("memory_cache_bytes", 32 * MB, 4 * MB), ("gpu_cache_bytes", 64 * MB, 4 * MB), ("disk_cache_bytes", 2 * MB, 200_000)):
            most = max(line[name] for line in lines)
            print(f"{name}: at most {most / MB:.2f} MB")
            self.assertLessEqual(most, budget + tile, name)
        resident = [line["resident_bytes"] for line in lines]
        print(f"resident_bytes: {max(resident[:120]) / MB:.0f} MB in the first half, {max(resident[120:]) / MB:.0f} MB in the second")
        self.assertLess(max(resident[120:]), 1.1 * max(resident[:120]), "the process does not grow")

    def test_stats_count_what_was_fetched(self):
        stats = self.folder / "stats.json"
        with TileServer() as server:
            self.render(self.world(server, "counted"), RAINIER, "--disk-cache", self.folder / "counted", "--stats", stats, name="counted")
            sizes = [(SHARED / path.lstrip("/")).stat().st_size for path in server.asked if (SHARED / path.lstrip("/")).is_file()]
        self.assertEqual(json.loads(stats.read_text())["bytes_fetched"], sum(sizes))


if __name__ == "__main__":
    unittest.main()
