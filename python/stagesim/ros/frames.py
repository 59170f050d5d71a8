# SPDX-License-Identifier: GPL-2.0-or-later
"""The coordinate frames of poses that clients send."""

from __future__ import annotations

from typing import Sequence

from ..fleet import Fleet
from .messages import Array, frames_between
from .names import joined
from .robots import Look, composed

Pose = tuple[float, float, float]


class Frames:
    """The planar frames of a world: the map, and the odometry and the body of each robot.

    Args:
        look: the names of the frames.
        prefixes: the prefix of each robot's frames.
        fleet: the robots.
    """

    def __init__(self, look: Look, prefixes: Sequence[str], fleet: Fleet) -> None:
        self._map, self._fleet, self._plain = look.map, fleet, look.plain_frames
        self._prefixes = list(prefixes)
        self._odometry = {joined(prefix, look.odom): i for i, prefix in enumerate(prefixes)}
        self._bodies = {joined(prefix, name): i for i, prefix in enumerate(prefixes)
                        for name in (look.footprint, look.base)}

    def origins(self) -> Array:
        """Origins of the odometry frames in the map frame, by the robots' true poses: x, y, heading, (n, 3)."""
        return frames_between(self._fleet.sensed_pose, self._fleet.estimate)

    def in_world(self, pose: Pose, frame: str, robot: int) -> Pose:
        """Transforms a pose (x, y, heading) to the map frame.

        Args:
            pose: the pose in `frame`.
            frame: name of the frame; empty: the map. A leading slash is ignored, as in ROS 1.
            robot: the receiver of the message. If messages name frames without prefixes, they mean its frames.

        Raises:
            ValueError: there is no such frame.
        """
        name = frame.removeprefix("/")
        if name in ("", self._map):
            return pose
        own = joined(self._prefixes[robot], name)
        if self._plain and (own in self._odometry or own in self._bodies):
            name = own
        if name in self._odometry:
            x, y, a = self.origins()[self._odometry[name]]
        elif name in self._bodies:
            x, y, a = self._fleet.pose[self._bodies[name]]
        else:
            some = [self._map, next(iter(self._odometry)), next(iter(self._bodies))]
            raise ValueError(f"found the frame {frame[:60]!a}, expected {', '.join(some)} or another robot's")
        x, y, _, a = composed((x, y, 0.0, a), (pose[0], pose[1], 0.0, pose[2]))
        return float(x), float(y), float(a)
