# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the robot is in the map: by odometry, by poses of a localization, or by both."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from dataclasses import dataclass

import numpy as np

from ..covariance import Array
from .plane import Moving, carried, composed, motion, relative, repaired, rotation

#: Odometry is kept for so many messages and seconds, for poses that arrive late.
_MOST_MESSAGES, _MEMORY = 2000, 10.0
SECOND = 1_000_000_000
#: Eigenvalues of a covariance may be below 0 by this share of its greatest number, from rounding.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Command:
    """A velocity in the own frame that the robot obeys from a time on, nanoseconds."""

    since: int
    velocity: Array


class Localization:
    """Combines measurements of the own pose.

    A pose of the localization says where the frame of the odometry is in the map, and odometry since then carries the
    pose on. Until now and beyond, it goes on with the measured velocity, or with the commands that it has got since.

    Args:
        uses: "both"; "odom": odometry is in the frame of the map; or "pose": there is no odometry, and the velocity is that
            of the last command.
        gap: longest time from a pose to the first odometry after it, seconds: the motion between them is unknown.
    """

    def __init__(self, uses: str = "both", gap: float = 1.0) -> None:
        self._uses, self._gap = uses, gap
        self.forget()

    def forget(self) -> None:
        """Starts anew, for example after time has gone back."""
        self._odometry: deque[Moving] = deque(maxlen=_MOST_MESSAGES)
        self._pose: Moving | None = None
        self._start: Moving | None = None  # the odometry at the time of the pose, once it is known

    @property
    def newest(self) -> int | None:
        """Time of the newest measurement that must not be old; None: there was none."""
        if self._uses == "pose":
            return self._pose.stamp if self._pose else None
        return self._odometry[-1].stamp if self._odometry else None

    def take_odometry(self, measured: Moving) -> bool:
        """Takes a measurement with a velocity in the robot's own frame.

        Returns:
            False: it is known already.

        Raises:
            ValueError: it is older than one before.
        """
        known = self._odometry
        if known and measured.stamp <= known[-1].stamp:
            _check_order(measured.stamp, known[-1].stamp)
            return False
        known.append(measured)
        while measured.stamp - known[0].stamp > _MEMORY * SECOND:
            known.popleft()
        self._find_start()
        return True

    def take_pose(self, measured: Moving) -> bool:
        """Takes a pose in the map; its velocity doesn't count. Returns and raises what take_odometry() does."""
        if self._pose is not None and measured.stamp <= self._pose.stamp:
            _check_order(measured.stamp, self._pose.stamp)
            return False
        self._pose, self._start = measured, None
        self._find_start()
        return True

    def why_not(self) -> str:
        """Why the place of the robot isn't known; empty if it is."""
        if self._uses != "pose" and not self._odometry:
            return "no odometry has been received"
        if self._uses != "odom" and self._pose is None:
            return "no pose of the localization has been received"
        if self._uses == "both" and self._pose is not None:
            seconds = (self._odometry[0].stamp - self._pose.stamp) / SECOND
            if self._start is None and seconds > self._gap:
                return f"the last pose is {seconds:.1f} s older than the first odometry, expected at most {self._gap:g} s"
        return ""

    def at(self, time: int, commands: list[Command]) -> Moving:
        """The robot in the map at a time, with its velocity in its own frame.

        Args:
            time: not before the newest measurement, else that is returned.
            commands: those that it has got, the oldest first.
        """
        if self._uses == "pose":
            assert self._pose is not None
            return _ahead(self._pose, time, commands)
        last = self._odometry[-1]
        if self._uses == "both":
            assert self._pose is not None
            start = self._start or (_ahead(last, self._pose.stamp, []) if self._pose.stamp > last.stamp
                                    else self._odometry[0])
            pose, covariance = carried(self._pose.pose, self._pose.pose_covariance, relative(last.pose, start.pose),
                                       _errors_between(start, last))
            last = Moving(last.stamp, pose, covariance, last.velocity, last.velocity_covariance)
        return _ahead(last, time, commands)

    def _find_start(self) -> None:
        """Finds the odometry at the time of the pose, between two messages."""
        if self._pose is None or self._start is not None or not self._odometry:
            return
        stamp, known = self._pose.stamp, self._odometry
        if not known[0].stamp <= stamp <= known[-1].stamp:
            return
        after = bisect_left(known, stamp, key=lambda each: each.stamp)
        if known[after].stamp == stamp:
            self._start = known[after]
            return
        one, two = known[after - 1], known[after]
        share = (stamp - one.stamp) / (two.stamp - one.stamp)
        pose = composed(one.pose, relative(two.pose, one.pose) * share)
        covariance = (1 - share) * one.pose_covariance + share * two.pose_covariance
        self._start = Moving(stamp, pose, covariance, two.velocity, two.velocity_covariance)


def _check_order(stamp: int, newest: int) -> None:
    if stamp < newest:
        raise ValueError(f"found a stamp that is {(newest - stamp) / SECOND:.3g} s older than one before, expected that time "
                         "goes on")


def _errors_between(start: Moving, end: Moving) -> Array:
    """Covariance of the motion between two poses of odometry, in the frame of the first one.

    Odometry adds independent errors to those that it has already, which the motion carries on. If its covariances can't
    have come about like that, for example because they never change, only the growth of variances counts.
    """
    _, grown = carried(start.pose, start.pose_covariance, relative(end.pose, start.pose), np.zeros((3, 3)))
    added = end.pose_covariance - grown
    if np.linalg.eigvalsh(added)[0] < -_ROUNDING * max(float(np.abs(grown).max()), 1e-12):
        added = np.diag(np.maximum(0, np.diag(end.pose_covariance - start.pose_covariance)))
    back = rotation(-start.pose[2])
    return repaired(back @ added @ back.T)


def _ahead(measured: Moving, time: int, commands: list[Command]) -> Moving:
    """Carries a measurement on to a later time."""
    pose, covariance, velocity = measured.pose, measured.pose_covariance, measured.velocity
    now = measured.stamp
    later = [each for each in commands if now <= each.since < time]
    if now < time and not (later and later[0].since == now):
        later.insert(0, Command(now, velocity))
    for each, end in zip(later, [each.since for each in later[1:]] + [time]):
        seconds, velocity = (end - each.since) / SECOND, each.velocity
        pose, covariance = carried(pose, covariance, motion(velocity, seconds),
                                   measured.velocity_covariance * seconds**2)
    return Moving(max(now, time), pose, covariance, velocity, measured.velocity_covariance)
