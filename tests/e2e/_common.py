"""What the scripts against the program share.

They run it, read what it writes, and hold that against the mathematics of ellipsoids, cameras and rasters, written here a
second time (numpy, float64) so that it can tell when the program's is wrong.
"""
import csv
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from osgeo import gdal

gdal.UseExceptions()
gdal.PushErrorHandler("CPLQuietErrorHandler")

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.path.abspath(os.environ.get("TELLURION", ROOT / "build/release/bin/tellurion"))
SHARED = pathlib.Path(os.environ.get("TELLURION_SHARED_DATA_DIR", ROOT / "../shared/data")).resolve()

ETOPO5 = "earth/elevation/etopo5.tif"
ARCTIC = "earth/elevation/arctic_polar_stereographic.tif"
EVEREST = "earth/regional/mt_everest_90m.tif"
RAINIER = "earth/regional/mt_rainier_90m.tif"
BLUE_MARBLE = "earth/imagery/blue_marble_4096.jpg"


def shared(path):
    """A file of the shared data, which these tests cannot do without."""
    file = SHARED / path
    if not file.exists():
        sys.exit(f"{file} is missing: set TELLURION_SHARED_DATA_DIR to the folder with the shared test data")
    return file


# --- The program -----------------------------------------------------------------------------------------------------


class Case(unittest.TestCase):
    """A test with a folder of its own, in which the program also keeps its caches; it stays there after a failure."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix=f"tellurion-{cls.__name__}-"))
        cls.failures_before = None

    @classmethod
    def tearDownClass(cls):
        if not getattr(cls, "failed", False):
            shutil.rmtree(cls.folder)

    def run(self, result=None):
        before = len(result.failures) + len(result.errors) if result else 0
        super().run(result)
        if result and len(result.failures) + len(result.errors) > before:
            type(self).failed = True
            print(f"what it wrote stays in {self.folder}", file=sys.stderr)

    def tellurion(self, *arguments, status=0, text=None, timeout=600):
        """Runs the program; its exit status must be `status`. Gives back what it printed."""
        command = [PROGRAM, *map(str, arguments)]
        environment = os.environ | {"XDG_CACHE_HOME": str(self.folder / "cache")}
        for display in ("DISPLAY", "WAYLAND_DISPLAY"):
            environment.pop(display, None)
        done = subprocess.run(command, input=text, text=True, capture_output=True, timeout=timeout, env=environment)
        self.assertEqual(done.returncode, status,
                         f"{' '.join(command)}\nended with status {done.returncode}, not {status}:\n{done.stderr[-2000:]}")
        return done

    def render(self, world, camera, *options, name="view", status=0):
        """Renders into the test's folder and gives the picture's path."""
        out = self.folder / f"{name}.png"
        out.unlink(missing_ok=True)
        self.tellurion("render", world, "--out", out, "--camera", camera_text(camera), *options, status=status)
        return out

    def world(self, name, *layers, planet="Earth"):
        """Writes a world file of layers (group, file[, more keys of the source[, more of the layer]]); files are those of the
        shared data."""
        lines = ["[planet]", f"name = {json.dumps(planet)}"]
        for group, path, *more in layers:
            of_source, of_layer = (*more, {}, {})[:2]
            source = {"type": "gdal", "path": str(shared(path))} | of_source
            if group == "height":
                source.setdefault("vertical", "ellipsoid")
            keys = ", ".join(f"{key} = {json.dumps(value)}" for key, value in source.items())
            lines += ["", "[[layer]]", f'group = "{group}"', f"source = {{ {keys} }}"]
            lines += [f"{key} = {json.dumps(value)}" for key, value in of_layer.items()]
        file = self.folder / f"{name}.toml"
        file.write_text("\n".join(lines) + "\n")
        return file


def camera_text(camera):
    return camera if isinstance(camera, str) else ",".join(repr(float(number)) for number in camera)


# --- What it writes --------------------------------------------------------------------------------------------------


def read_picture(file):
    """height x width x 3, uint8."""
    return np.moveaxis(gdal.Open(str(file)).ReadAsArray()[:3], 0, -1)


def read_geo(file):
    """latitude, longitude (degrees), height, distance (metres); NaN where there is sky."""
    data = gdal.Open(str(file))
    assert data.RasterCount == 4 and data.GetRasterBand(1).DataType == gdal.GDT_Float64, gdal.Info(data)
    return data.ReadAsArray()


def read_trace(file):
    """A dictionary a frame; numbers as floats."""
    def number(text):
        try:
            return float(text)
        except ValueError:
            return text
    with open(file, newline="") as stream:
        return [{key: number(value) for key, value in row.items()} for row in csv.DictReader(stream)]


def write_picture(file, pixels):
    bands = np.moveaxis(pixels.astype(np.uint8), -1, 0)
    memory = gdal.GetDriverByName("MEM").Create("", bands.shape[2], bands.shape[1], bands.shape[0], gdal.GDT_Byte)
    memory.WriteArray(bands)
    gdal.GetDriverByName("PNG").CreateCopy(str(file), memory)
    pathlib.Path(f"{file}.aux.xml").unlink(missing_ok=True)


# --- Ellipsoid and camera --------------------------------------------------------------------------------------------


class Ellipsoid:
    def __init__(self, a, b):
        self.a, self.b = a, b
        self.e2 = 1.0 - (b / a) ** 2

    def ecef(self, lat, lon, height):
        """Earth-centred position of places in degrees and metres; the last axis is x, y, z."""
        phi, lam = np.radians(lat), np.radians(lon)
        n = self.a / np.sqrt(1.0 - self.e2 * np.sin(phi) ** 2)
        return np.stack([(n + height) * np.cos(phi) * np.cos(lam), (n + height) * np.cos(phi) * np.sin(lam),
                         (n * (1.0 - self.e2) + height) * np.sin(phi)], axis=-1)

    def hit_distance(self, eye, rays):
        """How far along unit rays from an eye outside the ellipsoid is met; NaN where it is not."""
        scale = np.array([self.a, self.a, self.b])
        o, d = eye / scale, rays / scale
        aa, bb, cc = np.sum(d * d, axis=-1), np.sum(o * d, axis=-1), np.sum(o * o) - 1.0
        with np.errstate(invalid="ignore"):
            root = np.sqrt(bb * bb - aa * cc)
            return np.where(bb < 0.0, cc / (root - bb), np.nan)  # the form of the quadratic's root without cancellation


EARTH = Ellipsoid(6378137.0, 6378137.0 * (1.0 - 1.0 / 298.257223563))


class Camera:
    """The contract's CAM: lat, lon, height[, heading[, pitch[, roll]]] with square pixels."""

    def __init__(self, ellipsoid, pose, size, vfov=45.0):
        lat, lon, height, heading, pitch, roll = (*pose, *(0.0, -90.0, 0.0)[len(pose) - 3:])
        phi, lam, h, p, r = np.radians([lat, lon, heading, pitch, roll])
        east = np.array([-np.sin(lam), np.cos(lam), 0.0])
        north = np.array([-np.sin(phi) * np.cos(lam), -np.sin(phi) * np.sin(lam), np.cos(phi)])
        up = np.cross(east, north)
        ahead = np.sin(h) * east + np.cos(h) * north
        side = np.cross(ahead, up)
        self.forward = np.cos(p) * ahead + np.sin(p) * up
        level_up = np.cross(side, self.forward)
        self.right = np.cos(r) * side - np.sin(r) * level_up
        self.up = np.cos(r) * level_up + np.sin(r) * side
        self.eye = ellipsoid.ecef(lat, lon, height)
        self.width, self.height = size
        self.pixel_angle = 2.0 * np.tan(np.radians(vfov) / 2.0) / self.height

    def rays(self, x, y):
        """Unit rays through points of the picture; (0.5, 0.5) is the middle of the pixel at the top left."""
        x, y = np.asarray(x, float)[..., None], np.asarray(y, float)[..., None]
        ray = (self.forward + (x - self.width / 2.0) * self.pixel_angle * self.right
               - (y - self.height / 2.0) * self.pixel_angle * self.up)
        return ray / np.linalg.norm(ray, axis=-1, keepdims=True)

    def pixel_rays(self):
        x, y = np.meshgrid(np.arange(self.width) + 0.5, np.arange(self.height) + 0.5)
        return self.rays(x, y)


def angle_between(u, v):
    """Radians; right for small angles too."""
    return np.arctan2(np.linalg.norm(np.cross(u, v), axis=-1), np.sum(u * v, axis=-1))


def grown(mask, by):
    """`mask` with `by` pixels more on every side."""
    padded = np.pad(mask, by)
    height, width = mask.shape
    result = np.zeros_like(mask)
    for dy in range(2 * by + 1):
        for dx in range(2 * by + 1):
            result |= padded[dy:dy + height, dx:dx + width]
    return result


# --- Rasters ---------------------------------------------------------------------------------------------------------


class GeographicRaster:
    """A raster in longitude and latitude, looked up as GDAL does: samples at pixel centres, bilinear between."""

    def __init__(self, path, band=1):
        data = gdal.Open(str(path))
        self.values = data.GetRasterBand(band).ReadAsArray().astype(float)
        no_data = data.GetRasterBand(band).GetNoDataValue()
        if no_data is not None:
            self.values[self.values == no_data] = np.nan
        self.west, self.dlon, _, self.north, _, self.dlat = data.GetGeoTransform()
        self.wraps = abs(self.values.shape[1] * self.dlon - 360.0) < 1e-6

    def _corners(self, lat, lon):
        """The four samples round places, NaN where there is none, and their weights; then samples beyond the border."""
        x = np.asarray(lon, float) - self.west
        x = (np.mod(x, 360.0) if self.wraps else np.mod(x + 180.0, 360.0) - 180.0) / self.dlon - 0.5
        y = (np.asarray(lat, float) - self.north) / self.dlat - 0.5
        height, width = self.values.shape
        beyond = np.maximum(-y, y - (height - 1))
        if not self.wraps:
            beyond = np.maximum(beyond, np.maximum(-x, x - (width - 1)))
        known = np.isfinite(x) & np.isfinite(y)
        x, y = np.where(known, x, 0.0), np.where(known, y, 0.0)
        y = np.where(np.abs(beyond) < 1e-9, np.clip(y, 0, height - 1), y)  # a row on a pole, but for rounding
        column, row = np.floor(x).astype(int), np.minimum(np.floor(y).astype(int), height - 2 + (y > height - 1))
        u, v = x - column, y - row
        samples, weights = [], []
        for dy, wy in ((0, 1 - v), (1, v)):
            for dx, wx in ((0, 1 - u), (1, u)):
                i, j = row + dy, column + dx
                inside = known & (i >= 0) & (i < height)
                if self.wraps:
                    j = j % width
                inside &= (j >= 0) & (j < width)
                samples.append(np.where(inside, self.values[np.where(inside, i, 0), np.where(inside, j, 0)], np.nan))
                weights.append(wx * wy)
        return np.array(samples), np.array(weights), beyond

    def bilinear(self, lat, lon):
        """NaN where one of the four samples is missing, by no-data or because the raster ends."""
        samples, weights, _ = self._corners(lat, lon)
        return np.sum(samples * weights, axis=0)

    def absent(self, lat, lon):
        """Whether the raster has nothing to say there: outside by more than two samples."""
        return self._corners(lat, lon)[2] > 2.0


def elevation(rasters, lat, lon):
    """Height of rasters laid over one another, the last on top: bilinear, 0 outside of all. NaN, which means that there is no
    telling, where the topmost raster has a void among the four samples or ends within two samples."""
    result = np.zeros_like(np.asarray(lat, float))
    for raster in rasters:
        result = np.where(raster.absent(lat, lon), result, raster.bilinear(lat, lon))
    return np.where(np.isnan(lat), np.nan, result)
