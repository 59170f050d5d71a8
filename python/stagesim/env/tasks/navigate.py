# SPDX-License-Identifier: GPL-2.0-or-later
"""Navigation of one and of many robots."""

from __future__ import annotations

from dataclasses import dataclass

from ..arrays import Array
from ..features import distance_to, free_space, joined, speeds, towards, with_headings
from ..randoms import Randoms
from ..scene import Scene
from ..task import Outcome, Task
from .common import stall_penalty
from .worlds import rooms


@dataclass
class Navigate(Task):
    """Each robot drives to a goal of its own, where its episode is terminated.

    Starts and goals are random reachable places. Reward: progress towards the goal in metres, 1 at the goal,
    -0.05 for an action that ends stalled. Observation: distance to the goal in units of `far` (0 to 1),
    cosine and sine of its bearing, speeds forwards and turning in units of `top_speed`, ranges in units of
    `reach`. Info: `distance` (metres), `is_success`.

    Args:
        goal_radius: distance at which a goal is reached, metres.
        far: distances are clipped to this, metres.
        reach: ranges are clipped to this, metres.
        steps, limit, top_speed: see Task.
    """

    goal_radius: float = 0.3
    far: float = 10.0
    reach: float = 4.0
    steps: int = 2
    limit: int = 300
    top_speed: tuple[float, float, float] = (0.5, 0.0, 1.5)
    world = "navigate.world"

    def size(self, scene: Scene) -> int:
        return 5 + scene.ranges.shape[-1]

    def begin(self, scene: Scene, randoms: Randoms) -> Array | None:
        places = scene.scatter(randoms, 2 * scene.robots)
        starts, goals = places[:, ::2], places[:, 1::2]
        scene.notes["goal"] = goals
        scene.notes["distance"] = distance_to(starts, goals)
        return with_headings(starts, randoms.headings(scene.robots))

    def observe(self, scene: Scene) -> Array:
        return joined(towards(scene, scene.notes["goal"], self.far), speeds(scene, self.top_speed),
                      free_space(scene, self.reach))

    def marks(self, scene: Scene) -> Array:
        return scene.notes["goal"]

    def judge(self, scene: Scene) -> Outcome:
        distance = distance_to(scene.pose, scene.notes["goal"])
        there = distance <= self.goal_radius
        reward = (scene.notes["distance"] - distance) + there - stall_penalty(scene)
        scene.notes["distance"] = distance
        return Outcome(reward, there, {"distance": distance, "is_success": there})


@dataclass
class Navigate8(Navigate):
    """Navigate by eight robots in four rooms, 10 m by 10 m in all, with wide doors and a pillar in each.

    Robots see each other by their lidars. The episode of a robot ends at its goal, where it stands until those of all
    others have ended. Rewards, observations and infos are those of Navigate, for each robot.
    """

    world = rooms(2, 5.0, 8)


@dataclass
class Navigate32(Navigate):
    """Navigate by 32 robots in sixteen rooms, 16 m by 16 m in all, with wide doors and a pillar in each.

    Otherwise it is Navigate8. Goals are up to 21 m away; `far` limits only the distance that is observed.
    """

    limit: int = 400
    world = rooms(4, 4.0, 32)
