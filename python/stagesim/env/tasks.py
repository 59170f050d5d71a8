# SPDX-License-Identifier: GPL-2.0-or-later
"""The tasks that come with the package."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Mapping

import numpy as np
import numpy.typing as npt

from ..fleet import Floats
from .task import Outcome, Scene, Task, distance_to, seen_from

STALL_PENALTY = 0.05  # for each action that ends against something


def _senses(scene: Scene, reach: float, top_speed: tuple[float, float, float]) -> list[Floats]:
    """Speeds and ranges, -1 to 1 and 0 to 1; what a ranger has not measured counts as free."""
    speeds = np.stack([scene.velocity[..., 0] / (top_speed[0] or 1),
                       scene.velocity[..., 2] / (top_speed[2] or 1)], -1)
    ranges = scene.ranges / reach
    return [speeds, np.where(np.isnan(ranges), 1, np.minimum(ranges, 1))]


def _towards(scene: Scene, points: Floats, far: float) -> list[Floats]:
    """What is observed of points: how far they are (0 to 1), cosine and sine of their bearing."""
    distance, bearing = seen_from(scene.pose, points)
    return [np.minimum(distance / far, 1)[..., None], bearing]


def _with_headings(places: Floats, random: np.random.Generator) -> Floats:
    return np.column_stack([places, random.uniform(-np.pi, np.pi, len(places))])


@dataclass
class Navigate(Task):
    """Each robot drives to a goal of its own. It comes to its end there.

    Start and goal are places by chance that a way leads to. Reward: metres that it came nearer, 1 at the
    goal, -0.05 for an action that ends against something. Observed: distance to the goal in units of `far`
    (0 to 1), cosine and sine of its bearing, speed forwards and of turning in units of `top_speed`, ranges
    in units of `reach`. Info: `distance` (metres), `is_success`.

    Args:
        goal_radius: how near it has to come, metres.
        far: metres: distances beyond it look alike.
        reach: metres: ranges beyond it look alike.
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
    """Robots that begin in a cluster get away from each other, until each is alone within `spread` metres.

    Reward: metres that the nearest other one is further off than before, up to `spread`; 1 for all when all
    are alone, which is the end; -0.05 for an action that ends against something. Observed: distance to the
    nearest other robot in units of `spread` (0 to 1), cosine and sine of its bearing, speeds, ranges, as in
    Navigate. Info: `nearest` (metres, `spread` at most), `is_success`.

    Args:
        spread: metres.
        reach: metres: ranges beyond it look alike.
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
    """How far the nearest other robot is, and which it is: shape (n, robots) each. Robots that are gone are
    far away."""
    away = pose[:, :, None, :2] - pose[:, None, :, :2]
    squares = away[..., 0] * away[..., 0] + away[..., 1] * away[..., 1]
    squares[np.isnan(squares)] = np.inf
    squares[:, np.arange(pose.shape[1]), np.arange(pose.shape[1])] = np.inf
    which = squares.argmin(2)
    return np.sqrt(np.take_along_axis(squares, which[..., None], 2)[..., 0]), which


@dataclass
class Forage(Task):
    """Robots fetch things at the model "source" of the world and bring them to the model "sink".

    A robot gets one, without end, when it comes within `zone_radius` of the source without one, and leaves
    it when it comes as near to the sink. Reward: 1 for each it gets and each it brings, 0.1 for a metre
    nearer to where it has to go next, -0.05 for an action that ends against something. Observed: whether it
    carries one (1 or -1), distance to where it has to go next in units of `far` (0 to 1), cosine and sine of
    its bearing, speeds, ranges, as in Navigate. Info: `brought`, in this episode. It never ends by itself.

    Args:
        zone_radius: metres.
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
        """Where each robot has to go next: shape (n, robots, 2)."""
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
    """Robots together get what the metrics of the world file gain: rewards, and the end, that are worked out in C++.

    Those that come with Stage will do (`docs/properties.md`), such as the area that was swept, and those that a
    plug-in of your own registers. The shipped world has a room to be swept. Robots begin at places by chance.
    Reward of each robot: the sum over `reward` of the weight times what the metric of that name has grown by in the
    action; no value counts as 0. All come to their end when the metric `end` has a value of at least `end_at`.
    Observed: speeds, ranges, as in Navigate. Info: each metric of `reward`, by name.

    Args:
        reward: weights of metrics, by name.
        end: the name of a metric; None: it never ends by itself.
        end_at: what it has to come to.
        reach: metres: ranges beyond it look alike.
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
        """What the metrics of the reward come to: shape (n, metrics)."""
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


#: By the names that gymnasium.make() knows.
TASKS: dict[str, type[Task]] = {"Navigate": Navigate, "Disperse": Disperse, "Forage": Forage,
                               "Measured": Measured}
