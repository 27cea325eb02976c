#!/usr/bin/python3
"""Writes the rasters of the default world, data/earth/*.tif, from their published originals.

usage: tools/make_default_world.py ORIGINALS [OUT]

ORIGINALS is a folder that holds, at any depth, under either name:
  etopo5.cdf             or etopo5.tif              (Debian package ferret-datasets)
  earth-blue-marble.jpg  or blue_marble_4096.jpg    (npm package three-globe)
  earth-night.jpg        or night_lights_4096.jpg   (the same)
  earth-water.png        or water_mask_1600.png     (the same)
OUT is data/earth by default. To get the originals:
  mkdir originals && cd originals
  apt-get download ferret-datasets && dpkg -x ferret-datasets_*.deb .
  npm pack three-globe && tar xzf three-globe-*.tgz

Needs GDAL's Python module and numpy (Debian: python3-gdal, python3-numpy). Same originals and libraries, same bytes.
"""

import pathlib
import sys
import tempfile

import numpy as np
from osgeo import gdal

gdal.UseExceptions()
gdal.PushErrorHandler("CPLQuietErrorHandler")
gdal.SetConfigOption("GDAL_PAM_ENABLED", "NO")

COG = ["BLOCKSIZE=256", "OVERVIEW_RESAMPLING=AVERAGE", "NUM_THREADS=2"]


def find(folder, *names):
    for name in names:
        found = sorted(folder.rglob(name))
        if found:
            return str(found[0])
    sys.exit(f"make_default_world.py: {folder} holds none of: {', '.join(names)}")


def etopo5_samples(path):
    """The 2161 x 4320 samples, row 0 at the north pole, column 0 at 180 degrees west."""
    if path.endswith(".cdf"):
        dataset = gdal.Open(f'NETCDF:"{path}":ROSE')
        samples = dataset.ReadAsArray()  # turned north up by the driver
        longitude = gdal.Open(f'NETCDF:"{path}":ROSE').GetGeoTransform()[0]
        first = longitude + 1 / 24  # centre of column 0
        columns_to_west = round(((-180 - first) % 360) * 12)
        samples = np.roll(samples, -columns_to_west, axis=1)
    else:
        samples = gdal.Open(path).ReadAsArray()
    whole = samples.astype(np.int16)
    assert whole.shape == (2161, 4320) and (whole == samples).all()
    # A pole is one place: its whole row has one height, 2810 m of ice in the south and 4290 m of sea in the north.
    assert (whole[0] == -4290).all() and (whole[-1] == 2810).all()
    return whole


def area_means(samples, height, width):
    """Means over the cells that divide the raster's area into height x width, cells cutting through samples included."""

    def along_rows(grid, cells):
        rows = grid.shape[0]
        sums = np.vstack([np.zeros((1, grid.shape[1])), np.cumsum(grid, axis=0)])
        edges = np.arange(cells + 1) * rows / cells
        whole = np.minimum(edges.astype(int), rows - 1)
        return np.diff(sums[whole] + (edges - whole)[:, None] * grid[whole], axis=0) * cells / rows

    return along_rows(along_rows(samples.astype(np.float64), height).T, width).T


def write_elevation(original, out):
    samples = etopo5_samples(original)
    rows, columns = samples.shape
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/elevation.tif"
        dataset = gdal.GetDriverByName("GTiff").Create(path, columns, rows, 1, gdal.GDT_Int16, ["TILED=YES"])
        # Samples are points: the first lies on the corner 90 N 180 W, so the outermost pixels reach half a pixel beyond.
        dataset.SetGeoTransform((-180 - 1 / 24, 1 / 12, 0, 90 + 1 / 24, 0, -1 / 12))
        dataset.SetProjection("EPSG:4326")
        dataset.SetMetadataItem("AREA_OR_POINT", "Point")
        dataset.GetRasterBand(1).SetUnitType("m")
        dataset.GetRasterBand(1).WriteArray(samples)
        # Overviews span the same area as the raster. Its 2161 rows divide into no even number of rows, so that GDAL's
        # own averages would be shifted against it by up to a sample at each further level: computed here. They begin
        # at a quarter: one of a half would add 2.5 MB, and saves little against reading the raster itself.
        dataset.BuildOverviews("NONE", [4, 8, 16, 32])
        for index in range(4):
            overview = dataset.GetRasterBand(1).GetOverview(index)
            means = area_means(samples, overview.YSize, overview.XSize)
            overview.WriteArray(np.rint(means).astype(np.int16))
        dataset = None
        options = COG + ["COMPRESS=DEFLATE", "LEVEL=12", "PREDICTOR=2", "OVERVIEWS=AUTO"]
        gdal.Translate(str(out / "elevation.tif"), path, format="COG", creationOptions=options)

    written = gdal.Open(str(out / "elevation.tif"))
    band = written.GetRasterBand(1)
    assert (band.ReadAsArray() == samples).all()
    assert written.GetMetadataItem("AREA_OR_POINT") == "Point"
    assert np.allclose(written.GetGeoTransform(), (-180 - 1 / 24, 1 / 12, 0, 90 + 1 / 24, 0, -1 / 12), atol=1e-12)
    assert band.GetOverviewCount() == 4
    for index in range(4):
        overview = band.GetOverview(index)
        means = area_means(samples, overview.YSize, overview.XSize)
        assert np.abs(overview.ReadAsArray() - means).max() < 0.51


def write_image(original, out, name, *, bands, options):
    bare = gdal.Translate("", original, format="MEM", bandList=bands,
                          outputSRS="EPSG:4326", outputBounds=(-180, 90, 180, -90))
    # Metadata of the pictures (EXIF) says nothing about the world: left behind.
    for domain in bare.GetMetadataDomainList() or []:
        bare.SetMetadata({}, domain)
    if len(bands) == 1:
        bare.GetRasterBand(1).SetColorInterpretation(gdal.GCI_GrayIndex)
    gdal.Translate(str(out / name), bare, format="COG", creationOptions=COG + options)


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    originals = pathlib.Path(sys.argv[1])
    out = pathlib.Path(sys.argv[2]) if len(sys.argv) == 3 else pathlib.Path(__file__).parents[1] / "data/earth"
    out.mkdir(parents=True, exist_ok=True)

    write_elevation(find(originals, "etopo5.cdf", "etopo5.tif"), out)
    jpeg = ["COMPRESS=JPEG", "QUALITY=85"]
    write_image(find(originals, "earth-blue-marble.jpg", "blue_marble_4096.jpg"), out, "blue_marble.tif",
                bands=[1, 2, 3], options=jpeg)
    write_image(find(originals, "earth-night.jpg", "night_lights_4096.jpg"), out, "night_lights.tif",
                bands=[1, 2, 3], options=jpeg)
    # A grey picture in three equal bands.
    write_image(find(originals, "earth-water.png", "water_mask_1600.png"), out, "water_mask.tif",
                bands=[1], options=["COMPRESS=DEFLATE", "LEVEL=12", "PREDICTOR=YES"])
    for path in sorted(out.glob("*.tif")):
        print(f"{path.stat().st_size:>9}  {path}")


if __name__ == "__main__":
    main()
