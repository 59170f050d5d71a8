# SPDX-License-Identifier: GPL-2.0-or-later
"""Metrics of a scenario for sweeps."""

from __future__ import annotations

import numpy as np

from ..world import World
from . import metrics


class Social:
    """How close a robot came to people, for sweeps: metrics="stagesim.scenarios:Social".

    The robot is named "robot"; all other robots of the world are people. The results are `closest`, the distance of
    the nearest person's centre at any time in metres, and `personal` and `intimate`, the seconds with one within 1.2 and
    0.45 m.

    Args:
        world: a world at its first step.
    """

    def __init__(self, world: World) -> None:
        fleet = world.fleet()
        own = list(fleet.names).index("robot")
        self._pose = fleet.pose
        self._own, self._others = own, np.arange(len(fleet)) != own
        self._dt = world.dt
        self._closest = np.inf
        self._times = dict.fromkeys(("personal", "intimate"), 0.0)

    def step(self) -> None:
        """Looks at the poses after a step."""
        robot, people = self._pose[None, self._own], self._pose[None, self._others]
        distance = float(metrics.closest_distances(robot, people).min(initial=np.inf))
        self._closest = min(self._closest, distance)
        for name, limit in (("personal", metrics.PERSONAL), ("intimate", metrics.INTIMATE)):
            self._times[name] += self._dt * (distance < limit)

    def result(self) -> dict[str, float]:
        """The metrics by name."""
        return {"closest": self._closest, **self._times}
