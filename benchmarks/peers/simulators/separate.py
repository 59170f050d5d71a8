# SPDX-License-Identifier: GPL-2.0-or-later
"""Rewards and observations for simulators without batches, whose environments make their steps one after the other."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
import numpy.typing as npt

from ..task import Floats, Task, judge, places
from .simulation import Facts, Result, Simulation


class SeparateSimulation(Simulation):
    """Environments in a loop; subclasses place, move and read the agents of one environment."""

    note = "one thread, NumPy's arrays instead of tensors"

    def __init__(self, task: Task) -> None:
        self._task = task
        self._chance = np.random.default_rng(1)
        shape = (task.envs, task.agents)
        self._goals, self._positions = np.zeros((*shape, 2)), np.zeros((*shape, 2))
        self._velocities = np.zeros((*shape, 2))
        self._ranges = np.full((*shape, task.rays), task.reach)
        self._collided = np.zeros(shape, bool)
        self._distance = np.zeros(shape)

    @abstractmethod
    def _place(self, env: int, positions: Floats) -> None:
        """Begins an episode with agents at these positions, shape (agents, 2), heading 0."""

    @abstractmethod
    def _move(self, env: int, actions: Floats) -> None:
        """Makes a step in an environment; actions have the shape (agents, 2)."""

    @abstractmethod
    def _read(self, env: int) -> None:
        """Reads the state and the lidars of an environment into the arrays of this class."""

    def reset(self, which: npt.NDArray[np.int64]) -> None:
        """Begins new episodes."""
        task = self._task
        drawn = places(self._chance, len(which), 2 * task.agents, task.half_width)
        self._goals[which] = drawn[:, task.agents:]
        for env, positions in zip(which.tolist(), drawn[:, :task.agents]):
            self._place(env, positions)
            self._read(env)
        self._distance[which] = np.linalg.norm(self._positions - self._goals, axis=2)[which]

    def to_goals(self) -> Any:
        """Returns vectors to the goals."""
        return self._goals - self._positions

    def step(self, actions: Any) -> Result:
        """Makes a step."""
        for env in range(self._task.envs):
            self._move(env, actions[env])
            self._read(env)
        gap = self._positions - self._goals
        distance = np.linalg.norm(gap, axis=2)
        rewards, dones = judge(self._distance, distance, self._collided)
        self._distance = distance
        close = self._task.reach - self._ranges
        seen = np.concatenate([self._positions, self._velocities, gap, close], 2, dtype=np.float32)
        return seen, rewards, dones

    def poses(self) -> Floats:
        """Returns the poses; all headings are 0, because agents drive sideways."""
        return np.concatenate([self._positions, np.zeros((*self._positions.shape[:2], 1))], 2)

    def facts(self, result: Result) -> Facts:
        """Describes a step."""
        return Facts(self._task.reach - result[0][..., 6:].astype(float), result[1], self._collided.copy())
