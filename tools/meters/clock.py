# SPDX-License-Identifier: GPL-2.0-or-later
"""Time, and things done again and again in time. Tests put another clock in its place."""

from __future__ import annotations

import threading
import time
from typing import Callable

HANG_SECONDS = 5.0  # a sensor that takes longer to be read is given up


class Repeater:
    """Does something at once, then every so often in a thread, and once more at the end.

    The first and the last time happen in the thread too, so that a sensor whose read never returns
    cannot hold up the run. The action must not raise.
    """

    def __init__(self, period: float, action: Callable[[], None],
                 hang_seconds: float = HANG_SECONDS) -> None:
        self._period = period
        self._action = action
        self._hang_seconds = hang_seconds
        self._first_done = threading.Event()
        self._stopping = threading.Event()
        # A daemon, so that a read that hangs cannot hold up the end of the program either.
        self._thread = threading.Thread(target=self._work, name="energy meter", daemon=True)

    def start(self) -> bool:
        """Whether the first action ended in time."""
        self._thread.start()
        return self._first_done.wait(self._hang_seconds)

    def stop(self) -> bool:
        """Whether the last action ended in time; the thread has ended then, too."""
        self._stopping.set()
        # Where the first action never ended, this one has had its time.
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
    """The time of the machine, in seconds."""

    def monotonic(self) -> float:
        """Of intervals: never set, stands still while the machine sleeps."""
        return time.monotonic()

    def epoch(self) -> float:
        """Since 1970, as loggers have it."""
        return time.time()

    def suspended(self) -> float:
        """For which the machine has slept since it was started."""
        if not hasattr(time, "CLOCK_BOOTTIME"):
            return 0.0
        return time.clock_gettime(time.CLOCK_BOOTTIME) - time.clock_gettime(time.CLOCK_MONOTONIC)

    def sleep(self, seconds: float) -> None:
        """Wait."""
        time.sleep(seconds)

    def repeat(self, period: float, action: Callable[[], None]) -> Repeater:
        """Something to be started that does the action every so often."""
        return Repeater(period, action)
