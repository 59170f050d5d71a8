# SPDX-License-Identifier: GPL-2.0-or-later
"""Where robots can get to."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..fleet import Bools, Floats

if TYPE_CHECKING:
    from ..world import World

Cells = npt.NDArray[np.int64]
SIDES = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
ALL_AROUND = np.linspace(-np.pi, np.pi, 16, endpoint=False)


def reachable_places(world: World, starts: Floats, spacing: float = 0.25, clearance: float = 0.3,
                     most: int = 20000) -> Floats:
    """Places on a grid to which a way leads along its lines, without coming near to anything but robots.

    Args:
        world: whose map counts.
        starts: x, y, where ways begin: shape (k, 2).
        spacing: of the grid's lines, metres.
        clearance: how much is free around each place, metres.
        most: when there are so many, those further off are left out.

    Returns:
        x, y, metres: shape (m, 2), those at the end of shorter ways first.
    """
    front = _new_ones(np.rint(starts / spacing).astype(np.int64), set())
    front = front[_free(world, front, spacing, clearance)]
    seen = {(int(x), int(y)) for x, y in front}
    found = [front]
    count = len(front)
    while len(front) and count < most:
        front = _new_ones(_next(world, front, spacing), seen)
        front = front[_free(world, front, spacing, clearance)]
        found.append(front)
        count += len(front)
    return np.concatenate(found)[:most] * spacing


def _next(world: World, cells: Cells, spacing: float) -> Cells:
    """The neighbours that nothing separates from these cells."""
    poses = np.column_stack([cells * spacing, np.zeros(len(cells))])
    bearings = np.arange(4) * (np.pi / 2)
    open_sides = world.cast(poses, bearings, spacing) >= spacing
    return (cells[:, None] + SIDES)[open_sides]


def _new_ones(cells: Cells, seen: set[tuple[int, int]]) -> Cells:
    """Those that have not been seen, each once; they have been seen then."""
    fresh = []
    for x, y in cells.tolist():
        if (x, y) not in seen:
            seen.add((x, y))
            fresh.append((x, y))
    return np.array(fresh, np.int64).reshape(-1, 2)


def _free(world: World, cells: Cells, spacing: float, clearance: float) -> Bools:
    """Whether nothing is near to them."""
    poses = np.column_stack([cells * spacing, np.zeros(len(cells))])
    return np.all(world.cast(poses, ALL_AROUND, clearance) >= clearance, axis=1)
