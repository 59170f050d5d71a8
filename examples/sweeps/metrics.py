# SPDX-License-Identifier: GPL-2.0-or-later
"""Metrics in Python: a function called at the end of a run, and a class that observes each step."""

from __future__ import annotations

import numpy as np
import stagesim as st


def spread(world: st.World) -> dict[str, float]:
    """Return the mean distance of the robots from their centre at the end of the run, metres."""
    places = world.fleet().pose[:, :2]
    return {"spread": float(np.hypot(*(places - places.mean(0)).T).mean())}


class Crowding:
    """The fraction of steps in which at least one robot was stopped by another one or by a wall."""

    def __init__(self, world: st.World) -> None:
        """Called before the first step."""
        self.fleet = world.fleet()
        self.steps = self.crowded = 0

    def step(self) -> None:
        """Called after each step."""
        self.steps += 1
        self.crowded += bool(self.fleet.stalled.any())

    def result(self) -> dict[str, float]:
        """Return the metrics; called at the end."""
        return {"crowded": self.crowded / self.steps}
