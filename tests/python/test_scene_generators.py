# SPDX-License-Identifier: GPL-2.0-or-later
"""Random maps of rooms, mazes and clutter, and free places in maps."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim.scenes import GridMap, Ranger, Robot, Scene, clutter, free_places, maze, rooms
from stagesim.scenes.places import largest_part, room_for


def parts(free: np.ndarray) -> list[set[tuple[int, int]]]:
    """The connected parts of cells, found one by one."""
    left = set(map(tuple, np.argwhere(free).tolist()))
    found = []
    while left:
        part = {left.pop()}
        todo = list(part)
        while todo:
            row, column = todo.pop()
            for cell in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
                if cell in left:
                    left.remove(cell)
                    part.add(cell)
                    todo.append(cell)
        found.append(part)
    return found


def has_room(walls: GridMap, row: int, column: int, radius: float) -> bool:
    """Whether a disc at the centre of a cell touches neither a wall nor the edge of the map."""
    reach = radius / walls.resolution
    rows, columns = walls.shape
    for r in range(-1, rows + 1):
        for c in range(-1, columns + 1):
            inside = 0 <= r < rows and 0 <= c < columns
            gap = math.hypot(max(0, abs(r - row) - .5), max(0, abs(c - column) - .5))
            if (not inside or walls.occupied[r, c]) and (gap < reach or (r, c) == (row, column)):
                return False
    return True


@pytest.mark.parametrize("seed", range(12))
def test_all_rooms_can_be_reached(seed: int) -> None:
    made = rooms(12, 9, 0.1, room=2, door=1, seed=seed)
    assert made.shape == (90, 120) and made.occupied[[0, -1]].all() and made.occupied[:, [0, -1]].all()
    assert len(parts(~made.occupied)) == 1
    assert np.count_nonzero(made.occupied) > 2 * 210 + 100, "there are inner walls"
    # Robots pass the doors: a disc of 0.8 m can go to all rooms.
    assert len(parts(room_for(made, .4))) == 1


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 7), (5, 8), (9, 9)])
@pytest.mark.parametrize("seed", range(4))
def test_mazes_have_one_way(rows: int, columns: int, seed: int) -> None:
    made = maze(rows, columns, 0.25, corridor=0.75, seed=seed)
    assert made.shape == (4 * rows + 1, 4 * columns + 1)
    centers = np.argwhere(~made.occupied)
    assert len(parts(~made.occupied)) == 1
    # A tree of places has one passage less than places; each passage has three cells.
    assert len(centers) == 9 * rows * columns + 3 * (rows * columns - 1)
    assert len(parts(~maze(rows, columns, loops=1, seed=seed).occupied)) == 1


def test_loops_open_walls() -> None:
    counts = [int(maze(6, 6, .5, corridor=.5, loops=loops, seed=3).occupied.sum()) for loops in (0, .5, 1)]
    assert counts[0] > counts[1] > counts[2]
    assert counts[2] == 13 * 13 - (36 + 60), "all inner walls are open"


@pytest.mark.parametrize("share", [0, .1, .4, .9])
def test_clutter_covers_a_share(share: float) -> None:
    made = clutter(8, 6, .1, share=share, size=(.2, .6), clear=[(1, 1, .5), (7, 5, .3)], seed=5)
    inner = made.occupied[1:-1, 1:-1]
    assert share * .97 <= inner.mean() <= share + 36 / inner.size
    for x, y, radius in ((1, 1, .5), (7, 5, .3)):
        cell = made.cell_at(x, y)
        assert cell is not None and not made.occupied[cell] and has_room(made, *cell, radius - .15)


MAPS: list[tuple[Callable[..., GridMap], dict[str, Any], str]] = [
    (rooms, {}, "f52707569aec4cfea87f19c2"), (rooms, {"width": 20, "height": 6, "resolution": .05, "room": 1.5, "seed": 12345678901}, "537fa29c431d05c1bd780dcf"),
    (maze, {}, "f0287cb0fd05b4cabb1c3058"), (maze, {"rows": 20, "columns": 10, "loops": .2, "seed": 7}, "da9749125c138eacde748382"),
    (clutter, {}, "e1edefcfd4205397baa25df7"), (clutter, {"share": .3, "clear": [(5, 5, 1)], "seed": 9}, "d2640dbf75d704e902eae266"),
]


@pytest.mark.parametrize(("make", "given", "name"), MAPS)
def test_maps_are_equal_everywhere(make: Callable[..., GridMap], given: dict[str, Any], name: str) -> None:
    assert make(**given).picture[0] == f"map_{name}.pbm"
    assert make(**given) == make(**given) != make(**{**given, "seed": 99})


def test_places_are_equal_everywhere() -> None:
    found = rooms(seed=3).free_places(4, .3, seed=2)
    assert found.tolist() == PLACES


PLACES = [[5.15, 6.75, -2.603443065020804],
          [7.8500000000000005, 4.8500000000000005, -1.653668357959425],
          [1.55, 7.050000000000001, 1.8929632932132208],
          [2.15, 3.85, 0.5162392978075951]]


@pytest.mark.parametrize("radius", [0, .04, .05, .06, .1, .15, .25, .33, 1, 30])
@pytest.mark.parametrize("seed", [1, 2])
def test_discs_have_room(radius: float, seed: int) -> None:
    walls = GridMap(np.random.default_rng(seed).random((17, 23)) < .06, 0.1, (3, -1, 0))
    room = room_for(walls, radius)
    for row in range(17):
        for column in range(23):
            assert room[row, column] == has_room(walls, row, column, radius), (row, column)


@pytest.mark.parametrize("share", [0, .2, .4, .6, 1])
@pytest.mark.parametrize("shape", [(1, 1), (1, 30), (30, 1), (25, 31)])
def test_the_largest_part_is_found(share: float, shape: tuple[int, int]) -> None:
    for seed in range(8):
        free = np.random.default_rng(seed).random(shape) >= share
        largest = largest_part(free)
        found = parts(free)
        cells = set(map(tuple, np.argwhere(largest).tolist()))
        assert (cells in found and len(cells) == max(map(len, found))) if found else not cells


def test_the_largest_part_of_a_spiral_is_found() -> None:
    free = np.ones((61, 61), bool)
    for ring in range(1, 30, 2):  # walls around each other, each open at another side
        free[ring, ring:61 - ring] = free[60 - ring, ring:61 - ring] = False
        free[ring:61 - ring, ring] = free[ring:61 - ring, 60 - ring] = False
        free[(ring, ring + 1) if ring % 4 == 1 else (60 - ring, 59 - ring)] = True
    assert (largest_part(free) == free).all() and len(parts(free)) == 1


@pytest.mark.parametrize("origin", [(0, 0, 0), (-5, 3, 0), (1, 2, .7)])
@pytest.mark.parametrize("seed", [0, 1])
def test_free_places(seed: int, origin: tuple[float, ...]) -> None:
    walls = clutter(9, 7, .1, share=.2, origin=origin, seed=seed)
    poses = free_places(walls, 20, .25, seed)
    assert poses.shape == (20, 3) and (np.abs(poses[:, 2]) <= math.pi).all()
    apart = np.linalg.norm(poses[:, None, :2] - poses[:, :2], axis=2) + 9 * np.eye(20)
    assert apart.min() > .5
    part = max(parts(room_for(walls, .25)), key=len)
    assert all(walls.cell_at(x, y) in part for x, y, _ in poses)
    assert not np.array_equal(poses, walls.free_places(20, .25, seed + 1))


def test_robots_start_free(caplog: pytest.LogCaptureFixture) -> None:
    """No world warns that a robot starts in a wall, and all robots can drive."""
    for seed, walls in enumerate([rooms(seed=1), maze(seed=1), clutter(seed=1)]):
        robots = [Robot(pose=pose, size=(.3, .3, .3), sensors=[Ranger(range=(0, 5), samples=8, fov=6)])
                  for pose in walls.free_places(10, .22, seed)]
        world = st.World.of(Scene(walls, robots))
        fleet = world.fleet()
        fleet.cmd[:, 2] = .5
        before = fleet.pose.copy()
        world.step(3)
        assert not fleet.stalled.any() and (fleet.pose[:, 2] != before[:, 2]).all()
    assert not caplog.records


MISTAKES: list[tuple[Any, type, str]] = [
    (lambda: rooms(0), ValueError, "rooms(): width: found 0, expected metres above 0"),
    (lambda: rooms(5, 5, math.nan), ValueError, "rooms(): resolution: found nan, expected metres above 0"),
    (lambda: rooms(.2, 5), ValueError, "rooms(): found 50 x 2 cells, expected from 3 to 32768 in each direction"),
    (lambda: rooms(9000, 9000, .1), ValueError, "rooms(): found 90000 x 90000 cells, expected from 3 to 32768"),
    (lambda: rooms(door=-1), ValueError, "rooms(): door: found -1, expected metres above 0"),
    (lambda: rooms(room="big"), TypeError, "rooms(): room: found 'big', expected metres above 0"),
    (lambda: rooms(seed=-1), ValueError, "found -1 as the seed, expected a whole number, 0 or more"),
    (lambda: rooms(seed=1.5), TypeError, "found 1.5 as the seed, expected a whole number, 0 or more"),
    (lambda: maze(0, 5), ValueError, "found 0 as maze(): rows, expected a whole number, 1 or more"),
    (lambda: maze(loops=2), ValueError, "maze(): loops: found 2, expected a fraction from 0 to 1"),
    (lambda: maze(4000, 4000), ValueError, "maze(): found 44001 x 44001 cells, expected from 3 to 32768"),
    (lambda: clutter(share=.95), ValueError, "clutter(): share: found 0.95, expected a fraction from 0 to 0.9"),
    (lambda: clutter(size=(2, 1)), ValueError, "clutter(): size: found (2, 1), expected two numbers in order"),
    (lambda: clutter(clear=[(1, 2)]), ValueError, "clutter(): clear[0]: found (1, 2), expected x, y and radius in metres"),
    (lambda: rooms().free_places(3, -1), ValueError, "free_places(): radius: found -1, expected metres, 0 or more"),
    (lambda: rooms().free_places(-3, 1), ValueError, "found -3 as the number of places, expected a whole number, 0 or more"),
    (lambda: rooms(4, 4).free_places(900, .3), ValueError, "free_places(): found room for "),
    (lambda: GridMap(np.ones((3, 3), bool), 1).free_places(1, .1), ValueError,
     "free_places(): found room for 0 discs of the radius 0.1 m in <GridMap of 3 x 3 cells of 1 m>, expected 1"),
]


@pytest.mark.parametrize(("make", "kind", "message"), MISTAKES)
def test_mistakes_are_told_in_one_line(make: Any, kind: type[Exception], message: str) -> None:
    with pytest.raises(kind) as caught:
        make()
    assert str(caught.value).startswith(message) and "\n" not in str(caught.value)
