# SPDX-License-Identifier: GPL-2.0-or-later
"""The energy meter, if there is one. Meters are in the sub-package `power`, which is optional."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Protocol, Sequence


class EnergyError(Exception):
    """Why there is no such meter, in one line."""


class Reading(Protocol):
    """What a meter says of the time between its start and its stop."""

    joules: float | None
    watts: float | None
    seconds: float
    scope: str
    meter: str
    notes: str | Sequence[str]


class Meter(Protocol):
    """See the package `power`."""

    def start(self) -> None:
        """Begins a run."""

    def stop(self) -> Reading:
        """Ends it."""


@dataclass
class NoReading:
    """No energy."""

    joules: float | None = None
    watts: float | None = None
    seconds: float = 0.0
    scope: str = ""
    meter: str = "none"
    notes: str | Sequence[str] = ""


class NoMeter:
    """Measures nothing, and says so."""

    def start(self) -> None:
        """Nothing to start."""

    def stop(self) -> NoReading:
        return NoReading()


class GuardedMeter:
    """A meter whose failures cost the energy figures of a run, and nothing else."""

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
    """The meter that `choice` names; with "auto" the best one, or none."""
    if choice == "none":
        return NoMeter()
    try:
        # Only now: measuring without energy has to work where the meters cannot be loaded.
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
    """A first reading, which tells the meter's name and its scope."""
    meter.start()
    reading = meter.stop()
    if not reading.meter:
        raise EnergyError(notes_text(reading))
    return reading


def notes_text(reading: Reading) -> str:
    """The notes in one text; a meter may give a text or several."""
    notes = reading.notes
    if not notes:
        return ""
    return notes if isinstance(notes, str) else "; ".join(str(note) for note in notes)
