# SPDX-License-Identifier: GPL-2.0-or-later
"""Computes the joules of a run from the values of a sensor."""

from __future__ import annotations

import math
from typing import Protocol

from .reading import NoFigure

JUMP_SECONDS = 0.5  # maximum seconds of energy in one update, because sources are sometimes late
MOST_GAP = 1.0  # maximum seconds between two samples of power for interpolation


class Track(Protocol):
    """Receives the values of a sensor in order; raises NoFigure at the first impossible one."""

    def add(self, time: float, value: float) -> None:
        """Adds a value and its time in seconds."""

    def joules(self) -> float:
        """Energy from the first value to the last."""


class CounterTrack:
    """A sensor that counts energy, modulo `wrap` unless it is None.

    Values are in units of `scale` joules. A decrease is either a wrap or a reset. It counts as a
    wrap if the resulting power is possible. So samples must be close enough together that no
    possible power could pass a whole range of the counter between them.
    """

    def __init__(self, scale: float, wrap: float | None, most_watts: float,
                 update_seconds: float) -> None:
        self._scale = scale
        self._wrap = wrap  # in units of `scale` joules
        self._most_watts = most_watts
        self._update_seconds = update_seconds
        self._last: tuple[float, float] | None = None
        self._sum: float = 0  # stays an integer if the values are integers

    def add(self, time: float, value: float) -> None:
        """Adds a value."""
        if value < 0 or not math.isfinite(value) or (self._wrap and value > self._wrap):
            raise NoFigure(f"read {value * self._scale:.6g} J, which is out of its range")
        if self._last is not None:
            self._sum += self._step(time - self._last[0], self._last[1], value)
        self._last = (time, value)

    def _step(self, seconds: float, old: float, new: float) -> float:
        # An update includes the energy since the previous update.
        possible = self._most_watts * (seconds + self._update_seconds) / self._scale
        most_step = possible + self._most_watts * JUMP_SECONDS / self._scale
        if self._wrap is None and new < old:
            raise NoFigure(f"went back from {old * self._scale:.6g} J to {new * self._scale:.6g} J "
                           "(a reset?)")
        if self._wrap is not None and possible >= self._wrap:
            raise NoFigure(f"could not be sampled for {seconds:.1f} s, in which it may have "
                           "wrapped more than once")
        step = new - old if new >= old else new - old + (self._wrap or 0)
        if step > most_step:
            what = (f"jumped by {step * self._scale:.6g} J" if new >= old else
                    f"went back from {old * self._scale:.6g} J to {new * self._scale:.6g} J")
            raise NoFigure(f"{what} within {seconds:.3g} s, which no load can do (a reset?)")
        return step

    def joules(self) -> float:
        """Energy so far."""
        return self._sum * self._scale


class PowerTrack:
    """A sensor of power in units of `scale` watts. Energy is the integral of the linear
    interpolation."""

    def __init__(self, scale: float, most_watts: float, most_gap: float = MOST_GAP) -> None:
        self._scale = scale
        self._most_watts = most_watts
        self._most_gap = most_gap
        self._last: tuple[float, float] | None = None
        self._joules = 0.0

    def add(self, time: float, value: float) -> None:
        """Adds a value."""
        watts = value * self._scale
        if not 0 <= watts <= self._most_watts:  # also false for NaN
            raise NoFigure(f"read {watts:.6g} W, expected 0 to {self._most_watts:g} W")
        if self._last is not None:
            seconds = time - self._last[0]
            if seconds > self._most_gap:
                raise NoFigure(f"could not be sampled for {seconds:.1f} s, expected at most "
                               f"{self._most_gap:g} s")
            self._joules += seconds * (self._last[1] + watts) / 2
        self._last = (time, watts)

    def joules(self) -> float:
        """Energy so far."""
        return self._joules
