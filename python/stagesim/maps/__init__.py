# SPDX-License-Identifier: GPL-2.0-or-later
"""Worlds from maps and drawings: the command `stage import`."""

from __future__ import annotations

from .drawing import Drawing
from .reading import read_map
from .robots import PlacedRobot, robot_of
from .scene import MapScene

__all__ = ["Drawing", "MapScene", "PlacedRobot", "read_map", "robot_of"]
