# SPDX-License-Identifier: GPL-2.0-or-later
"""The place of a robot by odometry and poses together, and the plans of the node that decides."""

from __future__ import annotations

import numpy as np
import pytest
from stagesim.ros.what_if.localization import SECOND, Command, Localization
from stagesim.ros.what_if.others import Others
from stagesim.ros.what_if.plane import Moving, carried, composed, motion, relative
from stagesim.ros.what_if.plans import behaviours_of, dynamic_window, grid

ZEROS = np.zeros((3, 3))
FORWARD = np.array([0.5, 0, 0.2])


def measured(seconds: float, pose: object, velocity: object = FORWARD, covariance: np.ndarray = ZEROS) -> Moving:
    return Moving(round(seconds * SECOND), np.array(pose, float), covariance, np.array(velocity, float), ZEROS)


def drive(localization: Localization) -> None:
    """Odometry of an arc from 1 s on, for two seconds."""
    for time in np.arange(0, 2.0, 0.1):
        localization.take_odometry(measured(1 + time, motion(FORWARD, time), FORWARD))


@pytest.mark.parametrize("when", [1.0, 1.55, 2.9, 3.0])
def test_a_pose_says_where_odometry_began_whenever_it_comes(when: float) -> None:
    """The pose is that of a robot that began at (3, 4) with a heading of 1 rad; it may be early, between, or ahead."""
    began = np.array([3, 4, 1.0])
    first, last = Localization(), Localization()
    pose = measured(when, composed(began, motion(FORWARD, when - 1)))
    first.take_pose(pose)
    drive(first)
    drive(last)
    last.take_pose(pose)
    for localization in (first, last):
        found = localization.at(round(3.5 * SECOND), [])
        assert found.pose == pytest.approx(composed(began, motion(FORWARD, 2.5)), abs=1e-3)
        assert found.stamp == round(3.5 * SECOND)


@pytest.mark.parametrize("grows", [True, False])
def test_errors_of_odometry_are_added_to_those_of_the_pose(grows: bool) -> None:
    """Only errors that odometry has gained since the pose count, and none if it has always the same covariance."""
    localization = Localization()
    localization.take_pose(Moving(SECOND, np.zeros(3), np.diag([0.01, 0.01, 0.04]), np.zeros(3), ZEROS))
    for time in np.arange(0, 2.05, 0.1):
        pose = np.array([0.5 * time, 0, 0])
        covariance = carried(np.zeros(3), np.eye(3), pose, np.diag([0.02, 0, 0]) * time)[1] if grows else np.eye(3)
        localization.take_odometry(measured(1 + time, pose, (0.5, 0, 0), covariance))
    found = localization.at(3 * SECOND, []).pose_covariance
    assert np.diag(found) == pytest.approx([0.05 if grows else 0.01, 0.01 + 0.04 * 1.0**2, 0.04])


def test_the_robot_obeys_the_commands_that_it_has_got() -> None:
    localization = Localization("odom")
    localization.take_odometry(measured(1, (0, 0, 0), (0.5, 0, 0)))
    commands = [Command(round(at * SECOND), np.array([speed, 0, 0])) for at, speed in ((0.5, 9), (1.2, 1), (1.4, 0))]
    for time, x in ((1.0, 0), (1.1, 0.05), (1.3, 0.2), (1.5, 0.3)):
        assert localization.at(round(time * SECOND), commands).pose[0] == pytest.approx(x)
    assert localization.at(round(1.3 * SECOND), commands).velocity[0] == 1
    blind = Localization("pose")
    blind.take_pose(measured(1, (0, 0, 0), (0, 0, 0)))
    assert blind.at(round(1.3 * SECOND), commands).pose[0] == pytest.approx(0.1)


def test_motions_compose_and_errors_are_those_of_many_draws() -> None:
    random = np.random.default_rng(1)
    pose, by = np.array([1, 2, 0.5]), np.array([1.5, -0.3, 0.8])
    one, two = np.diag([0.02, 0.01, 0.03]) ** 2, np.diag([0.01, 0.03, 0.02]) ** 2
    assert composed(pose, relative(by, pose)) == pytest.approx(by)
    assert composed(motion(FORWARD, 1), motion(FORWARD, 2)) == pytest.approx(motion(FORWARD, 3))
    found, covariance = carried(pose, one, by, two)
    draws = np.array([composed(random.multivariate_normal(pose, one), random.multivariate_normal(by, two))
                      for _ in range(4000)])
    assert np.cov(draws.T) == pytest.approx(covariance, abs=1.5e-4)
    assert draws.mean(0) == pytest.approx(found, abs=5e-3)


def test_others_drive_where_they_look_and_are_forgotten() -> None:
    others = Others(behaviours_of("orca 2, go on"))
    others.take("people", "x", measured(1, (1, 2, np.pi / 2), (0.5, 0, 0)))
    others.take("people", "y", measured(2, (0, 0, 0), (0, 0, 0)))
    found = others.at(3 * SECOND)
    assert found.poses[0] == pytest.approx([1, 3, np.pi / 2]) and found.velocities[0] == pytest.approx([0, 0.5, 0])
    assert found.ids.tolist() == [0, 1] and found.behaviours[0][0].goal == pytest.approx((1, 8))
    assert [(each.kind, each.weight) for each in found.behaviours[1]] == [("orca", 2), ("go on", 1)]
    others.drop(2 * SECOND)
    assert others.at(3 * SECOND).ids.tolist() == [1] and others.newest("people") == 2 * SECOND


def test_plans_are_different_and_begin_with_a_stop() -> None:
    plans = grid([0, 0.5], [0], [-1, -0.5, 0, 0.5, 1], True)
    assert plans.shape == (34, 5, 3) and not plans[0].any() and len(np.unique(plans.reshape(34, -1), axis=0)) == 34
    assert grid([0, 0.5], [0], [0, 1], False).shape == (4, 1, 3)
    window = dynamic_window([0, 0, 0.5], [-1, 0, 1], np.array([0.4, 0, 0]), (0.4, 1.0), 0.5)
    assert window[1:, 0, 0].min() == pytest.approx(0.2) and window[:, 0, 0].max() == 0.5
    assert np.abs(window[:, 0, 2]).max() == 0.5 and not window[0].any() and len(window) == 10
