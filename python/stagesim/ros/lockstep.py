# SPDX-License-Identifier: GPL-2.0-or-later
"""Simulated time that waits for those who said that they would answer."""

from __future__ import annotations

import time
from typing import Iterable


class Lockstep:
    """Who has to answer before the next step, and who has.

    A robot is answered for by a command that carries the time of the world; any other name by a message on
    the topic `done` that does. Answers for another time than now are those of the past, and don't count.

    Args:
        names: who is waited for.
    """

    def __init__(self, names: Iterable[str] = ()) -> None:
        self.names = frozenset(names)
        self._answered: set[str] = set()
        self._since = time.monotonic()

    def begin(self) -> None:
        """The world is at another time: all answers are still to come."""
        self._answered.clear()
        self._since = time.monotonic()

    def answer(self, name: str) -> None:
        """That one has answered for the time that it is now."""
        self._answered.add(name)

    def missing(self) -> list[str]:
        """Who has not answered yet."""
        return sorted(self.names - self._answered)

    def is_late(self, seconds: float) -> bool:
        """Whether it has waited for so long, in real time; if so it begins to count again."""
        if time.monotonic() - self._since < seconds:
            return False
        self._since = time.monotonic()
        return True


def split(text: str) -> list[str]:
    """The names in a text, with commas or spaces between them."""
    return text.replace(",", " ").split()
