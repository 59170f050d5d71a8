# SPDX-License-Identifier: GPL-2.0-or-later
"""A plain ray caster over an occupancy grid, as one writes it in an afternoon, and World.cast() with the same rays.

The grid is the picture of worlds/cave.world, a cell per pixel. numba compiles the caster for all processors.
"""

from __future__ import annotations

import importlib.util
import logging
import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from benchkit.machine import ROOT

from .task import Floats

NEEDS = ("stagesim", "numba", "PIL")
SIDE = 64.0  # of the cave, metres
DARK = 128  # pixels that are darker are obstacles
SAME = 0.95  # minimum fraction of rays whose ranges agree within a cell of each grid
HITS = (0.8, 1.0)  # permitted fraction of rays that hit something


@dataclass(frozen=True)
class CastTask:
    """Rays all around from random places in the cave."""

    poses: int = 4000
    rays: int = 60
    reach: float = 30.0  # metres


def missing() -> str:
    """Returns which modules are not installed; empty: none."""
    return ", ".join(name for name in NEEDS if importlib.util.find_spec(name) is None)


class GridCaster:
    """The caster: walks from cell to cell (digital differential analyser) until it finds an obstacle."""

    def __init__(self, threads: int) -> None:
        import numba
        from PIL import Image

        numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
        picture = np.asarray(Image.open(ROOT / "worlds" / "bitmaps" / "cave.png").convert("L")) < DARK
        rows, columns = (np.nonzero(picture.any(axis))[0] for axis in (1, 0))
        dark = picture[rows[0]:rows[-1] + 1, columns[0]:columns[-1] + 1]
        self.grid = np.ascontiguousarray(dark[::-1])  # row 0 is the southern one
        self.cell = SIDE / dark.shape[1]
        self._walk = compile_walk(numba)

    def is_free(self, points: Floats) -> npt.NDArray[np.bool_]:
        """Tells which points, x and y in metres, are not in or beside an obstacle."""
        column, row = (np.floor((points + SIDE / 2) / self.cell).astype(int) + 1).T
        wide = np.pad(self.grid, 1, constant_values=True)
        free = np.ones(len(points), bool)
        for i in (-1, 0, 1):
            for j in (-1, 0, 1):
                free &= ~wide[(row + i).clip(0, wide.shape[0] - 1), (column + j).clip(0, wide.shape[1] - 1)]
        return free

    def cast(self, poses: Floats, bearings: Floats, reach: float, out: Floats) -> None:
        """Computes ranges as World.cast() does: shape (poses, rays)."""
        self._walk(self.grid, self.cell, SIDE / 2, poses, bearings, reach, out)


def compile_walk(numba: Any) -> Any:
    """Compiles the walk of all rays."""

    @numba.njit(parallel=True, fastmath=True)
    def walk(grid, cell, half, poses, bearings, reach, out):  # type: ignore[no-untyped-def]
        height, width = grid.shape
        for i in numba.prange(poses.shape[0]):
            for j in range(bearings.shape[0]):
                angle = poses[i, 2] + bearings[j]
                dx, dy = math.cos(angle), math.sin(angle)
                x, y = (poses[i, 0] + half) / cell, (poses[i, 1] + half) / cell
                column, row = int(math.floor(x)), int(math.floor(y))
                step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
                delta_x = abs(1 / dx) if dx != 0 else 1e30
                delta_y = abs(1 / dy) if dy != 0 else 1e30
                next_x = (column + 1 - x if dx > 0 else x - column) * delta_x
                next_y = (row + 1 - y if dy > 0 else y - row) * delta_y
                limit, distance = reach / cell, 0.0
                while distance < limit and 0 <= column < width and 0 <= row < height and not grid[row, column]:
                    if next_x < next_y:
                        distance = next_x
                        next_x += delta_x
                        column += step_x
                    else:
                        distance = next_y
                        next_y += delta_y
                        row += step_y
                inside = 0 <= column < width and 0 <= row < height
                out[i, j] = min(distance, limit) * cell if inside else reach

    return walk


class Casters:
    """Both casters with the same rays."""

    def __init__(self, task: CastTask, threads: int) -> None:
        import stagesim as st

        logging.getLogger("stagesim").setLevel(logging.ERROR)  # it warns that controllers are left out
        self.task = task
        self._grid = GridCaster(threads)
        self._world = st.World(str(ROOT / "worlds" / "cave.world"), threads=threads, controllers=False)
        chance = np.random.default_rng(1)
        points: Floats = np.empty((0, 2))
        while len(points) < task.poses:
            drawn = chance.uniform(-SIDE / 2, SIDE / 2, (task.poses, 2))
            points = np.concatenate([points, drawn[self._grid.is_free(drawn)]])
        headings = chance.uniform(-math.pi, math.pi, (task.poses, 1))
        self._poses = np.concatenate([points[:task.poses], headings], 1)
        self._bearings = np.arange(task.rays) * (math.tau / task.rays)
        self._ranges = {name: np.empty((task.poses, task.rays)) for name in ("stage", "stage-exact", "caster")}
        for name in self._ranges:
            self.cast(name)

    def cast(self, name: str) -> None:
        """Casts all rays once."""
        out = self._ranges[name]
        if name == "caster":
            self._grid.cast(self._poses, self._bearings, self.task.reach, out)
        else:
            model = "exact" if name == "stage-exact" else "cell"
            self._world.cast(self._poses, self._bearings, self.task.reach, ray_model=model, out=out)

    def hits(self, name: str) -> float:
        """Returns the fraction of rays that hit something."""
        return float((self._ranges[name] < self.task.reach).mean())

    def same(self, name: str) -> float:
        """Returns the fraction of rays whose ranges are those of the plain caster, within a cell of each grid."""
        cells = self._grid.cell + 0.02
        return float((np.abs(self._ranges[name] - self._ranges["caster"]) <= cells).mean())

    def faults(self) -> list[str]:
        """Returns what shows that the rays are not those of the cave."""
        found = []
        for name in self._ranges:
            hits, same = self.hits(name), self.same(name)
            if not HITS[0] <= hits <= HITS[1]:
                found.append(f"{name}: {hits:.1%} of the rays hit something, expected {HITS[0]:.0%} to {HITS[1]:.0%}")
            if same < SAME:
                found.append(f"{name}: {same:.1%} of the ranges agree with the plain caster within a cell, "
                             f"expected {SAME:.0%}")
        return found

    def measure(self, name: str, seconds: float) -> tuple[int, float]:
        """Casts rays for a time; returns their number and the seconds that they took."""
        count, start = 0, time.perf_counter()
        while time.perf_counter() - start < seconds:
            self.cast(name)
            count += self.task.poses * self.task.rays
        return count, time.perf_counter() - start
