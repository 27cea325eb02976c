"""A five-minute flight round the world within small caches: what the process takes, frame by frame; what a frame at rest takes."""
# label: slow
# timeout: 2400
import json
import unittest

from _common import BLUE_MARBLE, ETOPO5, EVEREST, RAINIER, SHARED, Case, read_trace

MB = 1 << 20
LARGEST_TILE = 4 * MB  # a 512x512 picture with its mip levels, with room to spare

# time, lat, lon, height, heading, pitch: low over the two mountains, far over the oceans and both poles
FLIGHT = [(0, 46.60, -121.76, 8000, 0, -15), (30, 47.50, -121.70, 30000, 10, -30), (60, 89.90, -60.0, 900000, 90, -60),
          (100, 50.0, 10.0, 3000000, 120, -70), (130, 28.5, 84.0, 100000, 110, -25), (150, 27.7, 86.9, 12000, 20, -15),
          (170, 27.9, 87.5, 15000, 80, -20), (200, -30.0, 140.0, 2000000, 150, -60), (230, -89.9, 170.0, 600000, 90, -50),
          (260, -20.0, -120.0, 6000000, 300, -80), (300, 46.70, -121.76, 6500, 360, -10)]


class Memory(Case):
    def test_a_flight_round_the_world(self):
        flight, trace = self.folder / "flight.csv", self.folder / "trace.csv"
        rows = [",".join(map(str, (*row, 0))) for row in FLIGHT]
        flight.write_text("\n".join(["time,lat,lon,height,heading,pitch,roll", *rows]) + "\n")
        world = self.world("world", *(("height", path) for path in (ETOPO5, EVEREST, RAINIER)), ("color", BLUE_MARBLE),
                           ("color", "earth/imagery/bluemarble_bathy_8192x4096.jpg"),
                           ("night", "earth/imagery/night_lights_4096.jpg"),
                           ("water", "earth/imagery/water_mask_1600.png"))
        self.tellurion("fly", world, flight, "--out", self.folder / "frames", "--fps", 2, "--memory-cache", 128,
                       "--gpu-cache", 128, "--trace", trace, timeout=2300)
        lines = read_trace(trace)
        self.assertEqual(len(lines), 601)
        for name, budget in (("resident_bytes", 450 * MB), ("memory_cache_bytes", 128 * MB + LARGEST_TILE),
                             ("gpu_cache_bytes", 128 * MB + LARGEST_TILE)):
            most = max(lines, key=lambda line: line[name])
            print(f"{name}: at most {most[name] / MB:.1f} MB, in frame {most['frame']:.0f}")
            with self.subTest(name):
                self.assertGreater(min(line[name] for line in lines), 0)
                self.assertLessEqual(most[name], budget, f"in frame {most['frame']:.0f}")
        self.assertTrue(all(line["complete"] == 1 for line in lines), "every frame is finished")

    def test_a_frame_of_a_finished_view_allocates_nothing(self):
        file = self.folder / "bench.json"
        self.tellurion("bench", "frame.rainier.allocations", "--quick", "--data", SHARED, "--json", file)
        (figure,) = json.loads(file.read_text())
        self.assertEqual(figure["value"], 0, figure["note"])


if __name__ == "__main__":
    unittest.main()
