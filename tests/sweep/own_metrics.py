# SPDX-License-Identifier: GPL-2.0-or-later
"""Metrics for tests."""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np
import stagesim as st


def spread(world: st.World) -> dict[str, Any]:
    """A function: the spread of the robots at the end, and a metric without a value."""
    return {"spread": np.std(world.fleet().pose[:, :2]), "nothing": None, "not_finite": float("nan")}


class Nearest:
    """A class: the min distance of a robot to the center over all steps, and the number of steps."""

    def __init__(self, world: st.World) -> None:
        self.fleet = world.fleet()
        self.least = np.inf
        self.steps = 0

    def step(self) -> None:
        self.least = min(self.least, np.hypot(*self.fleet.pose[:, :2].T).min())
        self.steps += 1

    def result(self) -> dict[str, Any]:
        return {"nearest": self.least, "steps_seen": self.steps}


def fails_with_six(world: st.World) -> dict[str, Any]:
    """Raises, dies by a signal or returns no number, if there are six robots."""
    if len(world.fleet()) == 6 and "SIX_ARE_FINE" not in os.environ:
        if world.seed % 3 == 0:
            os.abort()
        if world.seed % 3 == 1:
            return {"bad": "text"}
        sys.exit("found six robots")
    return {"fine": 1}


def fails_once(world: st.World) -> dict[str, Any]:
    """Raises in only one run of the sweep in test_report.py, by its seed."""
    if world.seed % 12 == 6:
        raise RuntimeError("found that seed")
    return {}


NUMBER = 5
