"""tellurion world: layers are listed, put into a world file and taken out, and the rest of the file stays; the guide's commands."""
import os
import re
import subprocess
import unittest
from pathlib import Path

from _common import BLUE_MARBLE, ETOPO5, PROGRAM, RAINIER, Case, shared

TEXT = """# My world.
[planet]
name = "Earth"

# The ground.
[[layer]]
group = "height"
name = "Ground"
source = { type = "gdal", path = "%s", vertical = "ellipsoid" }
"""


class World(Case):
    def begin(self, name):
        file = self.folder / name
        file.write_text(TEXT % shared(ETOPO5))
        return file

    def test_layers_come_and_go_and_the_rest_stays(self):
        file = self.begin("mine.toml")
        before = file.read_text()
        self.tellurion("world", "add", file, shared(BLUE_MARBLE), shared(RAINIER), "--opacity", 0.5)
        self.assertTrue(file.read_text().startswith(before))
        listed = self.tellurion("world", "list", file).stdout
        self.assertRegex(listed, r"1  height +Ground\n")
        self.assertRegex(listed, r"2  color +blue_marble_4096.jpg, opacity 0.5\n")
        self.tellurion("world", "add", file, shared(BLUE_MARBLE), "--name", "soft", "--feather", 40)
        self.assertRegex(self.tellurion("world", "list", file).stdout, r"color +soft, feather 40\n")
        self.tellurion("world", "remove", file, "soft")
        self.assertEqual(self.tellurion("world", "list", file).stdout, listed)
        self.assertRegex(listed, r"3  height +mt_rainier_90m.tif, opacity 0.5\n")
        self.tellurion("world", "remove", file, "2", "mt_rainier_90m.tif")
        self.assertEqual(file.read_text().rstrip(), before.rstrip())
        self.tellurion("info", file)

    def test_a_folder_is_a_catalogue_and_takes_files(self):
        tiles = self.folder / "tiles"
        tiles.mkdir()
        for column in range(4):
            subprocess.run(["gdal_translate", "-q", "-srcwin", str(1024 * column), "0", "1024", "2048", "-a_srs", "EPSG:4326", "-a_ullr", str(-180 + 90 * column), "90",
                            str(-90 + 90 * column), "-90", str(shared(BLUE_MARBLE)), str(tiles / f"{column}.tif")], check=True)
        moved = self.folder / "3.tif"
        (tiles / "3.tif").rename(moved)
        file = self.folder / "new.toml"
        self.tellurion("world", "add", file, tiles)
        self.assertRegex(self.tellurion("world", "list", file).stdout, r"1  color +tiles\n +catalogue ")
        self.assertIn('path = "tiles"', file.read_text().replace("'", '"'))
        self.assertRegex(self.tellurion("info", file).stdout, r"rasters +3, finer ones")
        self.tellurion("world", "add", file, moved, "--to", "tiles")
        told = self.tellurion("info", file).stdout
        self.assertRegex(told, r"rasters +4, finer ones")
        self.assertRegex(told, r"spacing +9783\.939 \.\. 9783\.939 m")
        self.tellurion("world", "remove", file, moved)
        self.assertRegex(self.tellurion("info", file).stdout, r"rasters +3, finer ones")

    def test_what_data_do_not_say_themselves(self):
        file = self.begin("said.toml")
        self.tellurion("world", "add", file, shared(RAINIER), "--vertical", "egm96", "--no-data=-32767")
        self.assertIn('vertical = "egm96"', file.read_text())
        self.assertRegex(file.read_text(), r"no_data = -32767(\.0)?\b")
        above_geoid = float(self.tellurion("height", file, text="46.8523 -121.7603\n").stdout.split()[2])
        above_ellipsoid = float(self.tellurion("height", shared(RAINIER), text="46.8523 -121.7603\n").stdout.split()[2])
        self.assertAlmostEqual(above_geoid - above_ellipsoid, -18.84, delta=0.02)  # as cs2cs from EPSG:4326+5773 to EPSG:4979 says

    def test_what_is_wrong_is_told_and_nothing_is_changed(self):
        file = self.begin("wrong.toml")
        before = file.read_text()
        bad = self.folder / "bad.tif"
        bad.write_text("no raster")
        for words, told in ((("add", file, bad), "bad.tif"), (("add", file, self.folder / "gone.tif"), "gone.tif"),
                            (("add", file, shared(BLUE_MARBLE), "--name", "Ground"), "another --name"),
                            (("add", file, shared(RAINIER), "--to", "Ground"), "no catalogue"),
                            (("add", file, shared(RAINIER), "--to", "Nothing"), "Nothing"),
                            (("remove", file, "Nothing"), "Nothing"), (("remove", file, "7"), "7"),
                            (("add", file, shared(BLUE_MARBLE), file), "wrong.toml"),
                            (("remove", self.folder / "none.toml", "1"), "none.toml"), (("list", self.folder / "none.toml"), "none.toml")):
            with self.subTest(words=words):
                self.assertIn(told, self.tellurion("world", *words, status=1).stderr)
                self.assertEqual(file.read_text(), before)
        self.assertFalse((self.folder / "none.toml").exists())
        self.assertIn("no group", self.tellurion("world", "add", file, shared(BLUE_MARBLE), "--group", "colour", status=2).stderr)


class Guide(Case):
    """The commands of docs/many-data-sets.md, in its order, with the shared data as `data`."""

    def test_the_commands_of_the_guide(self):
        guide = (Path(__file__).parents[2] / "docs/many-data-sets.md").read_text()
        (self.folder / "data").symlink_to(shared(".").resolve())
        commands = [line.strip() for block in re.findall(r"(?:^    .*\n)+", guide, re.M) for line in block.splitlines()]
        commands = [line for line in commands if re.match(r"(tellurion|gdal\w*|mkdir) ", line)]
        self.assertGreater(len(commands), 8)
        script = "set -e\ntellurion() { \"$PROGRAM\" \"$@\"; }\n" + "\n".join(commands)
        done = subprocess.run(["bash", "-c", script], cwd=self.folder, env=os.environ | {"PROGRAM": str(PROGRAM), "XDG_CACHE_HOME": str(self.folder / "cache")},
                              capture_output=True, text=True, timeout=250)
        self.assertEqual(done.returncode, 0, done.stderr[-2000:])
        self.assertTrue((self.folder / "mosaic.png").exists())


if __name__ == "__main__":
    unittest.main()
