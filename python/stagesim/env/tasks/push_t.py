# SPDX-License-Identifier: GPL-2.0-or-later
"""The task in which several robots push a block to a target pose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..arrays import Array, Arrays
from ..features import joined, with_headings
from ..randoms import Randoms
from ..scene import Scene
from ..task import Outcome, Task
from .worlds import T_PARTS, UNIT, pushing_room

OFF = 1e-9  # metres and radians by which the target is elsewhere, so that no edges of both outlines coincide


@dataclass
class PushT(Task):
    """Robots push a block shaped like a T to a target pose, which is painted on the floor.

    The overlap is the share of the target's area that the block covers. It is exact to seven digits. The block starts at a
    random pose up to `away` from the target, and the robots around it.

    Reward of each robot: 5 times the growth of the overlap, 5 per metre of progress of the block's centre of area towards
    the target, and 2.5 per radian of progress of its heading. An overlap of at least `enough` brings 5 more and terminates
    the episode. Actions are speeds along the axes of the block, so that no movement must be learnt once per heading.

    Observation, all of it in the frame of the block: x and y of the target, of the robot, and of each other robot from the
    next number on, in units of `far` (-1 to 1); cosine and sine of the target's heading. For the last centimetres, x, y and
    heading of the target follow once more, in units of `near` metres and radians (-1 to 1). Info: `overlap` (0 to 1),
    `distance` of the block to the target (metres), `is_success`.

    It differs from the benchmark Push-T (Florence et al., *Implicit behavioral cloning*, 2021; Chi et al., *Diffusion
    policy*, 2023), so results are not comparable with published ones. That has one pusher, a disc whose actions are the
    positions where it shall go; its reward is the overlap itself, divided by the 0.95 that count as success, and
    demonstrations by people come with it. Here two robots share the work, actions are speeds, and pushing is quasi-static
    (docs/motion.md). Rewards are increments, so that their sum tells what was reached. The block has the same proportions.

    It needs a world with a model "block" of this shape. With a device, the block's pose goes through the host in each
    action.

    Args:
        target: x, y (metres) and heading (radians) of the target.
        enough: overlap at which the task is done, 0 to 1.
        away: the block starts up to this far from the target along x and y, metres.
        far: distances along x and y are clipped to this, metres.
        near: those and the heading of the target are clipped to this as well, metres and radians.
        steps, limit, top_speed: see Task.
    """

    target: tuple[float, float, float] = (0.0, 0.0, -math.pi / 4)
    enough: float = 0.9
    away: float = 1.0
    far: float = 1.5
    near: float = 0.3
    steps: int = 4
    limit: int = 200
    top_speed: tuple[float, float, float] = (0.5, 0.5, 0.0)
    placed = "block"

    def __post_init__(self) -> None:
        x, y, heading = self.target
        self.target = (x, y, heading)
        self.world = pushing_room(self.target)

    def size(self, scene: Scene) -> int:
        return 9 + 2 * (scene.robots - 1)

    def begin(self, scene: Scene, randoms: Randoms) -> Array | None:
        block = randoms.uniform(3, -1.0, 1.0)
        block = block * scene.arrays.of([self.away, self.away, math.pi]) + scene.arrays.of([*self.target[:2], 0.0])
        scene.place(block[:, None])
        around = block[:, None, :2] + _ring(scene.arrays)
        starts = scene.scatter(randoms, scene.robots, 0.5, around)
        scene.notes["block"] = block
        scene.notes["overlap"] = self._overlap(scene, block)
        scene.notes["missing"] = self._missing(scene, block, self._distance(scene, block))
        return with_headings(starts, 0 * starts[..., 0])

    def command(self, scene: Scene, actions: Array) -> Array:
        xp = scene.xp
        turn = scene.placed_pose[..., 2] - scene.pose[..., 2]
        cosine, sine = xp.cos(turn), xp.sin(turn)
        x, y = actions[..., 0] * self.top_speed[0], actions[..., 1] * self.top_speed[1]
        return xp.stack([x * cosine - y * sine, y * cosine + x * sine, xp.zeros_like(x)], axis=-1)

    def _distance(self, scene: Scene, block: Array) -> Array:
        """How far the block is from the target, metres: shape (n,)."""
        x, y = block[:, 0] - self.target[0], block[:, 1] - self.target[1]
        return scene.xp.sqrt(x * x + y * y)

    def _missing(self, scene: Scene, block: Array, distance: Array) -> Array:
        """The reward for progress that blocks with these poses, shape (n, 3), have not had yet: shape (n,)."""
        return 5 * distance + 2.5 * scene.xp.abs(self._error(scene, block))

    def _error(self, scene: Scene, block: Array) -> Array:
        """How far blocks with these poses, shape (..., 3), must turn to the target, -pi to pi: shape (...)."""
        return math.pi - scene.xp.remainder(block[..., 2] - self.target[2] + math.pi, math.tau)

    def _overlap(self, scene: Scene, block: Array) -> Array:
        """The share of the target that blocks with these poses, shape (n, 3), cover: shape (n,)."""
        xp, lines = scene.xp, _lines(scene.arrays)
        turn = block[:, 2] - (self.target[2] + OFF)
        cosine, sine = (each[:, None, None] for each in (xp.cos(turn), xp.sin(turn)))
        x, y = self._places(xp, block, cosine, sine)
        signed = xp.concat([sine, -sine], axis=1)
        along = _inside(xp, x - lines.beside * signed, y + lines.beside * cosine, cosine, signed, lines.along)
        across = _inside(xp, x + lines.ahead * cosine, y + lines.ahead * signed, -signed, cosine, lines.across)
        # Twice the area is the sum of the cross products of the ends of the pieces of both outlines, by Green's theorem.
        twice = along * (lines.of_block * y[:, 1:] - lines.beside) - across * (lines.of_block * x[:, 1:] - lines.ahead)
        twice = lines.sign * twice
        share = xp.sum(xp.reshape(twice, (-1, 16)), axis=1) * (0.5 / (7 * UNIT * UNIT))
        return xp.clip(share, min=0.0, max=1.0)

    def _places(self, xp: Any, block: Array, cosine: Array, sine: Array) -> tuple[Array, Array]:
        """The block's place in the frame of the target, and the target's in that of the block: x, y, (n, 2, 1) each."""
        x, y = block[:, 0, None, None] - (self.target[0] + OFF), block[:, 1, None, None] - (self.target[1] + OFF)
        target_cosine, target_sine = math.cos(self.target[2] + OFF), math.sin(self.target[2] + OFF)
        x, y = x * target_cosine + y * target_sine, y * target_cosine - x * target_sine
        return xp.concat([x, -(x * cosine + y * sine)], axis=1), xp.concat([y, x * sine - y * cosine], axis=1)

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
        cosine, sine = xp.cos(heading), xp.sin(heading)
        others = pose[:, _others(scene.arrays, scene.robots)]
        places: list[Any] = [self.target, (pose[..., 0], pose[..., 1])]
        places += [(others[:, :, k, 0], others[:, :, k, 1]) for k in range(scene.robots - 1)]
        seen: list[Array] = []
        for place in places:
            x, y = (place[axis] - block[..., axis] for axis in (0, 1))
            seen += [x * cosine + y * sine, y * cosine - x * sine]
        error = self._error(scene, block)
        turned = [xp.cos(error), xp.sin(error)]
        return joined(_limited(scene, seen, self.far), _limited(scene, turned, 1), _limited(scene, [*seen[:2], error], self.near))

    def judge(self, scene: Scene) -> Outcome:
        xp, block = scene.xp, scene.placed_pose[:, 0]
        before, distance = scene.notes["overlap"] + 0.0, self._distance(scene, block)
        overlap, missing = self._note_overlap(scene, block), self._missing(scene, block, distance)
        done = overlap >= self.enough
        reward = 5 * (overlap - before) + (scene.notes["missing"] - missing) + 5 * done
        scene.notes["missing"] = missing
        shape = (scene.n, scene.robots)
        of_all = [xp.broadcast_to(values[:, None], shape) for values in (reward, done, overlap, distance)]
        return Outcome(of_all[0], of_all[1], {"overlap": of_all[2], "distance": of_all[3], "is_success": of_all[1]})


@dataclass(frozen=True)
class _Lines:
    """Edges of one T, each with a rectangle of the other one that it is clipped to: arrays of shape (8,).

    Edges along the bar come in pairs of a lower and an upper one, edges across it in pairs of a right and a left one.
    """

    sign: Array      # of the direction counter-clockwise
    beside: Array    # y of the edges along the bar
    ahead: Array     # x of the edges across it
    along: tuple[Array, ...]   # ends of the edges along the bar, and the least and greatest x and y of the rectangles
    across: tuple[Array, ...]  # the same of the edges across it
    of_block: Array  # 1 for the edges of the block, 0 for those of the target: shape (2, 1)


@lru_cache(maxsize=8)
def _lines(arrays: Arrays) -> _Lines:
    pairs = np.array([[*edge, *clip] for edge in T_PARTS for clip in T_PARTS])
    left, low, right, high = np.repeat(pairs[:, :4], 2, axis=0).T
    clips = tuple(arrays.of(each) for each in np.repeat(pairs[:, [4, 6, 5, 7]], 2, axis=0).T)
    first = np.arange(8) % 2 == 0
    return _Lines(arrays.of(np.where(first, 1.0, -1.0)), arrays.of(np.where(first, low, high)),
                  arrays.of(np.where(first, right, left)), (arrays.of(left), arrays.of(right), *clips),
                  (arrays.of(low), arrays.of(high), *clips), arrays.of([[1.0], [0.0]]))


def _inside(xp: Any, x: Array, y: Array, to_x: Array, to_y: Array, bounds: tuple[Array, ...]) -> Array:
    """Lengths of the parts of edges that are in rectangles (Liang and Barsky, 1984).

    Args:
        xp: the namespace of the arrays.
        x, y: the points 0 of the edges' lines.
        to_x, to_y: directions of the lines, of length 1.
        bounds: where the edges begin and end on the lines; least and greatest x, least and greatest y of the rectangles.
    """
    begin, end, left, right, low, high = bounds
    by_x, by_y = 1 / to_x, 1 / to_y
    one, other, below, above = (left - x) * by_x, (right - x) * by_x, (low - y) * by_y, (high - y) * by_y
    first = xp.maximum(xp.maximum(xp.minimum(one, other), xp.minimum(below, above)), begin)
    last = xp.minimum(xp.minimum(xp.maximum(one, other), xp.maximum(below, above)), end)
    return xp.clip(last - first, min=0.0)


def _limited(scene: Scene, values: list[Array], most: float) -> Array:
    """Values of all robots of worlds, in units of the most that is seen: shape (n, robots, len(values))."""
    stacked = scene.xp.stack([scene.xp.broadcast_to(each, (scene.n, scene.robots)) for each in values], axis=-1)
    return scene.xp.clip(stacked * (1 / most), min=-1.0, max=1.0)


@lru_cache(maxsize=8)
def _ring(arrays: Arrays) -> Array:
    """Places around a block where robots don't touch it, metres relative to its centre: shape (48, 2)."""
    angles, radii = np.meshgrid(np.arange(16) * (math.tau / 16), [0.9, 1.0, 1.1])
    return arrays.of(np.stack([radii * np.cos(angles), radii * np.sin(angles)], -1).reshape(-1, 2))


@lru_cache(maxsize=8)
def _others(arrays: Arrays, robots: int) -> Array:
    """Numbers of the other robots, from that after each robot on: shape (robots, robots - 1)."""
    return arrays.of([[(i + k) % robots for k in range(1, robots)] for i in range(robots)], "int64")
