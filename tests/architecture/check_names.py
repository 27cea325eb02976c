#!/usr/bin/env python3
"""Holds every name that the guides set in `code` against the tree, so that they do not speak of what is gone.

usage: check_names.py ROOT     checks README.md and docs/; exit status 1 with one line per name that nothing in the tree has
       check_names.py --self-test

Checked are names of C++ (`Globe::open`: each part must occur in the sources) and paths of the tree (`src/surface/rtin.h`).
Decision records speak of their own time and are left out.
"""

import pathlib
import re
import sys
import tempfile

CODE = re.compile(r"`([^`\n]+)`")
FENCED = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
NAME = re.compile(r"(?:[A-Za-z_]\w*::)+[A-Za-z_]\w*|[A-Z][a-z0-9]+(?:[A-Z][a-z0-9]+)+|[a-z0-9]+(?:_[a-z0-9]+)+")
WORD = re.compile(r"\w+")
SOURCES = ("src", "apps", "bench", "shaders", "examples", "cmake", "tests", "tools")
SOURCE_SUFFIXES = {".h", ".cpp", ".vert", ".frag", ".glsl", ".cmake", ".py", ".sh", ".in"}


def missing_names(root):
    words = set()
    tree = [root / "CMakeLists.txt", *(file for folder in SOURCES for file in sorted((root / folder).rglob("*")))]
    for file in tree:
        if file.is_file() and file.suffix in SOURCE_SUFFIXES | {".txt"}:
            words.update(WORD.findall(file.read_text(errors="replace")))
    folders = {path.name for path in root.iterdir()} - {"build"}  # what is built is not of the tree
    guides = [root / "README.md", *sorted((root / "docs").glob("*.md"))]
    for guide in guides:
        text = FENCED.sub("", guide.read_text())
        for code in CODE.findall(text):
            if "/" in code and code.split("/")[0] in folders and re.fullmatch(r"[\w./-]+", code):
                if not (root / code).exists():
                    yield guide, code
            elif NAME.fullmatch(code.removesuffix("()")):
                if not all(part in words for part in WORD.findall(code)):
                    yield guide, code


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in {"CMakeLists.txt": "", "src/a.h": "struct Globe { void open(); int tile_key; };", "README.md": "`build/bin/a`", "build/b": "",
                           "docs/guide.md": "`Globe::open` `tile_key` `src/a.h` `--sse 1` `a.tif` ```\n`Gone::now`\n```"
                                            "`Globe::shut` `src/b.h` `TileTree` `old_name()`"}.items():
            file = root / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        found = {code for _, code in missing_names(root)}
    assert {"Globe::shut", "src/b.h", "TileTree", "old_name()"} <= found, found
    assert not found & {"Globe::open", "tile_key", "src/a.h", "build/bin/a"}, found


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        sys.exit(0)
    checked_root = pathlib.Path(sys.argv[1])
    missing = list(missing_names(checked_root))
    for guide, code in missing:
        print(f"{guide.relative_to(checked_root)}: `{code}` is nowhere in the tree")
    sys.exit(bool(missing))
