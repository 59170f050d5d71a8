# SPDX-License-Identifier: GPL-2.0-or-later
"""The task in which several robots push a block to a target pose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..arrays import Array, Arrays
from ..features import joined, with_headings
from ..randoms import Randoms
from ..scene import Scene
from ..task import Outcome, Task
from .worlds import T_PARTS, UNIT, pushing_room

SPACING = UNIT / 4  # between neighbouring sample points, metres


@dataclass
class PushT(Task):
    """Robots push a block shaped like a T to a target pose, which is painted on the floor.

    The overlap is the share of the target's area that the block covers. It is computed from 112 sample points, those of a
    grid of 6.25 cm. The block starts at a random pose up to `away` from the target, and the robots around it.

    Reward of each robot: the growth of the overlap, 0.5 per metre of progress of the block's centre of area towards the
    target, and 1 when the overlap is at least `enough`, which terminates the episode. Actions are speeds along x and y of
    the world, whatever the robot's heading. Observation: x and y of the block, of the target, and of each other robot from
    the next number on; cosine and sine of the block's heading, and of its heading relative to the target's. Positions are
    relative to the robot, along the axes of the world, in units of `far` (-1 to 1). Info: `overlap` (0 to 1), `distance` of
    the block to the target (metres), `is_success`.

    It differs from the benchmark Push-T (Florence et al., *Implicit behavioral cloning*, 2021; Chi et al., *Diffusion
    policy*, 2023), so results are not comparable with published ones. That has one pusher, a disc whose actions are the
    positions where it shall go; its reward is the overlap itself, divided by the 0.95 that count as success, and
    demonstrations by people come with it. Here two robots share the work, actions are speeds, and pushing is quasi-static
    (docs/motion.md). Rewards are increments, so that their sum tells what was reached. The block has the same proportions.

    It needs a world with a model "block" of this shape, and is not for worlds on a card.

    Args:
        target: x, y (metres) and heading (radians) of the target.
        enough: overlap at which the task is done, 0 to 1.
        away: the block starts up to this far from the target along x and y, metres.
        far: distances along x and y are clipped to this, metres.
        steps, limit, top_speed: see Task.
    """

    target: tuple[float, float, float] = (0.0, 0.0, -math.pi / 4)
    enough: float = 0.9
    away: float = 1.0
    far: float = 4.0
    steps: int = 2
    limit: int = 400
    top_speed: tuple[float, float, float] = (0.5, 0.5, 0.0)
    placed = "block"

    def __post_init__(self) -> None:
        x, y, heading = self.target
        self.target = (x, y, heading)
        self.world = pushing_room(self.target)

    def size(self, scene: Scene) -> int:
        return 8 + 2 * (scene.robots - 1)

    def begin(self, scene: Scene, randoms: Randoms) -> Array | None:
        block = randoms.uniform(3, -1.0, 1.0)
        block = block * scene.arrays.of([self.away, self.away, math.pi]) + scene.arrays.of([*self.target[:2], 0.0])
        scene.place(block[:, None])
        around = block[:, None, :2] + _ring(scene.arrays)
        starts = scene.scatter(randoms, scene.robots, 0.5, around)
        scene.notes["block"] = block
        scene.notes["overlap"] = self._overlap(scene, block)
        scene.notes["distance"] = self._distance(scene, block)
        return with_headings(starts, 0 * starts[..., 0])

    def command(self, scene: Scene, actions: Array) -> Array:
        xp = scene.xp
        heading = scene.pose[..., 2] + 0.0
        cosine, sine = xp.cos(heading), xp.sin(heading)
        x, y = actions[..., 0] * self.top_speed[0], actions[..., 1] * self.top_speed[1]
        return xp.stack([x * cosine + y * sine, y * cosine - x * sine, xp.zeros_like(x)], axis=-1)

    def _distance(self, scene: Scene, block: Array) -> Array:
        """How far the block is from the target, metres: shape (n,)."""
        x, y = block[:, 0] - self.target[0], block[:, 1] - self.target[1]
        return scene.xp.sqrt(x * x + y * y)

    def _overlap(self, scene: Scene, block: Array) -> Array:
        """The share of the target that blocks with these poses, shape (n, 3), cover: shape (n,)."""
        xp = scene.xp
        x, y = _samples(scene.arrays, self.target)
        heading = block[:, 2] + 0.0
        place_x, place_y, cosine, sine = (xp.astype(each, xp.float32)[:, None] for each in (
            block[:, 0], block[:, 1], xp.cos(heading), xp.sin(heading)))
        away_x, away_y = x - place_x, y - place_y
        along, across = xp.abs(away_x * cosine + away_y * sine), away_y * cosine - away_x * sine
        (_, middle, half, top), (_, low, half_below, _) = T_PARTS
        covered = (across < top) & (across >= low) & (along < xp.where(across < middle, half_below, half))
        return xp.astype(xp.count_nonzero(covered, axis=1), xp.float64) * (1 / x.shape[0])

    def _note_overlap(self, scene: Scene, block: Array) -> Array:
        """The overlap, which is computed only where the block has moved: a new array of shape (n,)."""
        xp, notes = scene.xp, scene.notes
        moved = xp.nonzero(xp.any(block != notes["block"], axis=1))[0]
        overlap = xp.where(xp.isnan(block[:, 0]), 0.0, notes["overlap"])
        if moved.shape[0]:
            overlap[moved] = self._overlap(scene, block[moved])
        notes["block"], notes["overlap"] = block, overlap
        return overlap

    def observe(self, scene: Scene) -> Array:
        xp, pose, block = scene.xp, scene.pose, scene.placed_pose
        heading = block[..., 2] + 0.0
        error = heading - self.target[2]
        shape = (scene.n, scene.robots)
        turns = [xp.broadcast_to(each, shape) for each in (xp.cos(heading), xp.sin(heading), xp.cos(error), xp.sin(error))]
        others = pose[:, _others(scene.arrays, scene.robots)]
        points = [block[..., axis] - pose[..., axis] for axis in (0, 1)]
        points += [self.target[axis] - pose[..., axis] for axis in (0, 1)]
        points += [others[:, :, k, axis] - pose[..., axis] for k in range(scene.robots - 1) for axis in (0, 1)]
        near = xp.clip(xp.stack(points, axis=-1) * (1 / self.far), min=-1.0, max=1.0)
        return joined(near, *turns)

    def judge(self, scene: Scene) -> Outcome:
        xp, block = scene.xp, scene.placed_pose[:, 0]
        before, distance = scene.notes["overlap"] + 0.0, self._distance(scene, block)
        overlap = self._note_overlap(scene, block)
        done = overlap >= self.enough
        reward = (overlap - before) + 0.5 * (scene.notes["distance"] - distance) + done
        scene.notes["distance"] = distance
        shape = (scene.n, scene.robots)
        of_all = [xp.broadcast_to(values[:, None], shape) for values in (reward, done, overlap, distance)]
        return Outcome(of_all[0], of_all[1], {"overlap": of_all[2], "distance": of_all[3], "is_success": of_all[1]})


@lru_cache(maxsize=8)
def _samples(arrays: Arrays, target: tuple[float, float, float]) -> tuple[Array, Array]:
    """Centres of the cells of the target, metres: x and y, float32, shape (112,) each."""
    points = np.concatenate([np.stack(np.meshgrid(np.arange(left + SPACING / 2, right, SPACING),
                                                  np.arange(low + SPACING / 2, high, SPACING)), -1).reshape(-1, 2)
                             for left, low, right, high in T_PARTS])
    cosine, sine = math.cos(target[2]), math.sin(target[2])
    return (arrays.of(target[0] + points[:, 0] * cosine - points[:, 1] * sine, np.float32),
            arrays.of(target[1] + points[:, 0] * sine + points[:, 1] * cosine, np.float32))


@lru_cache(maxsize=8)
def _ring(arrays: Arrays) -> Array:
    """Places around a block where robots don't touch it, metres relative to its centre: shape (48, 2)."""
    angles, radii = np.meshgrid(np.arange(16) * (math.tau / 16), [0.9, 1.0, 1.1])
    return arrays.of(np.stack([radii * np.cos(angles), radii * np.sin(angles)], -1).reshape(-1, 2))


@lru_cache(maxsize=8)
def _others(arrays: Arrays, robots: int) -> Array:
    """Numbers of the other robots, from that after each robot on: shape (robots, robots - 1)."""
    return arrays.of([[(i + k) % robots for k in range(1, robots)] for i in range(robots)], "int64")
