#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tells how far a localization or SLAM is from the truth: compares the robot's pose on /tf with `ground_truth`.

  python examples/ros/pose_error.py --ros-args -p count:=100

It compares the poses at the same stamps, prints the errors and ends after `count` of them (100). Other parameters: `frame`
(map), the frame in which both poses are; `align` (false): lays the first poses on each other, for a SLAM or an odometry that
begins where the robot was; `base_frame` (base_footprint); `namespace` of the topics tf and tf_static (empty).
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node

from transforms import Placed, Transforms, placed, pose_of, seen_from


class PoseError(Node):
    """The node.

    Attributes:
        poses: pairs of the believed and the true pose, each x, y (metres) and heading (radians).
        enough: done when there are `count` of them.
    """

    def __init__(self, **parameters: Any) -> None:
        overrides = [rclpy.Parameter(name, value=value) for name, value in parameters.items()]
        super().__init__("pose_error", parameter_overrides=overrides)
        self.count = self.declare_parameter("count", 100).value
        self.align = self.declare_parameter("align", False).value
        self.enough = rclpy.Future()
        self.poses: list[tuple[np.ndarray, np.ndarray]] = []
        frame, self._base = (self.declare_parameter(name, value).value
                             for name, value in (("frame", "map"), ("base_frame", "base_footprint")))
        transforms = Transforms(self, self.declare_parameter("namespace", "").value)
        self._placed = Placed(transforms, frame, self._compare)
        self.create_subscription(Odometry, "ground_truth", lambda truth: self._placed.add(truth, self._base), 10)

    def _compare(self, truth: Odometry, believed: np.ndarray) -> None:
        self.poses.append((believed, pose_of(truth.pose.pose)))
        if len(self.poses) == self.count:
            self.enough.set_result(True)

    def errors(self) -> tuple[np.ndarray, np.ndarray]:
        """Distances in metres and differences of the headings in radians, shape (n,) each."""
        believed, true = (np.array(poses) for poses in zip(*self.poses))
        if self.align:
            believed = placed(true[0], seen_from(believed[0], believed))
        turns = np.angle(np.exp(1j * (believed[:, 2] - true[:, 2])))
        return np.hypot(*(believed - true)[:, :2].T), np.abs(turns)

    def summary(self) -> str:
        """The errors in a line."""
        distances, turns = self.errors()
        return (f"{len(distances)} poses: median error {np.median(distances):.4f} m and {np.degrees(np.median(turns)):.3f} "
                f"degrees, largest {distances.max():.4f} m and {np.degrees(turns.max()):.3f} degrees")


def main() -> None:
    rclpy.init(args=sys.argv)
    node = PoseError()
    try:
        rclpy.spin_until_future_complete(node, node.enough)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
    if node.poses:
        print(node.summary())


if __name__ == "__main__":
    main()
