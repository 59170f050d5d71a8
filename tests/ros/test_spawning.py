# SPDX-License-Identifier: GPL-2.0-or-later
"""Robots that are made and deleted while the node runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import stagesim as st
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from ros_testing import TWO, Client, node_here, time_of
from sensor_msgs.msg import JointState, LaserScan

BURGER = "turtlebot3_burger"


def topics_of(node: Any, prefix: str) -> set[str]:
    """Names of the topics of a robot that the node publishes or listens to, without the prefix."""
    own = (*node.publishers, *node.subscriptions)
    return {part.topic_name.removeprefix(f"/{prefix}/") for part in own if part.topic_name.startswith(f"/{prefix}/")}


def drive(node: Any, speeds: dict[int, tuple[float, float, float]], steps: int) -> None:
    """Makes steps, in which some robots drive."""
    for _ in range(steps):
        for robot, speed in speeds.items():
            node.team.cmd[robot] = speed
        node.advance()


def test_a_new_robot_has_its_topics_and_loses_them_when_it_is_deleted(client: Client) -> None:
    with st.World.from_text(TWO) as world, node_here(world, base_watchdog_timeout=0.0) as node:
        before = {part.topic_name for part in (*node.publishers, *node.subscriptions)}
        burger = node.spawn(BURGER, "c", (1.0, -1.0, math.pi / 2))
        assert {"base_scan", "odom", "ground_truth", "imu", "joint_states", "cmd_vel", "teleport", "robot_description",
                "stall"} <= topics_of(node, "c")
        assert node.get_parameter("c.robot_description").value.startswith("<?xml")
        scans, truth = client.listen(LaserScan, "/c/base_scan"), client.listen(Odometry, "/c/ground_truth")
        publisher = client.talk(Twist, "/c/cmd_vel")

        def moves() -> bool:
            message = Twist()
            message.linear.x = 0.1
            publisher.publish(message)
            node._executor.spin(0.01)
            node.advance()
            return bool(scans) and bool(truth) and truth[-1].pose.pose.position.y > -0.95

        client.until(moves)
        assert truth[-1].header.frame_id == "map" and truth[-1].child_frame_id == "c/base_footprint"
        assert truth[-1].pose.pose.position.x == pytest.approx(1.0, abs=1e-9)
        assert scans[-1].header.frame_id == "c/base_scan_link" and len(scans[-1].ranges) == 360
        burger.delete()
        node.update_team()
        assert {part.topic_name for part in (*node.publishers, *node.subscriptions)} == before
        assert not node.has_parameter("c.robot_description") and len(node.robots) == 2
        node.advance()


def test_robots_that_stay_keep_their_state(client: Client) -> None:
    """Odometry's errors, wheels, beliefs, last commands and subscribers are those of a node without a new robot."""
    found = []
    for spawns in (False, True):
        with st.World.from_text(TWO.replace("omni", "diff")) as world, node_here(
                world, publish_map_tf=True, base_watchdog_timeout=0.55, always_on=True) as node:
            drive(node, {0: (0.3, 0.0, 0.4), 1: (0.2, 0.0, -0.1)}, 5)
            message = PoseWithCovarianceStamped()
            message.pose.pose.position.x, message.pose.pose.orientation.w = 1.5, 1.0
            message.pose.covariance[0] = 0.25
            node.team.localization._believe(0, message)
            node.team.obey(1, (0.1, 0.0, 0.2), None)
            if spawns:
                burger = node.spawn(BURGER, "c", (3.0, -2.0, 0.0))
            for _ in range(3):
                node.advance()
            if spawns:
                burger.delete()
                node.update_team()
            for _ in range(4):
                node.advance()
            team = node.team
            found.append([team._errors.jacobian, team.motion.count(), team.frames.shifts, team.localization.covariances,
                          team.last_command, team.fleet.pose, team.fleet.estimate, team.fleet.velocity])
    for one, other in zip(*found):
        assert np.array_equal(one, other)
    assert found[0][0].any() and found[0][1].any() and found[0][2].any()
    assert found[1][4].tolist() == [-1, 500_000] and not found[1][7][1].any()  # the watchdog has stopped b


def test_a_reset_brings_the_first_robots_back_and_restore_those_of_its_time(client: Client) -> None:
    with st.World.from_text(TWO) as world, node_here(world, base_watchdog_timeout=0.0) as node:
        first = world.state_hash()
        drive(node, {0: (0.3, 0.0, 0.4)}, 3)
        node.spawn(BURGER, "c", (1.0, -1.0, 0.0), "fleet/one")
        drive(node, {0: (0.3, 0.0, 0.4), 2: (0.2, 0.0, 0.1)}, 3)
        turned = node.team.motion.count()[2]
        node._take()
        later = world.state_hash()
        world.model("a").delete()
        world.model("c").delete()
        node.update_team()
        assert [robot.prefix for robot in node.robots] == ["b"]
        node._restore()
        assert [robot.prefix for robot in node.robots] == ["a", "b", "fleet/one"] and world.state_hash() == later
        assert np.array_equal(node.team.motion.turned[2], turned)
        assert topics_of(node, "fleet/one") >= {"base_scan", "cmd_vel"}
        node.reset(None)
        assert [robot.prefix for robot in node.robots] == ["a", "b"] and not topics_of(node, "fleet/one")
        assert world.state_hash() == first
        node.spawn(BURGER, "c")
        assert node.robots[2].prefix == "c"


def test_lockstep_waits_for_new_robots_and_not_for_deleted_ones(client: Client) -> None:
    with st.World.from_text(TWO) as world, node_here(world, lockstep="all", stamped_cmd_vel=True) as node:
        node.advance()
        assert node._lockstep.missing() == ["a", "b"]
        made = node.spawn(BURGER, "c", (1.0, -1.0, 0.0))
        assert node._lockstep.missing() == ["a", "b"]  # c has got nothing to answer yet
        node.advance()
        assert node._lockstep.missing() == ["a", "b", "c"]
        assert np.isfinite(node.team.fleet.ranger().ranges[2]).any()
        stamped = TwistStamped()
        stamped.header.stamp.nanosec = 200_000_000
        node.team.command(2, stamped)
        assert node._lockstep.missing() == ["a", "b"]
        made.delete()
        node.update_team()
        node.advance()
        assert node._lockstep.missing() == ["a", "b"]


def test_runs_with_new_robots_repeat(ros: None) -> None:
    hashes = []
    for _ in range(2):
        with st.World.from_text(TWO) as world, node_here(world, always_on=True) as node:
            for i in range(3):
                node.spawn(BURGER, f"c{i}", (1.0 + i, -1.0, 0.0))
                drive(node, {0: (0.3, 0.0, 0.4), 2: (0.1, 0.0, 0.3)}, 3)
            world.model("c1").delete()
            node.update_team()
            drive(node, {0: (0.3, 0.0, 0.4)}, 3)
            hashes.append(world.state_hash())
    assert hashes[0] == hashes[1]


def test_the_last_robot_can_go_and_another_one_come(client: Client) -> None:
    with st.World.from_text('define bot position( size [0.3 0.3 0.2] )\nbot( name "a" )') as world, \
            node_here(world) as node:
        world.model("a").delete()
        node.update_team()
        assert node.robots == [] and node.topics == 0
        node.advance()
        node.spawn("bot")
        assert [robot.prefix for robot in node.robots] == ["bot"]
        joints = client.listen(JointState, "/bot/joint_states")
        client.until(lambda: node.advance() and bool(joints))
        assert time_of(joints[0]) > 0


@pytest.mark.parametrize(("arguments", "message"), [
    (("nobody",), "found the robot 'nobody', expected bot, epuck"), ((BURGER, "a"), "found the name 'a'"),
    ((BURGER, "x", (math.nan, 0, 0)), "found the pose"), ((BURGER, "x", (0, 1e9, 0)), "found the pose"),
    ((BURGER, "x", (0, 0, 0), "1/2"), "found the namespace '1/2'"), ((BURGER, "x", (0, 0, 0), "b"), "another robot has"),
    ((BURGER, "x" * 101), "found the name")])
def test_robots_that_make_no_sense_are_refused(ros: None, arguments: tuple[Any, ...], message: str) -> None:
    with st.World.from_text(TWO) as world, node_here(world) as node:
        models, state = len(world.models), world.state_hash()
        with pytest.raises(ValueError, match=message.replace("(", r"\(")):
            node.spawn(*arguments)
        assert len(world.models) == models and world.state_hash() == state and len(node.robots) == 2
