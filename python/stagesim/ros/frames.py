# SPDX-License-Identifier: GPL-2.0-or-later
"""The coordinate frames of poses that clients send."""

from __future__ import annotations

from typing import Sequence

import numpy as np

from ..fleet import Fleet
from .messages import Array, frames_between, in_frames
from .names import joined
from .robots import Look, composed

Pose = tuple[float, float, float]


class Frames:
    """The planar frames of a world: the map, and the odometry and the body of each robot.

    Args:
        look: the names of the frames.
        prefixes: the prefix of each robot's frames.
        fleet: the robots.

    Attributes:
        shifts: transforms from the true to the believed pose of each robot, in the map: x, y and heading, (n, 3).
    """

    def __init__(self, look: Look, prefixes: Sequence[str], fleet: Fleet) -> None:
        self._map, self._fleet, self._plain = look.map, fleet, look.plain_frames
        self._prefixes = list(prefixes)
        self.shifts = np.zeros((len(fleet), 3))
        self._odometry = {joined(prefix, look.odom): i for i, prefix in enumerate(prefixes)}
        self._bodies = {joined(prefix, name): i for i, prefix in enumerate(prefixes)
                        for name in (look.footprint, look.base)}

    def origins(self, rows: Array | slice = slice(None)) -> Array:
        """Origins of the odometry frames of some robots in the map, by their true poses: x, y, heading, (n, 3)."""
        return frames_between(self._fleet.sensed_pose[rows], self._fleet.estimate[rows])

    def beliefs(self) -> Array:
        """Believed poses of the robots in the map at the time of the newest readings: (n, 3)."""
        return in_frames(self.shifts, self._fleet.sensed_pose)

    def believed_origins(self, rows: Array) -> Array:
        """Origins of the odometry frames of some robots in the map, by their believed poses: (n, 3)."""
        return in_frames(self.shifts[rows], self.origins(rows))

    def shift(self, robot: int, pose: Pose) -> None:
        """Makes a robot believe that it is at the pose in the map now."""
        self.shifts[robot] = frames_between(np.array([pose]), self._fleet.pose[robot:robot + 1])[0]

    def in_world(self, pose: Pose, frame: str, robot: int | None = None) -> Pose:
        """Transforms a pose (x, y, heading) to the map frame.

        Args:
            pose: the pose in `frame`.
            frame: name of the frame; empty: the map. A leading slash is ignored, as in ROS 1.
            robot: the receiver of the message. If messages name frames without prefixes, they mean its frames.
                None: no robot is the receiver.

        Raises:
            ValueError: there is no such frame.
        """
        name = frame.removeprefix("/")
        if name in ("", self._map):
            return pose
        if self._plain and robot is not None:
            own = joined(self._prefixes[robot], name)
            name = own if own in self._odometry or own in self._bodies else name
        if name in self._odometry:
            x, y, a = self.origins()[self._odometry[name]]
        elif name in self._bodies:
            x, y, a = self._fleet.pose[self._bodies[name]]
        else:
            some = [self._map, next(iter(self._odometry)), next(iter(self._bodies))]
            raise ValueError(f"found the frame {frame[:60]!a}, expected {', '.join(some)} or another robot's")
        x, y, _, a = composed((x, y, 0.0, a), (pose[0], pose[1], 0.0, pose[2]))
        return float(x), float(y), float(a)
