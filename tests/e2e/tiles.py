"""Tiles from a server on loopback: asked for once, kept for the next time, and faults survived."""
# label: slow
# timeout: 900
import json
import random
import sqlite3
import unittest

import numpy as np
from osgeo import gdal

from _common import ETOPO5, SHARED, Case, read_geo, read_picture, shared
from _servers import NIGHT, RAINIER_TILES, TERRARIUM, TileServer


class Tiles(Case):
    def world_of_tiles(self, name, *layers):
        """A world file of (group, source as TOML) pairs."""
        path = self.folder / f"{name}.toml"
        path.write_text("".join(f'[[layer]]\ngroup = "{group}"\nsource = {{ {source} }}\n' for group, source in layers))
        return path

    def night(self, server, more="max_level = 4"):
        return self.world_of_tiles("night", ("height", f'path = "{shared(ETOPO5)}", vertical = "ellipsoid"'),
                                   ("color", f'type = "xyz", url = "{server.url(NIGHT)}/{{z}}/{{x}}/{{-y}}.png", {more}'))

    view = (30, 30, 15000000, 0, -90)

    def test_each_tile_is_fetched_once_and_the_next_run_fetches_none(self):
        with TileServer() as server:
            first = self.render(self.night(server), self.view, name="first")
            self.assertGreater(len(server.asked), 20)
            self.assertEqual(set(server.asked.values()), {1}, "no tile is asked for twice")
            asked = sum(server.asked.values())
            second = self.render(self.night(server), self.view, name="second")
            self.assertEqual(sum(server.asked.values()), asked, "a warm disk cache needs no request")
            self.assertEqual(first.read_bytes(), second.read_bytes())
            world = self.night(server)
        offline = self.render(world, self.view, "--offline", name="offline")
        self.assertEqual(first.read_bytes(), offline.read_bytes())

    def test_the_cache_tells_what_it_holds_and_is_emptied(self):
        kept = self.folder / "own"
        with TileServer() as server:
            self.render(self.night(server), self.view, "--disk-cache", kept, name="own")
            asked = len(server.asked)
        self.assertIn(f"{asked} files", self.tellurion("cache", "info", "--disk-cache", kept).stdout)
        self.assertIn("every file", self.tellurion("cache", "verify", "--disk-cache", kept).stdout)
        # A byte turns over in a tile.
        database = sqlite3.connect(kept / "files.sqlite")
        with database:
            key, body = database.execute("SELECT key, body FROM files LIMIT 1").fetchone()
            database.execute("UPDATE files SET body = ? WHERE key = ?", (body[:50] + bytes([body[50] ^ 1]) + body[51:], key))
        database.close()
        self.assertIn("1 damaged", self.tellurion("cache", "verify", "--disk-cache", kept).stdout)
        self.tellurion("cache", "clear", "--disk-cache", kept)
        self.assertIn("from servers  0 files", self.tellurion("cache", "info", "--disk-cache", kept).stdout)
        self.assertIn("from servers  0 files", self.tellurion("cache", "info", "--disk-cache", self.folder / "none").stdout)

    def test_a_url_is_a_world_over_the_default_one(self):
        with TileServer() as server:
            url = server.url(NIGHT) + "/{z}/{x}/{-y}.png?key=sesame"
            stats = self.folder / "stats.json"
            self.render(url, (89.9, 0, 3000000, 0, -90), "--stats", stats, name="pole")
        names = [source["name"] for source in json.loads(stats.read_text())["sources"]]
        self.assertTrue(any(NIGHT in name for name in names))
        self.assertNotIn("sesame", stats.read_text())
        for file in (self.folder / "cache").rglob("*"):
            if file.is_file():
                self.assertNotIn(b"sesame", file.read_bytes(), f"{file} holds the key")

    def test_the_pole_of_a_mercator_layer_shows_the_layer_below(self):
        plain = self.render("", (89.9, 0, 500000, 0, -90), "--no-atmosphere", name="plain")
        with TileServer() as server:
            over = self.render(server.url(NIGHT) + "/{z}/{x}/{-y}.png", (89.9, 0, 500000, 0, -90), "--no-atmosphere", name="over")
        # Nothing in view lies within 85 degrees of the equator. Slots may be finer than without the layer: means of 20x20 pixels.
        def means(file):
            pixels = gdal.Open(str(file)).ReadAsArray()[:3].astype(float)
            return pixels.reshape(3, 36, 20, 64, 20).mean(axis=(2, 4))
        self.assertLess(np.mean(np.abs(means(plain) - means(over))), 1)
        self.assertGreater(np.ptp(means(plain)), 40, "there is something to see")

    def test_heights_agree_with_the_numbers_in_the_tiles(self):
        with TileServer() as server:
            world = self.world_of_tiles("heights", ("height", f'type = "xyz", url = "{server.url(TERRARIUM)}/{{z}}/{{x}}/{{y}}.png", '
                                                    'encoding = "terrarium", max_level = 3, vertical = "ellipsoid"'))
            side = 256 << 3
            places, wanted = [], []
            random.seed(3)
            for _ in range(200):
                column, row = random.randrange(side), random.randrange(side)
                lon = (column + 0.5) / side * 360 - 180
                lat = np.degrees(np.arctan(np.sinh(np.pi * (1 - 2 * (row + 0.5) / side))))
                tile = gdal.Open(str(shared(f"{TERRARIUM}/3/{column // 256}/{row // 256}.png"))).ReadAsArray().astype(float)
                r, g, b = tile[:3, row % 256, column % 256]
                places.append(f"{lat:.12f} {lon:.12f}")
                wanted.append(r * 256 + g + b / 256 - 32768)
            printed = self.tellurion("height", world, text="\n".join(places) + "\n").stdout
        found = [float(line.split()[2]) for line in printed.strip().split("\n")]
        self.assertLess(np.max(np.abs(np.subtract(found, wanted))), 2e-3)

    def test_a_mountain_out_of_regional_tiles_over_global_ones(self):
        with TileServer() as server:
            world = self.world_of_tiles(
                "rainier",
                ("height", f'type = "xyz", url = "{server.url(TERRARIUM)}/{{z}}/{{x}}/{{y}}.png", encoding = "terrarium", max_level = 3, vertical = "ellipsoid"'),
                ("height", f'type = "xyz", url = "{server.url(RAINIER_TILES)}/{{z}}/{{x}}/{{y}}.webp", encoding = "terrain-rgb", '
                           'min_level = 9, max_level = 11, bounds = [-122, 46, -121, 47], vertical = "ellipsoid"'))
            geo = self.folder / "where.tif"
            self.render(world, (46.85, -121.76, 9000, 0, -90), "--size", "320x180", "--geo", geo, name="rainier")
            missing = [path for path in server.asked if RAINIER_TILES in path and not (SHARED / path.lstrip("/")).exists()]
            printed = self.tellurion("height", world, text="46.8529 -121.7604\n").stdout
        self.assertLess(len(missing), 60, "nothing is asked for beyond the bounds")
        self.assertGreater(np.nanmax(read_geo(geo)[2]), 4300, "the summit")
        self.assertAlmostEqual(float(printed.split()[2]), 4370, delta=15)

    def test_faults_are_survived_and_nothing_wrong_is_kept(self):
        kinds = ["reset", 500, 429, "truncated", "page", "corrupt", "large", "stall"]

        def fault(path, times):
            chosen = random.Random(path).random()
            return kinds[int(chosen * 20 * len(kinds)) % len(kinds)] if chosen < 0.4 and times == 1 else None

        with TileServer() as server:
            good = self.render(self.night(server), self.view, "--disk-cache", self.folder / "good", name="good")
        with TileServer(fault) as server:
            world = self.night(server)
            done = self.tellurion("render", world, "--out", self.folder / "faulty.png", "--camera", ",".join(map(str, self.view)),
                                  "--disk-cache", self.folder / "faulty", "--timeout", 120, timeout=200)
            self.assertGreater(sum(1 for count in server.asked.values() if count > 1), 5, "there were faults")
        self.assertEqual(good.read_bytes(), (self.folder / "faulty.png").read_bytes())
        self.assertLessEqual(len(done.stderr.splitlines()), 8, done.stderr)
        kept = self.render(world, self.view, "--disk-cache", self.folder / "faulty", "--offline", name="kept")
        self.assertEqual(good.read_bytes(), kept.read_bytes())

    def test_what_is_wrong_is_said(self):
        with TileServer(lambda path, times: 403) as server:
            done = self.tellurion("render", self.night(server), "--out", self.folder / "x.png", "--timeout", 20, status=3)
            self.assertIn("check the key", done.stderr)
        done = self.tellurion("render", "http://127.0.0.1:9/{z}/{x}.png", "--out", self.folder / "x.png", status=1)
        self.assertIn("{y}", done.stderr)
        done = self.tellurion("render", "http://127.0.0.1:9/{z}/{x}/{y}.png", "--out", self.folder / "x.png", "--timeout", 8, status=3)
        self.assertIn("is the server there", done.stderr)
        with TileServer() as server:
            done = self.tellurion("render", self.night(server, "max_level = 4, tile_size = 512"), "--out", self.folder / "x.png",
                                  "--timeout", 8, status=3)
            self.assertIn("tile_size", done.stderr)

    def test_a_server_that_is_not_there_leaves_the_rest_of_the_world(self):
        view = ("--camera", "20,30,12000000,0,-90", "--no-atmosphere", "--size", "640x360")
        plain, over = self.folder / "plain.png", self.folder / "over.png"
        self.tellurion("render", "--out", plain, *view)
        # It gives up by itself, long before the time-out.
        done = self.tellurion("render", "http://127.0.0.1:9/{z}/{x}/{y}.png", "--out", over, *view, status=3, timeout=60)
        self.assertIn("some data could not be read", done.stderr)
        self.assertGreater(np.std(read_picture(plain)), 30)
        self.assertLess(np.mean(np.abs(read_picture(plain).astype(float) - read_picture(over))), 1)


if __name__ == "__main__":
    unittest.main()
