# SPDX-License-Identifier: GPL-2.0-or-later
"""The shipped tasks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Mapping

from .arrays import Array
from .features import distance_to, free_space, joined, speeds, towards, with_headings
from .randoms import Randoms
from .scene import Scene
from .task import Outcome, Task

STALL_PENALTY = 0.05  # per action after which the robot is stalled
PER_SQUARE_METRE = 4096  # the unit of squared distances that are sorted


def _stall_penalty(scene: Scene) -> Array:
    return STALL_PENALTY * scene.xp.astype(scene.stalled, scene.xp.float64)


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

    def judge(self, scene: Scene) -> Outcome:
        distance = distance_to(scene.pose, scene.notes["goal"])
        there = distance <= self.goal_radius
        reward = (scene.notes["distance"] - distance) + there - _stall_penalty(scene)
        scene.notes["distance"] = distance
        return Outcome(reward, there, {"distance": distance, "is_success": there})


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
        reward = (nearest - scene.notes["nearest"]) + alone - _stall_penalty(scene)
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
        reward = 0.1 * (notes["distance"] - distance) + there - _stall_penalty(scene)
        notes["brought"] = notes["brought"] + (there & (carries == 1))
        notes["carries"] = carries ^ there
        notes["distance"] = distance_to(scene.pose, self._next_zone(scene, notes["carries"]))
        return Outcome(reward, scene.xp.zeros_like(there), {"brought": notes["brought"]})


@dataclass
class Measured(Task):
    """A team task whose rewards and end are metrics of the world file, computed in C++.

    The metrics may be built-in ones (`docs/properties.md`), such as the area swept, or come from your own
    plug-in. In the default world, robots sweep a room. They start at random places. Reward of each robot: the
    sum over `reward` of the weight times the growth of that metric during the action; a missing value counts
    as 0. All robots are terminated when the metric `end` is at least `end_at`. Observation: speeds and ranges
    as in Navigate. Info: each metric of `reward`, by name.

    Args:
        reward: weights by name of the metric.
        end: name of the metric that terminates the episode; None: it never terminates.
        end_at: value of the metric `end` at which the episode is terminated.
        reach: ranges are clipped to this, metres.
        steps, limit, top_speed: see Task.
    """

    reward: Mapping[str, float] = field(default_factory=lambda: {"covered": 1.0, "collisions": -0.05})
    end: str | None = None
    end_at: float = 0.0
    reach: float = 4.0
    steps: int = 2
    limit: int = 300
    top_speed: tuple[float, float, float] = (0.5, 0.0, 1.5)
    world = "explore.world"

    def prepare(self, scene: Scene) -> None:
        known = scene.metrics
        for name in [*self.reward, *([] if self.end is None else [self.end])]:
            if name not in known:
                raise ValueError(f"found the metric {name!r}, expected one of the world file: "
                                 f"{', '.join(sorted(known)) or 'it has none'}")
        scene.notes["measured"] = scene.arrays.zeros((scene.n, len(self.reward)))

    def size(self, scene: Scene) -> int:
        return 2 + scene.ranges.shape[-1]

    def begin(self, scene: Scene, randoms: Randoms) -> Array | None:
        starts = scene.scatter(randoms, scene.robots)
        return with_headings(starts, randoms.headings(scene.robots))

    def began(self, scene: Scene) -> None:
        scene.notes["measured"] = self._measured(scene, scene.metrics)

    def _measured(self, scene: Scene, known: Mapping[str, Array]) -> Array:
        """Values of the metrics in `reward`, 0 where there is none: shape (n, metrics)."""
        values = scene.xp.stack([known[name] for name in self.reward], axis=-1)
        return scene.xp.where(scene.xp.isfinite(values), values, 0.0)

    def observe(self, scene: Scene) -> Array:
        return joined(speeds(scene, self.top_speed), free_space(scene, self.reach))

    def judge(self, scene: Scene) -> Outcome:
        xp, shape = scene.xp, (scene.n, scene.robots)
        known = scene.metrics
        now = self._measured(scene, known)
        weights = scene.arrays.of(list(self.reward.values()), "float64")
        gained = xp.sum((now - scene.notes["measured"]) * weights, axis=1)
        scene.notes["measured"] = now
        ended = known[self.end] >= self.end_at if self.end is not None else xp.zeros_like(gained, dtype=xp.bool)
        info = {name: xp.broadcast_to(now[:, i, None], shape) for i, name in enumerate(self.reward)}
        return Outcome(xp.broadcast_to(gained[:, None], shape), xp.broadcast_to(ended[:, None], shape), info)


#: The shipped tasks by the names that gymnasium.make() knows.
TASKS: dict[str, type[Task]] = {"Navigate": Navigate, "Disperse": Disperse, "Forage": Forage,
                               "Measured": Measured}
