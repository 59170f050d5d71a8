# SPDX-License-Identifier: GPL-2.0-or-later
"""Finds the places that a robot can reach, and draws some of them."""

from __future__ import annotations

import math
from collections import OrderedDict
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .._variation import key_of
from ..batch import Batch
from ..errors import StageError
from ..fleet import Bools, Floats
from ..scenes import GridMap
from ..scenes.places import largest_part, room_for
from ..world import Recipe, World

if TYPE_CHECKING:
    from .randoms import Randoms
    from .scene import Scene

Cells = npt.NDArray[np.int64]
SIDES = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
QUARTERS = np.arange(4) * (np.pi / 2)
ALL_AROUND = np.linspace(-np.pi, np.pi, 16, endpoint=False)
BLOCK = 1024  # worlds whose places are drawn at a time
ROUNDS = 40  # of drawing again what is too near to others
MOST_KNOWN = 256  # maps whose places are kept
TRIES = 100  # of drawing one place after the other, where there is hardly any room


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


def places_in_map(world: World, walls: GridMap, spacing: float = 0.25, clearance: float = 0.3) -> Floats:
    """Finds centres of cells of a map where a robot can be: in the largest part that such a robot can drive in.

    Args:
        world: a world of the map, for its other obstacles; robots are none.
        walls: the map.
        spacing: least distance between places along rows and columns, metres.
        clearance: min distance to obstacles, metres.

    Returns:
        x, y, metres: shape (m, 2).
    """
    room = largest_part(room_for(walls, clearance))
    every = max(1, math.ceil(spacing / walls.resolution))
    few = np.zeros_like(room)
    few[::every, ::every] = room[::every, ::every]
    places = walls.centers(np.argwhere(few))
    poses = np.column_stack([places, np.zeros(len(places))])
    return places[(world.cast(poses, ALL_AROUND, clearance) >= clearance).all(1)]


class Places:
    """The places in each variant of the worlds of a batch where robots can be; they are found when they are needed.

    In a scene that has a map they are those of places_in_map(), and otherwise those that the first robot can reach.

    Args:
        batch: the worlds.
        world: a world of the first variant, as it was after loading.
    """

    def __init__(self, batch: Batch, world: World) -> None:
        self._batch = batch
        self._known: OrderedDict[str, Floats] = OrderedDict()  # by the content without values of vary()
        self._of_variants: dict[int, tuple[Recipe, Floats]] = {}
        self._first = world
        self._recipe_of_first = batch._recipes[0]
        self._start = np.array(np.asarray(batch.pose)[0, 0, :2])

    def of_variant(self, number: int) -> Floats:
        """The places of a variant: x, y, metres, shape (m, 2)."""
        recipe = self._batch._recipes[number]
        found = self._of_variants.get(number)
        if found is None or found[0] is not recipe:
            key = key_of(recipe._replace(varied=()))
            if key not in self._known:
                self._known[key] = self._search(number, recipe)
            self._known.move_to_end(key)
            while len(self._known) > MOST_KNOWN:
                self._known.popitem(last=False)
            found = self._of_variants[number] = recipe, self._known[key]
        return found[1]

    def _search(self, number: int, recipe: Recipe) -> Floats:
        is_first = recipe is self._recipe_of_first
        world = self._first if is_first else World._from_recipe(recipe._replace(varied=()))
        if recipe.scene is not None and recipe.scene.map is not None:
            return places_in_map(world, recipe.scene.map)
        if is_first:
            return reachable_places(world, self._start)
        robot = next(name for name, id_ in zip(self._batch.names, self._batch._ids[number]) if id_ is not None)
        return reachable_places(world, world.model(robot).pose[:2])

    def of_worlds(self, numbers: Cells) -> tuple[Floats, Cells, Cells]:
        """All places, and the index of the first and the number of those of each world."""
        if len(self._batch._recipes) == 1:
            places = self.of_variant(0)
            return places, np.zeros(1, np.int64), np.full(1, len(places))
        variants, of_worlds = np.unique(self._batch.variant[numbers], return_inverse=True)
        parts = [self.of_variant(int(variant)) for variant in variants]
        counts = np.array([len(part) for part in parts])
        firsts = np.cumsum(counts) - counts
        return np.concatenate(parts), firsts[of_worlds], counts[of_worlds]


def scattered(scene: Scene, known: Places, randoms: Randoms, count: int, gap: float, choice: Floats | None) -> Floats:
    """Implements Scene.scatter()."""
    if choice is None:
        choice, first, length = known.of_worlds(scene.numbers())
    else:
        first, length = np.zeros(1, np.int64), np.full(1, choice.shape[-2])
    draw = _Draw(choice, np.broadcast_to(first, scene.n), np.broadcast_to(length, scene.n))
    made = np.empty((scene.n, count, 2))
    for start in range(0, scene.n, BLOCK):
        rows = np.arange(start, min(start + BLOCK, scene.n))
        made[rows] = draw.apart(rows, randoms.part(rows), count, gap)
    randoms.bits()  # counts as a call
    return made


def _too_near(points: Floats, gap: float) -> Bools:
    """True for points that are too near to one with a smaller number: shape (m, count)."""
    x, y = points[..., 0], points[..., 1]
    away_x, away_y = x[:, :, None] - x[:, None, :], y[:, :, None] - y[:, None, :]
    near = away_x * away_x + away_y * away_y < gap * gap
    return (near & np.tri(points.shape[1], k=-1, dtype=bool)).any(2)


class _Draw:
    """Draws places of worlds.

    Args:
        places: places of all worlds, shape (p, 2), or of each world, shape (n, p, 2).
        first, length: the index of the first and the number of the places of each world: shape (n,).
    """

    def __init__(self, places: Floats, first: Cells, length: Cells) -> None:
        self._places = places
        self._first = first
        self._length = length

    def apart(self, rows: Cells, randoms: Randoms, count: int, gap: float) -> Floats:
        """Places of worlds with a minimum distance from each other: shape (m, count, 2)."""
        further = randoms.split()
        found, left = self._some(rows, randoms.split(), count), np.arange(len(rows))
        for _ in range(ROUNDS):
            wrong = _too_near(found[left], gap)
            bad = wrong.any(1)
            if not bad.any():
                return found
            left, wrong, further = left[bad], wrong[bad], further.part(bad)
            again = self._some(rows[left], further, count)
            found[left] = np.where(wrong[..., None], again, found[left])
        for number, row in enumerate(left):
            found[row] = self._one_by_one(int(rows[row]), further.part([number]), count, gap)
        return found

    def _some(self, rows: Cells, randoms: Randoms, count: int) -> Floats:
        """Places of worlds that may be too near to each other: shape (m, count, 2)."""
        index = self._first[rows, None] + randoms.integers(self._length[rows, None], count)
        return self._places[index] if self._places.ndim == 2 else self._places[rows[:, None], index]

    def _one_by_one(self, row: int, alone: Randoms, count: int, gap: float) -> Floats:
        """Places of one world, each drawn from those that are far enough from the ones before: shape (count, 2)."""
        whole = self._places if self._places.ndim == 2 else self._places[row]
        choice = whole[self._first[row]:self._first[row] + self._length[row]]
        most = 0
        for _ in range(TRIES):
            found = _drawn(choice, alone.uniform(count)[0], gap)
            if len(found) == count:
                return found
            most = max(most, len(found))
        raise StageError(f"found room for {most} robots or goals {gap:g} m apart, expected {count}")


def _drawn(choice: Floats, units: Floats, gap: float) -> Floats:
    """Draws places, each from those that are far enough from the ones before, until none is left."""
    left, found = choice, np.empty((len(units), 2))
    for i, unit in enumerate(units):
        if len(left) == 0:
            return found[:i]
        found[i] = left[int(unit * len(left))]
        left = left[((left - found[i]) ** 2).sum(1) >= gap * gap]
    return found


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
