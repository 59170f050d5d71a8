# SPDX-License-Identifier: GPL-2.0-or-later
"""Parts of the rewards of several tasks."""

from __future__ import annotations

from ..arrays import Array
from ..scene import Scene

STALL_PENALTY = 0.05  # per action after which the robot is stalled


def stall_penalty(scene: Scene) -> Array:
    """Returns the penalty of each robot for being stalled: shape (n, robots)."""
    return STALL_PENALTY * scene.xp.astype(scene.stalled, scene.xp.float64)
