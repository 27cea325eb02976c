"""No seam shows: over the borders of tiles, faces and maps, at the poles, and where two data sets of equal fineness meet."""
# label: slow
# timeout: 600
import json
import subprocess
import unittest

import numpy as np

from osgeo import gdal

from _common import BLUE_MARBLE, EARTH, ETOPO5, Camera, Case, Ellipsoid, GeographicRaster, read_geo, read_picture, shared

SIZE = (480, 300)
BARE = ("--size", "{}x{}".format(*SIZE), "--no-atmosphere", "--no-lighting")
VIEWS = {"face border": (1.0, 45.0, 1.2e6, 20.0, -80.0), "face corner": (35.2644, 45.0, 1.2e6, 10.0, -75.0),
         "antimeridian": (65.0, 179.9, 9e5, 0.0, -75.0), "north pole": (89.9, 30.0, 1.5e6, 20.0, -75.0),
         "south pole": (-89.9, 30.0, 1.5e6, 20.0, -75.0), "tiles": (40.0, 0.1, 1.2e6, 15.0, -80.0)}
UNIT = Ellipsoid(1.0, 1.0)
CUT = 9.84375  # degrees east: through the Alps; a whole number of blocks of eight texels from the map's border


def face_cells(lat, lon, level):
    """A number for the tile of `level` of the cube over the normals at each place (src/geo/tile_key.h), NaN without a place."""
    phi, lam = np.radians(lat), np.radians(lon)
    normal = np.stack([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)], axis=-1)
    axis = np.argmax(np.abs(np.nan_to_num(normal)), axis=-1)
    out = np.take_along_axis(normal, axis[..., None], axis=-1)[..., 0]
    cell = 2 * axis + (out > 0)
    for step in (1, 2):
        side = np.take_along_axis(normal, ((axis + step) % 3)[..., None], axis=-1)[..., 0] / np.abs(out)
        place = np.floor((np.arctan(side) / (np.pi / 4) + 1.0) / 2.0 * 2 ** level)
        cell = cell * 2 ** level + np.clip(place, 0, 2 ** level - 1)
    return np.where(np.isnan(lat), np.nan, cell)


def steps(values):
    """Differences to the right and downwards, flat; last axis: channels, if there are any."""
    return np.concatenate([(values[:, 1:] - values[:, :-1]).reshape(-1, *values.shape[2:]),
                           (values[1:] - values[:-1]).reshape(-1, *values.shape[2:])])


def crosses(cell):
    """For each of `steps`, whether it goes from one cell to another."""
    return steps(cell) != 0.0


class Seams(Case):
    def show(self, world, pose, name, *options):
        geo = self.folder / "geo.tif"
        picture = read_picture(self.render(world, pose, *BARE, "--geo", geo, *options, name=name)).astype(float)
        return picture, *read_geo(geo)

    def figures(self, found, expected, crossing):
        """Mean and 99 % quantile of what each step has beyond the expected one's, over the border and elsewhere."""
        beyond = np.abs(steps(found) - steps(expected))
        beyond = beyond.mean(axis=-1) if beyond.ndim > 1 else beyond
        known = np.isfinite(beyond)
        self.assertGreater((crossing & known).sum(), 100, "the border is in the picture")
        return [figure for where in (crossing & known, ~crossing & known) for figure in (beyond[where].mean(), np.quantile(beyond[where], 0.99))]

    def assert_no_seam(self, name, figures, unit, floor, contrast=1.0):
        """`contrast`: how much larger the data's own steps are over the border than elsewhere; resampling errs in proportion to them."""
        print(f"{name}: steps over the border {figures[0]:.3f} {unit}, 99 % {figures[1]:.2f}; elsewhere {figures[2]:.3f}, {figures[3]:.2f}; own contrast {contrast:.2f}")
        self.assertLess(figures[0], 1.25 * max(contrast, 1.0) * figures[2] + floor, name)
        self.assertLess(figures[1], 1.25 * figures[3] + 4 * floor, name)

    def smooth(self):
        """A picture of the whole Earth that is smooth everywhere, also over the poles and the antimeridian."""
        file = self.folder / "smooth.tif"
        if not file.exists():
            lat, lon = np.meshgrid(90 - (np.arange(2048) + 0.5) * 180 / 2048, -180 + (np.arange(4096) + 0.5) * 360 / 4096, indexing="ij")
            place = UNIT.ecef(lat, lon, 0.0)
            data = gdal.GetDriverByName("GTiff").Create(str(file), 4096, 2048, 3, gdal.GDT_Byte, ["TILED=YES", "COMPRESS=DEFLATE"])
            data.SetGeoTransform((-180, 360 / 4096, 0, 90, 0, -180 / 2048))
            data.SetProjection('GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]')
            for band in range(3):
                data.GetRasterBand(band + 1).WriteArray(np.round(128 + 100 * np.sin(20 * place[..., band]) * np.cos(15 * place[..., (band + 1) % 3])).astype(np.uint8))
        return file

    def test_colours_of_one_raster(self):
        for content, file in (("smooth", self.smooth()), ("marble", shared(BLUE_MARBLE))):
            bands = [GeographicRaster(file, band) for band in (1, 2, 3)]
            world = self.world(content, ("color", BLUE_MARBLE, {"path": str(file)}))
            for name, pose in VIEWS.items():
                if content == "marble" and name.endswith("pole"):
                    continue  # its last column does not fit to its first there
                with self.subTest(name, content=content):
                    picture, lat, lon, *_ = self.show(world, pose, f"{name} {content}")
                    expected = np.stack([band.bilinear(lat, lon) for band in bands], axis=-1)
                    for kind, crossing in self.borders(name, lat, lon):
                        figures = self.figures(picture, expected, crossing)
                        own = np.abs(steps(expected)).mean(axis=-1)
                        contrast = np.nanmean(own[crossing]) / np.nanmean(own[~crossing])
                        self.assert_no_seam(f"{content}, {name}, {kind}", figures, "of 255", 0.1, contrast)
                        # The check itself: one side brighter by 4 of 255 is told.
                        side = np.zeros(SIZE[::-1])
                        side[:, SIZE[0] // 2:] = 4.0
                        planted = self.figures(expected + side[..., None], expected, crosses(side))
                        self.assertGreater(planted[0], 1.25 * figures[2] + 0.1)

    def borders(self, name, lat, lon):
        """Kinds of borders in a view: a name and the steps that cross one."""
        if name in ("face border", "face corner"):
            yield "faces", crosses(face_cells(lat, lon, 0))
        if name == "antimeridian":
            yield "map", crosses(np.sign(lon)) & (np.abs(steps(lon)) > 180.0)
        if name.endswith("pole"):
            yield "map", crosses(np.sign(lon)) & (np.abs(steps(lon)) > 180.0)
            near = (np.abs(lat) > 89.5).astype(float)
            yield "pole", np.concatenate([((near[:, 1:] + near[:, :-1]) > 0).ravel(), ((near[1:] + near[:-1]) > 0).ravel()])
        yield "tiles", crosses(face_cells(lat, lon, 4))

    def test_heights_of_one_raster(self):
        """Meshes are as coarse as `--sse` allows, on either side of a border; a step over it is not larger than that."""
        raster = GeographicRaster(shared(ETOPO5))
        world = self.world("heights", ("height", ETOPO5))
        for name, pose in VIEWS.items():
            for sse in (1.0, 0.2):
                with self.subTest(name, sse=sse):
                    _, lat, lon, height, distance = self.show(world, pose, f"{name} of heights", "--sse", sse)
                    pixel = distance * Camera(EARTH, pose, SIZE).pixel_angle
                    expected = raster.bilinear(lat, lon)
                    beyond = np.abs(steps(height - expected)) / np.concatenate([pixel[:, 1:].ravel(), pixel[1:].ravel()])
                    for kind, crossing in self.borders(name, lat, lon):
                        over, elsewhere = (beyond[where & np.isfinite(beyond)] for where in (crossing, ~crossing))
                        print(f"heights, {name}, {kind}, --sse {sse}: steps over the border {over.mean():.4f} pixels, at most {over.max():.3f}; elsewhere "
                              f"{elsewhere.mean():.4f}, {elsewhere.max():.3f}")
                        self.assertGreater(len(over), 100, "the border is in the picture")
                        self.assertLess(over.max(), sse)
                        self.assertLess(over.mean(), 0.15 * sse)

    # --- Two data sets ---------------------------------------------------------------------------------------------

    def cut(self, path, group, column, pieces=2):
        """A raster whole and in two, with overviews made alike; worlds of the whole, of two layers, of a catalogue."""
        folder = self.folder / group
        folder.mkdir(exist_ok=True)
        data = gdal.Open(str(shared(path)))
        width, height = data.RasterXSize, data.RasterYSize
        west, step, _, north, _, down = data.GetGeoTransform()
        files = {}
        for name, first, last in (("whole", 0, width), ("west", 0, column), ("east", column, width)):
            files[name] = folder / f"{name}.tif"
            edges = (west + first * step, north, west + last * step, north + height * down)
            subprocess.run(["gdal_translate", "-q", "-a_srs", "EPSG:4326", "-srcwin", *map(str, (first, 0, last - first, height)), "-a_ullr", *map(repr, edges),
                            "-co", "TILED=YES", str(shared(path)), str(files[name])], check=True)
            subprocess.run(["gdaladdo", "-q", "-r", "average", str(files[name]), "2", "4", "8"], check=True)
        of = lambda name: (group, path, {"path": str(files[name])})
        worlds = {"whole": self.world(f"{group}-whole", of("whole")), "layers": self.world(f"{group}-layers", of("west"), of("east"))}
        worlds["catalogue"] = self.folder / f"{group}-catalogue.toml"
        more = ', vertical = "ellipsoid"' if group == "height" else ""
        listed = json.dumps([str(files["west"]), str(files["east"])])
        worlds["catalogue"].write_text(f'[planet]\nname = "Earth"\n[[layer]]\ngroup = "{group}"\nsource = {{ type = "catalogue", files = {listed}{more} }}\n')
        return worlds

    def test_colours_of_two_data_sets(self):
        worlds = self.cut(BLUE_MARBLE, "color", 2160)
        for view, pose in (("near", (46.0, CUT, 8e5, 10.0, -80.0)), ("far", (30.0, CUT, 6e6, 10.0, -85.0))):
            whole, lat, lon, *_ = self.show(worlds["whole"], pose, f"whole {view}")
            crossing = crosses((lon > CUT).astype(float)) & (np.abs(steps(lon)) < 180.0)
            for name in ("layers", "catalogue"):
                with self.subTest(name, view=view):
                    picture = self.show(worlds[name], pose, f"{name} {view}")[0]
                    self.compare(f"{name}, {view}", picture, whole, crossing, "of 255", 0.5)

    def test_heights_of_two_data_sets(self):
        column = 2278
        raster = GeographicRaster(shared(ETOPO5))
        cut = raster.west + column * raster.dlon
        worlds = self.cut(ETOPO5, "height", column)
        pose = (46.0, cut, 6e5, 10.0, -80.0)
        _, lat, lon, whole, _ = self.show(worlds["whole"], pose, "whole heights", "--sse", 0.2)
        crossing = crosses((lon > cut).astype(float))
        for name in ("layers", "catalogue"):
            with self.subTest(name):
                height = self.show(worlds[name], pose, f"{name} heights", "--sse", 0.2)[3]
                self.compare(f"heights, {name}", height, whole, crossing, "m", 5.0)
        # The samples' own heights, across the border in steps of a tenth of a sample.
        lat = np.repeat(np.linspace(44.0, 48.0, 40), 41)
        lon = np.tile(cut + np.linspace(-2.0, 2.0, 41) * raster.dlon, 40)
        text = "".join(f"{a!r} {o!r}\n" for a, o in zip(map(float, lat), map(float, lon)))
        profiles = {name: np.array([float(line.split()[2]) for line in self.tellurion("height", world, text=text).stdout.splitlines()]).reshape(40, 41)
                    for name, world in worlds.items()}
        np.testing.assert_allclose(profiles["whole"].ravel(), raster.bilinear(lat, lon), atol=0.05)
        whole_steps = np.abs(np.diff(profiles["whole"], axis=1))
        for name in ("layers", "catalogue"):
            own = np.abs(np.diff(profiles[name], axis=1))
            print(f"profiles, {name}: steps mean {own.mean():.2f} m, at most {own.max():.1f}; of the whole {whole_steps.mean():.2f}, {whole_steps.max():.1f}")
            # Blended over one sample, so that there is no cliff; the blend adds to the slope of the ground.
            self.assertLess(own.mean(), 1.02 * whole_steps.mean())
            self.assertLess(own.max(), 1.5 * whole_steps.max())
        # The check itself: a step of a sample's difference at once is told.
        cliff = np.where(np.arange(41) < 20, profiles["whole"][:, 15:16], profiles["whole"][:, 25:26])
        self.assertGreater(np.abs(np.diff(cliff, axis=1)).max(), 1.5 * whole_steps.max())

    def compare(self, name, found, whole, crossing, unit, floor):
        """Steps over the border are no larger than those of the whole there, or than those elsewhere in the picture."""
        sizes = [np.abs(steps(values)) for values in (found, whole)]
        sizes = [size.mean(axis=-1) if size.ndim > 1 else size for size in sizes]
        known = np.isfinite(sizes[0]) & np.isfinite(sizes[1])
        self.assertGreater((crossing & known).sum(), 100, "the border is in the picture")
        own, of_whole, elsewhere = sizes[0][crossing & known], sizes[1][crossing & known], sizes[0][~crossing & known]
        apart = np.abs(found - whole)
        figures = [(values.mean(), np.quantile(values, 0.99)) for values in (own, of_whole, elsewhere)]
        print(f"{name}: steps over the border mean {figures[0][0]:.3f} {unit}, 99 % within {figures[0][1]:.2f}; of the whole {figures[1][0]:.3f}, "
              f"{figures[1][1]:.2f}; elsewhere {figures[2][0]:.3f}, {figures[2][1]:.2f}; pictures apart by {np.nanmean(apart):.3f}, at most {np.nanmax(apart):.1f}")
        self.assertLess(figures[0][0], 1.02 * max(figures[1][0], figures[2][0]) + 0.1 * floor, name)
        self.assertLess(figures[0][1], 1.02 * max(figures[1][1], figures[2][1]) + floor, name)


if __name__ == "__main__":
    unittest.main()
