"""What lies over what, and how much of it shows: pictures against GDAL's values, put over one another by numpy."""
# label: slow
# timeout: 600
import subprocess
import unittest

import numpy as np
from osgeo import gdal, osr

from _common import BLUE_MARBLE, Case, grown, read_geo, read_picture, shared, write_picture

SIZE = (480, 300)
MOSAIC = ("earth/regional/mosaic_cog1.tif", "earth/regional/mosaic_cog2.tif")


class ColourRaster:
    """One level of a raster of three bands as GDAL reads it, looked up at places: bilinear among the samples that are there."""

    def __init__(self, path, overview=None):
        data = gdal.Open(str(path))
        bands = [data.GetRasterBand(i) for i in (1, 2, 3)]
        levels = bands if overview is None else [band.GetOverview(overview) for band in bands]
        self.values = np.stack([level.ReadAsArray() for level in levels], axis=-1).astype(float)
        no_data = bands[0].GetNoDataValue()
        self.there = np.ones(self.values.shape[:2]) if no_data is None else (self.values != no_data).any(axis=-1).astype(float)
        geo = data.GetGeoTransform()
        self.west, self.north = geo[0], geo[3]
        self.dx, self.dy = geo[1] * data.RasterXSize / self.values.shape[1], geo[5] * data.RasterYSize / self.values.shape[0]
        places, own = osr.SpatialReference(), osr.SpatialReference(wkt=data.GetProjection())
        places.ImportFromEPSG(4326)
        for system in (places, own):
            system.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        self.wraps = bool(own.IsGeographic()) and abs(self.dx * self.values.shape[1] - 360.0) < 1e-6
        self.way = osr.CoordinateTransformation(places, own)

    def pixels(self, lat, lon):
        """Columns and rows, 0 at the middle of the first sample; NaN where there is no place."""
        known = np.isfinite(lat)
        x, y = np.full(lat.shape, np.nan), np.full(lat.shape, np.nan)
        points = np.array(self.way.TransformPoints(np.stack([lon[known], lat[known]], axis=1).tolist()))
        x[known], y[known] = (points[:, 0] - self.west) / self.dx - 0.5, (points[:, 1] - self.north) / self.dy - 0.5
        return x, y

    def corners(self, lat, lon):
        """The four samples round each place: values, whether they are there, bilinear weights; each with the four first."""
        x, y = self.pixels(lat, lon)
        known = np.isfinite(x)
        x, y = np.where(known, x, -9.0), np.where(known, y, -9.0)
        height, width = self.there.shape
        column, row = np.floor(x).astype(int), np.floor(y).astype(int)
        values, there, weights = [], [], []
        for j, wy in ((row, 1 - (y - row)), (row + 1, y - row)):
            for i, wx in ((column, 1 - (x - column)), (column + 1, x - column)):
                i = i % width if self.wraps else i
                inside = known & (i >= 0) & (i < width) & (j >= 0) & (j < height)
                i, j_ = np.where(inside, i, 0), np.where(inside, j, 0)
                values.append(self.values[j_, i])
                there.append(np.where(inside, self.there[j_, i], 0.0))
                weights.append(wx * wy)
        return np.array(values), np.array(there), np.array(weights)

    def over(self, lat, lon, below, opacity=1.0):
        """The picture with this raster over `below`; then where it is certain: no sample lacks among the nearest 5 x 5."""
        values, there, weights = self.corners(lat, lon)
        cover = np.sum(weights * there, axis=0)[..., None]
        colour = np.sum((weights * there)[..., None] * values, axis=0)
        return opacity * colour + (1.0 - opacity * cover) * below, self.certain(lat, lon)

    def certain(self, lat, lon):
        """Whether all samples within two of a place are there, or none."""
        around = grown(self.there == 0.0, 2) | self.border(2)
        absent = ~grown(self.there > 0.0, 2)
        x, y = self.pixels(lat, lon)
        height, width = self.there.shape
        i, j = np.round(np.nan_to_num(x, nan=-9.0)).astype(int), np.round(np.nan_to_num(y, nan=-9.0)).astype(int)
        far = (i < -2) | (j < -2) | (i >= width + 2) | (j >= height + 2)
        inside = (i >= 0) & (j >= 0) & (i < width) & (j < height)
        i, j = np.clip(i, 0, width - 1), np.clip(j, 0, height - 1)
        return far | (inside & (~around[j, i] | (absent[j, i] & ~self.border(2)[j, i])))

    def border(self, by):
        edge = np.ones(self.there.shape, bool)
        edge[by:-by, (slice(None) if self.wraps else slice(by, -by))] = False
        return edge


class CompositionTrue(Case):
    def show(self, world, pose, name, *options):
        geo = self.folder / "geo.tif"
        picture = read_picture(self.render(world, pose, "--size", "{}x{}".format(*SIZE), "--no-lighting", "--no-atmosphere", "--geo", geo, *options, name=name))
        lat, lon, *_ = read_geo(geo)
        return picture.astype(float), lat, lon

    def agreement(self, name, picture, expected, where):
        """Mean difference, and the share of the pixels whose channels all are within 4 of 255."""
        apart = np.abs(picture - expected)[where & np.isfinite(expected).all(axis=-1)]
        self.assertGreater(len(apart), 10000)
        mean, share = apart.mean(), np.mean(apart.max(axis=-1) <= 4.0)
        print(f"{name}: {len(apart)} pixels, mean {mean:.3f} of 255, {100 * share:.3f} % within 4, at most {apart.max():.0f}")
        if share < 0.98:
            write_picture(self.folder / f"{name}-expected.png", np.clip(np.nan_to_num(expected), 0, 255))
        return mean, share

    def scenes(self):
        """The two scenes of 16 bits with one scale of 8 for both; what has no data stays so."""
        files = []
        for path in MOSAIC:
            file = self.folder / path.split("/")[-1]
            if not file.exists():
                data = gdal.Open(str(shared(path)))
                made = gdal.GetDriverByName("GTiff").Create(str(file), data.RasterXSize, data.RasterYSize, 3, gdal.GDT_Byte, ["TILED=YES"])
                made.SetGeoTransform(data.GetGeoTransform())
                made.SetProjection(data.GetProjection())
                for band in (1, 2, 3):
                    values = data.GetRasterBand(band).ReadAsArray().astype(float)
                    made.GetRasterBand(band).WriteArray(np.where(values == 0, 0, np.clip(np.round((values - 6000.0) / 40.0), 1, 255)).astype(np.uint8))
                    made.GetRasterBand(band).SetNoDataValue(0)
                del made
                subprocess.run(["gdaladdo", "-q", "-r", "average", str(file), "2", "4"], check=True)
            files.append(file)
        return files

    def smooth(self, name, size, transform, system, waves):
        """A picture that has no detail near its pixels' size: so that nothing but weights, places and the order can be wrong. On longitude and
        latitude or in a projection; of the directions of its places."""
        file = self.folder / f"{name}.tif"
        data = gdal.GetDriverByName("GTiff").Create(str(file), *size, 3, gdal.GDT_Byte, ["TILED=YES"])
        data.SetGeoTransform(transform)
        own, places = osr.SpatialReference(), osr.SpatialReference()
        own.ImportFromEPSG(system)
        places.ImportFromEPSG(4326)
        for crs in (own, places):
            crs.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        data.SetProjection(own.ExportToWkt())
        x, y = np.meshgrid(transform[0] + (np.arange(size[0]) + 0.5) * transform[1], transform[3] + (np.arange(size[1]) + 0.5) * transform[5])
        points = np.radians(np.array(osr.CoordinateTransformation(own, places).TransformPoints(np.stack([x.ravel(), y.ravel()], axis=1).tolist()))[:, :2])
        lon, lat = points[:, 0].reshape(x.shape), points[:, 1].reshape(x.shape)
        place = (np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat))
        for band in range(3):
            value = 128 + 100 * np.sin(waves * place[band]) * np.cos(0.7 * waves * place[(band + 1) % 3])
            data.GetRasterBand(band + 1).WriteArray(np.round(value).astype(np.uint8))
        return file

    def test_the_lookup_is_gdals(self):
        file = self.scenes()[0]
        for overview in (None, 0):
            with self.subTest(overview=overview):
                warped = gdal.Warp("", str(file), format="MEM", dstSRS="EPSG:4326", outputBounds=(-75.5, 45.2, -73.5, 46.6), width=500, height=400, resampleAlg="bilinear",
                                   errorThreshold=0.0, overviewLevel="NONE" if overview is None else overview, warpOptions=["XSCALE=1", "YSCALE=1"])
                lat, lon = np.meshgrid(46.6 - (np.arange(400) + 0.5) * 1.4 / 400, -75.5 + (np.arange(500) + 0.5) * 2.0 / 500, indexing="ij")
                found, certain = ColourRaster(file, overview).over(lat, lon, np.zeros((400, 500, 3)))
                apart = np.abs(found - np.moveaxis(warped.ReadAsArray(), 0, -1))[certain]
                print(f"lookup, overview {overview}: {len(apart)} places, at most {apart.max():.2f} from gdalwarp")
                self.assertGreater(len(apart), 100000)
                self.assertLess(apart.max(), 0.6)  # it rounds

    def test_layers_of_any_opacity_over_one_another(self):
        """Three pictures in three projections, of which the upper two let through: the weights are those of the world file."""
        below = self.smooth("below", (2048, 1024), (-180, 360 / 2048, 0, 90, 0, -180 / 1024), 4326, 12)
        utm = self.smooth("utm", (600, 600), (200e3, 1000, 0, 5400e3, 0, -1000), 32618, 300)
        mercator = self.smooth("mercator", (500, 500), (-8.4e6, 1500, 0, 6.2e6, 0, -1500), 3857, 200)
        for first, second in ((1.0, 1.0), (0.3, 0.7), (0.8, 0.2)):
            world = self.world("three", ("color", BLUE_MARBLE, {"path": str(below)}), ("color", BLUE_MARBLE, {"path": str(utm)}, {"opacity": first}),
                               ("color", BLUE_MARBLE, {"path": str(mercator)}, {"opacity": second}))
            for ratio, wanted in ((0.5, 0.999), (0.95, 0.999), (1.8, 0.98)):
                with self.subTest(opacities=(first, second), ratio=ratio):
                    pose = (46.0, -74.0, ratio * 1000.0 * SIZE[1] / (2 * np.tan(np.radians(22.5))), 25.0)
                    picture, lat, lon = self.show(world, pose, f"three {first} {ratio}")
                    expected, certain = ColourRaster(below).over(lat, lon, np.zeros((*lat.shape, 3)))
                    for file, part in ((utm, first), (mercator, second)):
                        expected, here = ColourRaster(file).over(lat, lon, expected, part)
                        certain &= here
                    mean, share = self.agreement(f"three layers, opacities {first} and {second}, {ratio} source pixels a pixel", picture, expected, certain)
                    self.assertLess(mean, 1.0)
                    self.assertGreater(share, wanted)
                    # The check itself: an opacity that is off by 0.05 is told.
                    if first < 1.0:
                        wrong = ColourRaster(below).over(lat, lon, np.zeros((*lat.shape, 3)))[0]
                        for file, part in ((utm, first + 0.05), (mercator, second - 0.05)):
                            wrong = ColourRaster(file).over(lat, lon, wrong, part)[0]
                        self.assertLess(self.agreement("(planted)", picture, wrong, certain)[1], wanted)

    def test_a_polar_raster(self):
        polar = self.smooth("polar", (800, 800), (-2e6, 5000, 0, 2e6, 0, -5000), 3995, 40)
        world = self.world("polar", ("color", BLUE_MARBLE, {"path": str(polar)}))
        for name, place in (("pole", (89.9, 20.0)), ("beside", (86.0, 178.0))):
            for ratio, wanted in ((0.5, 0.999), (0.95, 0.999)):
                with self.subTest(name, ratio=ratio):
                    picture, lat, lon = self.show(world, (*place, ratio * 5000.0 * SIZE[1] / (2 * np.tan(np.radians(22.5))), 25.0), f"{name} {ratio}")
                    expected, certain = ColourRaster(polar).over(lat, lon, np.zeros((*lat.shape, 3)))
                    mean, share = self.agreement(f"polar raster, {name}, {ratio} source pixels a pixel", picture, expected, certain)
                    self.assertLess(mean, 1.0)
                    self.assertGreater(share, wanted)

    def test_two_scenes_over_one_another(self):
        """Scenes of a satellite differ from pixel to pixel, and what is drawn is resampled twice, to the tile and to the picture, which
        takes from the contrast of single pixels. Wanted are at most 1 of 255 and at least 99.9 % within 4; of these only the first is reached, at 0.5 source pixels
        a pixel. The other bounds see to it that nothing becomes worse."""
        files = self.scenes()
        marble = ColourRaster(shared(BLUE_MARBLE))
        for opacity in (1.0, 0.6):
            world = self.world(f"scenes-{opacity}", ("color", BLUE_MARBLE), ("color", BLUE_MARBLE, {"path": str(files[0])}),
                               ("color", BLUE_MARBLE, {"path": str(files[1])}, {"opacity": opacity}))
            for ratio, most, least in ((0.5, 1.0, 0.95), (0.9, 1.5, 0.86)):
                with self.subTest(opacity=opacity, ratio=ratio):
                    pose = (46.0, -73.7, ratio * 300.0 * SIZE[1] / (2 * np.tan(np.radians(22.5))))
                    picture, lat, lon = self.show(world, pose, f"scenes {opacity} {ratio}")
                    expected, certain = marble.over(lat, lon, np.zeros((*lat.shape, 3)))
                    for file, part in zip(files, (1.0, opacity)):
                        expected, here = ColourRaster(file).over(lat, lon, expected, part)
                        certain &= here
                    mean, share = self.agreement(f"two scenes, opacity {opacity}, {ratio} source pixels a pixel", picture, expected, certain)
                    self.assertLess(mean, most)
                    self.assertGreater(share, least)

    def test_no_halo_where_data_end(self):
        """At the edge of a scene, which is one of no data within the raster, every colour lies between those that meet there."""
        file = self.scenes()[0]
        raster, marble = ColourRaster(file), ColourRaster(shared(BLUE_MARBLE))
        world = self.world("edge", ("color", BLUE_MARBLE), ("color", BLUE_MARBLE, {"path": str(file)}))
        beside = self.world("beside", ("color", BLUE_MARBLE))
        for name, place in (("west", (46.0, -75.7)), ("north", (46.95, -74.4))):
            for ratio in (0.3, 0.9, 3.0):
                with self.subTest(name, ratio=ratio):
                    pose = (*place, ratio * 300.0 * SIZE[1] / (2 * np.tan(np.radians(22.5))))
                    picture, lat, lon = self.show(world, pose, f"edge {name} {ratio}")
                    below = self.show(beside, pose, "below")[0]
                    by = 2 + int(np.ceil(2 * ratio))
                    low, high = self.around(raster, lat, lon, below, by)
                    edge = ~raster.certain(lat, lon) & np.isfinite(lat)
                    beyond = np.maximum(low - picture, picture - high).max(axis=-1)[edge]
                    print(f"edge, {name}, {ratio} source pixels a pixel: {edge.sum()} pixels, beyond what meets there by at most {beyond.max():.0f} of 255")
                    self.assertGreater(edge.sum(), 100)
                    self.assertLessEqual(beyond.max(), 4.0)
                    # The check itself: black mixed in is told.
                    self.assertGreater(np.maximum(low - 0.5 * picture, 0.5 * picture - high).max(axis=-1)[edge].max(), 4.0)

    def around(self, raster, lat, lon, below, by):
        """The least and the greatest of the samples within `by` of each place that are there, and of what lies below."""
        x, y = raster.pixels(lat, lon)
        x, y = np.round(np.nan_to_num(x, nan=-99.0)).astype(int), np.round(np.nan_to_num(y, nan=-99.0)).astype(int)
        height, width = raster.there.shape
        low, high = below.copy(), below.copy()
        for dy in range(-by, by + 1):
            for dx in range(-by, by + 1):
                i, j = x + dx, y + dy
                inside = (i >= 0) & (j >= 0) & (i < width) & (j < height)
                i, j = np.where(inside, i, 0), np.where(inside, j, 0)
                there = (inside & (raster.there[j, i] > 0))[..., None]
                values = raster.values[j, i]
                low, high = np.where(there, np.minimum(low, values), low), np.where(there, np.maximum(high, values), high)
        return low, high


if __name__ == "__main__":
    unittest.main()
