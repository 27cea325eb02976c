"""Terrain tiles in every encoding, of heights by a formula: what the program answers is the formula's."""
# label: slow
# timeout: 900
import collections
import gzip
import json
import struct
import unittest
import zlib

import numpy as np
from osgeo import gdal

from _common import Case, read_geo
from _servers import NOT_FOUND, Reply, Server, picture_bytes

LEVELS = 6  # 0 to 5


def formula(lon, lat):
    """Metres; its bend is at most 8 m in a square degree."""
    lon, lat = np.radians(lon), np.radians(lat)
    return 2500.0 + 1500.0 * np.sin(3 * lon) * np.cos(lat) ** 2 + 800.0 * np.sin(2 * lat)


class Terrain(Server):
    """Answers paths by a function; what it gives None for is not there. Every other tile is packed; of those every other says so."""

    def __init__(self, body_of):
        self.asked, self.body_of = collections.Counter(), body_of
        super().__init__()

    def answer(self, path, headers):
        path = path.split("?")[0]
        with self.lock:
            self.asked[path] += 1
        body = self.body_of(path)
        if body is None:
            return NOT_FOUND
        sum_of_path = zlib.crc32(path.encode())
        if not path.endswith(".terrain") or sum_of_path % 2:
            return Reply(200, body)
        return Reply(200, gzip.compress(body, 1), {} if sum_of_path % 4 else {"Content-Encoding": "gzip"})


# --- Encoders --------------------------------------------------------------------------------------------------------


def heightmap(lon, lat):
    """heightmap-1.0 of 65 x 65 samples; axes from west and from north."""
    heights = formula(*np.meshgrid(lon, lat))
    return np.rint((heights + 1000) * 5).astype("<u2").tobytes() + bytes([15, 0])


def zigzag(values):
    steps = np.diff(values, prepend=0)
    return np.where(steps >= 0, 2 * steps, -2 * steps - 1).astype("<u2").tobytes()


def quantized_mesh(west, south, east, north, cells=32):
    """A grid of triangles, evenly in longitude and latitude, with oct normals behind it."""
    u, v = np.meshgrid(np.rint(np.linspace(0, 32767, cells + 1)), np.rint(np.linspace(0, 32767, cells + 1)))
    u, v = u.ravel().astype(int), v.ravel().astype(int)
    heights = formula(west + u / 32767 * (east - west), south + v / 32767 * (north - south))
    low, high = np.float32(np.floor(heights.min())), np.float32(np.ceil(heights.max()))
    quantized = np.rint((heights - low) / (high - low) * 32767).astype(int)
    triangles = []
    for j in range(cells):
        for i in range(cells):
            a = j * (cells + 1) + i
            b, c, d = a + 1, a + cells + 1, a + cells + 2
            triangles += [(a, b, c), (c, b, d)]
    # Vertices are numbered as the triangles first name them.
    order, renamed = [], {}
    for triangle in triangles:
        for vertex in triangle:
            if vertex not in renamed:
                renamed[vertex] = len(order)
                order.append(vertex)
    u, v, quantized = u[order], v[order], quantized[order]
    codes, mark = [], 0
    for triangle in triangles:
        for vertex in triangle:
            index = renamed[vertex]
            codes.append(mark - index)
            mark += index == mark
    edges = [np.flatnonzero(values == edge) for values, edge in ((u, 0), (v, 0), (u, 32767), (v, 32767))]
    bytes_ = struct.pack("<3d2f7d", 6378137, 0, 0, low, high, *[1.0] * 7) + struct.pack("<I", len(u))
    bytes_ += zigzag(u) + zigzag(v) + zigzag(quantized)
    bytes_ += struct.pack("<I", len(triangles)) + np.array(codes, "<u2").tobytes()
    for edge in edges:
        bytes_ += struct.pack("<I", len(edge)) + edge.astype("<u2").tobytes()
    return bytes_ + struct.pack("<BI", 1, 2 * len(u)) + bytes(2 * len(u))


def mercator_latitude(y):
    """Of a share of the map from the north."""
    return np.degrees(np.arctan(np.sinh(np.pi * (1 - 2 * y))))


def coded_picture(z, x, y, code, driver="PNG", size=256):
    """A tile in Web Mercator whose 24 bits are code(heights)."""
    at = (np.arange(size) + 0.5) / size
    lon, lat = (x + at) / 2 ** z * 360 - 180, mercator_latitude((y + at) / 2 ** z)
    numbers = code(formula(*np.meshgrid(lon, lat))).astype(int)
    return picture_bytes([numbers >> shift & 255 for shift in (16, 8, 0)], driver)


def address(path):
    """Level, column and row of a path that ends with them."""
    try:
        z, x, y = (int(part) for part in path.split(".")[0].split("/")[-3:])
    except ValueError:
        return None
    return (z, x, y) if 0 <= z < LEVELS else None


def layer_json(tile_format, **more):
    available = [[{"startX": 0, "startY": 0, "endX": 2 ** (z + 1) - 1, "endY": 2 ** z - 1}] for z in range(LEVELS)]
    return json.dumps({"tilejson": "2.1.0", "format": tile_format, "version": "1.0.0", "scheme": "tms", "projection": "EPSG:4326",
                       "tiles": ["{z}/{x}/{y}.terrain?v={version}"], "available": available, "bounds": [-180, -90, 180, 90]} | more).encode()


# --- Tests -----------------------------------------------------------------------------------------------------------


class TerrainTiles(Case):
    # Near tiles' edges and corners of level 5 (5.625 degrees), too, and near a pole.
    places = [(46.85, -121.76), (27.99, 86.93), (0.01, 0.01), (-0.02, 179.98), (16.875, 22.5001), (-33.2, 151.3), (80.3, -44.4), (-78.9, 10.2)]

    def world_of(self, source):
        path = self.folder / "terrain.toml"
        path.write_text(f'[[layer]]\ngroup = "height"\nsource = {{ {source} }}\n')
        return path

    def check_heights(self, source, places, tolerance):
        """Answers differ from the formula by at most `tolerance`, and come from the finest tiles."""
        text = "".join(f"{lat} {lon}\n" for lat, lon in places)
        printed = self.tellurion("height", self.world_of(source), text=text).stdout
        answers = [line.split() for line in printed.splitlines() if line and not line.startswith("#")]
        self.assertEqual(len(answers), len(places), printed)
        for (lat, lon), answer in zip(places, answers):
            self.assertAlmostEqual(float(answer[2]), formula(lon, lat), delta=tolerance, msg=f"at {lat} {lon}")

    def test_heightmaps_of_a_layer(self):
        def tile(path):
            if path.endswith("layer.json"):
                return layer_json("heightmap-1.0")
            if not (at := address(path)):
                return None
            z, x, y = at
            step, grid = 180 / 2 ** z, np.arange(65) / 64
            return heightmap(-180 + (x + grid) * step, -90 + (y + 1 - grid) * step)

        with Terrain(tile) as server:
            # Half a step of 0.2 m; lines between samples 0.09 degrees apart add 0.01 m, twice.
            self.check_heights(f'type = "cesium-terrain", url = "{server.url("layer.json")}"', self.places, 0.13)
            self.assertEqual(set(server.asked.values()), {1}, "nothing is asked for twice")

    def test_meshes_of_a_layer_and_a_picture(self):
        def tile(path):
            if path.endswith("layer.json"):
                return layer_json("quantized-mesh-1.0", attribution="The makers of formulas")
            if not (at := address(path)):
                return None
            z, x, y = at
            step = 180 / 2 ** z
            return quantized_mesh(-180 + x * step, -90 + y * step, -180 + (x + 1) * step, -90 + (y + 1) * step)

        with Terrain(tile) as server:
            source = f'type = "cesium-terrain", url = "{server.url("layer.json")}"'
            # Triangles 0.18 degrees wide lie up to 0.03 m beside the formula; quantization adds 0.02 m.
            self.check_heights(source, self.places, 0.08)
            geo = self.folder / "where.tif"
            self.render(self.world_of(source), (40, 30, 60000, 20, -40), "--size", "320x180", "--geo", geo, name="meshes")
        lat, lon, height, distance = read_geo(geo)
        seen = np.isfinite(height)
        self.assertGreater(seen.mean(), 0.9)
        # Drawn within a pixel of the view, mostly within a quarter.
        error = np.abs(height - formula(lon, lat))[seen] / (distance[seen] * np.radians(45 / 180))
        self.assertLess(np.max(error), 1)
        self.assertLess(np.median(error), 0.25)

    def test_only_what_is_listed_is_asked_for(self):
        listed = [[{"startX": 0, "startY": 0, "endX": 1, "endY": 0}], [{"startX": 2, "startY": 1, "endX": 3, "endY": 1}]]

        def tile(path):
            if path.endswith("layer.json"):
                return layer_json("quantized-mesh-1.0", available=listed)
            z, x, y = address(path)
            step = 180 / 2 ** z
            return quantized_mesh(-180 + x * step, -90 + y * step, -180 + (x + 1) * step, -90 + (y + 1) * step)

        with Terrain(tile) as server:
            self.render(self.world_of(f'type = "cesium-terrain", url = "{server.url("layer.json")}"'), (10, 0, 20000000, 0, -90), name="listed")
            tiles = {path for path in server.asked if path.endswith(".terrain")}
        self.assertLessEqual(tiles, {"/0/0/0.terrain", "/0/1/0.terrain", "/1/2/1.terrain", "/1/3/1.terrain"})
        self.assertIn("/1/2/1.terrain", tiles)

    def test_meshes_in_web_mercator_go_evenly_by_latitude(self):
        def tile(path):
            if not (at := address(path)):
                return None
            z, x, y = at
            return quantized_mesh(x / 2 ** z * 360 - 180, mercator_latitude((y + 1) / 2 ** z), (x + 1) / 2 ** z * 360 - 180, mercator_latitude(y / 2 ** z))

        with Terrain(tile) as server:
            source = (f'type = "xyz", url = "{server.url("{z}/{x}/{y}.terrain")}", encoding = "quantized-mesh", max_level = {LEVELS - 1}, '
                      'tile_size = 128, vertical = "ellipsoid"')
            self.check_heights(source, [place for place in self.places if abs(place[0]) < 84], 0.3)

    def test_centimetres_in_lossless_pictures(self):
        code = lambda heights: np.rint((heights + 1000) * 100) * 16
        with Terrain(lambda path: coded_picture(*at, code) if (at := address(path)) else None) as server:
            source = f'type = "xyz", url = "{server.url("{z}/{x}/{y}.png")}", encoding = "centimetres", max_level = {LEVELS - 1}, vertical = "ellipsoid"'
            # A centimetre; lines between samples 0.04 degrees apart add less than half of one.
            self.check_heights(source, [place for place in self.places if abs(place[0]) < 84], 0.015)

    def test_codes_in_lossy_pictures_are_refused(self):
        code = lambda heights: np.rint((heights + 32768) * 256)
        with Terrain(lambda path: coded_picture(*at, code, "JPEG") if (at := address(path)) else None) as server:
            source = f'type = "xyz", url = "{server.url("{z}/{x}/{y}.jpg")}", encoding = "terrarium", max_level = 2, vertical = "ellipsoid"'
            done = self.tellurion("render", self.world_of(source), "--out", self.folder / "x.png", "--timeout", 20, status=3)
        self.assertIn("lossless", done.stderr)

    def test_what_is_wrong_is_said(self):
        with Terrain(lambda path: b"<html>" if path.endswith("layer.json") else None) as server:
            done = self.tellurion("render", self.world_of(f'type = "cesium-terrain", url = "{server.url("layer.json")}?key=sesame"'),
                                  "--out", self.folder / "x.png", status=3)
            self.assertIn("is no layer.json", done.stderr)
            self.assertNotIn("sesame", done.stderr)
            done = self.tellurion("render", self.world_of(f'type = "cesium-terrain", url = "{server.url("nothing")}"'), "--out", self.folder / "x.png", status=3)
            self.assertIn("is the URL right", done.stderr)


if __name__ == "__main__":
    unittest.main()
