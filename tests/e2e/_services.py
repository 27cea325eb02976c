"""Servers on loopback for services.py: the shared folder's files, MapProxy over them, nginx, and one that answers as it is told."""
import http.server
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import threading
import time
import urllib.request

from _common import SHARED

NIGHT = "earth/tiles/blackmarble_tms_mercator"

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
caches:
  whole:  # MapProxy reprojects from caches only
    grids: [tiles]
    sources: [tiles]
    disable_storage: true
    format: image/png
  night:
    grids: [mercator, geodetic, arctic]
    sources: [whole]
    disable_storage: true
    format: image/png
sources:
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


class Answering:
    """An HTTP server that calls `answer(path)`, path with its query, for (status, content type, bytes); keeps what was asked."""

    def __init__(self, answer):
        self.asked, self.headers = [], []
        lock, server = threading.Lock(), self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self):
                with lock:
                    server.asked.append(self.path)
                    server.headers.append(dict(self.headers))
                status, content, body = answer(self.path)
                self.send_response(status)
                self.send_header("Content-Type", content)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *_):
                pass

        self.http = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.http.daemon_threads = True
        self.base = f"http://127.0.0.1:{self.http.server_port}"
        threading.Thread(target=self.http.serve_forever, daemon=True).start()

    def close(self):
        self.http.shutdown()
        self.http.server_close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def shared_files(path):
    """For Answering: the shared folder."""
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
  access_log {folder}/nginx_access.log;
  client_body_temp_path {folder}/nginx_a; proxy_temp_path {folder}/nginx_b; fastcgi_temp_path {folder}/nginx_c;
  uwsgi_temp_path {folder}/nginx_d; scgi_temp_path {folder}/nginx_e;
  gzip on; gzip_types text/xml image/png; gzip_min_length 100;
  server {{
    listen 127.0.0.1:{port};
    root {root};
    limit_rate 64k;
    etag on;
    expires 1h;
  }}
}}
"""


def nginx(folder):
    """nginx over the shared folder: 64 kB/s for each reply, gzip; gives the program and its URL."""
    program = shutil.which("nginx", path=os.environ.get("PATH", "") + ":/usr/sbin")
    if not program:
        sys.exit("nginx is missing: run tools/setup.sh --test")
    folder, port = pathlib.Path(folder), free_port()
    config = folder / "nginx.conf"
    config.write_text(NGINX.format(folder=folder, port=port, root=SHARED))
    base = f"http://127.0.0.1:{port}"
    return Program([program, "-p", str(folder), "-e", str(folder / "nginx_errors.log"), "-c", str(config)], f"{base}/README.md", folder), base
