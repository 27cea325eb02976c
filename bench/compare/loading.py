#!/usr/bin/env python3
"""How Tellurion loads over a network: how soon, how much in vain, and how evenly it draws meanwhile.

  bench/compare/loading.py --tile-server tileserver.py --out results

The tile server is that of run.py. Nothing else should run meanwhile. Writes loading.json and loading.md:

- teleports: seconds until a view is complete from an empty cache and from a warm disk cache, and the time that the network
  alone would take (each request one delay, as many at a time as there are connections; loopback has bandwidth in plenty);
- how many of the files fetched for a teleport the finished picture rests on;
- a flight over the ground at 250 m/s by the wall clock: the share of the bytes that the same flight with every frame finished
  does not fetch, which is what was loaded and never drawn;
- frames while a view loads, by delay and at 2 Mbit/s: the worst as a multiple of the median.
"""
import contextlib
import csv
import json
import math
import pathlib
import random
import shutil
import socket
import sqlite3
import statistics
import sys
import tempfile
import threading
import time

import run
from scenarios import FRAMES_PER_SECOND, PEAK, PLAIN, SLOPE, Pose

CONNECTIONS = 12
DELAY_MS = 20
SPEED, FLIGHT_S = 250.0, 60
METRES_A_DEGREE = 111_320
STANDS_S = 12
SAMPLED_FILES = 60
LINE_BITS_PER_SECOND = 2_000_000


class SlowLine:
    """Passes connections on to a server; what comes back shares one line of so many bits a second."""

    def __init__(self, server, bits_per_second):
        self.target = ("127.0.0.1", int(server.url.rsplit(":", 1)[1]))
        self.seconds_per_byte = 8 / bits_per_second
        self.lock, self.free_at = threading.Lock(), 0.0
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self.listener.getsockname()[1]}"
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        with contextlib.suppress(OSError):
            while True:
                near = self.listener.accept()[0]
                far = socket.create_connection(self.target)
                threading.Thread(target=self.pump, args=(near, far, False), daemon=True).start()
                threading.Thread(target=self.pump, args=(far, near, True), daemon=True).start()

    def pump(self, source, sink, slow):
        with contextlib.suppress(OSError):
            while data := source.recv(4096):
                if slow:
                    with self.lock:
                        self.free_at = max(self.free_at, time.monotonic()) + len(data) * self.seconds_per_byte
                        wait = self.free_at - time.monotonic()
                    time.sleep(max(wait, 0))
                sink.sendall(data)
        for end in (source, sink):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.listener.close()


def kept_files(cache):
    """Name and size of what the disk cache holds."""
    with contextlib.closing(sqlite3.connect(cache / "files.sqlite")) as database:
        return dict(database.execute("SELECT key, length(body) FROM files"))


def write_flight(folder, rows):
    file = folder / "flight.csv"
    lines = ["time,lat,lon,height,heading,pitch,roll", *(f"{time_s:.6f},{pose.text()},0" for time_s, pose in rows)]
    file.write_text("\n".join(lines) + "\n")
    return file


# --- What is measured ------------------------------------------------------------------------------------------------


def teleport(server, pose, options):
    with tempfile.TemporaryDirectory(prefix="tellurion-loading-") as name:
        folder = pathlib.Path(name)
        figures = {}
        for kind in ("cold", "warm"):
            server.reset()
            stats = folder / "stats.json"
            run.run_tellurion([options.tellurion, "render", run.world_file(folder, server), "--camera", pose.text(), "--out", folder / "p.png",
                               "--stats", stats, *run.common_options(1, folder)], options)
            counted = server.stats()
            figures[f"{kind}_s"] = json.loads(stats.read_text())["load_ms"] / 1e3
            figures[f"{kind}_requests"] = sum(counted["hits"].values())
            figures[f"{kind}_bytes"] = sum(counted["bytes"].values())
        figures["network_s"] = math.ceil(figures["cold_requests"] / CONNECTIONS) * DELAY_MS / 1e3
        figures["ratio"] = figures["cold_s"] / max(figures["warm_s"], figures["network_s"])
        return figures


def final_set(server, pose, options):
    """How many of the files that a cold view fetches its finished picture rests on: the planet's coarsest tiles, and those without which,
    offline, it is another picture. Tried for each zoom as a whole, then for a sample of the files of the zooms that matter."""
    with tempfile.TemporaryDirectory(prefix="tellurion-loading-") as name:
        folder = pathlib.Path(name)
        world = run.world_file(folder, server)

        def picture(place, *more):
            out = place / "p.png"
            run.run_tellurion([options.tellurion, "render", world, "--camera", pose.text(), "--out", out, *more, *run.common_options(1, place)], options)
            return out.read_bytes()

        def without(keys):
            place = folder / "less"
            shutil.rmtree(place, ignore_errors=True)
            shutil.copytree(folder / "cache", place / "cache")
            with contextlib.closing(sqlite3.connect(place / "cache" / "files.sqlite")) as database, database:
                database.executemany("DELETE FROM files WHERE key = ?", [(key,) for key in keys])
            return picture(place, "--offline", "--timeout", 20)

        coarsest = folder / "coarsest"
        coarsest.mkdir()
        run.run_tellurion([options.tellurion, "render", world, "--camera", "0,0,5e7", "--out", coarsest / "p.png", *run.common_options(1000, coarsest)], options)
        roots = kept_files(coarsest / "cache")
        picture(folder)
        files = [key for key in kept_files(folder / "cache") if "/imagery/" in key or "/terrain/" in key]
        whole = without([])
        groups = {}
        for key in set(files) - set(roots):
            groups.setdefault(tuple(key.split("/")[-4:-2]), []).append(key)
        needed = [key for group in groups.values() if without(group) != whole for key in group]
        sample = random.Random(1).sample(sorted(needed), min(len(needed), SAMPLED_FILES))
        share = sum(without([key]) != whole for key in sample) / len(sample)
        return {"files": len(files), "coarsest": len(roots), "of_zooms_needed": len(needed), "sampled": len(sample), "share_needed": share,
                "ratio": len(files) / (len(roots) + share * len(needed))}


def final_sets(options):
    with run.TileServer(options.tile_server, options.cache, 0) as server:
        found = {}
        for name, pose in {"plain": PLAIN, "peak": PEAK, "slope": SLOPE}.items():
            found[name] = final_set(server, pose, options)
            print(f"final set, {name}: {found[name]}", file=sys.stderr, flush=True)
        return found


def teleports(options):
    found = {}
    with run.TileServer(options.tile_server, options.cache, DELAY_MS) as server:
        for name, pose in {"plain": PLAIN, "peak": PEAK, "slope": SLOPE}.items():
            teleport(server, pose, options)  # fills the server's cache
            runs = [teleport(server, pose, options) for _ in range(options.runs)]
            found[name] = {key: statistics.median(one[key] for one in runs) for key in runs[0]}
            print(f"{name}: {found[name]}", file=sys.stderr, flush=True)
    return found


def flight_in_vain(options):
    """Eastwards, 1,500 m above the plain."""
    degrees_a_second = SPEED / (METRES_A_DEGREE * math.cos(math.radians(PLAIN.lat)))
    count = FLIGHT_S * FRAMES_PER_SECOND
    rows = [(i / FRAMES_PER_SECOND, Pose(PLAIN.lat, PLAIN.lon + i / FRAMES_PER_SECOND * degrees_a_second, 1600, 90, -15)) for i in range(count + 1)]
    with run.TileServer(options.tile_server, options.cache, DELAY_MS) as server, tempfile.TemporaryDirectory(prefix="tellurion-loading-") as name:
        kept = {}
        # Twice by the wall clock: the first time the server makes its tiles.
        for kind, more in {"finished": ["--fps", 5], "first": ["--realtime", "--fps", FRAMES_PER_SECOND], "flown": ["--realtime", "--fps", FRAMES_PER_SECOND]}.items():
            folder = pathlib.Path(name) / kind
            folder.mkdir()
            run.run_tellurion([options.tellurion, "fly", run.world_file(folder, server), write_flight(folder, rows), *more, "--stats", folder / "stats.json",
                               *run.common_options(1, folder)], options)
            kept[kind] = kept_files(folder / "cache")
        # Servers differ in nothing but their port: the same one served all.
        vain = {key: size for key, size in kept["flown"].items() if key not in kept["finished"]}
        total = sum(size or 0 for size in kept["flown"].values())
        return {"files": len(kept["flown"]), "bytes": total, "finished_files": len(kept["finished"]), "finished_bytes": sum(size or 0 for size in kept["finished"].values()),
                "files_in_vain": len(vain), "bytes_in_vain": sum(size or 0 for size in vain.values()), "share_in_vain": sum(size or 0 for size in vain.values()) / total}


def frames_while_loading(options):
    rows = [(0, PLAIN), (STANDS_S, PLAIN)]
    found = {}
    for name, delay_ms, bits_per_second in [("0 ms", 0, None), ("20 ms", 20, None), ("200 ms", 200, None), ("2 Mbit/s", 20, LINE_BITS_PER_SECOND)]:
        with contextlib.ExitStack() as stack:
            server = stack.enter_context(run.TileServer(options.tile_server, options.cache, delay_ms))
            line = stack.enter_context(SlowLine(server, bits_per_second)) if bits_per_second else server
            folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="tellurion-loading-")))
            trace = folder / "trace.csv"
            run.run_tellurion([options.tellurion, "fly", run.world_file(folder, line), write_flight(folder, rows), "--realtime", "--fps", FRAMES_PER_SECOND,
                               "--trace", trace, *run.common_options(1, folder)], options)
            frames = list(csv.DictReader(trace.open()))
        loading = [float(frame["frame_ms"]) for frame in frames[1:] if frame["complete"] == "0"]
        found[name] = {"frames": len(loading), "complete": frames[-1]["complete"] == "1", "median_ms": statistics.median(loading),
                       "worst_ms": max(loading), "ratio": max(loading) / statistics.median(loading), "largest_upload_ms": max(float(f["upload_ms"]) for f in frames[1:])}
        print(f"{name}: {found[name]}", file=sys.stderr, flush=True)
    return found


# --- Reports ---------------------------------------------------------------------------------------------------------


def report(figures):
    lines = [figures["machine"], "", "| teleport | requests | MB | cold s | warm s | network s | ratio | warm requests |", "|---|---|---|---|---|---|---|---|"]
    lines += [f"| {name} | {f['cold_requests']:.0f} | {f['cold_bytes'] / 1e6:.2f} | {f['cold_s']:.2f} | {f['warm_s']:.2f} | {f['network_s']:.2f} | {f['ratio']:.2f} | {f['warm_requests']:.0f} |"
              for name, f in figures["teleports"].items()]
    lines += ["", "| final set | files fetched | coarsest tiles | of other zooms that matter | of a sample of them needed | ratio |", "|---|---|---|---|---|---|"]
    lines += [f"| {name} | {f['files']} | {f['coarsest']} | {f['of_zooms_needed']} | {f['share_needed']:.1%} of {f['sampled']} | {f['ratio']:.2f} |" for name, f in figures["final_sets"].items()]
    flight = figures["flight"]
    lines += ["", f"Flight at {SPEED:.0f} m/s for {FLIGHT_S} s: {flight['files']} files, {flight['bytes'] / 1e6:.2f} MB; {flight['files_in_vain']} files and "
              f"{flight['share_in_vain']:.1%} of the bytes are not among the {flight['finished_files']} files of the finished flight."]
    lines += ["", "| while it loads | frames | median ms | worst ms | ratio | largest upload ms |", "|---|---|---|---|---|---|"]
    lines += [f"| {name} | {f['frames']} | {f['median_ms']:.1f} | {f['worst_ms']:.1f} | {f['ratio']:.2f} | {f['largest_upload_ms']:.1f} |" for name, f in figures["frames"].items()]
    return "\n".join(lines) + "\n"


def main():
    options = run.parse_options(__doc__, browsers=False)
    figures = {"machine": run.machine([]), "teleports": teleports(options), "final_sets": final_sets(options), "flight": flight_in_vain(options), "frames": frames_while_loading(options)}
    (options.out / "loading.json").write_text(json.dumps(figures, indent=1) + "\n")
    (options.out / "loading.md").write_text(report(figures))
    print(report(figures), end="")


if __name__ == "__main__":
    main()
