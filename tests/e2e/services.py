"""WMTS, WMS and TMS as MapProxy and nginx serve them: the same picture as from the tiles themselves, and wrong services named."""
# label: slow
# timeout: 1800
import re
import sqlite3
import unittest

import numpy as np

from _common import ROOT, Case, read_picture
from _servers import NIGHT
from _services import Answering, mapproxy, nginx, shared_files

SAVED = ROOT / "tests/data/services"
PLAIN = ("--no-atmosphere", "--no-lighting", "--size", "480x270", "--timeout", "600")
GLOBE = (20, 20, 9000000, 0, -90)
EUROPE = (50, 10, 2500000, 0, -90)
ARCTIC = (80, 30, 5000000, 0, -90)


def means(picture):
    """Of 3 x 3 pixels round each."""
    height, width = picture.shape[:2]
    return sum(picture[dy:height - 2 + dy, dx:width - 2 + dx] for dy in range(3) for dx in range(3)) / 9.0


class Services(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.files = Answering(shared_files)
        cls.addClassCleanup(cls.files.close)
        cls.proxy, cls.base = mapproxy(cls.files.base, cls.folder)
        cls.addClassCleanup(cls.proxy.close)
        cls.references = {}

    def world_of(self, name, source):
        path = self.folder / f"{name}.toml"
        path.write_text(f'[[layer]]\nname = "{name}"\ngroup = "color"\nsource = {{ {source} }}\n')
        return path

    def reference(self, view):
        """The picture straight from the tiles."""
        if view not in self.references:
            world = self.world_of("tiles", f'type = "xyz", url = "{self.files.base}/{NIGHT}/{{z}}/{{x}}/{{-y}}.png", max_level = 4')
            file = self.render(world, view, *PLAIN, name=f"tiles{len(self.references)}")
            self.references[view] = read_picture(file).astype(float)
        return self.references[view]

    def check_same(self, name, source, view, most, margin=3):
        """But for `margin` pixels all round, the mean difference of means of 3 x 3 pixels is at most `most`, and no shift by a pixel makes
        that of pixels smaller: nothing is turned or moved. (A service that resamples takes from the contrast of single pixels.)"""
        wanted = self.reference(view)
        found = read_picture(self.render(self.world_of(name, source), view, *PLAIN, name=name)).astype(float)
        inner = wanted[margin:-margin, margin:-margin]
        self.assertGreater(np.std(inner), 10, "there is something to see")

        def difference(dx, dy):
            height, width = inner.shape[:2]
            return np.mean(np.abs(found[margin + dy:margin + dy + height, margin + dx:margin + dx + width] - inner))

        shifts = {(dx, dy): difference(dx, dy) for dx in (-2, -1, 0, 1, 2) for dy in (-2, -1, 0, 1, 2)}
        apart = np.mean(np.abs(means(found[margin:-margin, margin:-margin]) - means(inner)))
        print(f"{name}: mean difference {shifts[0, 0]:.3f}, of means {apart:.3f}, a pixel away at least {min(v for k, v in shifts.items() if k != (0, 0)):.3f}")
        self.assertLess(apart, most, name)
        self.assertEqual(min(shifts, key=shifts.get), (0, 0), f"{name} lies beside where it should")

    # --- The same picture ----------------------------------------------------------------------------------------

    def test_wmts_by_templates(self):
        url = f"{self.base}/wmts/1.0.0/WMTSCapabilities.xml"
        self.check_same("wmts-rest", f'type = "wmts", url = "{url}", layer = "night"', GLOBE, 0.2)
        self.check_same("wmts-rest-degrees", f'type = "wmts", url = "{url}", layer = "night", matrix_set = "geodetic"', GLOBE, 2)
        self.check_same("wmts-rest-arctic", f'type = "wmts", url = "{url}", layer = "arctic"', ARCTIC, 2, 50)

    def test_wmts_by_parameters(self):
        self.check_same("wmts-kvp", f'type = "wmts", url = "{self.base}/service", layer = "night", style = "default"', GLOBE, 0.2)
        self.check_same("wmts-kvp-degrees", f'type = "wmts", url = "{self.base}/service?", layer = "night", matrix_set = "geodetic"', EUROPE, 2)

    def test_wms_of_both_versions_in_degrees(self):
        for version in ("1.1.1", "1.3.0"):
            self.check_same(f"wms-{version}-4326", f'type = "wms", url = "{self.base}/service", layers = "night", version = "{version}", crs = "EPSG:4326", max_level = 5', GLOBE, 2)
        self.check_same("wms-crs84", f'type = "wms", url = "{self.base}/service", layers = "night84", crs = "CRS:84", max_level = 5', EUROPE, 2)

    def test_wms_in_projections(self):
        self.check_same("wms", f'type = "wms", url = "{self.base}/service", layers = "night", max_level = 4', GLOBE, 0.2)
        # Bounds reach over the middle of the picture only.
        for version in ("1.1.1", "1.3.0"):
            # EPSG:3035 has north before east.
            for crs in ("EPSG:25832", "EPSG:3035"):
                self.check_same(f"wms-{version}-{crs[5:]}", f'type = "wms", url = "{self.base}/service", layers = "night", version = "{version}", crs = "{crs}", bounds = [-5, 40, 25, 60]', EUROPE, 4, 90)
        self.check_same("wms-arctic", f'type = "wms", url = "{self.base}/service", layers = "arctic", crs = "EPSG:3995", bounds = [-180, 50, 180, 86]', ARCTIC, 2, 50)

    def test_tms_of_a_service_and_of_a_folder(self):
        self.check_same("tms", f'type = "tms", url = "{self.base}/tms/1.0.0/night/mercator"', GLOBE, 0.2)
        # The document has degrees in place of metres.
        self.check_same("tms-folder", f'type = "tms", url = "{self.files.base}/{NIGHT}/tilemapresource.xml", max_level = 4', GLOBE, 0.2)
        self.check_same("tms-folder-slash", f'type = "tms", url = "{self.files.base}/{NIGHT}/", max_level = 4', GLOBE, 0.2)

    def test_nginx_with_little_bandwidth(self):
        program, base = nginx(self.folder)
        self.addCleanup(program.close)
        self.check_same("nginx", f'type = "tms", url = "{base}/{NIGHT}/tilemapresource.xml", max_level = 4', GLOBE, 0.2)
        self.check_same("nginx-tiles", f'type = "xyz", url = "{base}/{NIGHT}/{{z}}/{{x}}/{{-y}}.png", max_level = 4', GLOBE, 0.2)

    # --- What else is promised ----------------------------------------------------------------------------------

    def test_offline_shows_what_was_seen(self):
        world = self.world_of("kept", f'type = "wmts", url = "{self.base}/wmts/1.0.0/WMTSCapabilities.xml", layer = "night"')
        first = self.render(world, GLOBE, *PLAIN, name="online")
        self.assertEqual(first.read_bytes(), self.render(world, GLOBE, *PLAIN, "--offline", name="offline").read_bytes())
        self.tellurion("render", world, "--out", self.folder / "x.png", "--offline", "--disk-cache", self.folder / "nothing", status=3)

    def test_info_tells_what_a_service_is(self):
        world = self.world_of("told", f'type = "wms", url = "{self.base}/service", layers = "night", crs = "EPSG:3035", bounds = [0, 40, 20, 60]')
        printed = self.tellurion("info", world).stdout
        self.assertIn("LAEA Europe", printed)
        self.assertIn("LAYERS=night", printed)
        self.assertIn("credit      Night over the Earth", printed)

    def test_worlds_of_the_guide(self):
        blocks = re.findall(r"```toml\n(.*?)```", (ROOT / "docs/tiles-and-services.md").read_text(), re.S)
        blocks = [block for block in blocks if re.search(r'type = "(wmts|wms|tms)"', block)]
        self.assertGreaterEqual(len(blocks), 3)
        for i, block in enumerate(blocks):
            text = block.replace("https://maps.example.org", self.base).replace("https://tiles.example.org", f"{self.files.base}/{NIGHT}")
            self.assertNotIn("example.org", text)
            world = self.folder / f"guide{i}.toml"
            world.write_text(text)
            self.assertIn("levels", self.tellurion("info", world).stdout, block)

    def test_keys_are_sent_but_neither_shown_nor_kept(self):
        capabilities = (SAVED / "mapproxy_wmts_kvp.xml").read_bytes()

        def answer(path):
            if "sesame" not in path:
                return 401, "text/plain", b""
            if "GetCapabilities" in path:
                return 200, "text/xml", capabilities.replace(b"http://127.0.0.1:8998", server.base.encode())
            return 200, "text/xml", b"<ServiceExceptionReport><ServiceException code='Denied'>sesame is no key for this layer</ServiceException></ServiceExceptionReport>"

        cache, stats = self.folder / "secret", self.folder / "secret.json"
        with Answering(answer) as server:
            world = self.world_of("secret", f'type = "wmts", url = "{server.base}/service?key=sesame", layer = "night", headers = {{ Authorization = "Bearer open-barley" }}')
            done = self.tellurion("render", world, "--out", self.folder / "x.png", "--disk-cache", cache, "--stats", stats, *PLAIN, "--timeout", 8, status=3)
            self.assertTrue(any("GetTile" in path for path in server.asked))
            self.assertTrue(all(headers.get("Authorization") == "Bearer open-barley" for headers in server.headers))
        self.assertIn("is no key for this layer (Denied)", done.stderr)
        for text in (done.stderr, done.stdout, stats.read_text()):
            self.assertNotIn("sesame", text)
            self.assertNotIn("open-barley", text)
        self.assertNotIn("sesame", self.kept(cache))
        self.assertNotIn("ServiceException", self.kept(cache))

    def kept(self, cache):
        """All that the disk cache has: names and bytes."""
        database = sqlite3.connect(cache / "files.sqlite")
        rows = database.execute("SELECT key, body FROM files").fetchall()
        database.close()
        self.assertGreater(len(rows), 0)
        return "\n".join(f"{key} {bytes(body or b'')!r}" for key, body in rows)

    def fault(self, name, source, *parts):
        """The layer fails with a line that says all of `parts`; what lies below it is drawn all the same."""
        world = self.folder / f"{name}.toml"
        world.write_text(f'[[layer]]\ngroup = "color"\nsource = {{ type = "xyz", url = "{self.files.base}/{NIGHT}/{{z}}/{{x}}/{{-y}}.png", max_level = 4 }}\n'
                         f'[[layer]]\nname = "{name}"\ngroup = "color"\nsource = {{ {source} }}\n')
        out = self.folder / f"{name}.png"
        done = self.tellurion("render", world, "--out", out, "--camera", ",".join(map(str, GLOBE)), *PLAIN, "--timeout", 30, status=3)
        for part in parts:
            self.assertIn(part, done.stderr)
        self.assertLessEqual(len(done.stderr.strip().splitlines()), 3, done.stderr)
        self.assertLess(np.mean(np.abs(read_picture(out).astype(float) - self.reference(GLOBE))), 0.01)

    def test_what_does_not_exist_is_named_with_what_does(self):
        wmts, wms = f"{self.base}/wmts/1.0.0/WMTSCapabilities.xml", f"{self.base}/service"
        self.fault("no-layer", f'type = "wmts", url = "{wmts}", layer = "day"', "WMTSCapabilities.xml", '"day"', "it has night")
        self.fault("no-style", f'type = "wmts", url = "{wmts}", layer = "night", style = "red"', '"red"', "it has default")
        self.fault("no-set", f'type = "wmts", url = "{wmts}", layer = "night", matrix_set = "moon"', '"moon"', "geodetic (EPSG:4326)")
        self.fault("no-dimension", f'type = "wmts", url = "{wmts}", layer = "night", dimensions = {{ Time = "now" }}', '"Time"', "none")
        self.fault("no-format", f'type = "wms", url = "{wms}", layers = "night", format = "image/bmp"', '"image/bmp"', "image/jpeg")
        self.fault("no-wms-layer", f'type = "wms", url = "{wms}", layers = "night,day"', '"day"', "it has night")
        self.fault("no-wms-style", f'type = "wms", url = "{wms}", layers = "night", styles = "red"', '"red"')
        self.fault("no-crs", f'type = "wms", url = "{wms}", layers = "night", crs = "EPSG:2180"', '"EPSG:2180"', "EPSG:25832")
        self.fault("no-map", f'type = "tms", url = "{self.base}/tms/1.0.0/"', "there is no such file")

    def test_broken_services_are_named(self):
        known = (SAVED / "mapproxy_wms_1.3.0.xml").read_text()
        replies = {
            "/401": (401, "text/plain", b"who are you"),
            "/page": (200, "text/html", b"<!DOCTYPE html><html><body>Welcome</body></html>"),
            "/half": (200, "text/xml", known[:1500].encode()),
            "/error": (200, "text/xml", (SAVED / "mapproxy_exception.xml").read_bytes()),
            "/strange": (200, "text/xml", re.sub(r"<CRS>.*</CRS>", "<CRS>EPSG:999999</CRS>", known).encode()),
        }
        with Answering(lambda path: replies.get(path.split("?")[0], (404, "text/plain", b""))) as server:
            for path, parts in {"/401": ("check the key",), "/page": ("HTML",), "/half": ("XML", "line"), "/error": ("unknown layer: none",),
                                "/strange": ("EPSG:999999", "PROJ"), "/none": ("no such file",)}.items():
                self.fault("broken" + path[1:], f'type = "wms", url = "{server.base}{path}", layers = "night"', server.base + path, *parts)
            # What is worthless is not kept: now the page is gone.
            replies["/page"] = (200, "text/xml", known.replace("http://127.0.0.1:8998", self.base).encode())
            self.check_same("mended", f'type = "wms", url = "{server.base}/page", layers = "night", max_level = 4', GLOBE, 0.2)

    def test_exceptions_in_place_of_maps_are_told_and_not_kept(self):
        known = (SAVED / "mapproxy_wms_1.3.0.xml").read_text()

        def answer(path):
            if "GetCapabilities" in path:
                return 200, "text/xml", known.replace("http://127.0.0.1:8998/service?", f"{server.base}/map?").encode()
            return 200, "application/vnd.ogc.se_xml", b"<ServiceExceptionReport><ServiceException>out of ink</ServiceException></ServiceExceptionReport>"

        with Answering(answer) as server:
            cache = self.folder / "ink"
            world = self.world_of("ink", f'type = "wms", url = "{server.base}/service", layers = "night", max_level = 3')
            done = self.tellurion("render", world, "--out", self.folder / "ink.png", "--disk-cache", cache, *PLAIN, "--timeout", 8, status=3)
            self.assertIn("the service answers: out of ink", done.stderr)
            self.assertLessEqual(len(done.stderr.strip().splitlines()), 3, done.stderr)
            self.assertNotIn("out of ink", self.kept(cache))


if __name__ == "__main__":
    unittest.main()
