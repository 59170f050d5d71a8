# SPDX-License-Identifier: GPL-2.0-or-later
"""People of a scenario: where they stand, where they go and how fast."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..scenes import Ranger, Robot
from ..scenes.draws import Draws

Floats = npt.NDArray[np.float64]
Area = tuple[float, float, float, float]  # the least and the greatest x, the least and the greatest y, m

RADIUS = 0.2  # m, of a person: a disc of about the area of a body seen from above
APART = 0.7  # m, between two people at first
TRIES = 400  # for the place of a person
# Desired speeds: U. Weidmann, Transporttechnik der Fussgaenger, ETH Zuerich, 1993.
MEAN_SPEED, SPEED_DEVIATION, SPEEDS = 1.34, 0.26, (0.5, 2.2)  # m/s
_BOUND = 3.0  # m/s
# In open places people keep their distance; in bottlenecks they come close to others and to walls.
_OPEN = ["radius=0.2", "repulsion=7", "reach=0.4", "tolerance=0.3"]
_CLOSE = ["radius=0.2", "repulsion=5", "reach=0.3", "wall=5", "wall_reach=0.1", "tolerance=0.3"]
_COLORS = ("red", "blue", "orange", "green", "purple", "brown")


def desired_speeds(n: int, draws: Draws) -> Floats:
    """Draws speeds in m/s from a normal distribution, the sum of twelve uniform numbers, without its far ends."""
    normal = draws.fractions(n, 12).sum(1) - 6
    speeds: Floats = np.clip(MEAN_SPEED + SPEED_DEVIATION * normal, *SPEEDS)
    return speeds


class Places:
    """Random places that keep a distance from each other."""

    def __init__(self, draws: Draws, scenario: str) -> None:
        self._draws = draws
        self._scenario = scenario
        self._taken: list[tuple[float, float, float]] = []

    def take(self, x: float, y: float, distance: float) -> None:
        """Keeps others at this distance, metres."""
        self._taken.append((x, y, distance))

    def one(self, area: Area, distance: float = APART) -> tuple[float, float]:
        """A random place in an area.

        Raises:
            ValueError: there is no room.
        """
        taken = np.array(self._taken).reshape(-1, 3)
        least = np.maximum(taken[:, 2], distance)
        for _ in range(TRIES):
            u, v = self._draws.fractions(2).tolist()
            x, y = area[0] + u * (area[1] - area[0]), area[2] + v * (area[3] - area[2])
            if ((taken[:, 0] - x)**2 + (taken[:, 1] - y)**2 >= least**2).all():
                self.take(x, y, distance)
                return x, y
        raise ValueError(f"found no room for all pedestrians of the scenario {self._scenario!r}, expected fewer pedestrians")


@dataclass(frozen=True)
class Person:
    """A person of a scenario.

    Attributes:
        start: x and y, metres.
        goals: x and y of each goal, metres.
        speed: the desired one, m/s.
        loop: whether the first goal follows the last one.
        wait: seconds at each goal but the last one.
        near: metres at which a goal that another one follows is reached.
        group: the size of the group, and the number in it from 1 on.
        stream: people of a stream have a colour.
        looks: whether walls are near, so that the person needs to see.
        close: whether the person comes close to others and to walls, as in a bottleneck.
    """

    start: tuple[float, float]
    goals: tuple[tuple[float, float], ...]
    speed: float
    loop: bool = False
    wait: float = 0.0
    near: float = 0.6
    group: tuple[int, int] = (1, 1)
    stream: int = 0
    looks: bool = True
    close: bool = False

    def robot(self, name: str, rule: str) -> Robot:
        """The person as a robot of a scene, with the controller stage/pedestrian or stage/orca."""
        heading = math.atan2(self.goals[0][1] - self.start[1], self.goals[0][0] - self.start[0])
        sensors = [Ranger(pose=(0, 0, 0.3, 0), range=(0, 2), fov=2 * math.pi, samples=36)] if self.looks else []
        return Robot(name=name, pose=(*self.start, heading), size=(2 * RADIUS, 2 * RADIUS, 1.7), round=True, drive="omni",
                     color=_COLORS[self.stream % len(_COLORS)], ctrl=self._controller(rule), sensors=sensors,
                     velocity_bounds=(-_BOUND, _BOUND, -_BOUND, _BOUND, 0, 0, -math.pi, math.pi))

    def _controller(self, rule: str) -> str:
        goals = ",".join(f"{x:.3f},{y:.3f}" for x, y in self.goals)
        words = [f"stage/{rule}", f"goals={goals}", f"speed={self.speed:.3f}", f"near={self.near:g}"]
        forces = _CLOSE if self.close else _OPEN
        words += forces if rule == "pedestrian" else [f"radius={RADIUS:g}"]
        words += ["loop=1"] if self.loop else []
        words += [f"wait={self.wait:g}"] if self.wait else []
        if self.group[0] > 1 and rule == "pedestrian":
            words += [f"group={self.group[0]}", f"member={self.group[1]}"]
        return " ".join(words)


def group_sizes(n: int, draws: Draws) -> Sequence[int]:
    """Splits people into groups of two to four; one may be alone."""
    sizes: list[int] = []
    while n > 0:
        sizes.append(min(n, draws.between(2, 4)))
        n -= sizes[-1]
    return sizes
