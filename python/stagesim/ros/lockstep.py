# SPDX-License-Identifier: GPL-2.0-or-later
"""Lock-step: simulated time waits for the answers of clients."""

from __future__ import annotations

import time
from typing import Iterable


class Lockstep:
    """Tracks which clients must still answer before the next step.

    The answer for a robot is a command with the current time of the world as stamp. The answer for any other name
    is such a message on the topic `done`. Answers with another stamp, and unexpected ones, are ignored.

    Args:
        names: robots and other clients that must answer.
        interval: microseconds of simulated time between answers; 0: after each step. No answer is expected at
            time 0, because sensors have not measured yet.
    """

    def __init__(self, names: Iterable[str] = (), interval: int = 0) -> None:
        self.names = frozenset(names)
        self._interval = interval
        self._missing: set[str] = set()
        self._since = time.monotonic()

    @property
    def is_used(self) -> bool:
        """True if there are names that must answer."""
        return bool(self.names)

    def begin(self, now: int, step: int) -> None:
        """Starts a new step at the time `now`; `step` is its duration (both microseconds)."""
        asked = now > 0 and (self._interval == 0 or now // self._interval > (now - step) // self._interval)
        self._missing = set(self.names) if asked else set()
        self._since = time.monotonic()

    def rename(self, names: Iterable[str]) -> None:
        """Changes the names that must answer; new ones must do so from the next step on."""
        self.names = frozenset(names)
        self._missing &= self.names

    def answer(self, name: str) -> bool:
        """Records an answer for the current time; returns whether it was expected."""
        if name not in self._missing:
            return False
        self._missing.discard(name)
        return True

    def missing(self) -> list[str]:
        """The sorted names that have not answered yet."""
        return sorted(self._missing)

    def is_late(self, seconds: float) -> bool:
        """Returns whether answers have been missing for `seconds` of real time; if so, starts counting anew."""
        if time.monotonic() - self._since < seconds:
            return False
        self._since = time.monotonic()
        return True


def split(text: str) -> list[str]:
    """Splits a string of names at commas and spaces."""
    return text.replace(",", " ").split()
