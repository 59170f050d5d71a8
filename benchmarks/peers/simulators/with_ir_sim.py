# SPDX-License-Identifier: GPL-2.0-or-later
"""The task in IR-SIM: an environment each, all in one process."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import irsim
import numpy as np

from ..task import RADIUS, STEP, TOP_SPEED, Floats, Task
from .separate import SeparateSimulation
from .simulation import Simulation


def scene(task: Task) -> str:
    """Returns an environment as IR-SIM's YAML. The first ray is turned to the heading."""
    fan = math.tau * (task.rays - 1) / task.rays
    side = 2 * task.half_width + 6
    robots = "".join(
        f"  - {{kinematics: {{name: omni}}, shape: {{name: circle, radius: {RADIUS}}}, state: [{i}, 0, 0],\n"
        f"     vel_max: [1, 1], sensors: [{{name: lidar2d, range_min: 0, range_max: {task.reach},\n"
        f"     angle_range: {fan:.9g}, offset: [0, 0, {fan / 2:.9g}], number: {task.rays}, noise: False}}]}}\n"
        for i in range(task.agents))
    return (f"world: {{height: {side}, width: {side}, offset: [{-side / 2}, {-side / 2}], step_time: {STEP},\n"
            f"  sample_time: {STEP}, collision_mode: contact}}\nrobot:\n{robots}")


class IrSimSimulation(SeparateSimulation):
    """Environments in a loop. Robots push each other; with its default mode, robots that touch stop for good."""

    note = "one thread, NumPy's arrays instead of tensors, `collision_mode: contact`"

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "navigation.yaml"
            file.write_text(scene(task), encoding="utf-8")
            self._envs: list[Any] = [irsim.make(str(file), display=False, log_level="ERROR") for _ in range(task.envs)]
        self._ids = list(range(task.agents))

    def _place(self, env: int, positions: Floats) -> None:
        self._envs[env].reset()
        for robot, (x, y) in zip(self._envs[env].robot_list, positions.tolist()):
            robot.set_state([x, y, 0])
        self._envs[env].refresh()

    def _move(self, env: int, actions: Floats) -> None:
        self._envs[env].step([TOP_SPEED * action[:, None] for action in actions], self._ids)

    def _read(self, env: int) -> None:
        for i, robot in enumerate(self._envs[env].robot_list):
            self._positions[env, i] = robot.state[:2, 0]
            self._velocities[env, i] = np.ravel(robot.velocity)[:2]
            self._ranges[env, i] = robot.sensors[0].range_data
            self._collided[env, i] = robot.contact.in_contact


def open_simulation(task: Task, device: str, threads: int, name: str) -> Simulation:
    """Starts the simulation."""
    assert name == "ir-sim" and device == "cpu" and threads >= 1
    return IrSimSimulation(task)
