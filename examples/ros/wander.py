#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Drives robots about by their scans; each turns back home where it is far from the origin of its odometry.

  python -m stagesim.ros simple.world --ros-args -p stamped_cmd_vel:=true -p lockstep:=all
  python examples/ros/wander.py r0 r1 --ros-args -p scan:=base_scan1

Without names, it drives the only robot of a world, whose topics and frames have no prefix. Several of these programs may
drive the robots of one world. Commands have the stamp of the scan that they answer, so they work in lock-step. Parameters:
`scan` (base_scan), topic of the scans in the namespace of each robot; `namespaced_tf` (false): transforms are on /NAME/tf,
with frames without prefixes.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import TwistStamped
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import LaserScan

from programs import run
from transforms import Placed, Transforms

NEAR, FAR = 0.6, 2.0  # distances of an obstacle to turn away from, and from home to turn back, metres


def velocity(ranges: np.ndarray, pose: np.ndarray) -> tuple[float, float]:
    """The speed (m/s) and turn rate (rad/s) for a scan from right to left, and the robot's pose.

    The pose only decides between a few velocities, so its rounding does not change runs.
    """
    if ranges.min() < NEAR:
        return 0.1, 0.9
    across = np.cos(pose[2]) * -pose[1] - np.sin(pose[2]) * -pose[0]  # > 0: home is on the left
    is_far = np.hypot(pose[0], pose[1]) > FAR
    return 0.4, float(is_far) * (0.6 if across > 0 else -0.6)


class Wanderer:
    """Drives one robot; `scans` is the number of scans that it has answered.

    Args:
        node: has the subscriptions and the publisher.
        robot: prefix of its topics; may be empty.
        transforms: those of the robot.
        prefix: prefix of its frames.
    """

    def __init__(self, node: Node, robot: str, scan: str, transforms: Transforms, prefix: str) -> None:
        self.scans = 0
        self._base = prefix + "base_footprint"
        self._placed = Placed(transforms, prefix + "odom", self._answer)
        space = f"/{robot}" if robot else ""
        node.create_subscription(LaserScan, f"{space}/{scan}", self._take, 10)
        self._out = node.create_publisher(TwistStamped, f"{space}/cmd_vel", 10)

    def _take(self, scan: LaserScan) -> None:
        self._placed.add(scan, self._base)

    def _answer(self, scan: LaserScan, pose: np.ndarray) -> None:
        self.scans += 1
        command = TwistStamped(header=scan.header)
        command.twist.linear.x, command.twist.angular.z = velocity(np.array(scan.ranges), pose)
        self._out.publish(command)


class Wander(Node):
    """The node of the robots with these names; "" is the only robot of a world."""

    def __init__(self, robots: list[str], **parameters: Any) -> None:
        overrides = [rclpy.Parameter(name, value=value) for name, value in parameters.items()]
        super().__init__("_".join(["wander", *filter(None, robots)]), parameter_overrides=overrides)
        scan = self.declare_parameter("scan", "base_scan").value
        apart = self.declare_parameter("namespaced_tf", False).value
        shared = None if apart else Transforms(self)
        self.robots = [Wanderer(self, name, scan, shared or Transforms(self, f"/{name}"), "" if apart or not name else f"{name}/")
                       for name in robots]


def main() -> None:
    robots = remove_ros_args(sys.argv)[1:]
    run(lambda: Wander(robots or [""]))


if __name__ == "__main__":
    main()
