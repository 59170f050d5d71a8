# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages for the node that decides."""

from __future__ import annotations

import math
from typing import Any, Sequence

import numpy as np
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile

KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PLANE = (0, 1, 5)


def _stamp(message: Any, nanoseconds: int, frame: str) -> None:
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(nanoseconds, 10**9)


def _place(pose: Any, x: float, y: float, heading: float) -> None:
    pose.position.x, pose.position.y = float(x), float(y)
    pose.orientation.z, pose.orientation.w = math.sin(heading / 2), math.cos(heading / 2)


def _covariance(numbers: Any, deviations: Sequence[float]) -> None:
    for axis, deviation in zip(PLANE, deviations):
        numbers[7 * axis] = math.copysign(deviation**2, deviation)


def odometry(now: int, pose: Sequence[float] = (0, 0, 0), velocity: Sequence[float] = (0, 0, 0), *, frame: str = "map",
             child: str = "base", errors: Sequence[float] = (0.01, 0.01, 0.01)) -> Odometry:
    """A measurement; negative errors make negative variances."""
    message = Odometry(child_frame_id=child)
    _stamp(message, now, frame)
    _place(message.pose.pose, *pose)
    twist = message.twist.twist
    twist.linear.x, twist.linear.y, twist.angular.z = map(float, velocity)
    _covariance(message.pose.covariance, errors)
    _covariance(message.twist.covariance, (0.01, 0.01, 0.01))
    return message


def pose(now: int, place: Sequence[float], *, frame: str = "map",
         errors: Sequence[float] = (0.1, 0.1, 0.05)) -> PoseWithCovarianceStamped:
    """A pose of a localization."""
    message = PoseWithCovarianceStamped()
    _stamp(message, now, frame)
    _place(message.pose.pose, *place)
    _covariance(message.pose.covariance, errors)
    return message


def goal(x: float, y: float, frame: str = "map") -> PoseStamped:
    message = PoseStamped()
    _stamp(message, 0, frame)
    _place(message.pose, x, y, 0)
    return message


def occupancy(cells: Any, *, resolution: float = 0.1, origin: Sequence[float] = (0, 0, 0), frame: str = "map") -> OccupancyGrid:
    """A map of cells in percent; row 0 is the lowest."""
    array = np.asarray(cells, np.int8)
    message = OccupancyGrid()
    _stamp(message, 0, frame)
    message.info.height, message.info.width = array.shape
    message.info.resolution = resolution
    _place(message.info.origin, *origin)
    message.data = array.ravel().tolist()
    return message
