#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Includes follow the dependencies between modules in CONTRIBUTING.md, which have one direction.

Each dependency is in one of the two tables below. A new one must be added there, where reviewers see
it, and an unused one must be removed.
"""

from __future__ import annotations

import os
import re
import unittest
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])

# For each module, the modules whose headers it includes. "face" is stage.hh and all public headers outside of the
# modules.
ALLOWED = {
    "config": "",
    "messages": "",
    "files": "",
    "threads": "messages",
    "kernels": "",
    "random": "",
    "geometry": "messages random",
    "pictures": "messages random geometry",
    "worldfile": "config messages files geometry pictures",
    "grid": "messages kernels geometry",
    "sensing": "messages threads kernels random geometry grid",
    "models": "messages random geometry pictures worldfile grid sensing",
    "models/types": "messages random geometry worldfile grid sensing models",
    "world": "config messages files threads random geometry pictures worldfile grid sensing models models/types",
    "insight": "geometry models models/types sensing world",
    "whatif": "messages threads geometry models models/types world",
    "recording": "config messages files geometry worldfile grid models models/types world",
    "face": "config messages random geometry pictures worldfile models models/types world insight whatif",
    "libstage_cl": "messages threads grid sensing",
    "gui/view": "geometry worldfile models models/types world",
    "gui/draw": "messages geometry pictures sensing models models/types world gui/view",
    "gui/offscreen": "files geometry worldfile models world gui/draw",
    "gui/window": "messages threads geometry worldfile models world face gui/view gui/draw gui/offscreen",
    "tools": ("messages files threads random geometry worldfile models world insight whatif recording face "
              "gui/offscreen gui/window"),
}

# Dependencies in the wrong direction, (module, header): the including file, and the reason.
BACK = {
    ("models", "world/world.hh"): (
        "body deletion_watch energy_charts log_entry model model_callbacks model_extras model_load "
        "model_sensing model_state model_tree placement power_pack",
        "Stage's interface wants models to know their world, and the world its models"),
    ("models/types", "world/world.hh"): (
        "actuator blinkenlight blobfinder bumper camera fiducial gripper position ranger wifi",
        "Stage's interface wants models to know their world, and the world its models"),
    ("models", "models/fiducial.hh"): (
        "fiducial_index", "the index keeps pointers to finders"),
    ("face", "window/world_gui.hh"): (
        "stage", "clients get the window with <stage.hh>, where it has been built"),
}

SUFFIXES = {".cc", ".hh", ".h", ".cl", ".in"}
INCLUDE = re.compile(r'^\s*#\s*include\s+(["<])([^">]+)[">]', re.MULTILINE)
# Headers that CMake generates.
MADE = {"stage_config.hh": "config/stage_config.hh", "kernels_embedded.hh": "libstage_cl/"}


class Include(NamedTuple):
    source: str  # such as libstage/grid/grid.hh
    header: str  # as written in the source
    target: str  # the included file; empty: not found


def module_of(path: str) -> str:
    parts = path.split("/")
    if parts[0] != "libstage":
        return parts[0]
    if parts[1] == "include":  # public headers belong to their module, too
        del parts[1]
    if len(parts) > 3 and parts[1] in {"gui", "models"}:
        return "/".join(parts[1:3])
    if parts[1] == "models" and (ROOT / "libstage/models/types" / Path(parts[-1]).with_suffix(".cc")).is_file():
        return "models/types"
    return parts[1] if len(parts) > 2 else "face"


def find(source: Path, header: str) -> str:
    """The file of the project that the compiler includes; empty if there is none."""
    if header in MADE:
        return MADE[header]
    folders = [source.parent, ROOT / "libstage/include", ROOT / "libstage", ROOT / "libstage/gui", ROOT, ROOT / "tools"]
    for folder in folders:
        if (folder / header).is_file():
            return (folder / header).resolve().relative_to(ROOT.resolve()).as_posix()
    return ""


def includes() -> list[Include]:
    found = []
    for folder in ("libstage", "libstage_cl", "kernels", "tools"):
        for source in sorted((ROOT / folder).rglob("*")):
            if source.suffix not in SUFFIXES:
                continue
            for bracket, header in INCLUDE.findall(source.read_text()):
                target = find(source, header)
                if target or bracket == '"':
                    name = source.relative_to(ROOT).as_posix()
                    found.append(Include(name, header, target))
    return found


def is_back(include: Include) -> bool:
    follower, _ = BACK.get((module_of(include.source), include.header), ("", ""))
    return Path(include.source).stem in follower.split()


def faults(found: Iterable[Include]) -> list[str]:
    """One line for each include without a file or without an allowed dependency."""
    lines = []
    for include in found:
        start, end = module_of(include.source), module_of(include.target)
        if not include.target:
            lines.append(f"{include.source}: there is no {include.header}")
        elif start != end and end not in ALLOWED[start].split() and not is_back(include):
            lines.append(f"{include.source}: {start} may not use {end} ({include.header})")
    return lines


def cycle(allowed: dict[str, str]) -> list[str]:
    """A cycle of modules that depend on each other; empty: none."""
    left = {module: set(used.split()) for module, used in allowed.items()}
    while left:
        ends = {module for module, used in left.items() if not used & left.keys()}
        if not ends:
            return sorted(left)
        left = {module: used for module, used in left.items() if module not in ends}
    return []


class ArrowsTest(unittest.TestCase):
    def test_rooms_use_what_the_tables_allow(self) -> None:
        found = includes()
        self.assertGreater(len(found), 700)
        self.assertEqual(faults(found), [])

    def test_arrows_point_one_way(self) -> None:
        self.assertEqual(cycle(ALLOWED), [])

    def test_tables_have_what_is_used_and_no_more(self) -> None:
        used = {(module_of(i.source), module_of(i.target)) for i in includes() if not is_back(i)}
        for module, allowed in ALLOWED.items():
            for other in allowed.split():
                self.assertIn((module, other), used, "an arrow that nobody follows")
        followed = {(module_of(i.source), i.header, Path(i.source).stem)
                    for i in includes() if is_back(i)}
        for (module, header), (followers, _) in BACK.items():
            for follower in followers.split():
                self.assertIn((module, header, follower), followed, "it need not be excused")

    def test_the_search_finds_what_it_is_to_find(self) -> None:
        grid = Include("libstage/grid/grid.cc", "world/world.hh", "libstage/include/world/world.hh")
        self.assertEqual(len(faults([grid])), 1)
        self.assertEqual(len(faults([grid._replace(header="x.hh", target="")])), 1)
        window = "libstage/gui/window/window_state.hh"
        self.assertEqual(len(faults([grid._replace(header="window_state.hh", target=window)])), 1)
        self.assertEqual(faults([grid._replace(header="grid.hh", target="libstage/grid/grid.hh")]),
                         [])
        self.assertEqual(cycle({"a": "b", "b": "c", "c": "a", "d": "a", "e": ""}),
                         ["a", "b", "c", "d"])


if __name__ == "__main__":
    unittest.main()
