# SPDX-License-Identifier: GPL-2.0-or-later
"""The task in a batch of stagesim on a CUDA device: the scenario's rewards, observations and resets in PyTorch."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import stagesim as st
import torch

from ..task import FINAL_REWARD, GAP, GOAL_RADIUS, PENALTY, RADIUS, TOP_SPEED, Floats, Task
from .simulation import Facts, Result, Simulation

TRIES = 8  #: places that are drawn at once


def places(which: torch.Tensor, count: int, half_width: float) -> torch.Tensor:
    """Draws random places that are at least GAP apart, as VMAS does.

    Args:
        which: the numbers of the environments.
        count: number of places in each.
        half_width: half the width of the square, metres.

    Returns:
        x and y in metres, shape (environments, count, 2).
    """
    found = torch.empty((len(which), count, 2), dtype=torch.float64, device=which.device)
    for i in range(count):
        todo = torch.arange(len(which), device=which.device)
        while len(todo):
            tried = torch.empty((len(todo), TRIES, 2), dtype=torch.float64,
                                device=which.device).uniform_(-half_width, half_width)
            apart = found[todo, None, :i] - tried[:, :, None]
            is_free = ((apart ** 2).sum(-1) >= (2 * RADIUS + GAP) ** 2).all(-1)
            first = is_free.to(torch.int8).argmax(1)  # the first free one
            found[todo, i] = tried[torch.arange(len(todo), device=which.device), first]
            todo = todo[~is_free.any(1)]
    return found


class CardSimulation(Simulation):
    """A batch on the card. All arrays stay there, and calls do not wait."""

    senses_first = True
    note = "on the card, with contacts of cells"

    def __init__(self, task: Task, world_text: str) -> None:
        torch.set_grad_enabled(False)
        torch.manual_seed(1)
        self._task = task
        self._batch = st.Batch.of(st.World.from_text(world_text), task.envs, device="opencl:gpu")
        batch = self._batch
        self._command, self._ranges, self._pose, self._stalled, self._velocity = (
            torch.from_dlpack(array) for array in (batch.cmd, batch.ranges, batch.pose, batch.stalled, batch.velocity))
        batch.synchronous = False
        self._goals = torch.zeros_like(self._pose[..., :2])
        self._distance = torch.zeros_like(self._goals[..., 0])
        self._start = torch.zeros_like(self._pose)

    def reset(self, which: npt.NDArray[np.int64]) -> None:
        """Begins new episodes; one step without commands measures the first ranges."""
        task = self._task
        chosen = torch.as_tensor(which, device="cuda")
        drawn = places(chosen, 2 * task.agents, task.half_width)
        self._goals[chosen] = drawn[:, task.agents:]
        self._start[chosen, :, :2] = drawn[:, :task.agents]
        mask = torch.zeros(task.envs, dtype=torch.bool, device="cuda")
        mask[chosen] = True
        self._batch.reset(ids=mask)
        self._batch.teleport(self._start, mask[:, None].expand(-1, task.agents).contiguous())
        self._batch.step(ids=which)
        self._distance[chosen] = self._gap().norm(dim=-1)[chosen]

    def _gap(self) -> torch.Tensor:
        """Positions relative to the goals: shape (envs, agents, 2)."""
        return self._pose[..., :2] - self._goals

    def to_goals(self) -> Any:
        """Returns vectors to the goals."""
        return -self._gap().float()

    def step(self, actions: Any) -> Result:
        """Makes a step. An agent touches another one if it is blocked."""
        torch.mul(actions, TOP_SPEED, out=self._command[..., :2])
        self._batch.step()
        gap = self._gap()
        distance = gap.norm(dim=-1)
        farthest = distance.amax(1)
        shared = (self._distance - distance).sum(1) + FINAL_REWARD * (farthest < GOAL_RADIUS)
        rewards = (shared[:, None] - PENALTY * self._stalled).float()
        self._distance = distance
        seen = torch.empty((*distance.shape, 6 + self._task.rays), dtype=torch.float32, device=gap.device)
        seen[..., 0:2] = self._pose[..., :2]
        seen[..., 2:4] = self._velocity[..., :2]
        seen[..., 4:6] = gap
        seen[..., 6:] = self._task.reach - self._ranges
        return seen, rewards, farthest < RADIUS

    def poses(self) -> Floats:
        """Returns the poses."""
        return self._batch.pose.numpy()

    def facts(self, result: Result) -> Facts:
        """Describes a step."""
        seen, rewards = (part.cpu().numpy().astype(float) for part in result[:2])
        return Facts(self._task.reach - seen[..., 6:], rewards, self._batch.stalled.numpy())

    def wait(self) -> None:
        """Waits for the card."""
        torch.cuda.synchronize()
