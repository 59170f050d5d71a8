# SPDX-License-Identifier: GPL-2.0-or-later
"""Where robots can get to."""

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
    """Places on a grid to which a way leads along its lines, without coming near to anything but robots.

    Args:
        world: whose map counts.
        start: x, y, where ways begin, a place in any case: shape (2,).
        spacing: of the grid's lines, metres.
        clearance: how much is free around each other place, metres.
        most: when there are so many, those further off are left out.

    Returns:
        x, y, metres: shape (m, 2), those at the end of shorter ways first.
    """
    origin = np.asarray(start, np.float64)
    front = np.zeros((1, 2), np.int64)
    seen = {(0, 0)}
    found, count = [front], 1
    while len(front) and count < most:
        front = _new_ones(_next(world, front, origin, spacing), seen)
        clear = world.cast(_poses(front, origin, spacing), ALL_AROUND, clearance) >= clearance
        front = front[clear.all(1)]
        found.append(front)
        count += len(front)
    return origin + np.concatenate(found)[:most] * spacing


def _poses(cells: Cells, origin: Floats, spacing: float) -> Floats:
    return np.column_stack([origin + cells * spacing, np.zeros(len(cells))])


def _next(world: World, cells: Cells, origin: Floats, spacing: float) -> Cells:
    """The neighbours that nothing separates from these cells."""
    open_sides = world.cast(_poses(cells, origin, spacing), QUARTERS, spacing) >= spacing
    return (cells[:, None] + SIDES)[open_sides]


def _new_ones(cells: Cells, seen: set[tuple[int, int]]) -> Cells:
    """Those that have not been seen, each once; they have been seen then."""
    fresh = []
    for x, y in cells.tolist():
        if (x, y) not in seen:
            seen.add((x, y))
            fresh.append((x, y))
    return np.array(fresh, np.int64).reshape(-1, 2)
