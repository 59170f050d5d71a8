# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the package has its program and its worlds."""

from __future__ import annotations

import os

FOLDER = os.path.dirname(os.path.abspath(__file__))
PROGRAM = os.path.join(FOLDER, "bin", "stage")
WORLDS = (os.path.join(FOLDER, "share", "stage", "worlds"), os.path.join(FOLDER, "worlds"))


def shipped_worlds() -> list[str]:
    """The names of the worlds that come with the package, such as "cave.world", sorted."""
    return sorted(name for folder in WORLDS if os.path.isdir(folder)
                  for name in os.listdir(folder) if name.endswith(".world"))


def resolve(file: str | os.PathLike[str]) -> str:
    """The path of a world file: as given, or a shipped one's if it is a plain name that is not here."""
    path = os.fsdecode(file)
    if os.path.dirname(path) or os.path.exists(path):
        return path
    for folder in WORLDS:
        shipped = os.path.join(folder, path)
        if os.path.exists(shipped):
            return shipped
    return path
