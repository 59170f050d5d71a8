# SPDX-License-Identifier: GPL-2.0-or-later
"""The task in which robots cover a room."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.spaces import Box, Dict, Space

from ...fleet import Floats
from ..arrays import Array, Arrays, namespace_of
from ..features import free_space, joined, speeds, with_headings
from ..randoms import Randoms
from ..scene import Scene
from ..task import Observations, Outcome, Task
from .common import stall_penalty
from .worlds import search_hall

PIXELS = 8  # of the image along both sides
STRIDE = 3  # cells between neighbouring pixels
HEADINGS = 64  # of the image
LEFT, DONE = 128, 255  # values of cells that are not covered yet, and of covered ones; others are 0
CLEAR = 0.3  # metres around a place of Scene.places that are free


@dataclass
class Cover(Task):
    """Robots drive over a room until nearly all of it is covered.

    A robot covers the cells within `radius` of its own cell, from centre to centre; walls in between don't matter. The
    cells of the room are those that a robot can drive over. They start at random places.

    Reward: the area in square metres that the robot has covered first (of two at once the one with the smaller number),
    1 for each robot when the share `enough` is covered, which terminates the episode, -0.05 for an action that ends
    stalled. Observation: a dictionary. "state" has the share covered, speeds and ranges as in Navigate. "image" is seen
    from the robot: 8 x 8 cells, each the third one in its row and column. It has the type uint8; 255 is covered, 128 is
    not covered yet, 0 is no cell of the room. The robot is in the middle and looks to the right; a row further down is
    further to its left. The image turns in 64 steps. Without `image` it is a vector: "state", and then the pixels row by
    row in units of 255. Info: `covered` (0 to 1), `is_success`.

    The room is that of the first world, also with maps that are made anew.

    Args:
        radius: metres.
        cell: side of a cell, metres.
        enough: share of the cells at which the room counts as covered, 0 to 1.
        image: whether observations are a dictionary with an image, or a vector.
        reach: ranges are clipped to this, metres.
        steps, limit, top_speed: see Task.
    """

    radius: float = 0.6
    cell: float = 0.25
    enough: float = 0.95
    image: bool = True
    reach: float = 4.0
    steps: int = 2
    limit: int = 400
    top_speed: tuple[float, float, float] = (0.5, 0.0, 1.5)
    world = search_hall()

    def size(self, scene: Scene) -> int:
        return 3 + scene.ranges.shape[-1] + PIXELS * PIXELS

    def observation_space(self, scene: Scene) -> Space[Any]:
        if not self.image:
            return super().observation_space(scene)
        return Dict({"image": Box(0, 255, (PIXELS, PIXELS, 1), np.uint8),
                     "state": Box(-1, 1, (3 + scene.ranges.shape[-1],), np.float32)})

    def prepare(self, scene: Scene) -> None:
        grid, origin = _grid_of(scene.places, self.cell)
        n = scene.n
        scene.notes["cells"] = scene.arrays.of(np.broadcast_to(grid, (n, *grid.shape)))
        scene.notes["origin"] = scene.arrays.of(np.broadcast_to(origin, (n, 2)))
        scene.notes["count"] = scene.arrays.of(np.full(n, np.count_nonzero(grid)))
        scene.notes["covered"] = scene.arrays.zeros((n,), "int64")

    def begin(self, scene: Scene, randoms: Randoms) -> Array | None:
        xp = scene.xp
        starts = scene.scatter(randoms, scene.robots)
        cells = scene.notes["cells"]
        cells = xp.where(cells > 0, xp.full_like(cells, LEFT), cells)
        at = self._cells_at(scene, starts)
        scene.notes["covered"] = xp.sum(self._sweep(scene, cells, at, at >= 0), axis=1)
        scene.notes["cells"], scene.notes["at"] = cells, at
        return with_headings(starts, randoms.headings(scene.robots))

    def _cells_at(self, scene: Scene, pose: Array) -> Array:
        """Numbers of the robots' cells, row by row: int64, shape (n, robots)."""
        xp = scene.xp
        rows, columns = scene.notes["cells"].shape[1:]
        origin = scene.notes["origin"]
        found = []
        for axis, most in ((0, columns), (1, rows)):
            place = (pose[..., axis] - origin[:, axis, None]) * (1 / self.cell)
            place = xp.where(xp.isnan(place), 0.0, place)
            found.append(xp.astype(xp.floor(xp.clip(place, min=_SIGHT, max=most - _SIGHT - 1)), xp.int64))
        return found[1] * columns + found[0]

    def _sweep(self, scene: Scene, cells: Array, at: Array, moved: Array) -> Array:
        """Marks the cells around robots that have moved to another one as covered.

        Returns:
            How many of them are new: int64, shape (n, robots).
        """
        xp, flat = scene.xp, cells.reshape(-1)
        offsets = _disc(scene.arrays, self.radius / self.cell, cells.shape[2])
        number = at + _firsts(cells)
        found = xp.zeros_like(at)
        for robot in range(at.shape[1]):
            worlds = xp.nonzero(moved[:, robot])[0]
            around = (number[worlds, robot][:, None] + offsets).reshape(-1)
            new = xp.take(flat, around, axis=0) == LEFT
            flat[around[new]] = DONE
            found[worlds, robot] = xp.count_nonzero(new.reshape((-1, offsets.shape[0])), axis=1)
        return found

    def observe(self, scene: Scene) -> Observations:
        xp, notes, shape = scene.xp, scene.notes, (scene.n, scene.robots)
        cells = notes["cells"]
        turn = xp.astype(xp.floor(xp.nan_to_num(scene.pose[..., 2]) * (HEADINGS / math.tau) + 0.5), xp.int64)
        seen = _views(scene.arrays, cells.shape[2])[turn & (HEADINGS - 1)]
        seen += (notes["at"] + _firsts(cells))[..., None]
        pixels = xp.take(cells.reshape(-1), seen.reshape(-1), axis=0).reshape(seen.shape)
        share = xp.broadcast_to((notes["covered"] / notes["count"])[:, None], shape)
        state = share, speeds(scene, self.top_speed), free_space(scene, self.reach)
        if not self.image:
            return joined(*state, xp.astype(pixels, xp.float32) / 255)
        return {"image": pixels.reshape((*shape, PIXELS, PIXELS, 1)), "state": joined(*state)}

    def judge(self, scene: Scene) -> Outcome:
        xp, notes, shape = scene.xp, scene.notes, (scene.n, scene.robots)
        at = self._cells_at(scene, scene.pose)
        new = self._sweep(scene, notes["cells"], at, at != notes["at"])
        notes["at"] = at
        notes["covered"] = notes["covered"] + xp.sum(new, axis=1)
        share = notes["covered"] / notes["count"]
        done = xp.broadcast_to((share >= self.enough)[:, None], shape)
        reward = self.cell**2 * new + done - stall_penalty(scene)
        return Outcome(reward, done, {"covered": xp.broadcast_to(share[:, None], shape), "is_success": done})


_SIGHT = math.ceil(PIXELS * STRIDE / math.sqrt(2))  # cells from the robot to the corner of an image, at most
_PAD = _SIGHT + 2  # cells around the room, so that images never end outside


def _grid_of(places: Floats, cell: float) -> tuple[npt.NDArray[np.uint8], Floats]:
    """The cells of a room, LEFT or 0: shape (rows, columns); and the lower left corner of the first one, metres."""
    origin = places.min(0) - CLEAR - _PAD * cell
    columns, rows = np.ceil((np.ptp(places, axis=0) + 2 * CLEAR) / cell).astype(int) + 2 * _PAD
    grid = np.zeros((rows, columns), np.uint8)
    reach = math.ceil(CLEAR / cell) + 1
    column, row = np.floor((places - origin) / cell).astype(int).T
    for up in range(-reach, reach + 1):
        for right in range(-reach, reach + 1):
            centers = origin + (np.stack([column + right, row + up], 1) + 0.5) * cell
            near = ((centers - places) ** 2).sum(1) <= CLEAR**2
            grid[row[near] + up, column[near] + right] = LEFT
    return grid, origin


@lru_cache(maxsize=8)
def _disc(arrays: Arrays, radius: float, columns: int) -> Array:
    """Differences of the numbers of cells that are within `radius` cells of one: shape (cells,)."""
    steps = np.arange(-math.floor(radius), math.floor(radius) + 1)
    row, column = np.meshgrid(steps, steps, indexing="ij")
    near = row**2 + column**2 <= radius * radius
    return arrays.of((row * columns + column)[near], np.int64)


@lru_cache(maxsize=8)
def _views(arrays: Arrays, columns: int) -> Array:
    """Differences of the numbers of cells between the pixels of an image and the robot: shape (HEADINGS, pixels)."""
    steps = STRIDE * (np.arange(PIXELS) - (PIXELS - 1) / 2)
    left, ahead = np.meshgrid(steps, steps, indexing="ij")
    angles = np.arange(HEADINGS)[:, None, None] * (math.tau / HEADINGS)
    # The summand decides alike for all halves, in spite of rounding errors.
    column = np.floor(ahead * np.cos(angles) - left * np.sin(angles) + 0.500001)
    row = np.floor(ahead * np.sin(angles) + left * np.cos(angles) + 0.500001)
    return arrays.of((row * columns + column).reshape(HEADINGS, -1), np.int64)


def _firsts(cells: Array) -> Array:
    """The number of each world's first cell among those of all worlds: int64, shape (n, 1)."""
    xp = namespace_of(cells)
    n, rows, columns = cells.shape
    on = {} if isinstance(cells, np.ndarray) else {"device": cells.device}
    return (xp.arange(n, **on) * (rows * columns))[:, None]
