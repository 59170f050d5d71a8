# SPDX-License-Identifier: GPL-2.0-or-later
"""Simulated time that waits for those who said that they would answer."""

from __future__ import annotations

import time
from typing import Iterable


class Lockstep:
    """Who has to answer before the next step, and who has.

    A robot is answered for by a command that carries the time of the world; any other name by a message on
    the topic `done` that does. Answers for another time, or at a time when nobody is waited for, don't count.

    Args:
        names: who is waited for.
        interval: microseconds of simulated time between answers; 0: after each step. Nobody is waited for at
            time 0: sensors have not measured then.
    """

    def __init__(self, names: Iterable[str] = (), interval: int = 0) -> None:
        self.names = frozenset(names)
        self._interval = interval
        self._missing: set[str] = set()
        self._since = time.monotonic()

    @property
    def is_used(self) -> bool:
        """Somebody is waited for."""
        return bool(self.names)

    def begin(self, now: int, step: int) -> None:
        """The world is at another time, that of a new step (microseconds, and how long a step is)."""
        asked = now > 0 and (self._interval == 0 or now // self._interval > (now - step) // self._interval)
        self._missing = set(self.names) if asked else set()
        self._since = time.monotonic()

    def answer(self, name: str) -> bool:
        """That one has answered for the time that it is now; whether it was waited for."""
        if name not in self._missing:
            return False
        self._missing.discard(name)
        return True

    def missing(self) -> list[str]:
        """Who has not answered yet."""
        return sorted(self._missing)

    def is_late(self, seconds: float) -> bool:
        """Whether it has waited for so long, in real time; if so it begins to count again."""
        if time.monotonic() - self._since < seconds:
            return False
        self._since = time.monotonic()
        return True


def split(text: str) -> list[str]:
    """The names in a text, with commas or spaces between them."""
    return text.replace(",", " ").split()
