"""tellurion bench: names, a cheap benchmark, the shape of its JSON. The figures themselves are in docs/PERFORMANCE.md."""
# timeout: 120
import json
import os
import unittest

from _common import Case


class Bench(Case):
    def listed(self, *names):
        return [line.split()[0] for line in self.tellurion("bench", *names, "--list").stdout.splitlines()]

    def test_the_list_names_every_figure_once(self):
        names = self.listed()
        self.assertEqual(len(names), len(set(names)))
        for name in ("frame.rainier.frame_ms", "cut.select.tiles_100", "rtin.time_ratio", "queries.bilinear", "poles.even.tiles_ratio",
                     "holes.views.finished", "truth.ground.x100.worst_px", "memory.flight.resident_mb", "tile.build_ms",
                     "scan.etopo5_s", "start.warm_s"):
            self.assertIn(name, names)

    def test_a_first_part_of_a_name_is_a_group(self):
        names = self.listed()
        self.assertEqual(self.listed("frame"), [name for name in names if name.startswith("frame.")])
        self.assertEqual(self.listed("truth.space", "rtin.time_ms"),
                         [name for name in names if name.startswith("truth.space.") or name == "rtin.time_ms"])

    def test_an_unknown_name_is_wrong_usage_and_gives_the_list(self):
        for name in ("teapot", "fram", "rtin.", "rtin.time_ms.x"):
            with self.subTest(name):
                done = self.tellurion("bench", "rtin.time_ms", name, status=2)
                self.assertIn(f'"{name}"', done.stderr)
                self.assertIn("frame.rainier.frame_ms", done.stderr)
                self.assertEqual(done.stdout, "")

    def test_json_has_the_figures_asked_for(self):
        file = self.folder / "bench.json"
        done = self.tellurion("bench", "rtin.time_ms", "--quick", "--json", file)
        figures = json.loads(file.read_text())
        self.assertEqual([figure["name"] for figure in figures], ["rtin.time_ms"])
        self.assertLessEqual({"name", "value", "unit", "goal", "note"}, set(figures[0]))
        self.assertGreater(figures[0]["value"], 0.0)
        self.assertEqual((figures[0]["unit"], figures[0]["goal"]), ("ms", None))
        self.assertIn("257x257", figures[0]["note"])
        self.assertIn("rtin.time_ms", done.stdout)
        with open("/proc/cpuinfo") as stream:
            model = next((line.split(": ")[1].strip() for line in stream if line.startswith("model name")), "")
        self.assertIn(model, done.stdout.splitlines()[0])

    def test_what_cannot_be_measured_says_why(self):
        file = self.folder / "bench.json"
        self.tellurion("bench", "truth.everest", "--data", self.folder, "--json", file)
        figures = json.loads(file.read_text())
        self.assertEqual(len(figures), 6)
        for figure in figures:
            self.assertIsNone(figure["value"])
            self.assertIn("not measured", figure["note"])
            self.assertIn("mt_everest_90m.tif", figure["note"])

    def test_a_file_that_cannot_be_written_is_a_failure(self):
        self.tellurion("bench", "rtin.time_ms", "--quick", "--json", self.folder / "no" / "bench.json", status=1)

    def test_nothing_stays_behind(self):
        scratch = self.folder / "scratch"
        scratch.mkdir()
        before = os.environ.get("TMPDIR")
        os.environ["TMPDIR"] = str(scratch)
        try:
            self.tellurion("bench", "rtin.time_ms", "--quick")
        finally:
            if before is None:
                del os.environ["TMPDIR"]
            else:
                os.environ["TMPDIR"] = before
        self.assertEqual(list(scratch.iterdir()), [])


if __name__ == "__main__":
    unittest.main()
