# SPDX-License-Identifier: GPL-2.0-or-later
"""Plans of the robot: sequences of velocities. The first plan is to stop."""

from __future__ import annotations

import re
from typing import Sequence

import numpy as np

from ...belief import Behaviour
from ..covariance import Array


#: Behaviours that need no more than the place and the velocity of somebody.
KINDS = ("stand", "go on", "go to", "social force", "orca")


def grid(speeds: Sequence[float], sideways: Sequence[float], turns: Sequence[float], detours: bool) -> Array:
    """All combinations of speeds and turn rates: shape (p, m, 3), the last of m velocities is for good.

    Args:
        detours: each one that turns is there three times more: the robot drives straight on after it with the greatest
            speed; or it does so, and turns back after the second or third velocity.
    """
    once = np.array([[ahead, left, turn] for ahead in speeds for left in sideways for turn in turns], float).reshape(-1, 3)
    plans = [np.zeros((1, 3)), *once[:, None]] if not detours else [np.zeros((5, 3)), *np.repeat(once[:, None], 5, 1)]
    for first in once[once[:, 2] != 0] if detours else ():
        fastest = max(0.0, *speeds)
        straight, back = (fastest, 0.0, 0.0), (fastest, 0.0, -first[2])
        plans += [np.array([first, straight, straight, straight, straight]), np.array([first, straight, back, straight, straight]),
                  np.array([first, straight, straight, back, straight])]
    return _unique(np.array(plans))


def dynamic_window(speeds: Sequence[float], turns: Sequence[float], now: Array, most: Sequence[float],
                   seconds: float) -> Array:
    """Velocities that can be reached from the present one, which are held for good: shape (p, 1, 3).

    Args:
        speeds, turns: their least and greatest are limits, and there are as many of each as given here.
        now: the present velocity.
        most: greatest accelerations, m/s2 and rad/s2.
        seconds: duration of the acceleration.
    """
    def between(limits: Sequence[float], middle: float, reach: float) -> Array:
        least, greatest = min(limits), max(limits)
        middle = min(max(middle, least), greatest)
        return np.linspace(max(least, middle - reach), min(greatest, middle + reach), len(limits))

    ahead, turn = between(speeds, now[0], most[0] * seconds), between(turns, now[2], most[1] * seconds)
    once = np.stack([np.repeat(ahead, len(turn)), np.zeros(len(ahead) * len(turn)), np.tile(turn, len(ahead))], 1)
    return _unique(np.concatenate([np.zeros((1, 1, 3)), once[:, None]]))


def _unique(plans: Array) -> Array:
    """The plans in their order, each once."""
    _, first = np.unique(plans.reshape(len(plans), -1) + 0.0, axis=0, return_index=True)
    return plans[np.sort(first)] + 0.0


def behaviours_of(text: str) -> list[Behaviour]:
    """Hypotheses from a text such as "go on 3, stand 1": kinds with weights.

    Raises:
        ValueError: a part of the text is nothing like that.
    """
    found = []
    for part in filter(None, (part.strip() for part in text.split(","))):
        match = re.fullmatch(r"([a-z ]+?)(?: +(\d+(?:\.\d*)?))?", part)
        kind, weight = (match[1], float(match[2] or 1)) if match else ("", 0.0)
        if kind not in KINDS or not weight > 0:
            raise ValueError(f"found the behaviour {part[:60]!a}, expected one of {', '.join(KINDS)}, and a weight above 0")
        found.append(Behaviour(kind, weight))
    return found
