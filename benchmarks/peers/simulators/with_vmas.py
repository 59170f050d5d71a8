# SPDX-License-Identifier: GPL-2.0-or-later
"""The task in VMAS: its scenario "navigation"."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from vmas import make_env

from ..task import RADIUS, Floats, Task
from .simulation import Facts, Result, Simulation


class VmasSimulation(Simulation):
    """A vectorized environment of VMAS, on the processor or on a GPU."""

    def __init__(self, task: Task, device: str, threads: int) -> None:
        torch.set_num_threads(threads)
        torch.set_grad_enabled(False)
        self._task, self._device = task, device
        self._env = make_env(
            scenario="navigation", num_envs=task.envs, device=device, continuous_actions=True, seed=1,
            n_agents=task.agents, n_lidar_rays=task.rays, lidar_range=task.reach, agent_radius=RADIUS,
            world_spawning_x=task.half_width, world_spawning_y=task.half_width)
        self._infos: list[dict[str, torch.Tensor]] = []

    def reset(self, which: npt.NDArray[np.int64]) -> None:
        """Begins new episodes: in all environments at once, or in one after the other."""
        if len(which) == self._task.envs:
            self._env.reset()
        else:
            for index in which.tolist():
                self._env.reset_at(index)

    def to_goals(self) -> Any:
        """Returns vectors to the goals."""
        return torch.stack([agent.goal.state.pos - agent.state.pos for agent in self._env.agents], 1)

    def step(self, actions: Any) -> Result:
        """Makes a step."""
        seen, rewards, dones, self._infos = self._env.step(list(actions.unbind(1)))
        return seen, rewards, dones

    def poses(self) -> Floats:
        """Returns the poses."""
        poses = torch.stack([torch.cat([agent.state.pos, agent.state.rot], 1) for agent in self._env.agents], 1)
        return poses.cpu().numpy().astype(float)

    def facts(self, result: Result) -> Facts:
        """Describes a step."""
        seen, rewards = (torch.stack(part, 1).cpu().numpy().astype(float) for part in result[:2])
        penalties = torch.stack([info["agent_collisions"] for info in self._infos], 1).cpu().numpy()
        return Facts(self._task.reach - seen[..., 6:], rewards, penalties < 0)

    def wait(self) -> None:
        """Waits for the GPU."""
        if self._device != "cpu":
            torch.cuda.synchronize()


def open_simulation(task: Task, device: str, threads: int, name: str) -> Simulation:
    """Starts the simulation."""
    assert name == "vmas"
    return VmasSimulation(task, device, threads)
