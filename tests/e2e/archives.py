"""Archives of tiles and GeoTIFFs on servers show what the same data show as a GeoTIFF on disk; what is damaged is said."""
# label: slow
# timeout: 1200
import collections
import contextlib
import gzip
import os
import pathlib
import random
import re
import shutil
import socket
import sqlite3
import struct
import subprocess
import time
import unittest

import numpy as np
from osgeo import gdal

from _common import SHARED, Case, read_picture, shared
from _servers import NOT_FOUND, Reply, Server

PMTILES = "earth/archives/bluemarble-merc.pmtiles"
HALF = 20037508.342789244
COGS = {  # file: planet, view, group
    "earth/regional/cog_int16_utm21n.tif": ("Earth", (73.4, -56.8, 300000, 0, -90), "color"),
    "earth/regional/mosaic_cog1.tif": ("Earth", (44.8, -74.9, 250000, 20, -60), "color"),
    "mars/cog_hirise_mars.tif": ("Mars", (-14.749, -53.566, 9000, 0, -90), "color"),
}


# --- Servers ---------------------------------------------------------------------------------------------------------


class RangeServer(Server):
    """Serves folders in parts and counts the parts."""

    def __init__(self, *folders):
        self.asked = collections.Counter()
        self.folders = [pathlib.Path(folder) for folder in folders]
        self.whole_only = False
        super().__init__()

    def answer(self, path, headers):
        path, part = path.split("?")[0].lstrip("/"), headers.get("Range")
        with self.lock:
            self.asked[path, part] += 1
        file = next((f for folder in self.folders if (f := folder / path).is_file()), None)
        if file is None:
            return NOT_FOUND
        whole = file.read_bytes()
        found = re.fullmatch(r"bytes=(\d+)-(\d+)", part or "")
        if not found or self.whole_only:
            return Reply(200, whole)
        first, last = int(found[1]), min(int(found[2]), len(whole) - 1)
        if first > last:
            return Reply(416)
        return Reply(206, whole[first:last + 1], {"Content-Range": f"bytes {first}-{last}/{len(whole)}", "ETag": f'"{file.stat().st_mtime_ns}"'})


class Nginx:
    """The real thing, over one folder; counts by its log."""

    def __init__(self, work, root):
        self.work = pathlib.Path(work)
        self.work.mkdir()
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        user = "user root;" if os.getuid() == 0 else ""
        (self.work / "nginx.conf").write_text(f"""{user} worker_processes 1; pid nginx.pid; error_log error.log; daemon off;
            events {{ worker_connections 64; }}
            http {{ log_format parts '$status $uri $http_range'; access_log access.log parts;
              client_body_temp_path b; proxy_temp_path p; fastcgi_temp_path f; uwsgi_temp_path u; scgi_temp_path s;
              server {{ listen 127.0.0.1:{self.port}; root {root}; }} }}""")
        program = shutil.which("nginx", path=os.environ.get("PATH", "") + ":/usr/sbin")
        self.process = subprocess.Popen([program, "-p", self.work, "-c", "nginx.conf", "-e", "error.log"])
        for _ in range(100):
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 1):
                return
            time.sleep(0.1)
        raise RuntimeError((self.work / "error.log").read_text())

    @staticmethod
    def there():
        return shutil.which("nginx", path=os.environ.get("PATH", "") + ":/usr/sbin") is not None

    def url(self, path):
        return f"http://127.0.0.1:{self.port}/{path}"

    def asked(self):
        """Parts by (path, range)."""
        time.sleep(0.2)
        lines = (self.work / "access.log").read_text().splitlines()
        return collections.Counter(tuple(line.split(" ", 1)) for line in lines)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(10)


# --- PMTiles, written after the specification --------------------------------------------------------------------------


def varint(number):
    out = bytearray()
    while number >= 0x80:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes(out) + bytes([number])


def directory(entries):
    """Of (tile, run, length, offset)."""
    out, before = varint(len(entries)), 0
    for tile, *_ in entries:
        out += varint(tile - before)
        before = tile
    for column in (1, 2):
        for entry in entries:
            out += varint(entry[column])
    return out + b"".join(varint(entry[3] + 1) for entry in entries)


def tile_number(zoom, x, y):
    """Along a Hilbert curve."""
    number, side = (4 ** zoom - 1) // 3, 2 ** zoom // 2
    while side:
        right, lower = int(x & side > 0), int(y & side > 0)
        number += side * side * (3 * right ^ lower)
        if not lower:
            if right:
                x, y = side - 1 - x & side - 1, side - 1 - y & side - 1
            x, y = y, x
        side //= 2
    return number


def pmtiles(root, leaves, tiles, internal=2, contents=1, kind=2, zooms=(0, 3)):
    at, ranges = 127, b""
    for section in (root, b"", leaves, tiles):
        ranges += struct.pack("<QQ", at, len(section))
        at += len(section)
    head = b"PMTiles\x03" + ranges + struct.pack("<3Q", 0, 0, 0) + bytes([1, internal, contents, kind, *zooms])
    return head + struct.pack("<4i", -1800000000, -850511287, 1800000000, 850511287) + bytes(9) + root + leaves + tiles


def pmtiles_of_mbtiles(source, packed):
    """The same tiles, in leaf directories of 20 entries."""
    with contextlib.closing(sqlite3.connect(source)) as database:
        rows = database.execute("SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles").fetchall()
    tiles, entries = b"", []
    for number, data in sorted((tile_number(z, x, 2 ** z - 1 - y), data) for z, x, y, data in rows):
        data = gzip.compress(data) if packed else data
        entries.append((number, 1, len(data), len(tiles)))
        tiles += data
    pack = gzip.compress if packed else bytes
    root, leaves = [], b""
    for begin in range(0, len(entries), 20):
        leaf = pack(directory(entries[begin:begin + 20]))
        root.append((entries[begin][0], 0, len(leaf), len(leaves)))
        leaves += leaf
    return pmtiles(pack(directory(root)), leaves, tiles, *((2, 2) if packed else (1, 1)), zooms=(min(r[0] for r in rows), max(r[0] for r in rows)))


# --- Tests -----------------------------------------------------------------------------------------------------------


class Archives(Case):
    size = ("--size", "640x360", "--no-atmosphere")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        file = cls.folder / "merc.tif"
        gdal.Warp(str(file), str(shared("earth/imagery/world.tif")), dstSRS="EPSG:3857", outputBounds=(-HALF, -HALF, HALF, HALF),
                  width=2048, height=2048, resampleAlg="bilinear", creationOptions=["TILED=YES"])
        archive = cls.folder / "merc.mbtiles"
        gdal.Translate(str(archive), str(file), format="MBTiles", creationOptions=["TILE_FORMAT=PNG"])
        for path in (file, archive):
            made = gdal.Open(str(path), gdal.GA_Update)
            made.BuildOverviews("AVERAGE", [2, 4, 8])
            del made

    def one_layer(self, name, source, group="color", planet="Earth"):
        path = self.folder / f"{name}.toml"
        path.write_text(f'[planet]\nname = "{planet}"\n[[layer]]\ngroup = "{group}"\nsource = {{ {source} }}\n')
        return path

    def show(self, name, source, camera, *options, planet="Earth", group="color"):
        return self.render(self.one_layer(name, source, group, planet), camera, *self.size, *options, name=name)

    def assert_alike(self, file, other, mean):
        a, b = read_picture(file).astype(float), read_picture(other).astype(float)
        self.assertGreater(np.ptp(a), 40, "there is something to see")
        self.assertLess(np.mean(np.abs(a - b)), mean, f"{file} and {other}")

    views = {"far": (20, 15, 12000000, 0, -90), "near": (44, 12, 1500000, 30, -60)}

    def test_mbtiles_show_what_the_geotiff_shows_in_the_same_places(self):
        before = sorted(self.folder.glob("merc.mbtiles*"))
        for view, camera in self.views.items():
            plain = self.show(f"tif_{view}", 'type = "gdal", path = "merc.tif"', camera)
            tiles = self.show(f"mbtiles_{view}", 'type = "mbtiles", path = "merc.mbtiles"', camera)
            self.assert_alike(plain, tiles, 0.5)
        self.assertEqual(before, sorted(self.folder.glob("merc.mbtiles*")), "nothing is written beside the archive")

    def test_pmtiles_here_and_on_a_server_show_what_the_mbtiles_show(self):
        for packed in (False, True):
            (self.folder / f"merc{packed}.pmtiles").write_bytes(pmtiles_of_mbtiles(self.folder / "merc.mbtiles", packed))
            with RangeServer(self.folder) as server:
                for view, camera in self.views.items():
                    name = f"{view}_{packed}"
                    wanted = self.show(f"wanted_{name}", 'type = "mbtiles", path = "merc.mbtiles"', camera)
                    local = self.show(f"local_{name}", f'type = "pmtiles", path = "merc{packed}.pmtiles"', camera)
                    remote = self.show(f"remote_{name}", f'type = "pmtiles", url = "{server.url(f"merc{packed}.pmtiles")}"', camera)
                    self.assertEqual(wanted.read_bytes(), local.read_bytes())
                    self.assertEqual(wanted.read_bytes(), remote.read_bytes())
                self.assertEqual(set(server.asked.values()), {1}, "no part is asked for twice")

    def check_remote(self, source, camera, counts, forget):
        """A remote source is fetched once, not again in the next run, and shown offline."""
        first = self.show("first", source, camera)
        parts = counts()
        self.assertGreater(sum(parts.values()), 2)
        self.assertEqual(set(parts.values()), {1}, f"a part was asked for twice: {parts}")
        second = self.show("second", source, camera)
        self.assertEqual(sum(counts().values()), sum(parts.values()), "a warm disk cache needs no request")
        self.assertEqual(first.read_bytes(), second.read_bytes())
        forget()
        offline = self.show("offline", source, camera, "--offline")
        self.assertEqual(first.read_bytes(), offline.read_bytes())
        return first

    def test_the_blue_marble_of_others_from_three_places(self):
        camera = (10, 20, 6000000, 0, -90)
        local = self.show("marble", f'type = "pmtiles", path = "{shared(PMTILES)}"', camera)
        # Its finest tiles as one GeoTIFF.
        self.one_picture_of_pmtiles(shared(PMTILES), self.folder / "marble.tif")
        self.assert_alike(self.show("marble_tif", 'type = "gdal", path = "marble.tif"', camera), local, 3)
        with RangeServer(SHARED) as server:
            remote = self.check_remote(f'type = "pmtiles", url = "{server.url(PMTILES)}?key=sesame"', camera, lambda: server.asked, lambda: None)
        self.assertEqual(local.read_bytes(), remote.read_bytes())
        for file in (self.folder / "cache").rglob("*"):
            self.assertFalse(file.is_file() and b"sesame" in file.read_bytes(), f"{file} holds the key")

    def test_from_nginx(self):
        if not Nginx.there():
            self.skipTest("nginx is not installed")
        camera = (10, 20, 6000000, 0, -90)
        local = self.show("marble2", f'type = "pmtiles", path = "{shared(PMTILES)}"', camera)
        with Nginx(self.folder / "nginx", SHARED) as server:
            remote = self.check_remote(f'type = "pmtiles", url = "{server.url(PMTILES)}"', camera, server.asked, lambda: None)
            self.assertTrue(all(status == "206" for status, _ in server.asked()))
            self.assertEqual(local.read_bytes(), remote.read_bytes())
            name = "earth/regional/cog_int16_utm21n.tif"
            planet, camera, group = COGS[name]
            local = self.show("cog_file", f'type = "gdal", path = "{shared(name)}"', camera)
            remote = self.check_remote(f'type = "cog", url = "{server.url(name)}"', camera, server.asked, lambda: None)
            self.assertEqual(local.read_bytes(), remote.read_bytes())

    def one_picture_of_pmtiles(self, source, out):
        data = source.read_bytes()
        root = struct.unpack_from("<QQ", data, 8)
        tiles_at, zoom = struct.unpack_from("<Q", data, 56)[0], data[101]
        raw = gzip.decompress(data[root[0]:root[0] + root[1]])
        at = 0

        def number():
            nonlocal at
            value = shift = 0
            while True:
                byte = raw[at]
                at += 1
                value |= (byte & 0x7F) << shift
                shift += 7
                if byte < 0x80:
                    return value

        count, tile, columns = number(), 0, []
        numbers = []
        for _ in range(count):
            tile += number()
            numbers.append(tile)
        columns = [[number() for _ in range(count)] for _ in range(3)]
        where, end = {}, 0
        for n, run, length, offset in zip(numbers, *columns):
            begin = offset - 1 if offset else end
            end = begin + length
            for i in range(run):
                where[n + i] = data[tiles_at + begin:tiles_at + end]
        mosaic = None
        for x in range(2 ** zoom):
            for y in range(2 ** zoom):
                gdal.FileFromMemBuffer("/vsimem/tile", where[tile_number(zoom, x, y)])
                pixels = gdal.Open("/vsimem/tile").ReadAsArray()[:3]
                side = pixels.shape[1]
                if mosaic is None:
                    mosaic = np.zeros((3, side << zoom, side << zoom), np.uint8)
                mosaic[:, y * side:(y + 1) * side, x * side:(x + 1) * side] = pixels
        made = gdal.GetDriverByName("GTiff").Create(str(out), mosaic.shape[2], mosaic.shape[1], 3, gdal.GDT_Byte, ["TILED=YES"])
        pixel = 2 * HALF / mosaic.shape[1]
        made.SetGeoTransform((-HALF, pixel, 0, HALF, 0, -pixel))
        made.SetProjection('LOCAL_CS[""]')
        from osgeo import osr
        crs = osr.SpatialReference()
        crs.ImportFromEPSG(3857)
        made.SetSpatialRef(crs)
        made.WriteArray(mosaic)
        made.BuildOverviews("AVERAGE", [2, 4, 8])

    def test_geopackages_of_pictures_in_any_grid(self):
        naip = shared("earth/regional/naip_20170827.tif")
        camera = (0, 0, 0)
        # In the picture's own CRS and pixels, and in Web Mercator.
        cases = {"own": (["TILE_FORMAT=PNG"], [2, 4]), "world": (["TILE_FORMAT=PNG", "TILING_SCHEME=GoogleMapsCompatible"], [2, 4])}
        plain = self.folder / "naip.tif"
        gdal.Translate(str(plain), str(naip), bandList=[1, 2, 3])
        made = gdal.Open(str(plain), gdal.GA_Update)
        made.BuildOverviews("AVERAGE", [2, 4])
        lon, lat = self.middle(made)
        del made
        camera = (lat, lon, 6000, 0, -90)
        wanted = self.show("naip", 'type = "gdal", path = "naip.tif"', camera)
        for name, (options, factors) in cases.items():
            file = self.folder / f"{name}.gpkg"
            gdal.Translate(str(file), str(plain), format="GPKG", creationOptions=options)
            made = gdal.Open(str(file), gdal.GA_Update)
            made.BuildOverviews("AVERAGE", factors)
            del made
            shown = self.show(f"naip_{name}", f'type = "geopackage", path = "{name}.gpkg"', camera)
            self.assert_alike(wanted, shown, 0.5 if name == "own" else 4)
        self.assertFalse(list(self.folder.glob("*.gpkg-*")), "nothing is written beside the archive")

    @staticmethod
    def middle(dataset):
        from osgeo import osr
        t = dataset.GetGeoTransform()
        x, y = t[0] + t[1] * dataset.RasterXSize / 2, t[3] + t[5] * dataset.RasterYSize / 2
        to = osr.SpatialReference()
        to.ImportFromEPSG(4326)
        to.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        source = dataset.GetSpatialRef()
        source.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        return osr.CoordinateTransformation(source, to).TransformPoint(x, y)[:2]

    def test_heights_of_a_geopackage_are_those_of_the_raster(self):
        source = gdal.Open(str(shared("earth/regional/dsm.tif")))
        file = self.folder / "dsm.gpkg"
        gdal.Translate(str(file), source, format="GPKG")
        heights = {}
        places = []
        random.seed(5)
        from osgeo import osr
        crs, to = source.GetSpatialRef(), osr.SpatialReference()
        to.ImportFromEPSG(4326)
        for reference in (crs, to):
            reference.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        transformation, t = osr.CoordinateTransformation(crs, to), source.GetGeoTransform()
        for _ in range(100):
            column, row = random.randrange(5, source.RasterXSize - 5), random.randrange(5, source.RasterYSize - 5)
            lon, lat, _ = transformation.TransformPoint(t[0] + (column + 0.5) * t[1], t[3] + (row + 0.5) * t[5])
            places.append(f"{lat:.12f} {lon:.12f}")
        for name, text in {"tif": f'type = "gdal", path = "{shared("earth/regional/dsm.tif")}", vertical = "ellipsoid"',
                           "gpkg": 'type = "geopackage", path = "dsm.gpkg", vertical = "ellipsoid"'}.items():
            printed = self.tellurion("height", self.one_layer(f"dsm_{name}", text, "height"), text="\n".join(places) + "\n").stdout
            heights[name] = np.array([float(line.split()[2]) for line in printed.strip().split("\n")])
        self.assertGreater(np.ptp(heights["tif"]), 1)
        self.assertLess(np.max(np.abs(heights["tif"] - heights["gpkg"])), 2e-3)

    def test_a_cog_on_a_server_shows_the_picture_of_the_file(self):
        for name, (planet, camera, group) in COGS.items():
            with self.subTest(name), RangeServer(SHARED) as server:
                key = pathlib.Path(name).stem
                local = self.show(f"{key}_file", f'type = "gdal", path = "{shared(name)}"', camera, planet=planet, group=group)
                source = f'type = "cog", url = "{server.url(name)}?key=sesame"'
                remote = self.show(f"{key}_server", source, camera, planet=planet, group=group)
                self.assertEqual(local.read_bytes(), remote.read_bytes())
                self.assertGreater(np.ptp(read_picture(local).astype(float)), 40, "there is something to see")
                self.assertEqual(set(server.asked.values()), {1}, f"a part was asked for twice: {server.asked}")
                asked = sum(server.asked.values())
                self.assertLess(asked, 60)
                self.show(f"{key}_again", source, camera, planet=planet, group=group)
                self.assertEqual(sum(server.asked.values()), asked, "a warm disk cache needs no request")

    def test_a_url_or_an_archive_is_a_world_over_the_default_one(self):
        with RangeServer(SHARED) as server:
            stats = self.folder / "stats.json"
            name = "earth/regional/cog_int16_utm21n.tif"
            self.render(server.url(name), COGS[name][1], *self.size, "--stats", stats, name="url_cog")
            self.assertIn("cog_int16_utm21n.tif", stats.read_text())
            self.assertGreater(len([path for path, _ in server.asked if path == name]), 2)
            self.render(server.url(PMTILES), (10, 20, 9000000), *self.size, "--stats", stats, name="url_pmtiles")
            self.assertIn("bluemarble-merc.pmtiles", stats.read_text())
        for file in (shared(PMTILES), self.folder / "merc.mbtiles"):
            self.render(file, (10, 20, 9000000), *self.size, "--stats", stats, name="file_archive")
            self.assertIn(file.name, stats.read_text())

    def test_what_is_wrong_is_said(self):
        def refused(source, *words, group="color", camera=(10, 20, 9000000)):
            world = self.one_layer("wrong", source, group)
            done = self.tellurion("render", world, "--out", self.folder / "x.png", "--camera", ",".join(map(str, camera)), *self.size,
                                  "--timeout", 20, status=3)
            for word in words:
                self.assertIn(word, done.stderr)
            self.assertLessEqual(len(done.stderr.splitlines()), 6, done.stderr)

        good = pmtiles_of_mbtiles(self.folder / "merc.mbtiles", True)
        entries = [(0, 1, 4, 0)]
        leaf = directory([(0, 0, 5, 0)])
        random.seed(8)
        files = {
            "cut.pmtiles": (good[:len(good) // 2], "cut off"),
            "head.pmtiles": (good[:100], "cut off"),
            "random.pmtiles": (random.randbytes(5000), "no PMTiles"),
            "wrong.pmtiles": (b"PMTiles\x02" + good[8:], "version 2"),
            "cyclic.pmtiles": (pmtiles(leaf, leaf, b"tile", 1), "deep"),
            "bomb.pmtiles": (pmtiles(gzip.compress(bytes(15_000_000)), b"", b"tile"), "directory"),
            "bomb_tile.pmtiles": (pmtiles(directory([(0, 1, len(bomb := gzip.compress(bytes(100_000_000))), 0)]), b"", bomb, 1, 2), "tile"),
            "vector.pmtiles": (pmtiles(gzip.compress(directory(entries)), b"", b"tile", kind=1), "vector tiles"),
            "brotli.pmtiles": (pmtiles(gzip.compress(directory(entries)), b"", b"tile", contents=3), "brotli"),
            "random.mbtiles": (random.randbytes(5000), "no SQLite database"),
            "cut.mbtiles": ((self.folder / "merc.mbtiles").read_bytes()[:20000], "cut.mbtiles"),
            "empty.gpkg": (b"", "no GeoPackage"),
            "random.gpkg": (random.randbytes(5000), "no SQLite database"),
        }
        for name, (content, word) in files.items():
            with self.subTest(name):
                (self.folder / name).write_bytes(content)
                kind = {"gpkg": "geopackage"}.get(name.split(".")[1], name.split(".")[1])
                refused(f'type = "{kind}", path = "{name}"', name, word)
        refused(f'type = "mbtiles", path = "{shared("earth/archives/honolulu.mbtiles")}"', "vector tiles")
        refused(f'type = "geopackage", path = "{shared("earth/archives/cities.gpkg")}"', "holds no tiles")
        refused('type = "mbtiles", path = "none.mbtiles"', "no such file")
        with RangeServer(SHARED, self.folder) as server:
            (self.folder / "text.tif").write_bytes(b"x" * 100000)
            refused(f'type = "cog", url = "{server.url("none.tif")}?key=sesame"', "no such file")
            refused(f'type = "cog", url = "{server.url("text.tif")}"', "no GeoTIFF")
            refused(f'type = "pmtiles", url = "{server.url("random.pmtiles")}"', "no PMTiles")
            server.whole_only = True
            refused(f'type = "pmtiles", url = "{server.url(PMTILES)}"', "HTTP ranges")
            refused(f'type = "cog", url = "{server.url("earth/regional/mosaic_cog1.tif")}"', "HTTP ranges")
        refused('type = "cog", url = "http://127.0.0.1:9/x.tif"', "is the server there")


if __name__ == "__main__":
    unittest.main()
