# SPDX-License-Identifier: GPL-2.0-or-later
"""Meters that only measure time: one without energy, and one with an assumed power."""

from __future__ import annotations

import math

from .clock import Clock
from .reading import Energy, Meter, MeterError

MOST_WATTS = 1e6


class NoMeter(Meter):
    """For runs whose energy does not matter."""

    method = "none"

    def __init__(self, clock: Clock) -> None:
        super().__init__("none", "none", "no meter", clock)

    def _finish(self, seconds: float) -> None:
        self._failure = "no meter was asked for"


class ConstantMeter(Meter):
    """Multiplies the time by an assumed power."""

    method = "assumed"

    def __init__(self, watts: float, clock: Clock) -> None:
        super().__init__(f"constant:{watts:g}", "assumed", f"assumed {watts:g} W", clock)
        self._watts = watts

    def _finish(self, seconds: float) -> Energy:
        return Energy(self._watts * seconds, seconds, 0,
                      [f"assumed, not measured: {self._watts:g} W throughout"])


def choose_constant(argument: str, clock: Clock) -> ConstantMeter:
    """The meter for the spec "constant:WATTS"."""
    try:
        watts = float(argument)
    except ValueError:
        watts = math.nan
    if not 0 < watts <= MOST_WATTS:
        raise MeterError(f"meter 'constant:{argument}': found '{argument}', expected watts, such "
                         "as constant:12.5")
    return ConstantMeter(watts, clock)
