# SPDX-License-Identifier: GPL-2.0-or-later
"""Paths of the program and of the worlds in the package."""

from __future__ import annotations

import os

FOLDER = os.path.dirname(os.path.abspath(__file__))
PROGRAM = os.path.join(FOLDER, "bin", "stage")
WORLDS = (os.path.join(FOLDER, "share", "stage", "worlds"), os.path.join(FOLDER, "worlds"))


def shipped_worlds() -> list[str]:
    """Returns the sorted file names of the worlds in the package, such as "cave.world"."""
    return sorted(name for folder in WORLDS if os.path.isdir(folder)
                  for name in os.listdir(folder) if name.endswith(".world"))


def resolve(file: str | os.PathLike[str]) -> str:
    """Returns the path of a world file.

    If `file` has no folder, or the folder robots, and does not exist in the working folder, a shipped world of that
    name is used.
    """
    path = os.fsdecode(file)
    if os.path.dirname(path) not in ("", "robots") or os.path.exists(path):
        return path
    for folder in WORLDS:
        shipped = os.path.join(folder, path)
        if os.path.exists(shipped):
            return shipped
    return path


def advice(path: str) -> str:
    """Returns a hint for the message about a missing world file; empty if no name is similar."""
    if os.path.exists(path):
        return ""
    import difflib  # rarely needed

    stems = [name.removesuffix(".world") for name in shipped_worlds()]
    similar = difflib.get_close_matches(os.path.splitext(os.path.basename(path))[0], stems, 1, 0.75)
    return f'; did you mean "{similar[0]}.world", which comes with Stage?' if similar else ""
