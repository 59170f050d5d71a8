# SPDX-License-Identifier: GPL-2.0-or-later
"""The shipped tasks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Mapping

import numpy as np
import numpy.typing as npt

from ..fleet import Floats
from .task import Outcome, Scene, Task, distance_to, seen_from

STALL_PENALTY = 0.05  # per action after which the robot is stalled


def _senses(scene: Scene, reach: float, top_speed: tuple[float, float, float]) -> list[Floats]:
    """Observed speeds (-1 to 1) and ranges (0 to 1); a sample without a reading counts as free (1)."""
    speeds = np.stack([scene.velocity[..., 0] / (top_speed[0] or 1),
                       scene.velocity[..., 2] / (top_speed[2] or 1)], -1)
    ranges = scene.ranges / reach
    return [speeds, np.where(np.isnan(ranges), 1, np.minimum(ranges, 1))]


def _towards(scene: Scene, points: Floats, far: float) -> list[Floats]:
    """Observed points: distance in units of `far` (0 to 1), cosine and sine of the bearing."""
    distance, bearing = seen_from(scene.pose, points)
    return [np.minimum(distance / far, 1)[..., None], bearing]


def _with_headings(places: Floats, random: np.random.Generator) -> Floats:
    return np.column_stack([places, random.uniform(-np.pi, np.pi, len(places))])


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

    def prepare(self, scene: Scene) -> None:
        scene.notes["goal"] = np.zeros((scene.n, scene.robots, 2))
        scene.notes["distance"] = np.zeros((scene.n, scene.robots))

    def size(self, scene: Scene) -> int:
        return 5 + scene.ranges.shape[-1]

    def begin(self, scene: Scene, index: int, random: np.random.Generator) -> npt.ArrayLike | None:
        places = scene.scatter(random, 2 * scene.robots)
        starts, goals = _with_headings(places[::2], random), places[1::2]
        scene.notes["goal"][index] = goals
        scene.notes["distance"][index] = distance_to(starts, goals)
        return starts

    def observe(self, scene: Scene) -> Floats:
        goal = _towards(scene, scene.notes["goal"], self.far)
        return np.concatenate([*goal, *_senses(scene, self.reach, self.top_speed)], -1)

    def judge(self, scene: Scene) -> Outcome:
        distance = distance_to(scene.pose, scene.notes["goal"])
        there = distance <= self.goal_radius
        reward = scene.notes["distance"] - distance + there - STALL_PENALTY * scene.stalled
        scene.notes["distance"][...] = distance
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
        scene.notes["nearest"] = np.zeros((scene.n, scene.robots))

    def size(self, scene: Scene) -> int:
        return 5 + scene.ranges.shape[-1]

    def begin(self, scene: Scene, index: int, random: np.random.Generator) -> npt.ArrayLike | None:
        places = scene.places
        middle = places[random.integers(len(places))]
        near = np.argsort(((places - middle) ** 2).sum(1), kind="stable")[:16 * scene.robots]
        starts = _with_headings(scene.scatter(random, scene.robots, 0.5, places[near]), random)
        scene.notes["nearest"][index] = np.minimum(_nearest(starts[None])[0], self.spread)
        return starts

    def observe(self, scene: Scene) -> Floats:
        _, which = _nearest(scene.pose)
        other = np.take_along_axis(scene.pose, which[..., None], 1)[..., :2]
        neighbour = _towards(scene, other, self.spread)
        return np.concatenate([*neighbour, *_senses(scene, self.reach, self.top_speed)], -1)

    def judge(self, scene: Scene) -> Outcome:
        nearest = np.minimum(_nearest(scene.pose)[0], self.spread)
        alone = np.all(nearest >= self.spread, axis=1, keepdims=True) & np.ones(nearest.shape, bool)
        reward = nearest - scene.notes["nearest"] + alone - STALL_PENALTY * scene.stalled
        scene.notes["nearest"][...] = nearest
        return Outcome(reward, alone, {"nearest": nearest, "is_success": alone})


def _nearest(pose: Floats) -> tuple[Floats, npt.NDArray[np.intp]]:
    """Distance and index of the nearest other robot: shape (n, robots) each. A deleted robot is infinitely far."""
    away = pose[:, :, None, :2] - pose[:, None, :, :2]
    squares = away[..., 0] * away[..., 0] + away[..., 1] * away[..., 1]
    squares[np.isnan(squares)] = np.inf
    squares[:, np.arange(pose.shape[1]), np.arange(pose.shape[1])] = np.inf
    which = squares.argmin(2)
    return np.sqrt(np.take_along_axis(squares, which[..., None], 2)[..., 0]), which


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
        scene.notes["zones"] = np.tile(np.array(zones), (scene.n, 1, 1))
        scene.notes["carries"] = np.zeros((scene.n, scene.robots), np.int64)
        scene.notes["brought"] = np.zeros((scene.n, scene.robots), np.int64)
        scene.notes["distance"] = np.zeros((scene.n, scene.robots))

    def size(self, scene: Scene) -> int:
        return 6 + scene.ranges.shape[-1]

    def begin(self, scene: Scene, index: int, random: np.random.Generator) -> npt.ArrayLike | None:
        starts = _with_headings(scene.scatter(random, scene.robots), random)
        scene.notes["carries"][index] = 0
        scene.notes["brought"][index] = 0
        scene.notes["distance"][index] = distance_to(starts, scene.notes["zones"][index, 0])
        return starts

    def _next_zone(self, scene: Scene) -> Floats:
        """Position of each robot's next zone, metres: shape (n, robots, 2)."""
        return np.take_along_axis(scene.notes["zones"], scene.notes["carries"][..., None], 1)

    def observe(self, scene: Scene) -> Floats:
        carries = 2.0 * scene.notes["carries"][..., None] - 1
        zone = _towards(scene, self._next_zone(scene), self.far)
        return np.concatenate([carries, *zone, *_senses(scene, self.reach, self.top_speed)], -1)

    def judge(self, scene: Scene) -> Outcome:
        notes = scene.notes
        distance = distance_to(scene.pose, self._next_zone(scene))
        there = distance <= self.zone_radius
        reward = 0.1 * (notes["distance"] - distance) + there - STALL_PENALTY * scene.stalled
        notes["brought"] += there & (notes["carries"] == 1)
        notes["carries"] ^= there
        notes["distance"][...] = distance_to(scene.pose, self._next_zone(scene))
        return Outcome(reward, np.zeros(there.shape, bool), {"brought": notes["brought"]})


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
        scene.notes["measured"] = np.zeros((scene.n, len(self.reward)))

    def size(self, scene: Scene) -> int:
        return 2 + scene.ranges.shape[-1]

    def begin(self, scene: Scene, index: int, random: np.random.Generator) -> npt.ArrayLike | None:
        return _with_headings(scene.scatter(random, scene.robots), random)

    def _measured(self, known: Mapping[str, Floats]) -> Floats:
        """Values of the metrics in `reward`, 0 where there is none: shape (n, metrics)."""
        return np.nan_to_num(np.stack([known[name] for name in self.reward], -1), posinf=0, neginf=0)

    def observe(self, scene: Scene) -> Floats:
        scene.notes["measured"][...] = self._measured(scene.metrics)
        return np.concatenate(_senses(scene, self.reach, self.top_speed), -1)

    def judge(self, scene: Scene) -> Outcome:
        robots = np.ones((1, scene.robots))
        known = scene.metrics
        now = self._measured(known)
        gained = ((now - scene.notes["measured"]) * np.array(list(self.reward.values()))).sum(1)
        ended = np.zeros(scene.n, bool) if self.end is None else known[self.end] >= self.end_at
        info = {name: now[:, i, None] * robots for i, name in enumerate(self.reward)}
        return Outcome(gained[:, None] * robots, ended[:, None] & (robots > 0), info)


#: The shipped tasks by the names that gymnasium.make() knows.
TASKS: dict[str, type[Task]] = {"Navigate": Navigate, "Disperse": Disperse, "Forage": Forage,
                               "Measured": Measured}
