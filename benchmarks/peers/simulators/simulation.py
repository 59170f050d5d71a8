# SPDX-License-Identifier: GPL-2.0-or-later
"""The interface of the measured simulators."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..task import Floats

#: Observations, rewards and dones.
Result = tuple[Any, Any, Any]


@dataclass
class Facts:
    """The result of one step as NumPy arrays, for checks."""

    ranges: Floats  # readings in the observations, metres: shape (envs, agents, rays)
    rewards: Floats  # shape (envs, agents)
    collided: npt.NDArray[np.bool_]  # agents that touch another one: shape (envs, agents)


class Simulation(ABC):
    """Environments of one simulator that carry out a task.

    Actions are an array or a tensor of shape (envs, agents, 2), whose vectors are at most 1 long. They are speeds in
    units of TOP_SPEED, or forces that lead to such speeds.
    """

    senses_first = False  # a step measures ranges before the agents move, not afterwards
    note = ""  # what a reader of the table must know

    @abstractmethod
    def reset(self, which: npt.NDArray[np.int64]) -> None:
        """Begins new episodes in the environments with these numbers, and computes their observations."""

    @abstractmethod
    def to_goals(self) -> Any:
        """Returns vectors from agents to goals, metres: shape (envs, agents, 2), of the type that step() takes."""

    @abstractmethod
    def step(self, actions: Any) -> Result:
        """Makes one step in all environments."""

    @abstractmethod
    def poses(self) -> Floats:
        """Returns a copy of the poses, x and y in metres and heading in radians: shape (envs, agents, 3)."""

    @abstractmethod
    def facts(self, result: Result) -> Facts:
        """Describes the last step, which returned `result`."""

    def wait(self) -> None:
        """Waits until a device has computed everything."""
