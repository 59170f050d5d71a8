# SPDX-License-Identifier: GPL-2.0-or-later
"""Places in maps that are free, and connected with each other."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from .._checks import integer
from .draws import Draws
from .grid_map import GridMap
from .properties import Number, checked

Cells = npt.NDArray[np.bool_]


def free_places(map: GridMap, n: int, radius: float, seed: int = 0) -> npt.NDArray[np.float64]:
    """Finds random places for robots at centres of cells: discs around them touch neither walls nor each other.

    A disc could also move from each place to all others without touching a wall. All cells are in the map.

    Args:
        map: the map.
        n: number of places.
        radius: that of the discs, metres.
        seed: of the random numbers. Equal seeds give equal places.

    Returns:
        x, y and heading: shape (n, 3), metres and radians.

    Raises:
        ValueError: there is no room for as many.
    """
    n = integer(n, "the number of places", 0)
    radius = checked(Number("metres, 0 or more", least=0), radius, "free_places(): radius")
    room = largest_part(room_for(map, radius))
    cells = _apart(room, n, 2 * radius / map.resolution, Draws(seed))
    if len(cells) < n:
        raise ValueError(f"free_places(): found room for {len(cells)} discs of the radius {radius:g} m in {map!r}, "
                         f"expected {n}")
    headings = Draws(seed + 1).fractions(n) * (2 * math.pi) - math.pi
    return np.column_stack([map.centers(cells), headings])


def room_for(map: GridMap, radius: float) -> Cells:
    """True for cells at whose centre a disc of this radius (metres) touches no wall, and stays inside of the map."""
    reach = radius / map.resolution
    rows, columns = map.shape
    far = min(max(rows, columns), math.ceil(reach + 0.5))
    walls = np.pad(map.occupied, far, constant_values=True)
    sums = np.pad(np.cumsum(walls, axis=1, dtype=np.int32), ((0, 0), (1, 0)))
    room = ~map.occupied
    for step in range(-far, far + 1):
        gap = max(0.0, abs(step) - 0.5)  # from the centre to that row
        if gap >= reach and step != 0:
            continue
        side = min(far, math.ceil(math.sqrt(reach * reach - gap * gap) + 0.5) - 1)  # cells that the disc reaches there
        row = sums[far + step:far + step + rows]
        room &= row[:, far + side + 1:far + side + 1 + columns] == row[:, far - side:far - side + columns]
    return room


def largest_part(free: Cells) -> Cells:
    """The largest part of the cells that is connected along rows and columns."""
    edges = np.diff(np.pad(free, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, starts = np.nonzero(edges == 1)  # of runs of free cells
    ends = np.nonzero(edges == -1)[1]
    if not len(rows):
        return np.zeros_like(free)
    labels = _labels(rows, starts, ends, free.shape[1] + 2)
    chosen = labels == np.bincount(labels, weights=ends - starts).argmax()
    marks = np.zeros((free.shape[0], free.shape[1] + 1), np.int8)
    marks[rows[chosen], starts[chosen]] += 1
    marks[rows[chosen], ends[chosen]] -= 1
    return np.cumsum(marks, axis=1)[:, :-1] > 0


def _labels(rows: npt.NDArray[np.int64], starts: npt.NDArray[np.int64], ends: npt.NDArray[np.int64],
            width: int) -> npt.NDArray[np.int64]:
    """A number for each run of cells; runs that are connected have the same."""
    # The runs in the next row that overlap a run are consecutive.
    first = np.searchsorted(rows * width + ends, (rows + 1) * width + starts, "right")
    counts = np.maximum(0, np.searchsorted(rows * width + starts, (rows + 1) * width + ends, "left") - first)
    above = np.repeat(np.arange(len(rows)), counts)
    below = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts) + np.repeat(first, counts)
    labels = np.arange(len(rows))
    while True:
        least = np.minimum(labels[above], labels[below])
        joined = labels.copy()
        for ends_of_links in (labels[above], labels[below]):
            np.minimum.at(joined, ends_of_links, least)
        while not np.array_equal(joined, joined[joined]):
            joined = joined[joined]
        if np.array_equal(joined, labels):
            return labels
        labels = joined


def _apart(room: Cells, n: int, distance: float, draws: Draws) -> npt.NDArray[np.int64]:
    """Up to `n` random cells, further from each other than `distance` cells: rows and columns."""
    cells = np.argwhere(room)
    taken = np.zeros_like(room)
    reach = min(math.floor(distance), max(room.shape))
    steps = np.arange(-reach, reach + 1)
    disc = steps[:, None]**2 + steps**2 <= distance * distance
    chosen: list[tuple[int, int]] = []
    for row, column in cells[draws.order(len(cells))].tolist():
        if len(chosen) == n:
            break
        if taken[row, column]:
            continue
        chosen.append((row, column))
        top, left = max(0, row - reach), max(0, column - reach)
        area = taken[top:row + reach + 1, left:column + reach + 1]
        area |= disc[top - row + reach:, left - column + reach:][:area.shape[0], :area.shape[1]]
    return np.array(chosen, np.int64).reshape(-1, 2)
