# SPDX-License-Identifier: GPL-2.0-or-later
"""Worlds from data: scenes of maps, robots and things, without files."""

from __future__ import annotations

from .generate import clutter, maze, rooms
from .grid_map import GridMap
from .models import Box, Model, Polygon, Robot
from .places import free_places
from .scene import Scene
from .sensors import Blobfinder, Bumper, Fiducial, Ranger, Sensor

__all__ = [
    "Blobfinder", "Box", "Bumper", "Fiducial", "GridMap", "Model", "Polygon", "Ranger", "Robot", "Scene", "Sensor",
    "clutter", "free_places", "maze", "rooms",
]
