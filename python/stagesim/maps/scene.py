# SPDX-License-Identifier: GPL-2.0-or-later
"""A world of a map or a drawing, and of robots that macros describe."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from ..scenes import GridMap, Scene
from ..scenes.properties import lines_of
from .drawing import Drawing
from .robots import PlacedRobot

WINDOW = 800, 700  # pixels


@dataclass(frozen=True)
class MapScene(Scene):
    """A world of a map or a drawing, and of robots that macros describe.

    Args:
        drawing: walls, if there is no map.
        robots: the robots, which are called r0, r1 and so on.
        title: a comment on the first line of the world file.
    """

    drawing: Drawing | None = None
    robots: Sequence[PlacedRobot] = ()
    title: str = "A world of a map."

    @classmethod
    def of(cls, walls: GridMap | Drawing, robots: Sequence[PlacedRobot] = (), title: str = title) -> MapScene:
        """The scene of a map or a drawing."""
        if isinstance(walls, GridMap):
            return cls(walls, robots=robots, title=title)
        return cls(drawing=walls, robots=robots, title=title)

    @cached_property
    def _text(self) -> str:
        walls = self.map if self.map is not None else self.drawing
        assert walls is not None
        includes = [f'include "{file}"' for file in dict.fromkeys(robot.include for robot in self.robots)]
        window = [_window(*(bounds_of(self.map) if self.map is not None else walls.bounds))]  # type: ignore[union-attr]
        section = self.map.lines(degrees=True) if self.map is not None else walls.lines()
        robots = [robot.line(f"r{i}") for i, robot in enumerate(self.robots)]
        return "\n".join([f"# {self.title}", "", *includes, *lines_of(self), *window, *section, *robots]) + "\n"


def bounds_of(map: GridMap) -> tuple[float, float, float, float]:
    """The smallest upright rectangle around a map: the least x and y, and the greatest ones."""
    rows, columns = map.shape
    c, s = math.cos(map.origin[3]), math.sin(map.origin[3])
    w, h = columns * map.resolution, rows * map.resolution
    xs = [map.origin[0] + x * c - y * s for x in (0, w) for y in (0, h)]
    ys = [map.origin[1] + x * s + y * c for x in (0, w) for y in (0, h)]
    return min(xs), min(ys), max(xs), max(ys)


def _window(x0: float, y0: float, x1: float, y1: float) -> str:
    """A window that shows the rectangle."""
    scale = 0.95 * min(WINDOW[0] / (x1 - x0), WINDOW[1] / (y1 - y0))
    return (f"window( size [{WINDOW[0]} {WINDOW[1]}] center [{(x0 + x1) / 2:g} {(y0 + y1) / 2:g}] scale {scale:g} "
            "show_data 1 )")
