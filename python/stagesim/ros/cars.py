# SPDX-License-Identifier: GPL-2.0-or-later
"""Commands to cars: steering angles, as AckermannDriveStamped has them, and turn rates, as Nav2 sends them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from .._core import Model
from .names import joined

try:
    from ackermann_msgs.msg import AckermannDriveStamped
except ModuleNotFoundError:  # not among PyPI's wheels
    AckermannDriveStamped = None

if TYPE_CHECKING:
    from .node import StageNode
    from .team import Team

Speeds = tuple[float, float, float]


def is_car(model: Model) -> bool:
    """True for models with car steering."""
    return model.drive_type == "car"


def steered(car: Model, speed: float, angle: float) -> Speeds:
    """The command of a car whose rear axle shall drive with `speed` (m/s) at a steering angle (rad)."""
    if not abs(angle) < math.pi / 2:
        return math.nan, 0.0, angle
    if car.commands_turn:
        return speed, 0.0, speed * math.tan(angle) / car.wheelbase
    return speed / math.cos(angle), 0.0, angle  # the speed of the front wheel


def turning(car: Model, speed: float, turn: float) -> Speeds:
    """The command of a car that shall drive with `speed` and turn by `turn` (rad/s). A car that stands does not turn."""
    if car.commands_turn:
        return speed, 0.0, turn
    angle = math.atan(turn * car.wheelbase / speed) if speed else car.steering_angle
    return steered(car, speed, angle)


def subscribe(node: StageNode, team: Team) -> None:
    """Subscribes to `ackermann_cmd` of all cars."""
    cars = [number for number, robot in enumerate(team.robots) if is_car(robot.model)]
    if cars and AckermannDriveStamped is None:
        node.get_logger().info("no ackermann_cmd: there is no Python module ackermann_msgs; docs/ros.md says how to "
                               "make it (python -m stagesim.ros.make_messages)")
        return
    for number in cars:
        robot = team.robots[number]

        def command(message: Any, number: int = number, car: Model = robot.model) -> None:
            team.obey(number, steered(car, message.drive.speed, message.drive.steering_angle), message.header)

        team.endpoints.subscribe(AckermannDriveStamped, joined(robot.prefix, "ackermann_cmd"), command)
