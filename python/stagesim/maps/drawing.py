# SPDX-License-Identifier: GPL-2.0-or-later
"""Walls from drawings of lines and areas."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ..scenes.properties import section

Points = npt.NDArray[np.float64]

#: Limits of a drawing: corners of all walls, and metres from the origin.
MOST_CORNERS, FARTHEST = 200_000, 1e6


@dataclass(frozen=True, eq=False)
class Drawing:
    """Walls whose outlines are polygons.

    Args:
        polygons: corners of each wall in metres, shape (n, 2), n at least 3.
        height: that of the walls, metres.
    """

    polygons: Sequence[Points]
    height: float = 1.0

    def __post_init__(self) -> None:
        if not self.polygons:
            raise ValueError("found no lines and areas, expected walls")
        corners = np.concatenate(self.polygons)
        if len(corners) > MOST_CORNERS:
            raise ValueError(f"found walls with {len(corners)} corners, expected at most {MOST_CORNERS}")
        if not (np.abs(corners) <= FARTHEST).all():
            raise ValueError(f"found a corner further than {FARTHEST:g} m from the origin; is the scale right?")
        if not (np.ptp(corners, axis=0) > 0).all():
            raise ValueError("found walls without an area")

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """The least x and y, and the greatest ones."""
        corners = np.concatenate(self.polygons)
        (x0, y0), (x1, y1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        return x0, y0, x1, y1

    def moved(self, x: float, y: float, heading: float) -> Drawing:
        """The drawing after it was turned around the origin by `heading` (radians) and moved to x and y."""
        c, s = math.cos(heading), math.sin(heading)
        turn = np.array([[c, s], [-s, c]])
        return replace(self, polygons=[polygon @ turn + (x, y) for polygon in self.polygons])

    def lines(self) -> list[str]:
        """The section of a world file that stands for the walls."""
        x0, y0, x1, y1 = self.bounds
        blocks: list[str] = []
        for polygon in self.polygons:
            corners = [f"point[{i}] [{x!r} {y!r}]" for i, (x, y) in enumerate(polygon.tolist())]
            blocks += section("block", [f"points {len(corners)}", *corners])
        return section("model", ['name "map"', "color_rgba [0.35 0.35 0.38 1.0]",
                                 f"origin [{x0 + (x1 - x0) / 2!r} {y0 + (y1 - y0) / 2!r} 0 0]",
                                 f"size [{x1 - x0!r} {y1 - y0!r} {self.height!r}]", *blocks, "gui_move 0"])


def walls_along(line: Iterable[Sequence[float]], thickness: float) -> list[Points]:
    """Walls of a thickness (metres) along the points of a line. They end half a thickness after its ends."""
    points = np.array(list(line), np.float64).reshape(-1, 2)
    walls = []
    for start, end in zip(points[:-1], points[1:]):
        length = math.hypot(*(end - start))
        if length > 0:
            along = (end - start) / length * (thickness / 2)
            across = np.array([-along[1], along[0]])
            walls.append(np.array([start - along - across, end + along - across, end + along + across,
                                   start - along + across]))
    return walls
