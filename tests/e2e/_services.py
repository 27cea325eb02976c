"""Servers on loopback for services.py: the shared folder's files, MapProxy over them, nginx, and one that answers as it is told."""
import functools
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import threading
import time
import urllib.request

import numpy as np
from osgeo import gdal, osr

from _common import SHARED
from _servers import NIGHT, Reply, Server, picture_bytes

MAPPROXY = """
services:
  tms: {{use_grid_names: true}}
  wmts: {{kvp: true, restful: true}}
  wms:
    md: {{title: Night over the Earth}}
    srs: ['EPSG:4326', 'CRS:84', 'EPSG:3857', 'EPSG:25832', 'EPSG:3035', 'EPSG:3995']
layers:
  - name: night
    title: City lights
    sources: [night]
  - name: arctic  # MapProxy does not reproject Mercator to where the pole is
    title: City lights round the pole
    sources: [night_arctic]
  - name: night84  # MapProxy mistakes CRS:84 for EPSG:4326 where there are several grids
    title: City lights, of one grid
    sources: [night_mercator]
caches:
  whole:  # MapProxy reprojects from caches only
    grids: [tiles]
    sources: [tiles]
    disable_storage: true
    format: image/png
  night:
    grids: [mercator, geodetic]
    sources: [whole]
    disable_storage: true
    format: image/png
  night_mercator:
    grids: [mercator]
    sources: [whole]
    disable_storage: true
    format: image/png
  night_arctic:
    grids: [arctic]
    sources: [arctic_tiles]
    disable_storage: true
    format: image/png
sources:
  arctic_tiles:
    type: tile
    grid: arctic
    url: {files}/arctic/%(z)s/%(x)s/%(y)s.png
    transparent: true
  tiles:
    type: tile
    grid: tiles
    url: {files}/{night}/%(z)s/%(x)s/%(y)s.png
    transparent: true
grids:
  tiles: {{base: GLOBAL_MERCATOR, num_levels: 5, origin: sw}}
  mercator: {{base: GLOBAL_WEBMERCATOR, num_levels: 5}}
  geodetic: {{base: GLOBAL_GEODETIC, num_levels: 6, origin: nw}}
  arctic: {{srs: 'EPSG:3995', bbox: [-4500000, -4500000, 4500000, 4500000], bbox_srs: 'EPSG:3995', num_levels: 5, origin: nw}}
globals:
  cache: {{base_dir: {folder}/mapproxy_data}}
  image: {{resampling_method: bilinear}}
"""

MAPPROXY_SERVER = """
import socketserver, sys
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer, make_server
from mapproxy.wsgiapp import make_wsgi_app
class Server(socketserver.ThreadingMixIn, WSGIServer):
    daemon_threads = True
class Quiet(WSGIRequestHandler):
    def log_message(self, *_): pass
make_server("127.0.0.1", int(sys.argv[2]), make_wsgi_app(sys.argv[1]), Server, Quiet).serve_forever()
"""


class Answering(Server):
    """Calls `answer(path)`, path with its query, for (status, content type, bytes); keeps what was asked."""

    def __init__(self, answer):
        self.asked, self.headers, self.reply = [], [], answer
        super().__init__()

    def answer(self, path, headers):
        with self.lock:
            self.asked.append(path)
            self.headers.append(headers)
        status, content, body = self.reply(path)
        return Reply(status, body, {"Content-Type": content})


def web_mercator_night():
    """The night tiles of level 4 in one raster."""
    count, half = 16, 6378137.0 * np.pi
    raster = gdal.GetDriverByName("MEM").Create("", 256 * count, 256 * count, 3)
    for x in range(count):
        for y in range(count):
            tile = gdal.Open(str(SHARED / NIGHT / f"4/{x}/{count - 1 - y}.png")).ReadAsArray()[:3]
            raster.WriteArray(tile, 256 * x, 256 * y)
    side = 2 * half / raster.RasterXSize
    raster.SetGeoTransform([-half, side, 0, half, 0, -side])
    raster.SetSpatialRef(spatial_reference(3857))
    return raster


def spatial_reference(code):
    reference = osr.SpatialReference()
    reference.ImportFromEPSG(code)
    return reference


class ArcticTiles:
    """The night as GDAL reprojects it to EPSG:3995, in tiles of 256 pixels: the picture for /arctic/z/x/y.png."""

    def __init__(self):
        half = 4500000.0
        night = web_mercator_night()
        self.levels = []
        for level in range(5):
            pixels = 256 << level
            raster = gdal.Warp("", night, format="MEM", dstSRS="EPSG:3995", outputBounds=(-half, -half, half, half), width=pixels,
                               height=pixels, resampleAlg="average" if level < 3 else "bilinear", dstAlpha=True)
            self.levels.append(raster.ReadAsArray())

    def picture(self, level, x, y):
        return picture_bytes(self.levels[level][:, 256 * y:256 * (y + 1), 256 * x:256 * (x + 1)])


@functools.cache
def arctic_tiles():
    return ArcticTiles()


arctic_lock = threading.Lock()


def shared_files(path):
    """For Answering: the shared folder, and the arctic tiles."""
    tile = re.fullmatch(r"/arctic/(\d+)/(\d+)/(\d+)\.png", path)
    if tile:
        with arctic_lock:
            tiles = arctic_tiles()
        return 200, "image/png", tiles.picture(*map(int, tile.groups()))
    file = SHARED / path.split("?")[0].lstrip("/")
    kinds = {".png": "image/png", ".xml": "text/xml", ".webp": "image/webp"}
    if not file.is_file():
        return 404, "text/plain", b"no such file"
    return 200, kinds.get(file.suffix, "application/octet-stream"), file.read_bytes()


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Program:
    """A server program of its own; it must answer at `probe` within a minute."""

    def __init__(self, command, probe, folder):
        self.log = pathlib.Path(folder) / f"{pathlib.Path(command[0]).name}.log"
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(command, stdout=log, stderr=log)
        end = time.monotonic() + 60
        while True:
            try:
                urllib.request.urlopen(probe, timeout=20).read()
                return
            except OSError:
                if self.process.poll() is not None or time.monotonic() > end:
                    self.close()
                    raise RuntimeError(f"{' '.join(map(str, command))} does not answer:\n{self.log.read_text()[-2000:]}") from None
                time.sleep(0.2)

    def close(self):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


def mapproxy(files, folder):
    """MapProxy over the tiles that are served at `files`; gives the program and its URL."""
    folder = pathlib.Path(folder)
    config, server, port = folder / "mapproxy.yaml", folder / "mapproxy_server.py", free_port()
    config.write_text(MAPPROXY.format(files=files, night=NIGHT, folder=folder))
    server.write_text(MAPPROXY_SERVER)
    base = f"http://127.0.0.1:{port}"
    return Program(["/usr/bin/python3", str(server), str(config), str(port)], f"{base}/tms/1.0.0/", folder), base


NGINX = """
daemon off;
pid {folder}/nginx.pid;
error_log {folder}/nginx_errors.log;
events {{ worker_connections 128; }}
http {{
  types {{ text/xml xml; image/png png; }}
  log_format short '$server_protocol $status $request_uri';
  access_log {folder}/nginx_access.log short;
  client_body_temp_path {folder}/nginx_a; proxy_temp_path {folder}/nginx_b; fastcgi_temp_path {folder}/nginx_c;
  uwsgi_temp_path {folder}/nginx_d; scgi_temp_path {folder}/nginx_e;
  gzip on; gzip_types text/xml image/png; gzip_min_length 100;
  server {{
    listen 127.0.0.1:{port};
    {tls}
    root {root};
    limit_rate {rate};
    etag on;
    expires 1h;
  }}
}}
"""


TLS = """
    listen 127.0.0.1:{port} ssl http2;
    ssl_certificate {certificate};
    ssl_certificate_key {key};
"""


def certificate(folder):
    """A certificate of 127.0.0.1 that nobody vouches for, and its key."""
    file, key = pathlib.Path(folder) / "certificate.pem", pathlib.Path(folder) / "key.pem"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=127.0.0.1",
                    "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", key, "-out", file], check=True, capture_output=True)
    return file, key


def nginx(folder, tls_port=None, rate="64k"):
    """nginx over the shared folder: 64 kB/s for each reply, gzip; gives the program and its URL. With `tls_port` it also answers
    there, by HTTP/2, with the certificate of the folder."""
    program = shutil.which("nginx", path=os.environ.get("PATH", "") + ":/usr/sbin")
    if not program:
        sys.exit("nginx is missing: run tools/setup.sh --test")
    folder, port = pathlib.Path(folder), free_port()
    config = folder / "nginx.conf"
    tls = ""
    if tls_port:
        file, key = certificate(folder)
        tls = TLS.format(port=tls_port, certificate=file, key=key)
    config.write_text(NGINX.format(folder=folder, port=port, root=SHARED, tls=tls, rate=rate))
    base = f"http://127.0.0.1:{port}"
    return Program([program, "-p", str(folder), "-e", str(folder / "nginx_errors.log"), "-c", str(config)], f"{base}/README.md", folder), base
