# SPDX-License-Identifier: GPL-2.0-or-later
"""The task in a batch of stagesim: a world file, and the scenario's rewards and observations in NumPy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import stagesim as st

from ..task import RADIUS, STEP, TOP_SPEED, Floats, Task, judge, places
from .simulation import Facts, Result, Simulation

try:
    import torch
except ImportError:
    torch = None

CORNERS = 8  # of an agent's outline
CELL = 0.02  # metres


def outline() -> str:
    """Returns the block of an agent: a polygon with the area of a circle of unit diameter."""
    angle = math.tau / CORNERS
    scale = math.sqrt(angle / math.sin(angle)) / 2
    points = [(0.5 + scale * math.cos((i + 0.5) * angle), 0.5 + scale * math.sin((i + 0.5) * angle))
              for i in range(CORNERS)]
    return f"block( points {CORNERS} " + " ".join(
        f"point[{i}] [{x:.6f} {y:.6f}]" for i, (x, y) in enumerate(points)) + " )"


def width() -> float:
    """Returns the distance between two opposite sides of the polygon, metres: a block is scaled to the size of its
    model."""
    angle = math.tau / CORNERS
    return 2 * RADIUS * math.sqrt(angle / math.sin(angle)) * math.cos(angle / 2)


def world_file(task: Task, ray_model: str, contacts: str = "outlines") -> str:
    """Returns the scenario as a world file. Lidars are below the top of the agents, so they detect each other."""
    first = 180 - 180 / task.rays  # degrees; turns the fan so that the first ray points forwards
    lines = [
        f"resolution {CELL}", f"interval_sim {1000 * STEP:g}", f'ray_model "{ray_model}"',
        f'contacts "{contacts}"',
        f"define lidar ranger( size [0.02 0.02 0.1] pose [0 0 -0.2 {first:.9g}] "
        f"sensor( range [0 {task.reach}] fov {360 - 360 / task.rays:.9g} samples {task.rays} ) )",
        f"define agent position( size [{width():.9g} {width():.9g} 0.3] drive \"omni\" {outline()} lidar() )"]
    return "\n".join(lines + [f"agent( pose [{i} 0 0 0] )" for i in range(task.agents)]) + "\n"


def length(gap: Floats) -> Floats:
    """Lengths of vectors with x and y on the first axis."""
    return np.sqrt(gap[0] * gap[0] + gap[1] * gap[1])


class StageSimulation(Simulation):
    """A batch on the host.

    Coordinates are computed one after the other, because NumPy is slow with a last axis of two numbers.
    """

    senses_first = True

    def __init__(self, task: Task, threads: int, world_text: str) -> None:
        world = st.World.from_text(world_text)
        self._batch = st.Batch.of(world, task.envs, threads=threads)
        self._task = task
        self._chance = np.random.default_rng(1)
        self._command, self._ranges, self._pose = self._batch.cmd, self._batch.ranges, self._batch.pose
        self._stalled, self._velocity = self._batch.stalled, self._batch.velocity
        self._goals = np.zeros((2, task.envs, task.agents))  # x and y
        self._distance = np.zeros((task.envs, task.agents))
        if torch is None:
            self.note = "NumPy's arrays instead of tensors, because torch is not installed"
        else:
            torch.set_num_threads(1)  # PyTorch's threads wait busily, on the processors that step the worlds
            torch.set_grad_enabled(False)

    def reset(self, which: npt.NDArray[np.int64]) -> None:
        """Begins new episodes; one step without commands measures the first ranges."""
        task = self._task
        drawn = places(self._chance, len(which), 2 * task.agents, task.half_width)
        self._goals[:, which] = np.moveaxis(drawn[:, task.agents:], 2, 0)
        start = np.zeros((task.envs, task.agents, 3))
        start[which, :, :2] = drawn[:, :task.agents]
        mask = np.zeros((task.envs, 1), bool)
        mask[which] = True
        self._batch.reset(ids=which)
        self._batch.teleport(start, mask)
        self._batch.step(ids=which)
        gap = self._gap()
        self._distance[which] = length(gap)[which]
        self._observe(gap)

    def _gap(self) -> Floats:
        """Positions relative to the goals, x and y: shape (2, envs, agents)."""
        gap = np.empty_like(self._goals)
        for axis in range(2):
            np.subtract(self._pose[..., axis], self._goals[axis], out=gap[axis])
        return gap

    def _observe(self, gap: Floats) -> npt.NDArray[np.float32]:
        task = self._task
        seen = np.empty((task.envs, task.agents, 6 + task.rays), np.float32)
        for axis in range(2):
            seen[..., axis] = self._pose[..., axis]
            seen[..., 2 + axis] = self._velocity[..., axis]
            seen[..., 4 + axis] = gap[axis]
        np.subtract(task.reach, self._ranges, out=seen[..., 6:], casting="same_kind")
        return seen

    def to_goals(self) -> Any:
        """Returns vectors to the goals."""
        return self._given(np.moveaxis(-self._gap(), 0, 2).astype(np.float32))

    def step(self, actions: Any) -> Result:
        """Makes a step. An agent touches another one if it is blocked."""
        given = self._host(actions)
        for axis in range(2):
            np.multiply(given[..., axis], TOP_SPEED, out=self._command[..., axis])
        self._batch.step()
        gap = self._gap()
        distance = length(gap)
        rewards, dones = judge(self._distance, distance, self._stalled)
        self._distance = distance
        return self._given(self._observe(gap)), self._given(rewards.astype(np.float32)), self._given(dones)

    def _given(self, array: npt.NDArray[Any]) -> Any:
        """Passes an array to the learner, as a tensor if there is PyTorch."""
        return array if torch is None else torch.from_numpy(array)

    def _host(self, actions: Any) -> npt.NDArray[np.float32]:
        """Returns the actions of a learner as an array."""
        array: npt.NDArray[np.float32] = np.asarray(actions)
        return array

    def poses(self) -> Floats:
        """Returns the poses."""
        return np.array(self._pose)

    def facts(self, result: Result) -> Facts:
        """Describes a step."""
        seen, rewards = self._host(result[0]), self._host(result[1])
        return Facts(self._task.reach - seen[..., 6:].astype(float), rewards.astype(float), np.array(self._stalled))


def open_simulation(task: Task, device: str, threads: int, name: str) -> Simulation:
    """Starts the simulation; `name` says which ray model and which contacts."""
    ray_model = "exact" if name == "stage-exact" else "cell"
    if device == "cpu":
        contacts = "cells" if name == "stage-cells" else "outlines"
        return StageSimulation(task, threads, world_file(task, ray_model, contacts))
    from .stage_on_card import CardSimulation

    return CardSimulation(task, world_file(task, ray_model, "cells"))
