# SPDX-License-Identifier: GPL-2.0-or-later
"""Pure pursuit of paths, compared with its theory.

Near a path, at lookahead L, the distance e from the path obeys e'' + 2 e'/L + 2 e/L^2 = c, where c comes from curvatures ahead.
Where the curvature changes by k, the solution is at most exp(-pi/2)/2 k L^2, half a pi lookaheads behind the point where
the robot begins to feel the change; on circles it vanishes.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import Any, Iterator

import numpy as np
import pytest
import stagesim as st
from nav_msgs.msg import Odometry
from ros_testing import Client, node_here, time_of

pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not there; try tools/setup --ros")

from follower import Follower, figure_eight, path_of  # noqa: E402  (from examples/ros)
from transforms import pose_of  # noqa: E402

ROBOT = """
interval_sim 40
position( name "r" size [0.3 0.3 0.3] pose [0 0 0 0] update_interval 40 localization "gps" {} )
"""
DIFF, CAR = 'drive "diff"', 'drive "car" wheelbase 0.2'
LOOKAHEAD, SPEED, RADIUS = 0.3, 0.5, 0.7


def rounded_rectangle(width: float, height: float, radius: float) -> np.ndarray:
    """A lap from the middle of the lower side on, against the clock, shape (n, 2)."""
    turn = np.linspace(0, np.pi / 2, 40)
    parts = [np.zeros((1, 2))]
    for k, (x, y) in enumerate([(1, 0), (1, 1), (-1, 1), (-1, 0)]):
        middle = np.array([x * (width / 2 - radius), radius if y == 0 else height - radius])
        angles = turn + (k - 1) * np.pi / 2
        parts.append(middle + radius * np.stack([np.cos(angles), np.sin(angles)], 1))
    return np.concatenate([*parts, parts[0]])


def distances(places: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The distance of places, shape (n, 2), from a path, metres."""
    ways = np.diff(points, axis=0)
    keep = np.hypot(*ways.T) > 0
    starts, ways = points[:-1][keep], ways[keep]
    share = np.clip(((places[:, None] - starts) * ways).sum(-1) / (ways**2).sum(-1), 0, 1)
    return np.hypot(*np.moveaxis(places[:, None] - starts - share[..., None] * ways, -1, 0)).min(1)


def drive(client: Client, robot: str, points: np.ndarray, car: bool = False, **node: Any) -> np.ndarray:
    """Follows a path to its end; returns the true poses, shape (n, 3)."""
    with st.World.from_text(ROBOT.format(robot)) as world, node_here(world, base_watchdog_timeout=0.0, **node) as made:
        parameters = {"lookahead": LOOKAHEAD, "speed": SPEED, "wheelbase": 0.2 if car else 0.0,
                      "stamped_cmd_vel": node.get("stamped_cmd_vel", False)}
        follower = client.serve(Follower(**parameters))
        odometry = client.listen(Odometry, "/odom")

        def listen() -> bool:
            made.advance()
            client.spin(0.02)
            return bool(odometry) and follower.count_subscribers(follower._out.topic_name) > 0

        client.until(listen)
        client.until(lambda: time_of(odometry[-1]) == made.now)
        client.spin(0.3)  # so that the follower has seen all odometry, and answers each step once from now on
        follower.follow(path_of(points, "odom"))

        def is_answered() -> bool:
            made._executor.spin(0.001)
            return bool(made.team.last_command[0] == made.now)

        poses = []
        while follower._pursuit is not None:
            assert len(poses) < 5000
            made.advance()
            client.until(is_answered)
            poses.append(tuple(made.team.fleet.pose[0]))
        for _ in range(3):
            made.advance()
        assert not made.team.fleet.actual_velocity[0].any()
        return np.array(poses)


@pytest.mark.parametrize(("shape", "robot", "car", "node"), [
    ("eight", DIFF, False, {}), ("eight", CAR, True, {}), ("rectangle", DIFF, False, {"stamped_cmd_vel": True}),
    ("rectangle", CAR, False, {"cars_turn": True})])
def test_the_distance_from_the_path_is_that_of_the_theory(client: Client, shape: str, robot: str, car: bool,
                                                         node: dict[str, Any]) -> None:
    if car:
        pytest.importorskip("ackermann_msgs.msg", reason="ackermann_msgs is not there; try tools/setup --ros")
    points, jump = (figure_eight(RADIUS), 2) if shape == "eight" else (rounded_rectangle(2.8, 2.4, RADIUS), 1)
    poses = drive(client, robot, points, car, **node)
    error = distances(poses[:, :2], points).max()
    expected = np.exp(-np.pi / 2) / 2 * jump / RADIUS * LOOKAHEAD**2
    print(f"{shape}, {robot}: {len(poses)} steps, {error * 1e3:.2f} mm, in theory {expected * 1e3:.2f} mm, end "
          f"{np.hypot(*(poses[-1, :2] - points[-1])) * 1e3:.1f} mm")
    assert error == pytest.approx(expected, rel=0.25)
    assert np.hypot(*(poses[-1, :2] - points[-1])) < 0.03
