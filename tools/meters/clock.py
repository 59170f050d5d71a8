# SPDX-License-Identifier: GPL-2.0-or-later
"""Clocks and periodic actions. Tests replace the clock."""

from __future__ import annotations

import threading
import time
from typing import Callable

HANG_SECONDS = 5.0  # limit for reading a sensor, which may hang


class Repeater:
    """Performs an action immediately, then periodically in a thread, and once more at the end.

    The first and last time run in the thread as well, so that a sensor whose read never returns
    cannot block the run. The action must not raise.
    """

    def __init__(self, period: float, action: Callable[[], None],
                 hang_seconds: float = HANG_SECONDS) -> None:
        self._period = period
        self._action = action
        self._hang_seconds = hang_seconds
        self._first_done = threading.Event()
        self._stopping = threading.Event()
        # A daemon thread, so that a read that hangs cannot block the end of the program.
        self._thread = threading.Thread(target=self._work, name="energy meter", daemon=True)

    def start(self) -> bool:
        """Returns whether the first action ended in time."""
        self._thread.start()
        return self._first_done.wait(self._hang_seconds)

    def stop(self) -> bool:
        """Returns whether the last action ended in time; the thread has then ended as well."""
        self._stopping.set()
        # If the first action has not ended by now, waiting again is useless.
        self._thread.join(self._hang_seconds if self._first_done.is_set() else 0)
        return not self._thread.is_alive()

    def _work(self) -> None:
        self._action()
        self._first_done.set()
        due = time.monotonic() + self._period
        while not self._stopping.wait(max(0.0, due - time.monotonic())):
            self._action()
            due = max(due + self._period, time.monotonic())  # no burst after a slow action
        self._action()


class Clock:
    """The clocks of the machine, in seconds."""

    def monotonic(self) -> float:
        """For intervals: is never set, and stands still while the machine sleeps."""
        return time.monotonic()

    def epoch(self) -> float:
        """Time since 1970, as in the files of loggers."""
        return time.time()

    def suspended(self) -> float:
        """Time that the machine has slept since it was started."""
        if not hasattr(time, "CLOCK_BOOTTIME"):
            return 0.0
        return time.clock_gettime(time.CLOCK_BOOTTIME) - time.clock_gettime(time.CLOCK_MONOTONIC)

    def sleep(self, seconds: float) -> None:
        """Waits."""
        time.sleep(seconds)

    def repeat(self, period: float, action: Callable[[], None]) -> Repeater:
        """Returns an object that, once started, performs the action periodically."""
        return Repeater(period, action)
