# SPDX-License-Identifier: GPL-2.0-or-later
"""The task in which robots carry items."""

from __future__ import annotations

from dataclasses import dataclass

from ..arrays import Array
from ..features import distance_to, free_space, joined, speeds, towards, with_headings
from ..randoms import Randoms
from ..scene import Scene
from ..task import Outcome, Task
from .common import stall_penalty


@dataclass
class Forage(Task):
    """Robots fetch items at the model "source" of the world and bring them to the model "sink".

    An empty robot within `zone_radius` of the source picks up an item; the supply is unlimited. Within the same
    distance of the sink it drops the item. Reward: 1 for each item picked up or delivered, 0.1 per metre of
    progress towards the next zone, -0.05 for an action that ends stalled. Observation: 1 with an item or -1
    without, distance to the next zone in units of `far` (0 to 1), cosine and sine of its bearing, speeds and
    ranges as in Navigate. Info: `brought`, the items delivered in this episode. It never terminates.

    Args:
        zone_radius: radius of both zones, metres.
        far, reach: see Navigate.
        steps, limit, top_speed: see Task.
    """

    zone_radius: float = 1.0
    far: float = 10.0
    reach: float = 4.0
    steps: int = 2
    limit: int = 600
    top_speed: tuple[float, float, float] = (0.5, 0.0, 1.5)
    world = "forage.world"

    def prepare(self, scene: Scene) -> None:
        zones = [scene.world.model(name).pose[:2] for name in ("source", "sink")]
        scene.notes["zones"] = scene.arrays.of([zones] * scene.n)

    def size(self, scene: Scene) -> int:
        return 6 + scene.ranges.shape[-1]

    def begin(self, scene: Scene, randoms: Randoms) -> Array | None:
        starts = scene.scatter(randoms, scene.robots)
        scene.notes["carries"] = scene.xp.zeros_like(starts[..., 0], dtype=scene.xp.int64)
        scene.notes["brought"] = scene.xp.zeros_like(starts[..., 0], dtype=scene.xp.int64)
        scene.notes["distance"] = distance_to(starts, scene.notes["zones"][:, :1])
        return with_headings(starts, randoms.headings(scene.robots))

    def _next_zone(self, scene: Scene, carries: Array) -> Array:
        """Position of each robot's next zone, metres: shape (n, robots, 2)."""
        return scene.notes["zones"][scene.xp.arange(scene.n)[:, None], carries]

    def observe(self, scene: Scene) -> Array:
        carries = scene.notes["carries"]
        return joined(2.0 * carries - 1, towards(scene, self._next_zone(scene, carries), self.far),
                      speeds(scene, self.top_speed), free_space(scene, self.reach))

    def judge(self, scene: Scene) -> Outcome:
        notes = scene.notes
        carries = notes["carries"]
        distance = distance_to(scene.pose, self._next_zone(scene, carries))
        there = distance <= self.zone_radius
        reward = 0.1 * (notes["distance"] - distance) + there - stall_penalty(scene)
        notes["brought"] = notes["brought"] + (there & (carries == 1))
        notes["carries"] = carries ^ there
        notes["distance"] = distance_to(scene.pose, self._next_zone(scene, notes["carries"]))
        return Outcome(reward, scene.xp.zeros_like(there), {"brought": notes["brought"]})
