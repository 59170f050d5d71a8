# SPDX-License-Identifier: GPL-2.0-or-later
"""Metrics in Python: a function that is called at the end of a run, and a class that looks at each step."""

from __future__ import annotations

import numpy as np
import stagesim as st


def spread(world: st.World) -> dict[str, float]:
    """How far the robots are from their middle, metres, when the run ends."""
    places = world.fleet().pose[:, :2]
    return {"spread": float(np.hypot(*(places - places.mean(0)).T).mean())}


class Crowding:
    """The share of steps in which some robot stood still because another one, or a wall, was in its way."""

    def __init__(self, world: st.World) -> None:
        """Before the first step."""
        self.fleet = world.fleet()
        self.steps = self.crowded = 0

    def step(self) -> None:
        """After each step."""
        self.steps += 1
        self.crowded += bool(self.fleet.stalled.any())

    def result(self) -> dict[str, float]:
        """At the end."""
        return {"crowded": self.crowded / self.steps}
