# SPDX-License-Identifier: GPL-2.0-or-later
"""The task in which several robots catch a faster one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..arrays import Array, Arrays
from ..features import distance_to, free_space, joined, seen_from, speeds, towards, with_headings
from ..randoms import Randoms
from ..scene import Scene
from ..task import Outcome, Task
from .common import stall_penalty
from .worlds import hunting_ground

SIGHT = 2.5  # metres: the evader doesn't care for free space further away


@dataclass
class Pursue(Task):
    """Pursuers catch the last robot of the world, the evader, which is faster than they are.

    The evader starts at that of eight random places which is farthest from the pursuers. It obeys a policy of its own: it
    drives in the direction in which its lidar sees most free space, away from near pursuers. Its actions are ignored and
    its rewards are 0. With `learns` it obeys its actions and gets minus the sum of the pursuers' rewards, which suits
    learners with several policies. It is caught when a pursuer is within `catch` of it, which terminates the episode.

    Reward of each pursuer: what it came nearer to the evader in metres, 1 when the evader is caught, -0.05 for an action
    that ends stalled. Observation: of each other robot the distance in units of `far` (0 to 1) and the cosine and sine of
    its bearing; speeds in units of the evader's, and ranges as in Navigate. The other robots are first the evader and
    then the pursuers from the next number on. Info: `distance` to the evader in metres, which for the evader is the least
    one, and `is_success`, which is True for all if it is caught.

    Args:
        catch: distance at which the evader is caught, metres.
        evader_speed: m/s, for an action of 1 if it learns.
        learns: whether the evader obeys its actions.
        far, reach: distances and ranges are clipped to these, metres.
        steps, limit, top_speed: see Task; the speeds are those of the pursuers.
    """

    catch: float = 0.5
    evader_speed: float = 0.7
    learns: bool = False
    far: float = 10.0
    reach: float = 4.0
    steps: int = 2
    limit: int = 300
    top_speed: tuple[float, float, float] = (0.5, 0.0, 1.5)
    world = hunting_ground()

    def prepare(self, scene: Scene) -> None:
        if scene.robots < 2:
            raise ValueError("found one robot, expected one or more pursuers and an evader")

    def size(self, scene: Scene) -> int:
        return 3 * (scene.robots - 1) + 2 + scene.ranges.shape[-1]

    def begin(self, scene: Scene, randoms: Randoms) -> Array | None:
        xp = scene.xp
        pursuers = scene.scatter(randoms, scene.robots - 1)
        choices = scene.scatter(randoms, 8, 0.1)
        nearest = xp.min(distance_to(choices[:, :, None], pursuers[:, None]), axis=2)
        evader = choices[xp.arange(scene.n), xp.argmax(nearest, axis=1)][:, None]
        scene.notes["distance"] = distance_to(pursuers, evader)
        return with_headings(xp.concat([pursuers, evader], axis=1), randoms.headings(scene.robots))

    def command(self, scene: Scene, actions: Array) -> Array:
        speeds = super().command(scene, actions)
        if self.learns:
            speeds[:, -1, 0] = speeds[:, -1, 0] * (self.evader_speed / self.top_speed[0])
        else:
            speeds[:, -1, 0], speeds[:, -1, 2] = self._flight(scene)
        return speeds

    def _flight(self, scene: Scene) -> tuple[Array, Array]:
        """Speeds forwards and turning of the evader: shape (n,) each."""
        xp, pose = scene.xp, scene.pose
        bearings, cosines, sines = _rays(scene.arrays, scene.ranges.shape[-1])
        free = _clearance(xp, scene.ranges[:, -1])
        distance, bearing = seen_from(pose[:, -1:], pose[:, :-1, :2])
        weights = (1 / (distance * distance + 0.01))[..., None] * bearing
        danger = xp.astype(xp.sum(weights, axis=1), xp.float32)
        best = xp.argmax(free - danger[:, :1] * cosines - danger[:, 1:] * sines, axis=1)
        turn = bearings[best]
        forwards = self.evader_speed * xp.clip(cosines[best], min=0.0)
        return forwards, xp.clip(4 * turn, min=-math.pi, max=math.pi)

    def observe(self, scene: Scene) -> Array:
        others = scene.pose[:, _others(scene.arrays, scene.robots), :2]
        seen = [towards(scene, others[:, :, k], self.far) for k in range(scene.robots - 1)]
        fastest = max(self.top_speed[0], self.evader_speed), 0.0, math.pi
        return joined(*seen, speeds(scene, fastest), free_space(scene, self.reach))

    def judge(self, scene: Scene) -> Outcome:
        xp, pose = scene.xp, scene.pose
        distance = distance_to(pose, pose[:, -1:, :2])[:, :-1]
        least = xp.min(distance, axis=1, keepdims=True)
        caught = xp.broadcast_to(least <= self.catch, (scene.n, scene.robots))
        reward = (scene.notes["distance"] - distance) + caught[:, 1:] - stall_penalty(scene)[:, :-1]
        scene.notes["distance"] = distance
        total = -xp.sum(reward, axis=1, keepdims=True) if self.learns else xp.zeros_like(least)
        return Outcome(xp.concat([reward, total], axis=1), caught,
                       {"distance": xp.concat([distance, least], axis=1), "is_success": caught})


@lru_cache(maxsize=8)
def _rays(arrays: Arrays, samples: int) -> tuple[Array, Array, Array]:
    """Bearings of the rays of a lidar that looks in all directions, radians, cosines and sines: float32, shape (samples,)."""
    bearings = (np.arange(samples) - (samples - 1) / 2) * (math.tau / samples)
    return (arrays.of(bearings, np.float32), arrays.of(np.cos(bearings), np.float32),
            arrays.of(np.sin(bearings), np.float32))


@lru_cache(maxsize=8)
def _others(arrays: Arrays, robots: int) -> Array:
    """Numbers of the other robots as each robot observes them: the evader, then those after it: (robots, robots - 1)."""
    pursuers = [[robots - 1, *((i + k) % (robots - 1) for k in range(1, robots - 1))] for i in range(robots - 1)]
    return arrays.of([*pursuers, list(range(robots - 1))])


def _clearance(xp: Any, ranges: Array) -> Array:
    """The least range of each ray and its neighbours on both sides, at most 2.5 m: shape (n, samples)."""
    free = xp.astype(xp.where(ranges < SIGHT, ranges, SIGHT), xp.float32)
    wide = xp.concat([free[:, -1:], free, free[:, :1]], axis=1)
    return xp.minimum(free, xp.minimum(wide[:, :-2], wide[:, 2:]))
