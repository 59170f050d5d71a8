#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks the dependencies between modules: which module includes headers of which other modules.

The table of modules in CONTRIBUTING.md lists all dependencies. They must have no cycle. A new one must be
added to the table, where reviewers see it, and one that is no longer used must be removed.
"""

from __future__ import annotations

import os
import re
import unittest
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])


def read_table(text: str) -> dict[str, str]:
    """The table of modules in CONTRIBUTING.md: for each module, the modules whose headers it includes."""
    table = {}
    for folder, used in re.findall(r"^\| `([^`]+)` \|.*\|([^|`]+)\|$", text, re.MULTILINE):
        if folder.split("/")[0] in {"libstage", "libstage_cl", "kernels", "tools"} or folder == "python/src":
            table[folder.removeprefix("libstage/")] = used.replace(",", "").strip().removeprefix("nothing")
    return table


ALLOWED = read_table((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"))

# Exceptions: dependencies in the wrong direction, (module, header): the including file, and the reason.
EXCEPTIONS = {
    ("libstage", "window/world_gui.hh"): (
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
        return "python/src" if parts[0] == "python" else parts[0]
    if parts[1] == "include":  # public headers belong to their module, too
        del parts[1]
    if len(parts) > 3 and parts[1] in {"gui", "models"}:
        return "/".join(parts[1:3])
    if parts[1] == "models" and (ROOT / "libstage/models/types" / Path(parts[-1]).with_suffix(".cc")).is_file():
        return "models/types"
    return parts[1] if len(parts) > 2 else "libstage"


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
    for folder in ("libstage", "libstage_cl", "kernels", "tools", "python/src"):
        for source in sorted((ROOT / folder).rglob("*")):
            if source.suffix not in SUFFIXES:
                continue
            for bracket, header in INCLUDE.findall(source.read_text()):
                target = find(source, header)
                if target or bracket == '"':
                    name = source.relative_to(ROOT).as_posix()
                    found.append(Include(name, header, target))
    return found


def is_exception(include: Include) -> bool:
    users, _ = EXCEPTIONS.get((module_of(include.source), include.header), ("", ""))
    return Path(include.source).stem in users.split()


def faults(found: Iterable[Include]) -> list[str]:
    """One line for each include without a file or without an allowed dependency."""
    lines = []
    for include in found:
        start, end = module_of(include.source), module_of(include.target)
        if not include.target:
            lines.append(f"{include.source}: there is no {include.header}")
        elif start != end and end not in ALLOWED[start].split() and not is_exception(include):
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


class ModuleDependenciesTest(unittest.TestCase):
    def test_modules_include_only_what_the_table_lists(self) -> None:
        found = includes()
        self.assertGreater(len(found), 700)
        self.assertEqual(faults(found), [])

    def test_dependencies_have_no_cycle(self) -> None:
        self.assertEqual(cycle(ALLOWED), [])

    def test_each_listed_dependency_is_used(self) -> None:
        used = {(module_of(i.source), module_of(i.target)) for i in includes() if not is_exception(i)}
        self.assertEqual([(module, other) for module, allowed in ALLOWED.items() for other in allowed.split()
                          if (module, other) not in used], [], "dependencies that no file uses")
        needed = {(module_of(i.source), i.header, Path(i.source).stem)
                  for i in includes() if is_exception(i)}
        self.assertEqual([(module, header, user) for (module, header), (users, _) in EXCEPTIONS.items()
                          for user in users.split() if (module, header, user) not in needed], [],
                         "exceptions that no file needs")

    def test_public_headers_include_only_the_standard_library(self) -> None:
        system = {header for source in (ROOT / "libstage" / "include").rglob("*.hh")
                  for bracket, header in INCLUDE.findall(source.read_text()) if bracket == "<"}
        self.assertIn("vector", system)
        of_c = {"assert.h", "stddef.h", "stdint.h", "stdio.h", "stdlib.h", "string.h"}
        self.assertEqual({header for header in system - of_c if "/" in header or "." in header}, set())

    def test_each_kind_of_fault_is_found(self) -> None:
        grid = Include("libstage/grid/grid.cc", "world/world.hh", "libstage/include/world/world.hh")
        self.assertEqual(len(faults([grid])), 1)
        self.assertEqual(len(faults([grid._replace(header="x.hh", target="")])), 1)
        window = "libstage/gui/window/window_state.hh"
        self.assertEqual(len(faults([grid._replace(header="window_state.hh", target=window)])), 1)
        self.assertEqual(faults([grid._replace(header="grid.hh", target="libstage/grid/grid.hh")]),
                         [])
        host = Include("libstage/models/host.hh", "models/wifi.hh", "libstage/include/models/wifi.hh")
        self.assertEqual(len(faults([host])), 1)
        self.assertEqual(read_table("| `libstage/a` | the `a` | b, c/d |\n| `kernels` | k | nothing |\n| `x` | y | z |"),
                         {"a": "b c/d", "kernels": ""})
        self.assertEqual(cycle({"a": "b", "b": "c", "c": "a", "d": "a", "e": ""}),
                         ["a", "b", "c", "d"])


if __name__ == "__main__":
    unittest.main()
