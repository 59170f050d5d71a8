# SPDX-License-Identifier: GPL-2.0-or-later
"""A Monte Carlo localizer finds the pose of the stamp of each scan, also while the robot turns quickly."""

from __future__ import annotations

from contextlib import contextmanager
from typing import Any, Iterator

import numpy as np
import pytest
import stagesim as st
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from ros_testing import Client, node_here

pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not there; try tools/setup --ros")

from localizer import Localizer  # noqa: E402  (from examples/ros)
from transforms import nanoseconds, pose_of, seen_from  # noqa: E402

ROOM = """
model( pose [0 4.5 0 0] size [10 1 1] )
model( pose [0 -4.5 0 0] size [10 1 1] )
model( pose [4.5 0 0 0] size [1 10 1] )
model( pose [-4.5 0 0 0] size [1 10 1] )
model( pose [2.5 2.2 0 20] size [1.5 0.6 1] )
model( pose [-2.1 -2 0 0] size [0.8 2.2 1] )
"""
BITMAP = 'include "maps.inc"\nfloorplan( size [{0} {0} 0.8] bitmap "bitmaps/{1}.png" )\n'
#: Text of a world, and where the robot starts.
WORLDS = {"room": (ROOM, (-1, 1, 30)), "rooms": (BITMAP.format(16, "rooms"), (0, -6, 90)),
          "cave": (BITMAP.format(16, "cave"), (-0.75, -2.25, 50))}
ROBOT = """
interval_sim {step}
resolution 0.02
ray_model "exact"
position( name "r" size [0.3 0.3 0.3] pose [{pose[0]} {pose[1]} 0 {pose[2]}] localization "{localization}"
  odom_error [0 0 0 0] velocity_bounds [-1 1 -1 1 -1 1 -200 200] update_interval {step}
  ranger( pose [0.05 0.02 0 5] update_interval 100
    sensor( pose [0.05 0 0 10] range [0 10] fov 350 samples 181 ) ) )
"""
#: Turn rates on curves (with a speed, m/s) and on the spot.
MOTIONS = ((0.3, 1.0), (0.3, -2.0), (0.0, 1.0), (0.0, 2.0))
WRONG = np.array([0.2, -0.22, np.radians(10)])  # error of the first guess: 0.3 m, 10 degrees
BOUND = 0.3  # degrees
SETTLING, SCANS = 15, 8  # scans until the particles are near, and at each speed


class Early(Localizer):
    """A localizer for which the stamps of scans are those of the step before."""

    step = 0  # milliseconds

    def take_scan(self, scan: Any) -> None:
        time = nanoseconds(scan.header.stamp) - self.step * 1_000_000
        scan.header.stamp.sec, scan.header.stamp.nanosec = time // 10**9, time % 10**9
        super().take_scan(scan)


class Drive:
    """Drives robot 0 of a node and compares a localizer with the truth; `truth` is the pose at the last scan."""

    truth = np.zeros(3)

    def __init__(self, client: Client, node: Any, localizer: Localizer) -> None:
        self._client, self._node, self._localizer = client, node, localizer
        self._truth = client.listen(Odometry, "/ground_truth")

        def listen() -> bool:
            node.advance()
            client.spin(0.02)
            return localizer.time >= 0 and bool(self._truth)

        client.until(listen)

    def run(self, speed: float, turn: float, scans: int) -> np.ndarray:
        """Drives until there are more scans; returns the errors of their poses, shape (n, 3): metres and degrees."""
        errors = []
        node, localizer, client = self._node, self._localizer, self._client
        for _ in range(scans):
            before = localizer.time
            node.team.fleet.cmd[0] = speed, 0, turn
            node.advance()
            while node.now % 100_000:
                node.advance()
            client.until(lambda: localizer.time > before and nanoseconds(self._truth[-1].header.stamp) == node.now * 1000)
            truths = {nanoseconds(message.header.stamp): pose_of(message.pose.pose) for message in self._truth[-10:]}
            self.truth = truths[localizer.time]
            errors.append(seen_from(self.truth, localizer.pose) * [1, 1, 180 / np.pi])
        return np.array(errors)


@contextmanager
def driven(client: Client, world: str, step: int, localization: str, kind: type = Localizer,
           **parameters: Any) -> Iterator[tuple[Drive, Localizer]]:
    """A robot that is localized from a wrong first guess on."""
    text, pose = WORLDS[world]
    text += ROBOT.format(step=step, pose=pose, localization=localization)
    with st.World.from_text(text) as loaded, node_here(loaded, publish_map=True, map_resolution=0.025,
                                                       base_watchdog_timeout=0.0) as node:
        guess = np.array([pose[0], pose[1], np.radians(pose[2])]) + WRONG
        localizer = client.serve(kind(**{"start": guess.tolist(), **parameters}))
        yield Drive(client, node, localizer), localizer


@pytest.mark.parametrize(("world", "step", "localization"), [
    ("room", 20, "odom"), ("room", 100, "gps"), ("rooms", 20, "gps"), ("rooms", 100, "odom"), ("cave", 20, "odom"),
    ("cave", 100, "gps")])
def test_the_heading_is_right_while_the_robot_turns(client: Client, world: str, step: int, localization: str) -> None:
    with driven(client, world, step, localization, odometry_errors=[0.02, 0.02, 0.05, 0.01]) as (drive, _):
        first = drive.run(*MOTIONS[0], 2 * SETTLING)
        errors = np.concatenate([drive.run(*motion, SCANS) for motion in MOTIONS])
    print(f"{world}, steps of {step} ms, {localization}: first {first[0].round(3)}, then at most "
          f"{np.abs(errors).max(0).round(3)} (m, m, degrees)")
    assert np.abs(errors[:, 2]).max() < BOUND
    assert np.hypot(*errors[:, :2].T).max() < 0.1


@pytest.mark.parametrize(("motion", "step"), zip(MOTIONS, (20, 100, 100, 20)))
def test_a_stamp_that_is_wrong_by_a_step_shows(client: Client, monkeypatch: pytest.MonkeyPatch,
                                               motion: tuple[float, float], step: int) -> None:
    """The heading errs by what the robot turns in a step, or a part of it until the filter has followed."""
    monkeypatch.setattr(Early, "step", step)
    with driven(client, "room", step, "odom", Early) as (drive, _):
        errors = drive.run(*motion, SETTLING + SCANS)[SETTLING:, 2]
    expected = np.degrees(motion[1] * step / 1000)
    print(f"{motion}, steps of {step} ms: {errors.mean():.3f} degrees, expected {expected:.3f}")
    assert 2 * BOUND < errors.mean() * np.sign(expected) < 1.1 * abs(expected)


def test_an_initial_pose_starts_it_again(client: Client) -> None:
    with driven(client, "room", 100, "odom", start=[3.0, -3.0, 2.0]) as (drive, localizer):
        lost = drive.run(*MOTIONS[0], 5)
        assert np.hypot(*lost[-1, :2]) > 1
        talk = client.talk(PoseWithCovarianceStamped, "/initialpose")
        guess = drive.truth + WRONG
        message = PoseWithCovarianceStamped()
        message.pose.pose.position.x, message.pose.pose.position.y = guess[:2].tolist()
        message.pose.pose.orientation.z, message.pose.pose.orientation.w = np.sin(guess[2] / 2), np.cos(guess[2] / 2)
        message.pose.covariance[[0, 7, 35]] = 0.09, 0.09, 0.04
        talk.publish(message)
        client.spin(0.05)
        drive.run(*MOTIONS[0], SETTLING)
        found = drive.run(*MOTIONS[0], SCANS)
        assert np.hypot(*found[:, :2].T).max() < 0.1 and np.abs(found[:, 2]).max() < BOUND
