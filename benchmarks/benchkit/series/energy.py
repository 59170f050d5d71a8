# SPDX-License-Identifier: GPL-2.0-or-later
"""The energy meter, if there is one. Meters are in the optional package `meters`."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Protocol, Sequence


class EnergyError(Exception):
    """The reason in one line why there is no such meter."""


class Reading(Protocol):
    """The result of a meter for the time between start and stop."""

    joules: float | None
    watts: float | None
    seconds: float
    scope: str
    meter: str
    notes: str | Sequence[str]


class Meter(Protocol):
    """The interface of the package `meters`."""

    def start(self) -> None:
        """Begins a measurement."""

    def stop(self) -> Reading:
        """Ends the measurement."""


@dataclass
class NoReading:
    """A reading without energy."""

    joules: float | None = None
    watts: float | None = None
    seconds: float = 0.0
    scope: str = ""
    meter: str = "none"
    notes: str | Sequence[str] = ""


class NoMeter:
    """A meter that measures nothing and says so."""

    def start(self) -> None:
        """Does nothing."""

    def stop(self) -> NoReading:
        return NoReading()


class GuardedMeter:
    """Wraps a meter: if it fails, a run lacks energy figures but does not fail."""

    def __init__(self, meter: Meter, failures: tuple[type[Exception], ...]) -> None:
        self._meter = meter
        self._failures = failures
        self._reason = ""

    def start(self) -> None:
        self._reason = ""
        try:
            self._meter.start()
        except self._failures as error:
            self._reason = str(error) or type(error).__name__

    def stop(self) -> Reading:
        if not self._reason:
            try:
                return self._meter.stop()
            except self._failures as error:
                self._reason = str(error) or type(error).__name__
        return NoReading(meter="", notes=f"the energy meter failed: {self._reason}")


def open_energy_meter(choice: str) -> Meter:
    """Opens the meter called `choice`; for "auto" the best one, or none."""
    if choice == "none":
        return NoMeter()
    try:
        # Imported late, because series without energy must work where the meters cannot be
        # imported.
        power = importlib.import_module("meters")
    except ImportError as error:
        if choice == "auto":
            return NoMeter()
        raise EnergyError(f"--meter {choice}: energy meters cannot be loaded ({error})") from None
    try:
        return GuardedMeter(power.open_meter(choice), (power.MeterError, OSError))
    except power.MeterError as error:
        if choice == "auto":
            return NoMeter()
        raise EnergyError(f"--meter {choice}: {error}") from None


def try_meter(meter: Meter) -> Reading:
    """Takes a first reading, which gives the meter's name and scope."""
    meter.start()
    reading = meter.stop()
    if not reading.meter:
        raise EnergyError(notes_text(reading))
    return reading


def notes_text(reading: Reading) -> str:
    """Joins the notes of a meter, which may be one text or several."""
    notes = reading.notes
    if not notes:
        return ""
    return notes if isinstance(notes, str) else "; ".join(str(note) for note in notes)
