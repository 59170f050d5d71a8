# SPDX-License-Identifier: GPL-2.0-or-later
"""Finds the places that a robot can reach."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..fleet import Floats

if TYPE_CHECKING:
    from ..world import World

Cells = npt.NDArray[np.int64]
SIDES = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
QUARTERS = np.arange(4) * (np.pi / 2)
ALL_AROUND = np.linspace(-np.pi, np.pi, 16, endpoint=False)


def reachable_places(world: World, start: npt.ArrayLike, spacing: float = 0.25, clearance: float = 0.3,
                     most: int = 20000) -> Floats:
    """Finds the points of a grid that can be reached from `start` along free grid lines.

    It is a breadth-first search. The world's map is an obstacle; robots are not.

    Args:
        world: the world whose map is used.
        start: x, y of the first grid point, metres: shape (2,). It is always part of the result.
        spacing: distance between neighbouring grid points, metres.
        clearance: min distance of every other point to obstacles, metres.
        most: max number of points.

    Returns:
        x, y, metres: shape (m, 2), sorted by the length of the path.
    """
    origin = np.asarray(start, np.float64)
    front = np.zeros((1, 2), np.int64)
    seen = {(0, 0)}
    found, count = [front], 1
    while len(front) and count < most:
        front = _unseen(_next(world, front, origin, spacing), seen)
        clear = world.cast(_poses(front, origin, spacing), ALL_AROUND, clearance) >= clearance
        front = front[clear.all(1)]
        found.append(front)
        count += len(front)
    return origin + np.concatenate(found)[:most] * spacing


def _poses(cells: Cells, origin: Floats, spacing: float) -> Floats:
    return np.column_stack([origin + cells * spacing, np.zeros(len(cells))])


def _next(world: World, cells: Cells, origin: Floats, spacing: float) -> Cells:
    """The neighbours of these cells that no obstacle separates from them."""
    open_sides = world.cast(_poses(cells, origin, spacing), QUARTERS, spacing) >= spacing
    return (cells[:, None] + SIDES)[open_sides]


def _unseen(cells: Cells, seen: set[tuple[int, int]]) -> Cells:
    """The cells that are not in `seen`, each once; adds them to `seen`."""
    fresh = []
    for x, y in cells.tolist():
        if (x, y) not in seen:
            seen.add((x, y))
            fresh.append((x, y))
    return np.array(fresh, np.int64).reshape(-1, 2)
