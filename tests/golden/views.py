# label: slow
# timeout: 900
"""Pictures of real places, compared with ones that somebody has looked at.

    views.py                    compares all views with expected/<name>.png
    views.py --update [NAME..]  writes these (all, or those named): look at each before it is committed, and say in the
                                commit why it changed

A view passes when at most 0.1 % of its pixels differ by more than 5/255 in a channel. What fails is kept in
the build folder, in golden/: the picture, and the differences (grey, eightfold; red: beyond the limit).
"""
import pathlib
import sys
import tempfile
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "e2e"))
from _common import (ARCTIC, BLUE_MARBLE, ETOPO5, EVEREST, PROGRAM, RAINIER, Case, read_picture, write_picture)  # noqa: E402

LARGEST_DIFFERENCE = 5
SHARE_BEYOND = 0.001
EXPECTED = pathlib.Path(__file__).resolve().parent / "expected"
KEPT = pathlib.Path(PROGRAM).parent.parent / "golden"
OPTIONS = ["--size", "480x270", "--workers", 2]

EARTH = [("height", ETOPO5), ("color", BLUE_MARBLE)]
MOUNTAINS = [("height", ETOPO5), ("height", EVEREST), ("height", RAINIER), ("color", BLUE_MARBLE)]
MARS = [("height", "mars/mola_4ppd.tif"), ("color", "mars/mars_color_4096x2048.jpg")]
MOON = [("height", "moon/lola_ldem4_4ppd_scale0.5.tif"), ("color", "moon/moon_4k.jpg")]
POLAR = [("height", ETOPO5), ("height", ARCTIC), ("color", BLUE_MARBLE)]
OVERLAPPING = [*EARTH, ("color", "earth/regional/mosaic_cog1.tif"), ("color", "earth/regional/mosaic_cog2.tif")]
LIGHTS = [*EARTH, ("night", "earth/imagery/night_lights_4096.jpg"), ("water", "earth/imagery/water_mask_1600.png")]
CLOUDS = [*EARTH, ("grayscale", "earth/imagery/water_mask_1600.png", {}, {"opacity": 0.3}), ("overlay", "earth/imagery/clouds_4096.png")]
CITY = [*EARTH, ("color", "earth/regional/boston-inset.tif")]

# name: layers, camera, more options
VIEWS = {
    "space": (EARTH, (20.0, 10.0, 1.2e7), ["--time", "2024-06-20T10:00:00Z"]),
    "terminator": (EARTH, (10.0, 80.0, 1.5e7), ["--time", "2024-12-21T12:30:00Z"]),
    "alps_high": (EARTH, (43.0, 9.0, 500e3, 0.0, -45.0), []),
    "alps_middle": (EARTH, (44.5, 7.0, 60e3, 30.0, -25.0), []),
    "alps_low": (EARTH, (45.5, 8.2, 9e3, 340.0, -8.0), []),
    "north_pole": (EARTH, (89.9, 0.0, 1.5e6, 20.0, -60.0), []),
    "south_pole": (EARTH, (-89.9, 0.0, 1.5e6, 20.0, -60.0), []),
    "antimeridian": (EARTH, (-17.0, 179.9, 900e3, 0.0, -75.0), []),
    "mars": (MARS, (8.0, -134.0, 500e3, 0.0, -35.0), []),
    "moon": (MOON, (-43.0, -11.0, 600e3, 180.0, -50.0), []),
    "polar_stereographic": (POLAR, (68.0, -45.0, 900e3, 15.0, -50.0), []),
    "two_overlapping_rasters": (OVERLAPPING, (46.0, -73.7, 420e3), ["--no-lighting"]),
    "utm_inset": (CITY, (42.0, -71.1, 60e3, 0.0, -55.0), []),
    "exaggeration": (EARTH, (22.0, 84.0, 600e3, 0.0, -25.0), ["--exaggeration", 20]),
    "night": (LIGHTS, (35.0, 10.0, 6e6), ["--time", "2024-12-21T17:00:00Z"]),
    "sun_in_the_sea": (LIGHTS, (5.0, -30.0, 1.2e7), ["--time", "2024-06-20T13:30:00Z"]),
    "brightness_and_overlay": (CLOUDS, (20.0, 60.0, 9e6), ["--time", "2024-03-20T03:00:00Z"]),
    "sunset_in_the_sea": (LIGHTS, (38.0, 15.0, 60e3, 290.0, -12.0), ["--time", "2024-06-20T17:40:00Z"]),
    "wireframe": (MOUNTAINS, (46.70, -121.76, 6500, 0, -10), ["--wireframe"]),
    "rainier": (MOUNTAINS, (46.70, -121.76, 6500, 0, -10), []),
    "rainier_plain": (MOUNTAINS, (46.95, -121.95, 9000, 135, -30), ["--no-lighting", "--no-atmosphere", "--clear", "404040"]),
    "everest": (MOUNTAINS, (27.75, 86.75, 8800, 35, -12), ["--time", "2024-03-20T03:00:00Z"]),
    "tile_borders": (MOUNTAINS, (46.0, -121.76, 60e3, 0, -35), ["--tile-borders", "--bounds"]),
}


def differences(expected, actual):
    """Largest of the channels' differences, a number a pixel."""
    return np.abs(expected.astype(int) - actual.astype(int)).max(axis=-1)


def passes(difference):
    return np.mean(difference > LARGEST_DIFFERENCE) <= SHARE_BEYOND


class Views(Case):
    def draw(self, name):
        layers, camera, options = VIEWS[name]
        planet = {id(MARS): "Mars", id(MOON): "Moon"}.get(id(layers), "Earth")
        return self.render(self.world(name, *layers, planet=planet), camera, *OPTIONS, *options, name=name)

    def test_every_view_is_as_it_was(self):
        for name in VIEWS:
            with self.subTest(name):
                actual, expected = read_picture(self.draw(name)), read_picture(EXPECTED / f"{name}.png")
                self.assertEqual(actual.shape, expected.shape)
                difference = differences(expected, actual)
                if not passes(difference):
                    KEPT.mkdir(exist_ok=True)
                    write_picture(KEPT / f"{name}_actual.png", actual)
                    grey = np.repeat(np.minimum(255, 8 * difference)[..., None], 3, axis=-1)
                    grey[difference > LARGEST_DIFFERENCE] = (255, 0, 0)
                    write_picture(KEPT / f"{name}_difference.png", grey)
                    beyond = np.mean(difference > LARGEST_DIFFERENCE)
                    self.fail(f"{beyond:.3%} of the pixels differ by more than {LARGEST_DIFFERENCE}/255, the most by "
                              f"{difference.max()}/255; see {KEPT}/{name}_*.png and {EXPECTED}/{name}.png")

    def test_every_expected_picture_is_of_a_view(self):
        self.assertEqual({file.stem for file in EXPECTED.glob("*.png")}, set(VIEWS))

    def test_the_comparison_itself_finds_a_moved_and_a_darker_picture(self):
        expected = read_picture(EXPECTED / "rainier.png")
        self.assertTrue(passes(differences(expected, expected)))
        self.assertFalse(passes(differences(expected, np.roll(expected, 1, axis=1))))
        self.assertFalse(passes(differences(expected, (0.93 * expected).astype(np.uint8))))


def update(names):
    EXPECTED.mkdir(exist_ok=True)
    case = Views()
    Views.setUpClass()
    for name in names or VIEWS:
        pixels = read_picture(case.draw(name))
        write_picture(EXPECTED / f"{name}.png", pixels)
        print(EXPECTED / f"{name}.png")
    Views.tearDownClass()


if __name__ == "__main__":
    if "--update" in sys.argv:
        update(sys.argv[sys.argv.index("--update") + 1:])
    else:
        unittest.main()
