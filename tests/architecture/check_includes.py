#!/usr/bin/env python3
"""Holds every #include of src/, bench/ and apps/ against cmake/rooms.txt.

usage: check_includes.py ROOT     checks the tree below ROOT; exit status 1 with one line per violation
       check_includes.py --self-test   plants each kind of violation in a small tree and requires that it is found

Reports: a room that uses a room it may not; a third-party header outside the folders that may name it; an include of a
file that does not exist; includes by a path relative to the file; cycles between files; headers that nothing includes.
"""

import pathlib
import re
import sys
import tempfile

INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(?:"([^"]+)"|<([^>]+)>)', re.MULTILINE)
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
SOURCE_SUFFIXES = {".h", ".cpp"}
CHECKED = ("src", "bench", "apps")
# Where else a header may be used from, so as not to be an orphan.
USERS = ("tests", "fuzz", "examples", "web")


class Rules:
    def __init__(self, text):
        self.rooms = {}  # room -> rooms it may use
        self.guarded = []  # (prefix of a header's name, folders that may name it)
        for line in text.splitlines():
            line = line.split("#")[0].strip()
            if line.startswith("@"):
                prefix, folders = (part.strip() for part in line[1:].split("@"))
                self.guarded.append((prefix, folders.split()))
            elif line:
                room, uses = line.split(":")
                self.rooms[room.strip()] = {room.strip(), "base", *uses.split()}

    def room_of(self, path):
        parts = path.parts
        return parts[1] if parts[0] == "src" else parts[0]


def includes_of(file):
    text = COMMENT.sub(lambda match: "\n" * match.group().count("\n"), file.read_text(encoding="utf-8"))
    for match in INCLUDE.finditer(text):
        yield text.count("\n", 0, match.start()) + 1, match.group(1) or match.group(2), match.group(1) is not None


def sources(root, folder):
    return sorted(path.relative_to(root) for path in (root / folder).rglob("*") if path.suffix in SOURCE_SUFFIXES)


def resolve(root, path, name):
    """The file of this project that `name` means in `path`, and whether it is named in the way that we name files."""
    if (root / "src" / name).is_file():
        return pathlib.Path("src") / name, True
    if path.parts[0] == "apps" and (root / "apps" / name).is_file():
        return pathlib.Path("apps") / name, True
    if name.startswith("bench/") and path.parts[0] in ("apps", "bench") and (root / name).is_file():
        return pathlib.Path(name), True
    beside = root / path.parent / name
    if beside.is_file():
        return pathlib.Path(beside.resolve().relative_to(root.resolve())), False
    return None, False


def is_within(path, folders):
    return any(path.as_posix() == folder or path.as_posix().startswith(folder + "/") for folder in folders)


def cycles(graph):
    """Each cycle found by a depth-first walk, as the list of its files."""
    found, done, stack, on_stack = [], set(), [], set()

    def walk(node):
        stack.append(node)
        on_stack.add(node)
        for other in graph.get(node, ()):
            if other in on_stack:
                found.append(stack[stack.index(other):] + [other])
            elif other not in done:
                walk(other)
        stack.pop()
        on_stack.discard(node)
        done.add(node)

    for node in sorted(graph):
        if node not in done:
            walk(node)
    return found


def check(root):
    rules = Rules((root / "cmake/rooms.txt").read_text(encoding="utf-8"))
    violations, graph, included = [], {}, set()
    files = [path for folder in CHECKED for path in sources(root, folder)]
    for path in files:
        room = rules.room_of(path)
        if room not in rules.rooms:
            violations.append(f"{path}: the room `{room}` is not in cmake/rooms.txt")
            continue
        for line, name, quoted in includes_of(root / path):
            where = f"{path}:{line}"
            target, well_named = resolve(root, path, name)
            if target is not None:
                included.add(target)
                graph.setdefault(path, []).append(target)
                if not well_named or not quoted:
                    right = target if target.parts[0] == "bench" else target.relative_to(target.parts[0])
                    violations.append(f'{where}: write this include as "{right}"')
                used = rules.room_of(target)
                if used not in rules.rooms[room]:
                    violations.append(f"{where}: `{room}` may not use `{used}` ({name})")
                continue
            if quoted:
                violations.append(f"{where}: there is no file src/{name}")
            for prefix, folders in rules.guarded:
                if name.startswith(prefix) and not is_within(path, folders):
                    violations.append(f"{where}: only {' and '.join(folders)} may name {name}")
    for cycle in cycles(graph):
        violations.append("cycle: " + " -> ".join(map(str, cycle)))

    for folder in USERS:
        for path in sources(root, folder):
            for _, name, _ in includes_of(root / path):
                target, _ = resolve(root, path, name)
                if target is not None:
                    included.add(target)
    for path in files:
        if path.suffix == ".h" and path not in included:
            violations.append(f"{path}: nothing includes this header")
    return violations, len(files)


def self_test():
    own_rules = pathlib.Path(__file__).parents[2] / "cmake/rooms.txt"
    clean = {
        "cmake/rooms.txt": own_rules.read_text(encoding="utf-8"),
        "src/base/result.h": "#pragma once\n#include <string>\n",
        "src/geo/ellipsoid.h": '#pragma once\n#include "base/result.h"\n#include <glm/vec3.hpp>\n',
        "src/geo/ellipsoid.cpp": '#include "geo/ellipsoid.h"\n',
        "src/gpu/texture.cpp": "#include <epoxy/gl.h>\n",
        "src/source/gdal/open.cpp": "#include <gdal_priv.h>\n#include <cpl_vsi.h>\n",
        "src/globe/globe.h": '#pragma once\n#include "geo/ellipsoid.h"\n',
        "bench/registry.h": '#pragma once\n#include "geo/ellipsoid.h"\n',
        "bench/frame.cpp": '#include "bench/registry.h"\n#include "globe/globe.h"\n',
        "apps/viewer/window.h": '#pragma once\n#include "globe/globe.h"\n',
        "apps/viewer/window.cpp": '#include "viewer/window.h"\n#include <GLFW/glfw3.h>\n#include <imgui.h>\n',
    }
    planted = [
        ("a room below uses one above", {"src/geo/bad.cpp": '#include "globe/globe.h"\n'}, "`geo` may not use `globe`"),
        ("rooms side by side", {"src/raster/bad.cpp": '#include "geo/ellipsoid.h"\n'}, "`raster` may not use `geo`"),
        ("apps look behind globe", {"apps/bad.cpp": '#include "geo/ellipsoid.h"\n'}, "`apps` may not use `geo`"),
        ("a room uses the benchmarks", {"src/globe/bad.cpp": '#include "bench/registry.h"\n'}, "there is no file src/bench"),
        ("a benchmark names a neighbour", {"bench/bad.cpp": '#include "registry.h"\n'}, 'write this include as "bench/registry.h"'),
        ("OpenGL in a benchmark", {"bench/bad.cpp": "#include <epoxy/gl.h>\n"}, "may name epoxy/gl.h"),
        ("OpenGL outside", {"src/surface/bad.cpp": "#include <epoxy/gl.h>\n"}, "may name epoxy/gl.h"),
        ("OpenGL in the viewer", {"apps/viewer/bad.cpp": "#include <GL/gl.h>\n"}, "may name GL/gl.h"),
        ("OpenGL ES outside", {"src/globe/bad.cpp": "#include <GLES3/gl3.h>\n"}, "may name GLES3/gl3.h"),
        ("GDAL outside", {"src/source/bad.cpp": "#include <gdal.h>\n"}, "may name gdal.h"),
        ("PROJ outside", {"src/geo/bad.cpp": "#include <proj.h>\n"}, "may name proj.h"),
        ("network outside", {"src/source/bad.cpp": "#include <curl/curl.h>\n"}, "may name curl/curl.h"),
        ("sockets outside", {"apps/bad.cpp": "#include <sys/socket.h>\n"}, "may name sys/socket.h"),
        ("a window outside", {"src/render/bad.cpp": "#include <GLFW/glfw3.h>\n"}, "may name GLFW/glfw3.h"),
        ("an interface outside", {"apps/bad.cpp": "#include <imgui.h>\n"}, "may name imgui.h"),
        ("spaces and tabs", {"src/geo/bad.cpp": '\t#  include\t"globe/globe.h"\n'}, "`geo` may not use `globe`"),
        ("angle brackets", {"src/geo/bad.cpp": "#include <base/result.h>\n"}, "write this include as"),
        ("relative path", {"src/geo/bad.cpp": '#include "ellipsoid.h"\n'}, "write this include as"),
        ("missing file", {"src/geo/bad.cpp": '#include "geo/nothing.h"\n'}, "there is no file src/geo/nothing.h"),
        ("unknown room", {"src/cellar/bad.cpp": "\n"}, "`cellar` is not in"),
        ("orphan", {"src/geo/orphan.h": "#pragma once\n"}, "nothing includes this header"),
        ("cycle", {"src/geo/a.h": '#include "geo/b.h"\n', "src/geo/b.h": '#include "geo/a.h"\n'}, "cycle: "),
        ("cycle of one", {"src/geo/a.h": '#include "geo/a.h"\n'}, "cycle: "),
    ]
    failures = 0
    for name, files, expected in [("nothing planted", {}, None), *planted]:
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for path, text in {**clean, **files}.items():
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_text(text, encoding="utf-8")
            violations, _ = check(root)
        if expected is None:
            right = not violations
        else:
            right = any(expected in violation for violation in violations)
        if not right:
            failures += 1
            print(f"self-test `{name}`: expected {expected!r}, found {violations}")
    print(f"{len(planted) + 1 - failures} of {len(planted) + 1} self-tests passed")
    return 1 if failures else 0


def main():
    if len(sys.argv) != 2 or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        return 0 if len(sys.argv) == 2 else 2
    if sys.argv[1] == "--self-test":
        return self_test()
    violations, count = check(pathlib.Path(sys.argv[1]))
    for violation in violations:
        print(violation)
    print(f"{count} files, {len(violations)} violations")
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main())
