# SPDX-License-Identifier: GPL-2.0-or-later
"""Paces the steps of a world by real time."""

from __future__ import annotations

import math
import time


class Pace:
    """Counts the simulated seconds that are due.

    Time that is already due is kept when the speed changes or the world pauses. Therefore a client that changes
    these many times per second does not slow down or speed up the world.

    Args:
        speed: simulated seconds per real second; 0 or infinity: unlimited, a step is always due.
        running: False: the world is paused.
        lag: max real time in seconds that the world catches up; beyond that it runs slower than `speed`.
    """

    def __init__(self, speed: float, running: bool, lag: float) -> None:
        self._speed, self._running, self._lag = speed, running, lag
        self.begin()

    def begin(self) -> None:
        """Starts anew, for example after the world was reset: no step is due."""
        self._due = 0.0  # simulated seconds
        self._counted = time.monotonic()

    def change(self, speed: float | None = None, running: bool | None = None) -> None:
        """Sets the speed and whether the world runs, from now on; None: unchanged."""
        self._count()
        self._speed = self._speed if speed is None else speed
        self._running = self._running if running is None else running

    def steps_due(self, dt: float) -> int:
        """Returns how many steps of `dt` simulated seconds are due. The speed must be limited."""
        self._count()
        # Drop time beyond the lag, but keep one whole step due.
        self._due = min(self._due, self._lag * self._speed + dt)
        return max(0, math.floor(self._due / dt + 1e-9))

    def is_due(self, dt: float) -> bool:
        """Returns whether a step of `dt` simulated seconds is due."""
        return self._running and (self.is_unlimited or self.steps_due(dt) > 0)

    def made(self, seconds: float) -> None:
        """Records that due steps of `seconds` simulated seconds in total have been made."""
        if not self.is_unlimited:
            self._due -= seconds

    def wait(self, dt: float) -> float:
        """Returns the real seconds until a step of `dt` simulated seconds is due; infinity if paused."""
        if not self._running:
            return math.inf
        if self.is_unlimited:
            return 0.0
        self._count()
        return max(0.0, (dt - self._due) / self._speed)

    def passed(self, dt: float) -> float:
        """Returns the simulated seconds that are due since the last step, always less than `dt`."""
        self._count()
        return min(max(0.0, self._due), 0.999 * dt)

    @property
    def is_unlimited(self) -> bool:
        """True if steps are made as fast as possible."""
        return self._speed == 0 or math.isinf(self._speed)

    def _count(self) -> None:
        now = time.monotonic()
        if self._running and not self.is_unlimited:
            self._due += (now - self._counted) * self._speed
        self._counted = now
