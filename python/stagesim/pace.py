# SPDX-License-Identifier: GPL-2.0-or-later
"""When the steps of a world are due in real time."""

from __future__ import annotations

import math
import time


class Pace:
    """Counts the simulated seconds that are due.

    Real time that has passed stays counted when the speed changes and when the world pauses. So a client that changes
    them many times a second neither stops the clock of the world nor hurries it.

    Args:
        speed: simulated seconds for each real one; 0 and infinity: as many as can be, so that steps are always due.
        running: real time counts.
        lag: seconds of real time that are made up for. What is lost beyond them is lost: the world becomes slower.
    """

    def __init__(self, speed: float, running: bool, lag: float) -> None:
        self._speed, self._running, self._lag = speed, running, lag
        self.begin()

    def begin(self) -> None:
        """The world is at another time: no step is due."""
        self._due = 0.0  # simulated seconds
        self._counted = time.monotonic()

    def change(self, speed: float | None = None, running: bool | None = None) -> None:
        """From now on time passes at that speed, or not at all; None: as before."""
        self._count()
        self._speed = self._speed if speed is None else speed
        self._running = self._running if running is None else running

    def steps_due(self, dt: float) -> int:
        """How many steps of `dt` simulated seconds are due, if a speed says so."""
        self._count()
        # Time that the world can't keep up with is dropped; a whole step stays due.
        self._due = min(self._due, self._lag * self._speed + dt)
        return max(0, math.floor(self._due / dt + 1e-9))

    def is_due(self, dt: float) -> bool:
        """Whether a step of `dt` simulated seconds is due."""
        return self._running and (self.is_unlimited or self.steps_due(dt) > 0)

    def made(self, seconds: float) -> None:
        """Steps of so many simulated seconds have been made that were due."""
        if not self.is_unlimited:
            self._due -= seconds

    def wait(self, dt: float) -> float:
        """Seconds of real time until a step of `dt` simulated seconds is due; infinity in a pause."""
        if not self._running:
            return math.inf
        if self.is_unlimited:
            return 0.0
        self._count()
        return max(0.0, (dt - self._due) / self._speed)

    def passed(self, dt: float) -> float:
        """Simulated seconds since the last step, less than `dt`: as far as real time has come."""
        self._count()
        return min(max(0.0, self._due), 0.999 * dt)

    @property
    def is_unlimited(self) -> bool:
        """Steps are made as fast as can be."""
        return self._speed == 0 or math.isinf(self._speed)

    def _count(self) -> None:
        now = time.monotonic()
        if self._running and not self.is_unlimited:
            self._due += (now - self._counted) * self._speed
        self._counted = now
