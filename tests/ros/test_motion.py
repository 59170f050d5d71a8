# SPDX-License-Identifier: GPL-2.0-or-later
"""Inertial measurement units, joint states and ticks of wheels, compared with closed forms and with odometry."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st
from nav_msgs.msg import Odometry
from ros_testing import Client, node_here, time_of
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Int64MultiArray
from stagesim.ros.covariance import EXACT
from stagesim.ros.messages import heading_of

ROBOT = 'position( name "a" size [0.5 0.4 0.3] localization "odom" odom_error [0.02 0 0 3] {} )\n'


def drive(node: Any, client: Client, speeds: tuple[float, float, float], lists: list[list[Any]], steps: int = 20) -> None:
    """Drives robot 0 once somebody hears it stand, until each list has the messages of all steps."""

    def listen() -> bool:
        node.team.fleet.cmd[0] = 0.0
        node.advance()
        return all(lists)

    client.until(listen)
    client.spin(0.1)
    for messages in lists:
        messages.clear()
    for _ in range(steps):
        node.team.fleet.cmd[0] = speeds
        node.advance()
    client.until(lambda: all(len(messages) >= steps and (not hasattr(messages[-1], "header") or
                                                         time_of(messages[-1]) == node.now) for messages in lists))


@pytest.mark.parametrize(("kind", "speeds", "expected"), [
    ("diff", (0.5, 0.0, 0.4), (0.0, 0.2)), ("diff", (-0.5, 0.0, 0.4), (0.0, -0.2)), ("omni", (0.3, 0.2, 0.5), (-0.1, 0.15)),
    ("diff", (0.7, 0.0, 0.0), (0.0, 0.0))])
def test_accelerations_on_a_circle(client: Client, tmp_path: Path, kind: str, speeds: tuple[float, float, float],
                                   expected: tuple[float, float]) -> None:
    """A robot with the velocity v that turns by w accelerates by w v to the left of v; at rest, there is gravity alone."""
    file = tmp_path / "a.world"
    file.write_text(ROBOT.format(f'drive "{kind}"'))
    with st.World(file) as world, node_here(world) as node:
        heard, truth = client.listen(Imu, "/imu"), client.listen(Odometry, "/ground_truth")
        drive(node, client, speeds, [heard, truth], 20)
        last = heard[-1]
        force = last.linear_acceleration
        assert (force.x, force.y, force.z) == pytest.approx((*expected, 9.80665), abs=1e-9)
        turn = last.angular_velocity
        assert (turn.x, turn.y, turn.z) == pytest.approx((0, 0, speeds[2]))
        assert last.header.stamp == truth[-1].header.stamp and last.header.frame_id == "base_link"
        assert heading_of(last.orientation) == pytest.approx(heading_of(truth[-1].pose.pose.orientation))
        for covariance in (last.orientation_covariance, last.angular_velocity_covariance,
                           last.linear_acceleration_covariance):
            assert np.array_equal(covariance, EXACT * np.eye(3).ravel())
        # Stopping from the velocity v within a step is an acceleration of -v / dt.
        node.team.fleet.cmd[0] = 0.0
        count = len(heard)
        node.advance()
        client.until(lambda: len(heard) > count)
        force = heard[-1].linear_acceleration
        assert force.x == pytest.approx(-speeds[0] / world.dt + speeds[2] * speeds[1] / 4, abs=0.1)


def test_wheels_turn_as_odometry_has_it(client: Client, tmp_path: Path) -> None:
    """The pose from the turns of the wheels is that of odometry, with its errors and at the same instant."""
    file = tmp_path / "a.world"
    file.write_text(ROBOT.format(""))
    with st.World(file) as world, node_here(world, wheel_radius=0.1, wheel_separation=0.35, ticks_per_turn=360) as node:
        joints, ticks = client.listen(JointState, "/joint_states"), client.listen(Int64MultiArray, "/wheel_ticks")
        odometry = client.listen(Odometry, "/odom")
        drive(node, client, (0.5, 0.0, 0.4), [joints, ticks, odometry], 30)
        last = joints[-1]
        assert list(last.name) == ["left_wheel_joint", "right_wheel_joint"]
        assert last.header.stamp == odometry[-1].header.stamp
        left, right = last.position
        assert (right - left) * 0.1 / 0.35 == pytest.approx(heading_of(odometry[-1].pose.pose.orientation))
        assert (left + right) / 2 * 0.1 == pytest.approx(0.5 * 1.02 * 29 * world.dt)
        turn = 0.4 * (1 + world.model("a").odom_error[2])
        assert list(last.velocity) == pytest.approx([(0.51 - turn * 0.175) / 0.1, (0.51 + turn * 0.175) / 0.1])
        assert list(ticks[-1].data) == [math.floor(angle * 180 / math.pi) for angle in (left, right)]
        assert ticks[-1].layout.dim[0].label == "left_wheel right_wheel"
        # A restored state has the turns of its time.
        node._take()
        node.advance()
        node._restore()
        node.advance()
        assert node.team.motion.turned[0, 0] == pytest.approx(left + last.velocity[0] * world.dt)


def test_wheels_of_a_car_roll_about_one_point(client: Client, tmp_path: Path) -> None:
    file = tmp_path / "a.world"
    file.write_text('position( name "a" size [0.5 0.4 0.3] drive "car" wheelbase 0.5 localization "gps" )\n')
    with st.World(file) as world, node_here(world) as node:
        joints = client.listen(JointState, "/joint_states")
        drive(node, client, (0.5, 0.0, 0.3), [joints], 5)
        names = [name.removesuffix("_joint") for name in joints[-1].name]
        angle = dict(zip(names, joints[-1].position))
        speed = dict(zip(names, joints[-1].velocity))
        radius = 0.5 / math.tan(0.3)  # from the point to the middle of the rear axle
        turn = 0.5 * math.sin(0.3) / 0.5
        for side, sign in (("left", -1), ("right", 1)):
            rear = radius + sign * 0.2
            assert angle[f"front_{side}_steering"] == pytest.approx(math.atan2(0.5, rear))
            assert speed[f"rear_{side}_wheel"] == pytest.approx(turn * rear / 0.08)
            assert speed[f"front_{side}_wheel"] == pytest.approx(turn * math.hypot(rear, 0.5) / 0.08)


def test_drives_without_wheels_have_no_joints(ros: None, two: str) -> None:
    with st.World(two) as world, node_here(world) as node:
        topics = {feed.topic for feed in node.team.feeds}
        assert "a/imu" in topics and not topics & {"a/joint_states", "a/wheel_ticks"}
        assert not node.team.motion._follows_bodies and not node.team.motion._follows_wheels
