# SPDX-License-Identifier: GPL-2.0-or-later
"""The task in which robots disperse."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..arrays import Array
from ..features import free_space, joined, speeds, towards, with_headings
from ..randoms import Randoms
from ..scene import Scene
from ..task import Outcome, Task
from .common import stall_penalty

PER_SQUARE_METRE = 4096  # the unit of squared distances that are sorted


@dataclass
class Disperse(Task):
    """Robots start in a cluster and disperse until no two are within `spread` metres of each other.

    Reward: increase of the distance to the nearest other robot, which counts up to `spread`, in metres; 1 for
    each robot when all are dispersed, which terminates the episode; -0.05 for an action that ends stalled.
    Observation: distance to the nearest other robot in units of `spread` (0 to 1), cosine and sine of its
    bearing, speeds and ranges as in Navigate. Info: `nearest` (metres, max `spread`), `is_success`.

    Args:
        spread: the distance to be reached, metres.
        reach: ranges are clipped to this, metres.
        steps, limit, top_speed: see Task.
    """

    spread: float = 2.0
    reach: float = 4.0
    steps: int = 2
    limit: int = 300
    top_speed: tuple[float, float, float] = (0.5, 0.0, 1.5)
    world = "disperse.world"

    def prepare(self, scene: Scene) -> None:
        if scene.robots < 2:
            raise ValueError("found one robot, expected two or more that can disperse")

    def size(self, scene: Scene) -> int:
        return 5 + scene.ranges.shape[-1]

    def begin(self, scene: Scene, randoms: Randoms) -> Array | None:
        places = scene.arrays.of(scene.places)
        middle = places[randoms.integers(len(places))]
        away_x, away_y = (places[:, axis] - middle[:, None, axis] for axis in (0, 1))
        # Sorting numbers that contain both the distance and the index is faster than a stable sort of distances.
        squares = scene.xp.astype((away_x * away_x + away_y * away_y) * PER_SQUARE_METRE, scene.xp.int64)
        ranked = scene.xp.sort(squares * len(places) + scene.arrays.of(range(len(places))), axis=1, stable=False)
        near = ranked[:, :16 * scene.robots] % len(places)
        starts = scene.scatter(randoms, scene.robots, 0.5, places[near])
        return with_headings(starts, randoms.headings(scene.robots))

    def began(self, scene: Scene) -> None:
        scene.notes.update(self._neighbours(scene))

    def _neighbours(self, scene: Scene) -> dict[str, Array]:
        """The distance to the nearest other robot (metres, max `spread`), and its index: shape (n, robots) each."""
        distance, which = _nearest(scene, scene.pose)
        return {"nearest": scene.xp.clip(distance, max=self.spread), "neighbour": which}

    def observe(self, scene: Scene) -> Array:
        other = scene.pose[scene.xp.arange(scene.n)[:, None], scene.notes["neighbour"]][..., :2]
        return joined(towards(scene, other, self.spread), speeds(scene, self.top_speed), free_space(scene, self.reach))

    def judge(self, scene: Scene) -> Outcome:
        xp = scene.xp
        found = self._neighbours(scene)
        nearest = found["nearest"]
        alone = xp.broadcast_to(xp.all(nearest >= self.spread, axis=1, keepdims=True), nearest.shape)
        reward = (nearest - scene.notes["nearest"]) + alone - stall_penalty(scene)
        scene.notes.update(found)
        return Outcome(reward, alone, {"nearest": nearest, "is_success": alone})


def _nearest(scene: Scene, pose: Array) -> tuple[Array, Array]:
    """Distance and index of the nearest other robot: shape (n, robots) each. A deleted robot is infinitely far."""
    xp = scene.xp
    away_x, away_y = (pose[:, :, None, axis] - pose[:, None, :, axis] for axis in (0, 1))
    squares = away_x * away_x + away_y * away_y
    robots = xp.arange(scene.robots)
    squares[:, robots, robots] = math.inf
    squares = xp.where(xp.isnan(squares), math.inf, squares)
    which = xp.argmin(squares, axis=2)
    return xp.sqrt(xp.min(squares, axis=2)), which
