# SPDX-License-Identifier: GPL-2.0-or-later
"""Worlds from maps and drawings, and maps of worlds: the commands `stage import` and `stage export map`."""

from __future__ import annotations

from .drawing import Drawing
from .reading import read_map
from .robots import PlacedRobot, robot_of
from .scene import MapScene
from .world_map import map_of, write_map

__all__ = ["Drawing", "MapScene", "PlacedRobot", "map_of", "read_map", "robot_of", "write_map"]
