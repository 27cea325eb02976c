#!/usr/bin/env python3
"""Tellurion beside CesiumJS and MapLibre GL JS: the same planet from the same tile server, the same cameras.

  bench/compare/run.py --tile-server tileserver.py --out results

The tile server is a program with the options --port, --cache, --static and --delay-ms that serves /imagery/{z}/{x}/{y}.jpg,
/terrain/{z}/{x}/{y}.webp and /cesium (512 pixels, terrain-RGB, heightmap-1.0), and counts: /stats, /reset.
Needs what `tools/setup.sh --bench` installs, and a built Tellurion. Nothing else should run meanwhile.

Writes results.json, results.md and a picture of each system in each scenario. Requests and bytes are the server's count.
Every system draws 1280x720 pixels with a vertical field of view of 45 degrees, without atmosphere, light, fog and sky.
"""
import argparse
import json
import os
import pathlib
import shutil
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import time
import urllib.request

from scenarios import FLIGHT_S, FRAMES_PER_SECOND, HEIGHT, MOUNTAIN, REST_S, SCENARIOS, VERTICAL_FOV, WIDTH, flight_rows

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
TIMED_FRAMES = 20           # as many as `tellurion render --stats` draws
IMAGERY_MAX = 17            # zooms: 0.6 m a pixel at the equator
TERRAIN_MAX = 12            # 19 m between heights, as the deepest tiles of the heightmap-1.0 that CesiumJS gets
SYSTEMS = {                 # name in the tables: (page or None for Tellurion, wanted error in pixels or None)
    "Tellurion --sse 1": (None, 1),
    "Tellurion --sse 2": (None, 2),
    "CesiumJS": ("cesium.html", None),
    "CesiumJS, error 1.33": ("cesium.html", 1.33),
    "MapLibre GL JS": ("maplibre.html", None),
}
DEFAULT_SYSTEMS = ["Tellurion --sse 1", "Tellurion --sse 2", "CesiumJS", "MapLibre GL JS"]


# --- The tile server -------------------------------------------------------------------------------------------------


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class TileServer:
    def __init__(self, program, cache, delay_ms):
        self.url = f"http://127.0.0.1:{free_port()}"
        command = [shutil.which("python3", path="/usr/bin") or "python3", program, "--port", self.url.rsplit(":", 1)[1],
                   "--cache", cache, "--static", HERE, "--delay-ms", delay_ms, "--max-seconds", 6 * 3600]
        self.process = subprocess.Popen(list(map(str, command)), stdout=subprocess.DEVNULL)

    def __enter__(self):
        for _ in range(100):
            try:
                self.stats()
                return self
            except OSError:
                if self.process.poll() is not None:
                    sys.exit(f"the tile server ended with status {self.process.returncode}")
                time.sleep(0.1)
        sys.exit("the tile server does not answer")

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()

    def get(self, path):
        with urllib.request.urlopen(self.url + path, timeout=60) as reply:
            return reply.read()

    def reset(self):
        self.get("/reset")

    def stats(self):
        return json.loads(self.get("/stats"))


def check_rows(server):
    """heightmap/layer.json counts the rows of /cesium from the north. A server that counts them from the south would give CesiumJS
    the heights of the other hemisphere: the highest mountain tells."""
    zoom = 10
    lat, lon = MOUNTAIN
    column, row = int((lon + 180) / 180 * 2 ** zoom), int((90 - lat) / 180 * 2 ** zoom)
    heights = struct.unpack("<4225H", server.get(f"/cesium/{zoom}/{column}/{row}.terrain")[:8450])
    highest = max(heights) / 5 - 1000
    if highest < 5000:
        sys.exit(f"the tile server's /cesium has {highest:.0f} m where a mountain of more than 5,000 m is: does it count rows from the south? "
                 'Then heightmap/layer.json must say "scheme": "tms"')


# --- Tellurion -------------------------------------------------------------------------------------------------------


def world_file(folder, server):
    file = folder / "world.toml"
    file.write_text(f"""[planet]
name = "Earth"

[[layer]]
group = "height"
source = {{ type = "xyz", url = "{server.url}/terrain/{{z}}/{{x}}/{{y}}.webp", encoding = "terrain-rgb", tile_size = 512, max_level = {TERRAIN_MAX}, vertical = "ellipsoid" }}

[[layer]]
group = "color"
source = {{ type = "xyz", url = "{server.url}/imagery/{{z}}/{{x}}/{{y}}.jpg", tile_size = 512, max_level = {IMAGERY_MAX} }}
""")
    return file


def flight_file(folder, scenario, hold_s):
    lines = ["time,lat,lon,height,heading,pitch,roll"]
    lines += [f"{time_s:.6f},{pose.text()},0" for time_s, pose in flight_rows(scenario, hold_s)]
    file = folder / "flight.csv"
    file.write_text("\n".join(lines) + "\n")
    return file


def run_tellurion(command, options):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=options.timeout + 600)
    if done.returncode not in (0, 3):  # 3: written, but not complete
        sys.exit(f"{' '.join(map(str, command))}\nended with status {done.returncode}:\n{done.stderr[-2000:]}")
    return [line for line in done.stderr.splitlines() if line]


def render(scenario, server, sse, picture, folder, options):
    """Stands still: one picture, then some frames of it."""
    stats = folder / "stats.json"
    complaints = run_tellurion(
        [options.tellurion, "render", world_file(folder, server), "--camera", scenario.pose.text(), "--out", picture or folder / "unwanted.png",
         "--stats", stats, "--timeout", options.timeout, *common_options(sse, folder)], options)
    figures = json.loads(stats.read_text())
    return {
        "complete_ms": figures["load_ms"] if figures["complete"] else None,
        "frame_ms_median": figures["frame_ms_median"], "frame_ms_worst": figures["frame_ms_max"],
        "resident_bytes": figures["resident_bytes"],
        "detail": {key: figures[key] for key in ("tiles_drawn", "tiles_drawn_by_level", "triangles", "max_error_px")},
        "complaints": complaints,
    }


def fly(scenario, server, sse, picture, folder, options):
    """The flight by the wall clock, and a stay until all is there; the figures are those of the trace."""
    trace = folder / "trace.csv"
    complaints = run_tellurion(
        [options.tellurion, "fly", world_file(folder, server), flight_file(folder, scenario, options.hold), "--realtime",
         "--fps", FRAMES_PER_SECOND, "--trace", trace, *common_options(sse, folder)], options)
    header, *lines = trace.read_text().splitlines()
    frames = [dict(zip(header.split(","), line.split(","))) for line in lines]
    arrival_s = REST_S + FLIGHT_S
    flown = [float(frame["frame_ms"]) for frame in frames if REST_S <= float(frame["time"]) <= arrival_s]
    late = [float(frame["time"]) for frame in frames if frame["complete"] == "0"]
    complete = frames[-1]["complete"] == "1"
    return {
        "complete_ms": 1e3 * max(late[-1] + 1 / FRAMES_PER_SECOND - arrival_s, 0) if complete else None,
        "frame_ms_median": statistics.median(flown), "frame_ms_worst": max(flown),
        "frames": len(flown), "resident_bytes": int(frames[-1]["resident_bytes"]),
        "detail": {key: frames[-1][key] for key in ("tiles_drawn", "triangles", "max_error_px")},
        "complaints": complaints,
    }


def common_options(sse, folder):
    return ["--size", f"{WIDTH}x{HEIGHT}", "--vfov", VERTICAL_FOV, "--sse", sse, "--no-atmosphere", "--no-lighting",
            "--disk-cache", folder / "cache"]


def measure_tellurion(scenario, server, sse, picture, options):
    with tempfile.TemporaryDirectory(prefix="tellurion-compare-") as name:
        folder = pathlib.Path(name)
        figures = (fly if scenario.start else render)(scenario, server, sse, picture, folder, options)
        counted = server.stats()
        if scenario.start and picture:  # fly has not written any: the same view once more, from the disk cache
            render(scenario, server, sse, picture, folder, options)
        return figures, counted


# --- The systems in the browser --------------------------------------------------------------------------------------


def measure_browser(scenario, server, page, sse, picture, options):
    job = {
        "url": f"{server.url}/static/{page}", "server": server.url, "width": WIDTH, "height": HEIGHT,
        "vertical_fov": VERTICAL_FOV, "imagery_max": IMAGERY_MAX, "terrain_max": TERRAIN_MAX, "sse": sse,
        "timeout_ms": 1000 * options.timeout, "timed_frames": TIMED_FRAMES, "pose": scenario.pose.numbers(), "ground": scenario.ground,
        "picture": str(picture) if picture else None,
    }
    if scenario.start:
        rows = [{"time": time_s, "pose": pose.numbers()} for time_s, pose in flight_rows(scenario, 0)]
        job |= {"rows": rows, "frames_per_second": FRAMES_PER_SECOND, "rest_s": REST_S}
    command = ["node", str(HERE / "browser.mjs"), options.chromium]
    done = subprocess.run(command, input=json.dumps(job), capture_output=True, text=True, timeout=options.timeout + 600)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)} ({page}, {scenario.name}):\n{done.stderr[-2000:]}")
    figures = json.loads(done.stdout)
    frames = figures.pop("frames")
    figures |= {"frame_ms_median": statistics.median(frames), "frame_ms_worst": max(frames), "frames": len(frames)}
    return figures, server.stats()


# --- Runs and reports ------------------------------------------------------------------------------------------------


def measure(system, scenario, server, picture, options):
    page, sse = SYSTEMS[system]
    server.reset()
    figures, counted = (measure_browser(scenario, server, page, sse, picture, options) if page
                        else measure_tellurion(scenario, server, sse, picture, options))
    figures |= {"requests": sum(counted["hits"].values()), "bytes": sum(counted["bytes"].values()),
                "requests_by_kind": counted["hits"], "bytes_by_kind": counted["bytes"], "tiles_made": counted["made"]}
    return figures


def median_of(runs):
    """Of each figure the median; None where a run was not complete."""
    keys = ("complete_ms", "frame_ms_median", "frame_ms_worst", "resident_bytes", "requests", "bytes")
    return {key: None if any(run[key] is None for run in runs) else statistics.median(run[key] for run in runs)
            for key in keys} | {"runs": runs}


def measure_all(options):
    results = []
    for scenario in options.scenarios:
        with TileServer(options.tile_server, options.cache, scenario.delay_ms) as server:
            check_rows(server)
            for system in options.systems:
                picture = options.out / f"{scenario.name}-{system.split()[0].lower()}{SYSTEMS[system][1] or ''}.png"
                measure(system, scenario, server, picture, options)  # fills the server's cache, and the driver's with shaders
                runs = [measure(system, scenario, server, None, options) for _ in range(options.runs)]
                results.append({"scenario": scenario.name, "system": system, "picture": picture.name} | median_of(runs))
                print(table_row(results[-1]), file=sys.stderr, flush=True)
                write(options, results)
    return results


def machine(results):
    processor = next(line.split(":", 1)[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name"))
    memory_gb = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    runs = [run for result in results for run in result["runs"]]
    driver = next((run["driver"] for run in runs if "driver" in run), "")
    browser = next((f"Chromium {run['browser']}" for run in runs if "browser" in run), "")
    return ", ".join(filter(None, [processor, f"{os.cpu_count()} cores", f"{memory_gb:.0f} GB", browser, driver]))


def versions():
    packages = json.loads((HERE / "package.json").read_text())["dependencies"]
    return f"cesium {packages['cesium']}, maplibre-gl {packages['maplibre-gl']}"


def table_row(result):
    def number(key, scale, digits):
        return "-" if result[key] is None else f"{result[key] * scale:.{digits}f}"
    complete = "not complete" if result["complete_ms"] is None else number("complete_ms", 1e-3, 2)
    return " | ".join(["| " + result["scenario"], result["system"], number("requests", 1, 0), number("bytes", 1e-6, 2), complete,
                       number("frame_ms_median", 1, 1), number("frame_ms_worst", 1, 1), number("resident_bytes", 1e-6, 0) + " |"])


def write(options, results):
    report = {"machine": machine(results), "versions": versions(), "runs": options.runs, "results": results}
    (options.out / "results.json").write_text(json.dumps(report, indent=1) + "\n")
    lines = [f"{report['machine']}; {report['versions']}; medians of {options.runs} runs.", "",
             "| scenario | system | requests | MB | complete s | frame ms | worst | memory MB |", "|---|---|---|---|---|---|---|---|"]
    (options.out / "results.md").write_text("\n".join(lines + [table_row(result) for result in results]) + "\n")


def chosen(text, all_of):
    names = [name.strip() for name in text.split(";")]
    unknown = [name for name in names if name not in all_of]
    if unknown:
        sys.exit(f"unknown: {'; '.join(unknown)}; there are {'; '.join(all_of)}")
    return names


def parse_options(about, browsers=True):
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    environment = os.environ.get
    parser.add_argument("--tile-server", default=environment("TELLURION_TILE_SERVER"), metavar="PROGRAM.py", help="or $TELLURION_TILE_SERVER")
    parser.add_argument("--cache", type=pathlib.Path, metavar="DIR", help="where the server keeps its tiles (default: tiles in --out)")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("compare-results"), metavar="DIR")
    parser.add_argument("--tellurion", default=environment("TELLURION", ROOT / "build/release/bin/tellurion"), metavar="PROGRAM")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--timeout", type=int, default=120, metavar="S", help="for a view to be complete (120)")
    if browsers:
        add_comparison(parser)
    options = parser.parse_args()
    if not options.tile_server:
        parser.error("--tile-server or $TELLURION_TILE_SERVER must name the tile server")
    if browsers:
        check_comparison(parser, options)
    options.out = options.out.resolve()
    options.cache = (options.cache or options.out / "tiles").resolve()
    options.out.mkdir(parents=True, exist_ok=True)
    return options


def add_comparison(parser):
    parser.add_argument("--chromium", default=shutil.which("chromium"), metavar="PROGRAM")
    parser.add_argument("--hold", type=float, default=20, metavar="S", help="how long Tellurion stays after a flight (20)")
    parser.add_argument("--systems", default=";".join(DEFAULT_SYSTEMS), help="some of: " + "; ".join(SYSTEMS))
    parser.add_argument("--scenarios", default=";".join(s.name for s in SCENARIOS), help="some of: " + "; ".join(s.name for s in SCENARIOS))


def check_comparison(parser, options):
    options.systems = chosen(options.systems, SYSTEMS)
    by_name = {scenario.name: scenario for scenario in SCENARIOS}
    options.scenarios = [by_name[name] for name in chosen(options.scenarios, by_name)]
    if any(SYSTEMS[system][0] for system in options.systems) and not (options.chromium and (HERE / "node_modules").is_dir()):
        parser.error("the browser's packages are missing: tools/setup.sh --bench installs them")


def main():
    options = parse_options(__doc__)
    measure_all(options)
    print((options.out / "results.md").read_text(), end="")


if __name__ == "__main__":
    main()
