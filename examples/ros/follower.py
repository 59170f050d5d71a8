#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Follows a path by pure pursuit: drives arcs to the point of the path that is `lookahead` metres away (Coulter 1992).

  python -m stagesim.ros simple.world
  python examples/ros/follower.py --ros-args -r odom:=/r0/odom -r cmd_vel:=/r0/cmd_vel -p eight:=1.0

It follows each nav_msgs/Path on the topic `path` once, with poses in any frame of /tf, and stops at its end. Parameters:
`lookahead` (0.5 m), `speed` (0.5 m/s), `acceleration` (0.5 m/s2, to stop) and `tolerance` (0.02 m, of the end). `eight` is
the radius of the circles of a figure eight that it follows first, from where the robot is; 0: none. `wheelbase`, metres, is
that of a car that gets steering angles on ackermann_cmd; 0: velocities on cmd_vel. Others are `stamped_cmd_vel` (false), and
`namespace` of the topics tf and tf_static (empty).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node

from programs import run
from transforms import Placed, Transforms, placed, pose_of, seen_from

SPACING = 0.01  # between the points of a path, metres


def figure_eight(radius: float, spacing: float = 0.05) -> np.ndarray:
    """Points of an eight of two circles, that begins and ends at the origin in the direction of x, shape (n, 2)."""
    turn = np.linspace(0, 2 * np.pi, round(2 * np.pi * radius / spacing))
    left = radius * np.stack([np.sin(turn), 1 - np.cos(turn)], 1)
    return np.concatenate([left, left[1:] * [1, -1]])


def path_of(points: np.ndarray, frame: str) -> Path:
    """Converts points, shape (n, 2), to a message."""
    message = Path()
    message.header.frame_id = frame
    for x, y in points.tolist():
        pose = PoseStamped(header=message.header)
        pose.pose.position.x, pose.pose.position.y = x, y
        message.poses.append(pose)
    return message


class Pursuit:
    """Pure pursuit of a path.

    Args:
        points: the path, shape (n, 2), at least two different points, metres.
        lookahead: metres.
    """

    def __init__(self, points: np.ndarray, lookahead: float) -> None:
        self.lookahead = lookahead
        ways = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        at = np.linspace(0, ways[-1], round(ways[-1] / SPACING) + 1)
        self.points = np.stack([np.interp(at, ways, points[:, axis]) for axis in (0, 1)], 1)
        self._last = 0  # index of the point that is nearest to the robot
        ahead = self.points[-1] - self.points[-2]
        # The path goes straight on after its end, so that the last arcs lead along it.
        further = np.arange(1, round(lookahead / SPACING) + 2)[:, None] * ahead
        self._long = np.concatenate([self.points, self.points[-1] + further])

    def step(self, pose: np.ndarray) -> tuple[float, float]:
        """Returns the curvature of the arc to drive (1/m, left is positive), and the rest of the path (m)."""
        # The robot is near where it was, so that crossings of the path don't matter.
        near = self.points[self._last:self._last + round(2 * self.lookahead / SPACING)]
        self._last += int(np.argmin(np.hypot(*(near - pose[:2]).T)))
        away = np.hypot(*(self._long[self._last:] - pose[:2]).T)
        found = np.flatnonzero(away >= self.lookahead)
        target = self._last + (int(found[0]) if len(found) else len(away) - 1)
        _, left, _ = seen_from(pose, np.array([*self._long[target], 0.0]))
        return 2 * left / away[target - self._last]**2, SPACING * (len(self.points) - 1 - self._last)


class Follower(Node):
    """The node; `rest` is the rest of its path in metres, None before the first path and after its end."""

    def __init__(self, cli_args: list[str] | None = None, **parameters: Any) -> None:
        overrides = [rclpy.Parameter(name, value=value) for name, value in parameters.items()]
        super().__init__("follower", parameter_overrides=overrides, cli_args=cli_args)
        defaults = {"lookahead": 0.5, "speed": 0.5, "acceleration": 0.5, "tolerance": 0.02, "eight": 0.0, "wheelbase": 0.0,
                    "stamped_cmd_vel": False, "namespace": ""}
        self._get = {name: self.declare_parameter(name, value).value for name, value in defaults.items()}
        self.rest: float | None = None
        self._pursuit: Pursuit | None = None
        self._placed = Placed(Transforms(self, self._get["namespace"]), "", self._drive)
        self._command = self._car if self._get["wheelbase"] else self._twist
        self._out = self.create_publisher(self._kind(), "ackermann_cmd" if self._get["wheelbase"] else "cmd_vel", 10)
        self.create_subscription(Path, "path", self.follow, 10)
        self.create_subscription(Odometry, "odom", self._take_odometry, 10)

    def _kind(self) -> type:
        """The type of commands."""
        if not self._get["wheelbase"]:
            return TwistStamped if self._get["stamped_cmd_vel"] else Twist
        from ackermann_msgs.msg import AckermannDriveStamped

        return AckermannDriveStamped

    def follow(self, path: Path) -> None:
        """Follows a path from now on; one with less than two points stops the robot."""
        points = np.array([[pose.pose.position.x, pose.pose.position.y] for pose in path.poses])
        self._placed.target = path.header.frame_id
        self._pursuit = Pursuit(points, self._get["lookahead"]) if len(points) > 1 else None

    def _take_odometry(self, message: Odometry) -> None:
        if self._get["eight"]:
            start = message.pose.pose
            points = figure_eight(self._get["eight"])
            poses = placed(pose_of(message.pose.pose), np.column_stack([points, np.zeros(len(points))]))
            self.follow(path_of(poses[:, :2], message.header.frame_id))
            self._get["eight"] = 0.0
        if self._placed.target:
            self._placed.add(message, message.child_frame_id)

    def _drive(self, message: Odometry, pose: np.ndarray) -> None:
        speed = curvature = 0.0
        if self._pursuit is not None:
            curvature, self.rest = self._pursuit.step(pose)
            speed = min(self._get["speed"], float(np.sqrt(2 * self._get["acceleration"] * self.rest)))
            if self.rest <= self._get["tolerance"]:
                self._pursuit, self.rest, speed = None, None, 0.0
        self._out.publish(self._command(message.header, speed, curvature))

    def _twist(self, header: Any, speed: float, curvature: float) -> Any:
        twist = Twist()
        twist.linear.x, twist.angular.z = speed, float(speed * curvature)
        stamp = TwistStamped()
        stamp.header.stamp, stamp.twist = header.stamp, twist
        return stamp if self._get["stamped_cmd_vel"] else twist

    def _car(self, header: Any, speed: float, curvature: float) -> Any:
        message = self._kind()()
        message.header.stamp = header.stamp
        message.drive.speed, message.drive.steering_angle = speed, float(np.arctan(self._get["wheelbase"] * curvature))
        return message


def main() -> None:
    run(Follower)


if __name__ == "__main__":
    main()
