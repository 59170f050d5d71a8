# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks the actions that an environment is given."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete, Space

from ..fleet import Bools
from .arrays import Array, are_within, on_host
from .scene import Scene


class Actions:
    """The actions of the robots of many worlds.

    Args:
        space: the space of a robot's actions: Discrete, or a Box of numbers from -1 to 1.
        scene: all worlds.
        clips: whether numbers outside -1 to 1 are clipped and counted; False: they are errors.

    Raises:
        TypeError: the space is of another kind.
    """

    def __init__(self, space: Space[Any], scene: Scene, clips: bool) -> None:
        if not isinstance(space, (Box, Discrete)) or (isinstance(space, Box) and len(space.shape) != 1):
            raise TypeError(f"found the action space {space}, expected Discrete, or a Box with one axis")
        self.space = space  #: the space of a robot
        self.clipped = 0  #: how many numbers have been clipped
        self._clips = clips
        self._arrays = scene.arrays
        self._shape = (scene.n, scene.robots, *space.shape)
        self._names = scene.batch.names

    @property
    def is_discrete(self) -> bool:
        """True if actions are numbers of choices."""
        return isinstance(self.space, Discrete)

    def of_team(self) -> Space[Any]:
        """The space of all robots of a world together."""
        robots = self._shape[1]
        if isinstance(self.space, Box):
            return Box(-1, 1, (robots * self.space.shape[0],), np.float32)
        return self.space if robots == 1 else MultiDiscrete([int(self.space.n)] * robots)

    def checked(self, actions: Any, going: Bools) -> Array:
        """The actions as an array of shape (n, robots, ...): float64, or int64 if they are discrete.

        Raises ValueError or TypeError for actions of the worlds `going` that are not in the space; all others are 0.
        """
        given = self._arrays.given(actions)
        n, shape = self._shape[0], tuple(given.shape)
        if math.prod(shape) != math.prod(self._shape) or (n > 1 and shape[0] != n):
            raise ValueError(f"found actions of shape {shape}, expected {self._shape}, or those of a world in one axis")
        given = given.reshape(self._shape)
        xp = self._arrays.xp
        if isinstance(self.space, Discrete):
            if not xp.isdtype(given.dtype, "integral"):
                raise TypeError(f"found actions of the type {given.dtype}, expected whole numbers, each a choice")
            given = xp.astype(given, xp.int64)
            low, high = 0, int(self.space.n) - 1
        else:
            given = xp.astype(given, xp.float64, copy=False)
            low, high = -1, 1
        if are_within(given, low, high):
            return given
        return self._of_going(given, going, low, high)

    def _of_going(self, given: Array, going: Bools, low: int, high: int) -> Array:
        xp = self._arrays.xp
        mask = self._arrays.of(going).reshape((-1,) + (1,) * (given.ndim - 1))
        given = xp.where(mask, given, xp.zeros_like(given))
        wrong = ~((given >= low) & (given <= high))
        count = int(xp.sum(xp.astype(wrong, xp.int64)))
        if count == 0:
            return given
        finite = self.is_discrete or bool(xp.all(xp.isfinite(given)))
        if not self._clips or self.is_discrete or not finite:
            place = np.argwhere(on_host(wrong))[0].tolist()
            value = on_host(given)[tuple(place)]
            raise ValueError(f"found the action {value:g} of {self._names[place[1]]} in world {place[0]}, expected {low} "
                             f"to {high}" + ("; clip it, or make the environment with clip_actions=True"
                                             if finite and not self.is_discrete else ""))
        self.clipped += count
        return xp.clip(given, low, high)
