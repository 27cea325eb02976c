"""HTTP servers on loopback that answer as a test tells them."""
import collections
import contextlib
import dataclasses
import http.server
import threading
import time

import numpy as np
from osgeo import gdal, gdal_array

from _common import SHARED

NIGHT = "earth/tiles/blackmarble_tms_mercator"
TERRARIUM = "earth/tiles/terrarium_etopo5"
RAINIER_TILES = "earth/tiles/terrain_rgb_webp_rainier"


@dataclasses.dataclass
class Reply:
    status: int = 200
    body: bytes = b""
    headers: dict = dataclasses.field(default_factory=dict)
    promised: int | None = None  # the length that the header names, if it is not the body's; then the connection ends


NOT_FOUND = Reply(404)


def picture_bytes(pixels, driver="PNG"):
    """Bands, rows and columns of bytes as a file."""
    raster = gdal_array.OpenArray(np.ascontiguousarray(pixels, np.uint8))
    name = f"/vsimem/picture-{threading.get_ident()}"
    gdal.GetDriverByName(driver).CreateCopy(name, raster)
    file = gdal.VSIFOpenL(name, "rb")
    data = gdal.VSIFReadL(1, gdal.VSIStatL(name).size, file)
    gdal.VSIFCloseL(file)
    gdal.Unlink(name)
    return bytes(data)


class Server:
    """Answers by `answer`, one call a request, in threads of their own; to be used as a context."""

    def __init__(self):
        self.lock = threading.Lock()
        server = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self):
                reply = server.answer(self.path, dict(self.headers))
                if reply is None or reply.promised is not None:
                    self.close_connection = True
                if reply is None:
                    return
                self.send_response(reply.status)
                length = len(reply.body) if reply.promised is None else reply.promised
                for name, value in {"Content-Length": str(length), **reply.headers}.items():
                    self.send_header(name, value)
                self.end_headers()
                with contextlib.suppress(ConnectionError):
                    self.wfile.write(reply.body)

            def log_message(self, *_):
                pass

        self.http = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.http.daemon_threads = True
        self.http.handle_error = lambda *_: None  # programs that are killed leave their connections
        self.base = f"http://127.0.0.1:{self.http.server_port}"
        threading.Thread(target=self.http.serve_forever, daemon=True).start()

    def answer(self, path, headers):
        """The reply to a path with its query; None ends the connection without a word."""
        raise NotImplementedError

    def url(self, path):
        return f"{self.base}/{path}"

    def close(self):
        self.http.shutdown()
        self.http.server_close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class TileServer(Server):
    """Serves the shared folder of tiles, counts what is asked for, and answers wrongly when `fault(path, times)` says how."""

    def __init__(self, fault=lambda path, times: None):
        self.asked = collections.Counter()
        self.headers = {}
        self.fault = fault
        super().__init__()

    def answer(self, path, headers):
        path = path.split("?")[0]
        with self.lock:
            self.asked[path] += 1
            self.headers[path] = headers
            times = self.asked[path]
        kind = self.fault(path, times)
        if kind == "reset":
            return None
        if kind == "stall":
            time.sleep(3)
        if isinstance(kind, int):
            return Reply(kind, headers={"Retry-After": "1"} if kind == 429 else {})
        if kind == "page":
            return Reply(200, b"<html>no tile for you</html>", {"Content-Type": "text/html"})
        if kind == "large":
            return Reply(200, (SHARED / "moon/moon_4k.jpg").read_bytes(), {"Content-Type": "image/png"})
        file = SHARED / path.lstrip("/")
        if not file.is_file():
            return NOT_FOUND
        body = file.read_bytes()
        if kind == "truncated":
            return Reply(200, body[:len(body) // 2], {"Content-Type": "image/png"}, promised=len(body))
        if kind == "corrupt":
            body = body[:40] + bytes(255 - b for b in body[40:])
        return Reply(200, body, {"Content-Type": "image/png"})
