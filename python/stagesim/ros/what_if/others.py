# SPDX-License-Identifier: GPL-2.0-or-later
"""Tracked others, by the messages of robots and of trackers."""

from __future__ import annotations

from typing import Any, NamedTuple, Sequence

import numpy as np

from ...belief import Behaviour
from ..covariance import Array
from .localization import SECOND
from .plane import Moving, covariance_of, pose_of, rotation, shown, stamp_of, velocity_of

#: The goal of behaviours with a goal is where the present velocity leads within this time, seconds.
_FAR = 10.0


class Arrays(NamedTuple):
    """All others as arguments of Belief.set_others()."""

    ids: Array
    poses: Array
    velocities: Array
    pose_covariances: Array
    velocity_covariances: Array
    behaviours: list[list[Behaviour]]


def moving_of(message: Any, pose_errors: Sequence[float], twist_errors: Sequence[float]) -> Moving:
    """Somebody or something by a nav_msgs/Odometry, with the velocity in its own frame.

    Raises:
        ValueError: a number isn't finite, or a covariance makes no sense.
    """
    return Moving(stamp_of(message.header), pose_of(message.pose.pose), covariance_of(message.pose.covariance, pose_errors),
                  velocity_of(message.twist.twist), covariance_of(message.twist.covariance, twist_errors))


class Others:
    """Others by the names of their topics and of themselves, with velocities in the frame of the map.

    Args:
        behaviours: hypotheses for each of them; goals are replaced.
    """

    def __init__(self, behaviours: Sequence[Behaviour]) -> None:
        self._behaviours = list(behaviours)
        self._numbers: dict[tuple[str, str], int] = {}
        self._known: dict[tuple[str, str], Moving] = {}

    def forget(self) -> None:
        """Starts anew, for example after time has gone back. Numbers stay."""
        self._known.clear()

    def take(self, topic: str, name: str, measured: Moving) -> None:
        """Takes a measurement in the map with a velocity in its own frame.

        Raises:
            ValueError: it contradicts one before.
        """
        key = (topic, name)
        before = self._known.get(key)
        if before is not None and measured.stamp <= before.stamp:
            seconds = (before.stamp - measured.stamp) / SECOND
            if seconds > 0:
                raise ValueError(f"found a stamp of {name!a} that is {seconds:.3g} s older than one before, expected that "
                                 "time goes on")
            if not np.array_equal(measured.pose, before.pose):
                raise ValueError(f"found {name!a} twice at the same time, at {shown(before.pose)} and {shown(measured.pose)}, "
                                 "expected once")
            return
        self._numbers.setdefault(key, len(self._numbers))
        turned = rotation(measured.pose[2])
        self._known[key] = Moving(measured.stamp, measured.pose, measured.pose_covariance, turned @ measured.velocity,
                                  turned @ measured.velocity_covariance @ turned.T)

    def newest(self, topic: str) -> int | None:
        """Time of the newest measurement on a topic; None: there was none."""
        return max((each.stamp for key, each in self._known.items() if key[0] == topic), default=None)

    def drop(self, before: int) -> None:
        """Forgets those of which nothing has been heard since then."""
        for key in [key for key, each in self._known.items() if each.stamp < before]:
            del self._known[key]

    def at(self, time: int) -> Arrays:
        """All others at a time: they go on with their velocities until then."""
        n = len(self._known)
        found = Arrays(np.zeros(n, np.int64), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3, 3)), np.zeros((n, 3, 3)), [])
        for i, (key, each) in enumerate(self._known.items()):
            seconds = max(0.0, (time - each.stamp) / SECOND)
            found.ids[i] = self._numbers[key]
            found.poses[i] = each.pose + each.velocity * seconds
            found.velocities[i] = each.velocity
            found.pose_covariances[i] = each.pose_covariance + each.velocity_covariance * seconds**2
            found.velocity_covariances[i] = each.velocity_covariance
            goal = found.poses[i, :2] + each.velocity[:2] * _FAR
            found.behaviours.append([one._replace(goal=(float(goal[0]), float(goal[1]))) for one in self._behaviours])
        return found
