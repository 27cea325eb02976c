"""An hour of flight by the wall clock over a planet that a server paints: caches keep their bytes, the process does not grow."""
# label: long
# timeout: 5400
import math
import random
import subprocess
import sys
import time
import unittest
import urllib.request

from _common import SHARED, Case, read_trace
from _services import free_port

MB = 1 << 20
LARGEST_TILE = 4 * MB   # a 512x512 picture with its mip levels, with room to spare
LARGEST_FILE = 2 * MB   # of the server's tiles, encoded
BUDGETS_MB = {"memory": 48, "gpu": 96, "disk": 48}
SECONDS = 3600
SERVER = SHARED.parent / "tools/tileserver.py"


def hops(seconds):
    """Rows of a flight: down to a random place, half a minute along the ground at 250 m/s, up again, and on to the next place."""
    dice, rows, at = random.Random(11), [], 0.0
    while at < seconds:
        lat, lon, heading = dice.uniform(-75, 75), dice.uniform(-180, 180), dice.uniform(0, 360)
        low = 10 ** dice.uniform(3.85, 4.4)
        along = 7500 / 6.371e6
        far_lat = lat + math.degrees(along * math.cos(math.radians(heading)))
        far_lon = lon + math.degrees(along * math.sin(math.radians(heading)) / math.cos(math.radians(lat)))
        for after, where, height, pitch in ((0, (lat, lon), 3e6, -90), (20, (lat, lon), low, -25), (50, (far_lat, far_lon), low, -15),
                                            (60, (far_lat, far_lon), 2e6, -80)):
            rows.append((at + after, *where, height, heading, pitch, 0))
        at += 90
    return [row for row in rows if row[0] < seconds] + [(seconds, *rows[-1][1:])]


@unittest.skipUnless(SERVER.is_file(), f"{SERVER} is missing")
class LoadingAll(Case):
    def server(self):
        port = free_port()
        process = subprocess.Popen([sys.executable, SERVER, "--port", str(port), "--cache", self.folder / "painted", "--delay-ms", "20",
                                    "--max-seconds", str(2 * SECONDS)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        for _ in range(100):
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{port}/stats", timeout=5).close()
                return f"http://127.0.0.1:{port}"
            except OSError:
                time.sleep(0.1)
        self.fail("the tile server does not answer")

    def test_budgets_hold_for_an_hour(self):
        url = self.server()
        world = self.folder / "world.toml"
        world.write_text(f"""[[layer]]
group = "height"
source = {{ type = "xyz", url = "{url}/terrain/{{z}}/{{x}}/{{y}}.webp", encoding = "terrain-rgb", tile_size = 512, max_level = 12, vertical = "ellipsoid" }}
[[layer]]
group = "color"
source = {{ type = "xyz", url = "{url}/imagery/{{z}}/{{x}}/{{y}}.jpg", tile_size = 512, max_level = 17 }}
""")
        flight, trace = self.folder / "hour.csv", self.folder / "trace.csv"
        flight.write_text("\n".join(["time,lat,lon,height,heading,pitch,roll", *(",".join(map(str, row)) for row in hops(SECONDS))]) + "\n")
        self.tellurion("fly", world, flight, "--realtime", "--fps", 10, "--size", "640x360", "--trace", trace,
                       "--memory-cache", BUDGETS_MB["memory"], "--gpu-cache", BUDGETS_MB["gpu"],
                       "--disk-cache", f"{self.folder / 'disk'},{BUDGETS_MB['disk']}", timeout=SECONDS + 600)
        lines = read_trace(trace)
        print(f"{len(lines)} frames, {lines[-1]['requests']:.0f} requests, {lines[-1]['bytes_fetched'] / MB:.0f} MB over the network")
        self.assertGreater(lines[-1]["time"], SECONDS - 10)
        self.assertGreater(lines[-1]["bytes_fetched"], 5 * BUDGETS_MB["disk"] * MB, "enough for the caches to be full again and again")
        for name, tile in (("memory", LARGEST_TILE), ("gpu", LARGEST_TILE), ("disk", LARGEST_FILE)):
            most = max(lines, key=lambda line: line[f"{name}_cache_bytes"])
            bytes_ = most[f"{name}_cache_bytes"]
            print(f"{name} cache: at most {bytes_ / MB:.1f} of {BUDGETS_MB[name]} MB, after {most['time']:.0f} s")
            full = 0.7 if name == "memory" else 0.9  # a quarter of it waits for files that GDAL reads
            self.assertGreater(bytes_, full * BUDGETS_MB[name] * MB, f"the {name} cache was full")
            self.assertLessEqual(bytes_, BUDGETS_MB[name] * MB + tile, name)
        sixths = [max(line["resident_bytes"] for line in lines if i <= 6 * line["time"] / SECONDS < i + 1) for i in range(6)]
        print("resident, the most of every ten minutes:", ", ".join(f"{most / MB:.0f}" for most in sixths), "MB")
        self.assertLess(max(sixths[1:]), 1.05 * sixths[0], "the process does not grow")


if __name__ == "__main__":
    unittest.main()
