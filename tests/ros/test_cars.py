# SPDX-License-Identifier: GPL-2.0-or-later
"""Commands to cars: steering angles and turn rates lead to the circles that they describe."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import stagesim as st
from geometry_msgs.msg import Twist
from ros_testing import Client, node_here

CAR = 'position( name "a" drive "car" wheelbase 0.5 localization "gps" {} )\n'
KINDS = ('car_command "steering"', 'car_command "turn"')


@pytest.mark.parametrize("kind", KINDS)
def test_ackermann_commands_have_steering_angles(client: Client, tmp_path: Path, kind: str) -> None:
    messages = pytest.importorskip("ackermann_msgs.msg", reason="ackermann_msgs is not there; try tools/setup --ros")
    file = tmp_path / "a.world"
    file.write_text(CAR.format(kind))
    with st.World(file) as world, node_here(world, base_watchdog_timeout=0) as node:
        talk = client.talk(messages.AckermannDriveStamped, "/ackermann_cmd")
        command = messages.AckermannDriveStamped()
        command.drive.speed, command.drive.steering_angle = 0.5, 0.3
        talk.publish(command)
        client.until(lambda: node._executor.spin(0.01) or node.team.last_command[0] >= 0)
        for _ in range(3):
            node.advance()
        ahead, _, turn = node.team.fleet.actual_velocity[0]
        assert (ahead, turn) == pytest.approx((0.5, 0.5 * math.tan(0.3) / 0.5))
        # Angles at which wheels stand across are refused.
        command.drive.steering_angle = 2.0
        before = node.team.cmd[0].copy()
        talk.publish(command)
        node._executor.spin(0.3)
        assert np.array_equal(node.team.cmd[0], before)


@pytest.mark.parametrize("kind", KINDS)
def test_turn_rates_of_cars(ros: None, tmp_path: Path, kind: str) -> None:
    file = tmp_path / "a.world"
    file.write_text(CAR.format(kind))
    with st.World(file) as world, node_here(world, cars_turn=True, base_watchdog_timeout=0) as node:
        command = Twist()
        for speed, turn in ((0.5, 0.2), (-0.5, 0.2), (0.0, 0.2)):
            command.linear.x, command.angular.z = speed, turn
            node.team.command(0, command)
            for _ in range(3):
                node.advance()
            expected = (speed, turn if speed else 0.0)
            assert tuple(node.team.fleet.actual_velocity[0, [0, 2]]) == pytest.approx(expected, abs=1e-12)
