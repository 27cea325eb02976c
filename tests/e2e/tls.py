"""Tiles over https: HTTP/2, and certificates that are trusted or not."""
# label: slow
import os
import unittest
from unittest import mock

from _common import Case
from _servers import NIGHT
from _services import free_port, nginx

VIEW = ("--no-atmosphere", "--no-lighting", "--size", "480x270", "--timeout", "120")
GLOBE = (20, 20, 9000000, 0, -90)
VARIABLES = ("SSL_CERT_FILE", "CURL_CA_BUNDLE")


class Tls(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        port = free_port()
        cls.program, cls.plain = nginx(cls.folder, tls_port=port, rate=0)
        cls.addClassCleanup(cls.program.close)
        cls.safe = f"https://127.0.0.1:{port}"

    def setUp(self):
        (self.folder / "nginx_access.log").write_text("")
        trusts = mock.patch.dict(os.environ)
        trusts.start()
        self.addCleanup(trusts.stop)
        for variable in VARIABLES:
            os.environ.pop(variable, None)

    def world_of(self, name, base):
        path = self.folder / f"{name}.toml"
        path.write_text(f'[[layer]]\nname = "night"\ngroup = "color"\n'
                        f'source = {{ type = "xyz", url = "{base}/{NIGHT}/{{z}}/{{x}}/{{-y}}.png", max_level = 4 }}\n')
        return path

    def requests(self):
        return (self.folder / "nginx_access.log").read_text().splitlines()

    def test_a_trusted_server_gives_the_same_picture_by_http_2(self):
        plain = self.render(self.world_of("plain", self.plain), GLOBE, *VIEW, name="plain")
        asked = [line for line in self.requests() if NIGHT in line]
        self.assertGreater(len(asked), 10)
        self.assertTrue(all(line.startswith("HTTP/1.1 200 ") for line in asked), asked)
        for variable in VARIABLES:
            with self.subTest(variable), mock.patch.dict(os.environ, {variable: str(self.folder / "certificate.pem")}):
                (self.folder / "nginx_access.log").write_text("")
                safe = self.render(self.world_of("safe", self.safe), GLOBE, *VIEW, "--disk-cache", self.folder / variable, name="safe")
                self.assertEqual(plain.read_bytes(), safe.read_bytes())
                again = [line for line in self.requests() if NIGHT in line]
                self.assertEqual(len(again), len(asked))
                self.assertTrue(all(line.startswith("HTTP/2.0 200 ") for line in again), again)

    def test_a_server_that_nobody_vouches_for_is_asked_for_nothing(self):
        done = self.tellurion("render", self.world_of("untrusted", self.safe), "--out", self.folder / "untrusted.png", *VIEW, status=3)
        self.assertIn("certificate is not trusted", done.stderr)
        self.assertIn(self.safe, done.stderr)
        self.assertEqual(self.requests(), [])

    def test_a_file_of_certificates_that_is_not_there_is_said(self):
        with mock.patch.dict(os.environ, {"SSL_CERT_FILE": str(self.folder / "no.pem")}):
            done = self.tellurion("render", self.world_of("absent", self.safe), "--out", self.folder / "absent.png", *VIEW, status=3)
        self.assertIn("no.pem", done.stderr)


if __name__ == "__main__":
    unittest.main()
