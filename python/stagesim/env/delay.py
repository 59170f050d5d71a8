# SPDX-License-Identifier: GPL-2.0-or-later
"""Latency of commands: robots obey an action some actions later."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .._checks import integer, shown
from .arrays import Array, Arrays
from .scene import Scene

NAME = "action.delay"  #: of the values in vary()
MOST = 1000  # actions


class Delay:
    """Keeps the last commands of all worlds, each of which obeys them after its own number of actions.

    Robots stand still until the first command of an episode arrives.

    Args:
        scene: all worlds.
        actions: the delay of each world in actions, 0 to 1000.
    """

    def __init__(self, scene: Scene, actions: int) -> None:
        actions = integer(actions, "action_delay", 0, MOST)
        self._arrays: Arrays = scene.arrays
        self._shape = scene.n, scene.robots, 3
        self._next = np.full(scene.n, actions, np.int64)  # from the next episode on
        self._delays = self._next.copy()
        self._kept: Array = None
        self._now = 0
        self._make_room()

    def set(self, values: Any) -> None:
        """Gives each world another delay from its next episode on; None: 0."""
        n = self._shape[0]
        given = np.zeros(n, np.int64) if values is None else np.asarray(values)
        if given.shape != (n,):
            raise ValueError(f"vary({NAME!r}): found the shape {given.shape}, expected ({n},): a delay for each world")
        if given.dtype.kind not in "iu" or not (0 <= given.min() and given.max() <= MOST):
            raise ValueError(f"vary({NAME!r}): found {shown(values)}, expected whole numbers of actions from 0 to {MOST}")
        self._next = given.astype(np.int64)

    @property
    def values(self) -> npt.NDArray[np.int64]:
        """The delays that set() was given: a copy."""
        return self._next.copy()

    def begin(self, ids: npt.NDArray[np.int64] | slice) -> None:
        """Begins episodes in these worlds: their new delays are in force, and no command is under way."""
        self._delays[ids] = self._next[ids]
        if self._delays.any():
            self._make_room()
            self._kept[:, ids if isinstance(ids, slice) else self._arrays.of(ids)] = 0

    def passed(self, speeds: Array) -> Array:
        """Takes the commands of this action and returns those that are obeyed now: shape (n, robots, 3)."""
        if not self._delays.any():
            return speeds
        length = self._kept.shape[0]
        self._now = (self._now + 1) % length
        self._kept[self._now] = speeds
        which = self._arrays.of((self._now - self._delays) % length)
        return self._kept[which, self._arrays.of(np.arange(self._shape[0]))]

    def _make_room(self) -> None:
        """Makes room for the longest delay. What is under way stays, the newest command first."""
        length = int(self._delays.max(initial=0)) + 1
        before = 0 if self._kept is None else self._kept.shape[0]
        if length <= before:
            return
        kept = self._arrays.zeros((length, *self._shape))
        for age in range(before):
            kept[-1 - age] = self._kept[(self._now - age) % before]
        self._kept, self._now = kept, length - 1
