# SPDX-License-Identifier: GPL-2.0-or-later
"""Drives a simulation through episodes, as a learner would."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import numpy.typing as npt

from .simulators.simulation import Result, Simulation
from .task import Schedule, Task, unit


class Driver:
    """Makes steps, and resets environments whose episodes end.

    An action depends only on the agent's start and goal, so a step costs no time for a policy.
    """

    def __init__(self, simulation: Simulation, task: Task) -> None:
        self._simulation = simulation
        self._schedule = Schedule(task)
        self._length = task.episode
        self._steps = 0
        self.resets = 0  # episodes begun after the first ones
        simulation.reset(np.arange(task.envs))
        self._actions: Any = unit(simulation.to_goals())

    def begin(self) -> npt.NDArray[np.int64] | None:
        """Begins new episodes where they are due; call it before act(). Returns the environments; None: there are none.
        """
        self._steps += 1
        ended, turning = self._schedule.ended(self._steps), self._schedule.turning(self._steps)
        if turning is not None:
            self._actions[turning] = -self._actions[turning]
        if ended is not None:
            self._simulation.reset(ended)
            self._actions[ended] = unit(self._simulation.to_goals())[ended]
            self.resets += len(ended)
        return ended

    def step(self) -> Result:
        """Makes one step in all environments."""
        self.begin()
        return self.act()

    def act(self) -> Result:
        """Makes the step that begin() has prepared."""
        return self._simulation.step(self._actions)

    def episode(self) -> Result:
        """Makes the steps of one episode, resets included, and returns the last result."""
        for _ in range(self._length):
            result = self.step()
        return result

    def measure(self, seconds: float) -> tuple[int, float, Result]:
        """Makes whole episodes for a time; returns the steps, the seconds that they took, and the last result."""
        self._simulation.wait()
        count, start = 0, time.perf_counter()
        while time.perf_counter() - start < seconds:
            result = self.episode()
            count += self._length
        self._simulation.wait()
        return count, time.perf_counter() - start, result
