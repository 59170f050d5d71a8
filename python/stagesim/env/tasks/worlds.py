# SPDX-License-Identifier: GPL-2.0-or-later
"""The default worlds of tasks that have no world file: scenes with a map of cells of 0.1 m."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ...scenes import GridMap, Polygon, Ranger, Robot, Scene

Cells = npt.NDArray[np.bool_]
CELL = 0.1  # side of a cell of the maps, metres
COLORS = ("red", "blue", "green", "orange", "purple", "black", "brown", "magenta")
RESOLUTION = 0.02  # of collisions and rays, metres


def rooms(across: int, side: float, robots: int) -> Scene:
    """Square rooms in rows, with wide doors between neighbours and a pillar in each, and up to four robots in each.

    Args:
        across: number of rows, and of rooms in a row.
        side: side of a room from the middle of a wall to that of the next one, metres.
        robots: number of robots.
    """
    cells, half = round(side / CELL), round(0.34 * side / CELL)
    walls = np.zeros((across * cells + 1,) * 2, bool)
    walls[::cells] = walls[:, ::cells] = True
    for i in range(across):
        middle = i * cells + cells // 2
        for wall in range(cells, across * cells, cells):
            walls[wall, middle - half:middle + half + 1] = walls[middle - half:middle + half + 1, wall] = False
        for j in range(across):
            row, column = middle, j * cells + cells // 2
            walls[row - 2:row + 3, column - 2:column + 3] = True
    starts = []
    for i in range(robots):
        aside = 0.25 * (1 if i // across**2 % 2 == 0 else -1), 0.25 * (1 if i // across**2 % 4 in (0, 3) else -1)
        cell = i % across - (across - 1) / 2, i // across % across - (across - 1) / 2
        starts.append(((cell[0] + aside[0]) * side, (cell[1] + aside[1]) * side, 0))
    return _scene(_centred(walls), [_robot(i, start) for i, start in enumerate(starts)])


def corridor(length: float = 6.0, width: float = 0.5, bay: float = 1.4, end: float = 1.4) -> Scene:
    """A corridor along x with a bay beside its middle and a square room at each end, and two round robots in each room.

    Two robots cannot pass each other but in the bay and in the rooms.

    Args:
        length: of the corridor between the rooms, metres.
        width: of the corridor and depth of the bay, metres.
        bay: length of the bay, metres.
        end: side of the rooms, metres.
    """
    long, wide, stay, square = (round(metres / CELL) for metres in (length, width, bay, end))
    columns, rows = long + 2 * square + 2, square + 2
    walls = np.ones((rows, columns), bool)
    low = (rows - wide) // 2
    walls[low:low + wide, 1:-1] = False
    walls[1:-1, 1:1 + square] = walls[1:-1, -1 - square:-1] = False
    walls[low:low + 2 * wide, (columns - stay) // 2:(columns + stay) // 2] = False
    away = (length + end) / 2
    places = [(-away, 0.3, 0.0), (-away, -0.3, 0.0), (away, 0.3, math.pi), (away, -0.3, math.pi)]
    return _scene(_centred(walls), [_robot(i, place, round=True) for i, place in enumerate(places)])


def hall(width: float, height: float, pillars: Sequence[tuple[float, float]], robots: Sequence[Robot]) -> Scene:
    """A hall with pillars of 0.5 m at these places.

    Args:
        width, height: of the inside, metres.
        pillars: centres of the pillars relative to that of the hall, metres.
        robots: what drives in it.
    """
    rows, columns = round(height / CELL) + 2, round(width / CELL) + 2
    walls = np.zeros((rows, columns), bool)
    walls[[0, -1]] = walls[:, [0, -1]] = True
    for x, y in pillars:
        row, column = round(rows / 2 + y / CELL), round(columns / 2 + x / CELL)
        walls[row - 2:row + 3, column - 2:column + 3] = True
    return _scene(_centred(walls), robots)


def search_hall() -> Scene:
    """A hall of 8 m by 8 m with four pillars and four robots."""
    places = [(0.4, 0.4, 0), (-0.4, 0.4, 0), (0.4, -0.4, 0), (-0.4, -0.4, 0)]
    return hall(8, 8, [(2, 2), (-2, 2), (2, -2), (-2, -2)], [_robot(i, place) for i, place in enumerate(places)])


def hunting_ground() -> Scene:
    """A hall of 8 m by 8 m with three pillars, three robots and, as the last one, a faster robot."""
    pursuers = [_robot(i, (-3, y, 0)) for i, y in enumerate((-1, 0, 1))]
    return hall(8, 8, [(0, 1.8), (1.6, -1.2), (-1.6, -1.2)],
                [*pursuers, _robot(3, (3, 0, math.pi), fastest=0.7, turning=math.pi, name="evader")])


UNIT = 0.25  # side of the seven squares that make the block of Push-T, metres: four in a row and three below
BAR = 6 / 7 * UNIT  # from the centre of area, which is the origin of the block, to the middle of the row
#: Its two rectangles: least x and y, greatest x and y, metres.
T_PARTS = ((-2 * UNIT, BAR - UNIT / 2, 2 * UNIT, BAR + UNIT / 2), (-UNIT / 2, BAR - 3.5 * UNIT, UNIT / 2, BAR - UNIT / 2))


def t_corners() -> list[tuple[float, float]]:
    """The corners of the block of Push-T counter-clockwise, metres: shape (8, 2)."""
    (left, middle, right, top), (near, bottom, far, _) = T_PARTS
    return [(left, middle), (near, middle), (near, bottom), (far, bottom), (far, middle), (right, middle), (right, top),
            (left, top)]


def pushing_room(target: tuple[float, float, float]) -> Scene:
    """A room of 5 m by 5 m with a block shaped like a T, its target painted on the floor, and two round robots.

    The robots drive in all directions. Each of them is strong enough to push the block alone.
    """
    block = Polygon(points=t_corners(), height=0.3, name="block", color="peru", mass=4, pushable=True, friction=0.2)
    paint = Polygon(points=t_corners(), height=0.01, name="target", color="PaleGreen", pose=target, obstacle_return=False,
                    ranger_return=-1)
    robots = [Robot(name=f"r{i}", pose=(x, -1.5, 0), size=(0.3, 0.3, 0.25), round=True, mass=10, friction=0.2, drive="omni",
                    localization="gps", color=COLORS[i], velocity_bounds=(-0.5, 0.5, -0.5, 0.5, 0, 0, -1, 1))
              for i, x in enumerate((-0.5, 0.5))]
    room = hall(5, 5, [], [])
    return Scene(room.map, [paint, block, *robots], resolution=0.1, interval_sim=100)


def _centred(walls: Cells) -> GridMap:
    """A map whose centre is the origin."""
    rows, columns = walls.shape
    return GridMap(walls, CELL, (-columns * CELL / 2, -rows * CELL / 2, 0), height=0.6)


def _scene(walls: GridMap, robots: Sequence[Robot]) -> Scene:
    return Scene(walls, list(robots), resolution=RESOLUTION, interval_sim=100)


def _robot(number: int, pose: Sequence[float], *, fastest: float = 0.5, turning: float = math.pi / 2, round: bool = False,
           name: str | None = None) -> Robot:
    """A robot with a lidar of 32 rays in all directions, which sees other robots.

    Args:
        number: chooses its colour and its name.
        pose: x, y, heading, metres and radians.
        fastest: speed, m/s.
        turning: turn rate, rad/s.
        round: whether it is a disc instead of a square, of 0.3 m in either case.
        name: another name.
    """
    lidar = Ranger(size=(0.1, 0.1, 0.1), range=(0, 4), fov=2 * math.pi * 31 / 32, samples=32)
    return Robot(name=name or f"r{number}", pose=pose, size=(0.3, 0.3, 0.25), round=round or None, drive="diff",
                 localization="gps", color=COLORS[number % len(COLORS)], sensors=[lidar],
                 velocity_bounds=(-fastest, fastest, 0, 0, 0, 0, -turning, turning))
