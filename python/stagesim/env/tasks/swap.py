# SPDX-License-Identifier: GPL-2.0-or-later
"""The task in which two groups exchange their sides of a corridor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, on_host
from ..features import free_space, joined, speeds, with_headings
from ..places import reachable_places
from ..randoms import Randoms
from ..scene import Scene
from ..task import Outcome, Task
from .common import stall_penalty
from .worlds import corridor


@dataclass
class Swap(Task):
    """Two groups of robots start in the rooms at the two ends of a corridor and exchange their sides.

    The corridor runs along x. The first half of the robots starts where x is less than -`line`, the others where it is
    greater than `line`; a robot is across while it is beyond the other line. The corridor is too narrow for two robots
    side by side, but there is a bay in its middle.

    Reward: progress towards the other line in metres, 1 for each robot when all are across, which terminates the episode,
    and -0.05 for an action that ends stalled. Observation: x and y in units of `far` (-1 to 1), cosine and sine of the
    heading; 1 for the first half or -1 for the second one; speeds and ranges as in Navigate. The second half sees the first
    four numbers turned by half a turn, as if it went along x as well. Info: `across`, `is_success`.

    Args:
        line: where a robot is across, metres along x.
        gap: least distance of robots at the start, metres.
        far: metres.
        reach: ranges are clipped to this, metres.
        steps, limit, top_speed: see Task.
    """

    line: float = 3.2
    gap: float = 0.45
    far: float = 5.0
    reach: float = 4.0
    steps: int = 2
    limit: int = 400
    top_speed: tuple[float, float, float] = (0.5, 0.0, 1.5)
    world = corridor()

    def prepare(self, scene: Scene) -> None:
        if scene.robots % 2:
            raise ValueError(f"found {scene.robots} robots, expected an even number of robots, half for each side")
        way = np.repeat([1.0, -1.0], scene.robots // 2)
        scene.notes["way"] = scene.arrays.of(np.broadcast_to(way, (scene.n, scene.robots)))
        starts = on_host(scene.pose)[0, :, :2]
        for name, side, start in (("left side", -1, starts[0]), ("right side", 1, starts[-1])):
            places = reachable_places(scene.world, start, 0.15, 0.2)
            places = places[side * places[:, 0] > self.line]
            if not len(places):
                raise ValueError(f"found no free place where x is beyond {side * self.line:g} m: change the line of Swap")
            scene.notes[name] = scene.arrays.of(np.broadcast_to(places, (scene.n, *places.shape)))

    def size(self, scene: Scene) -> int:
        return 7 + scene.ranges.shape[-1]

    def begin(self, scene: Scene, randoms: Randoms) -> Array | None:
        sides = [scene.scatter(randoms, scene.robots // 2, self.gap, scene.notes[name])
                 for name in ("left side", "right side")]
        starts = scene.xp.concat(sides, axis=1)
        scene.notes["left"] = self._left(scene, starts)
        return with_headings(starts, randoms.headings(scene.robots))

    def _left(self, scene: Scene, pose: Array) -> Array:
        """How far each robot is from being across, metres: shape (n, robots)."""
        return scene.xp.clip(self.line - scene.notes["way"] * pose[..., 0], min=0.0)

    def observe(self, scene: Scene) -> Array:
        xp, pose, way = scene.xp, scene.pose, scene.notes["way"]
        heading = pose[..., 2] + 0.0
        place = xp.clip(way[..., None] * pose[..., :2] * (1 / self.far), min=-1.0, max=1.0)
        return joined(place, way * xp.cos(heading), way * xp.sin(heading), way, speeds(scene, self.top_speed),
                      free_space(scene, self.reach))

    def judge(self, scene: Scene) -> Outcome:
        xp, left = scene.xp, self._left(scene, scene.pose)
        across = left <= 0
        done = xp.broadcast_to(xp.all(across, axis=1, keepdims=True), across.shape)
        reward = (scene.notes["left"] - left) + done - stall_penalty(scene)
        scene.notes["left"] = left
        return Outcome(reward, done, {"across": across, "is_success": done})
