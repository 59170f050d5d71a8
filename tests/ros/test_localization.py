# SPDX-License-Identifier: GPL-2.0-or-later
"""Believed poses: initialpose moves them and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
import stagesim as st
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from ros_testing import Client, node_here, time_of
from stagesim.ros.messages import frames_between, heading_of, in_frames

TFMessage = pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not there; try tools/setup --ros").TFMessage


def planar_of(position: object, orientation: object) -> tuple[float, float, float]:
    return position.x, position.y, heading_of(orientation)


def given(x: float, y: float, turn: float, frame: str = "map") -> PoseWithCovarianceStamped:
    message = PoseWithCovarianceStamped()
    message.header.frame_id = frame
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    message.pose.pose.orientation.z, message.pose.pose.orientation.w = np.sin(turn / 2), np.cos(turn / 2)
    message.pose.covariance[0] = 0.25
    return message


def test_an_initial_pose_moves_the_belief_and_nothing_else(client: Client, two: str) -> None:
    with st.World(two) as world, node_here(world, publish_map_tf=True) as node:
        beliefs = client.listen(PoseWithCovarianceStamped, "/b/amcl_pose")
        truths, guesses = client.listen(Odometry, "/b/ground_truth"), client.listen(Odometry, "/b/odom")
        moving = client.listen(TFMessage, "/tf")
        talk = client.talk(PoseWithCovarianceStamped, "/b/initialpose")

        def compare() -> tuple[np.ndarray, np.ndarray]:
            """Makes a step; returns the believed and the true pose, after a comparison of the belief with /tf."""
            node.advance()
            client.until(lambda: all(time_of(got[-1]) == node.now for got in (beliefs, truths, guesses, moving)))
            links = {t.child_frame_id: t.transform for t in moving[-1].transforms}
            frame, body = (np.array([planar_of(links[name].translation, links[name].rotation)])
                           for name in ("b/odom", "b/base_footprint"))
            belief, truth, guess = (np.array(planar_of(m.pose.pose.position, m.pose.pose.orientation))
                                    for m in (beliefs[-1], truths[-1], guesses[-1]))
            placed = in_frames(frame, body)[0]
            assert placed[:2] == pytest.approx(belief[:2]) and np.cos(placed[2] - belief[2]) == pytest.approx(1)
            assert body[0] == pytest.approx(guess)
            return belief, truth

        def listen() -> bool:
            node.advance()
            return bool(beliefs and truths and guesses and moving)

        client.until(listen)
        client.spin(0.1)
        belief, truth = compare()
        assert belief == pytest.approx(truth) and beliefs[-1].header.frame_id == "map"
        talk.publish(given(5.0, -3.0, 0.5))
        client.until(lambda: node._executor.spin(0.01) or node.team.frames.shifts.any(1)[1])
        belief, truth = compare()
        assert belief == pytest.approx((5, -3, 0.5)) and truth == pytest.approx((0, 2, np.pi / 2))
        assert beliefs[-1].pose.covariance[0] == 0.25
        # The belief moves as the robot does: from (0, 2) to the north in truth, from (5, -3) along 0.5 rad in the belief.
        for _ in range(10):
            node.team.fleet.cmd[1] = (0.5, 0.0, 0.0)
            belief, truth = compare()
        way = truth[1] - 2
        assert way > 0.3 and belief == pytest.approx((5 + way * np.cos(0.5), -3 + way * np.sin(0.5), 0.5))
        assert not node.team.frames.shifts[0].any()
        node._take()
        node.reset(None)
        assert not node.team.frames.shifts.any()
        node._restore()
        assert node.team.frames.shifts[1].any()


@pytest.mark.parametrize("message", (given(np.nan, 0, 0), given(0, 0, 0, "mars")))
def test_a_bad_initial_pose_is_not_taken(ros: None, one: str, message: PoseWithCovarianceStamped) -> None:
    with st.World(one) as world, node_here(world, publish_map_tf=True) as node:
        node.team.localization._believe(0, message)
        assert not node.team.frames.shifts.any()


def test_nobody_takes_initial_poses_without_the_transform(ros: None, one: str) -> None:
    with st.World(one) as world, node_here(world) as node:
        assert "/initialpose" not in {name for name, _ in node.get_subscriber_names_and_types_by_node("stage", "/")}


def test_composition_undoes_the_frame_between() -> None:
    outer, inner = np.random.default_rng(1).uniform(-3, 3, (2, 20, 3))
    placed = in_frames(frames_between(outer, inner), inner)
    assert np.allclose(placed[:, :2], outer[:, :2]) and np.allclose(np.cos(placed[:, 2] - outer[:, 2]), 1)
