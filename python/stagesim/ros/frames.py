# SPDX-License-Identifier: GPL-2.0-or-later
"""Frames that poses for robots may be in."""

from __future__ import annotations

from typing import Sequence

from ..fleet import Fleet
from .messages import Array, frames_between
from .names import joined
from .robots import Look, composed

Pose = tuple[float, float, float]


class Frames:
    """The frames of a world that lie in the plane: the map's, and the odometry and the body of each robot.

    Args:
        look: what they are called.
        prefixes: of the robots' frames.
        fleet: the robots.
    """

    def __init__(self, look: Look, prefixes: Sequence[str], fleet: Fleet) -> None:
        self._map, self._fleet = look.map, fleet
        self._odometry = {joined(prefix, look.odom): i for i, prefix in enumerate(prefixes)}
        self._bodies = {joined(prefix, name): i for i, prefix in enumerate(prefixes)
                        for name in (look.footprint, look.base)}

    def origins(self) -> Array:
        """Of the odometry of each robot in the frame of the map, where the robot truly is: shape (n, 3)."""
        return frames_between(self._fleet.sensed_pose, self._fleet.estimate)

    def in_world(self, pose: Pose, frame: str) -> Pose:
        """The pose in the frame of the map; x, y and heading.

        Args:
            pose: in that frame.
            frame: empty: the map's. A slash before it means nothing, as in ROS 1.

        Raises:
            ValueError: there is no such frame.
        """
        name = frame.removeprefix("/")
        if name in ("", self._map):
            return pose
        if name in self._odometry:
            x, y, a = self.origins()[self._odometry[name]]
        elif name in self._bodies:
            x, y, a = self._fleet.pose[self._bodies[name]]
        else:
            some = [self._map, next(iter(self._odometry)), next(iter(self._bodies))]
            raise ValueError(f"found the frame {frame[:60]!a}, expected {', '.join(some)} or another robot's")
        x, y, _, a = composed((x, y, 0.0, a), (pose[0], pose[1], 0.0, pose[2]))
        return float(x), float(y), float(a)
