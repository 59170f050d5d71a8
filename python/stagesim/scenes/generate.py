# SPDX-License-Identifier: GPL-2.0-or-later
"""Random maps. Equal arguments and seeds give equal maps on every platform."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from .._checks import integer
from .draws import Draws
from .grid_map import MOST_CELLS, MOST_SIDE, GridMap
from .properties import Number, Numbers, checked

Cells = npt.NDArray[np.bool_]
Origin = Sequence[float]


def rooms(width: float = 12, height: float = 8, resolution: float = 0.1, *, room: float = 2.5, door: float = 1.0,
          origin: Origin = (0, 0, 0), seed: int = 0) -> GridMap:
    """Makes a map of rooms with doors, all of which can be reached from each other.

    Args:
        width, height: size of the map, metres.
        resolution: side of a cell, metres.
        room: least width of a room, metres.
        door: width of the doors, metres.
        origin: pose of the lower left corner.
        seed: of the random numbers.
    """
    walls = _walled("rooms()", width, height, resolution)
    least = _cells("rooms(): room", room, resolution)
    gap = _cells("rooms(): door", door, resolution)
    draws = Draws(seed)
    areas = [(1, 1, walls.shape[0] - 1, walls.shape[1] - 1)]
    while areas:
        areas += _divide(walls, areas.pop(), least, gap, draws)
    return GridMap(walls, resolution, origin)


def maze(rows: int = 6, columns: int = 8, resolution: float = 0.1, *, corridor: float = 1.0, loops: float = 0.0,
         origin: Origin = (0, 0, 0), seed: int = 0) -> GridMap:
    """Makes a map of a maze, in which each place can be reached from all others.

    Args:
        rows, columns: size of the maze, corridors.
        resolution: side of a cell and thickness of the walls, metres.
        corridor: width of a corridor, metres.
        loops: the share of the remaining inner walls that is removed; 0: there is one way from each place to another.
        origin: pose of the lower left corner.
        seed: of the random numbers.
    """
    rows, columns = integer(rows, "maze(): rows", 1), integer(columns, "maze(): columns", 1)
    loops = checked(Number("a fraction from 0 to 1", least=0, most=1), loops, "maze(): loops")
    _checked_resolution("maze()", resolution)
    side = _cells("maze(): corridor", corridor, resolution) + 1
    _check_count("maze()", rows * side + 1, columns * side + 1)
    walls = np.zeros((rows * side + 1, columns * side + 1), bool)
    walls[::side] = walls[:, ::side] = True
    draws = Draws(seed)
    inner = _passages(rows, columns, draws)
    closed = [wall for wall, is_open in inner.items() if not is_open]
    keep = round(len(closed) * (1 - loops))
    opened = [wall for wall, is_open in inner.items() if is_open]
    opened += [closed[i] for i in draws.order(len(closed))[keep:].tolist()]
    for (row, column), (below, beside) in opened:
        if row == below:
            walls[row * side + 1:(row + 1) * side, beside * side] = False
        else:
            walls[below * side, column * side + 1:(column + 1) * side] = False
    return GridMap(walls, resolution, origin)


def clutter(width: float = 10, height: float = 10, resolution: float = 0.1, *, share: float = 0.15,
            size: Sequence[float] = (0.2, 0.8), clear: Sequence[Sequence[float]] = (), origin: Origin = (0, 0, 0),
            seed: int = 0) -> GridMap:
    """Makes a map of rectangular obstacles between four walls. Use free_places() for places that are connected.

    Args:
        width, height: size of the map, metres.
        resolution: side of a cell, metres.
        share: the share of the cells that are occupied by obstacles, 0 to 0.9, apart from those of `clear`.
        size: least and largest side of an obstacle, metres.
        clear: places that stay free: x, y and radius of each, metres from the lower left corner.
        origin: pose of the lower left corner.
        seed: of the random numbers.
    """
    walls = _walled("clutter()", width, height, resolution)
    share = checked(Number("a fraction from 0 to 0.9", least=0, most=0.9), share, "clutter(): share")
    sides = checked(Numbers("two numbers in order: metres above 0", 2, least=1e-9, in_order=True), size,
                    "clutter(): size")
    least, most = (_cells("clutter(): size", length, resolution) for length in sides)
    rows, columns = walls.shape
    free = ~walls & ~_discs(walls.shape, resolution, clear)
    left_free = (1 - share) * np.count_nonzero(free)
    count = np.count_nonzero(free)
    draws = Draws(seed)
    while count > left_free:
        tall, wide = draws.between(least, most), draws.between(least, most)
        top, left = draws.below(rows), draws.below(columns)
        place = free[top:top + tall, left:left + wide]
        walls[top:top + tall, left:left + wide] |= place
        count -= np.count_nonzero(place)
        place[...] = False
    return GridMap(walls, resolution, origin)


# ---- parts ----


def _divide(walls: Cells, area: tuple[int, int, int, int], least: int, gap: int,
            draws: Draws) -> list[tuple[int, int, int, int]]:
    """Divides an area by a wall with a door; returns both parts, or nothing if it is too small.

    An area is its first and last row and column, without the last ones. A wall never ends at a door.
    """
    top, left, bottom, right = area
    tall, wide = bottom - top, right - left
    for across in (tall >= wide, tall < wide):  # the wall runs along a row
        first, last = (top, bottom) if across else (left, right)
        near, far = (walls[:, left - 1], walls[:, right]) if across else (walls[top - 1], walls[bottom])
        places = [at for at in range(first + least, last - least) if near[at] and far[at]]
        if not places:
            continue
        at = places[draws.below(len(places))]
        length, start = (wide, left) if across else (tall, top)
        door = min(gap, length)
        opening = start + draws.between(0, length - door)
        line = walls[at, left:right] if across else walls[top:bottom, at]
        line[:] = True
        line[opening - start:opening - start + door] = False
        return ([(top, left, at, right), (at + 1, left, bottom, right)] if across else
                [(top, left, bottom, at), (top, at + 1, bottom, right)])
    return []


_Wall = tuple[tuple[int, int], tuple[int, int]]


def _passages(rows: int, columns: int, draws: Draws) -> dict[_Wall, bool]:
    """All inner walls between places of a maze, by both places in order; True: it is open. They make a tree."""
    inner: dict[_Wall, bool] = {}
    for row in range(rows):
        for column in range(columns):
            for other in ((row, column + 1), (row + 1, column)):
                if other[0] < rows and other[1] < columns:
                    inner[(row, column), other] = False
    path = [(draws.below(rows), draws.below(columns))]
    seen = set(path)
    while path:
        row, column = path[-1]
        around = [(row, column - 1), (row, column + 1), (row - 1, column), (row + 1, column)]
        new = [(r, c) for r, c in around if 0 <= r < rows and 0 <= c < columns and (r, c) not in seen]
        if not new:
            path.pop()
            continue
        following = new[draws.below(len(new))]
        first, second = sorted((path[-1], following))
        inner[first, second] = True
        seen.add(following)
        path.append(following)
    return inner


def _discs(shape: tuple[int, int], resolution: float, discs: Sequence[Sequence[float]]) -> Cells:
    """True for cells whose centre is in one of the discs."""
    rows, columns = (np.arange(length) + 0.5 for length in shape)
    inside = np.zeros(shape, bool)
    kind = Numbers("x, y and radius in metres", 3)
    for i, disc in enumerate(discs):
        x, y, radius = (number / resolution for number in checked(kind, disc, f"clutter(): clear[{i}]"))
        inside |= (rows[:, None] - y) ** 2 + (columns - x) ** 2 <= radius * radius
    return inside


def _walled(function: str, width: float, height: float, resolution: float) -> Cells:
    """A map with nothing but a wall around it."""
    _checked_resolution(function, resolution)
    rows, columns = (_cells(f"{function}: {name}", length, resolution)
                     for name, length in (("height", height), ("width", width)))
    _check_count(function, rows, columns)
    walls = np.zeros((rows, columns), bool)
    walls[[0, -1]] = walls[:, [0, -1]] = True
    return walls


def _checked_resolution(function: str, resolution: float) -> None:
    checked(Number("metres above 0", above=0), resolution, f"{function}: resolution")


def _cells(place: str, length: float, resolution: float) -> int:
    """A length in whole cells, at least one."""
    return max(1, round(checked(Number("metres above 0", above=0), length, place) / resolution))


def _check_count(function: str, rows: int, columns: int) -> None:
    if not (3 <= rows <= MOST_SIDE and 3 <= columns <= MOST_SIDE and rows * columns <= MOST_CELLS):
        raise ValueError(f"{function}: found {rows} x {columns} cells, expected from 3 to {MOST_SIDE} in each direction and "
                         f"at most {MOST_CELLS} in all")
