# SPDX-License-Identifier: GPL-2.0-or-later
"""Poses, velocities and covariances in the plane: of messages, of compositions, and at later times.

Poses are arrays (x, y, heading), in metres and radians. Times are nanoseconds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Sequence

import numpy as np

from ..covariance import PLANE, Array
from ..messages import heading_of

#: A covariance may have eigenvalues below 0 by this share of the greatest, from rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Moving:
    """Somebody or something at a time.

    Attributes:
        stamp: the time.
        pose, pose_covariance: shapes (3,) and (3, 3).
        velocity, velocity_covariance: in the frame of the body or of the map, as the owner says.
    """

    stamp: int
    pose: Array
    pose_covariance: Array
    velocity: Array
    velocity_covariance: Array


def stamp_of(header: Any) -> int:
    """The time of a std_msgs/Header, nanoseconds."""
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def pose_of(message: Any) -> Array:
    """The pose in a geometry_msgs/Pose. Raises ValueError if it isn't finite."""
    pose = np.array([message.position.x, message.position.y, heading_of(message.orientation)])
    if not np.isfinite(pose).all():
        raise ValueError(f"found the pose {shown(pose)}, expected finite numbers")
    return pose


def velocity_of(message: Any) -> Array:
    """The velocity in a geometry_msgs/Twist. Raises ValueError if it isn't finite."""
    velocity = np.array([message.linear.x, message.linear.y, message.angular.z])
    if not np.isfinite(velocity).all():
        raise ValueError(f"found the velocity {shown(velocity)}, expected finite numbers")
    return velocity


def covariance_of(numbers: Any, unknown: Sequence[float]) -> Array:
    """The planar part of the 36 numbers of a covariance in ROS: shape (3, 3).

    Args:
        numbers: row by row; zeros mean that it is unknown.
        unknown: standard deviations for that case.

    Raises:
        ValueError: it isn't symmetric and positive semidefinite.
    """
    found = np.asarray(numbers, float).reshape(6, 6)[PLANE[:, None], PLANE]
    if not found.any():
        return np.diag(np.square(unknown))
    if np.isfinite(found).all():
        values = np.linalg.eigvalsh(found)
        slack = _ROUNDING * float(np.abs(values).max())
        if values[0] >= -slack and np.abs(found - found.T).max() <= slack:
            return repaired(found)
    raise ValueError(f"found a covariance with the diagonal {shown(np.diag(found))}, expected a symmetric and positive "
                     "semidefinite one")


def repaired(covariance: Array) -> Array:
    """The nearest symmetric and positive semidefinite covariance."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    if values[0] < 0:
        covariance = vectors * np.maximum(values, 0) @ vectors.T
    return (covariance + covariance.T) / 2


def shown(numbers: Array) -> str:
    """Some numbers for a message."""
    return "(" + ", ".join(f"{number:.4g}" for number in numbers) + ")"


def rotation(angle: float) -> Array:
    """Turns velocities and errors by an angle: shape (3, 3)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def composed(frame: Array, pose: Array) -> Array:
    """Transforms a pose from a frame to the one in which that frame is given."""
    x, y, a = frame
    c, s = math.cos(a), math.sin(a)
    return np.array([x + c * pose[0] - s * pose[1], y + s * pose[0] + c * pose[1], wrapped(a + pose[2])])


def relative(pose: Array, frame: Array) -> Array:
    """A pose in the frame of another one; both are in the same frame."""
    x, y, a = pose - frame
    c, s = math.cos(frame[2]), math.sin(frame[2])
    return np.array([c * x + s * y, c * y - s * x, wrapped(a)])


def wrapped(angle: float) -> float:
    """The angle from -pi to pi."""
    return math.remainder(angle, 2 * math.pi)


def motion(velocity: Array, seconds: float) -> Array:
    """The pose that is reached from 0, 0, 0 with a constant velocity in the own frame: an arc."""
    x, y, turn = velocity * seconds
    if abs(turn) < 1e-9:
        return np.array([x, y, turn])
    s, c = math.sin(turn) / turn, (1 - math.cos(turn)) / turn
    return np.array([s * x - c * y, c * x + s * y, turn])


def carried(pose: Array, covariance: Array, by: Array, errors: Array) -> tuple[Array, Array]:
    """Composes a pose with a motion; returns the new pose and its covariance.

    Args:
        pose, covariance: at the beginning.
        by, errors: the motion in the frame of that pose, and its covariance there.
    """
    after = composed(pose, by)
    lever = np.eye(3)
    lever[0, 2], lever[1, 2] = pose[1] - after[1], after[0] - pose[0]
    turned = rotation(pose[2])
    return after, lever @ covariance @ lever.T + turned @ errors @ turned.T
