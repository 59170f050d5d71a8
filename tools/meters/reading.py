# SPDX-License-Identifier: GPL-2.0-or-later
"""What every energy meter has in common: the Meter itself, and the Reading that it gives."""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Iterator

from .clock import Clock

# From the widest to the narrowest. "GPU" stands after "package" because a run without a GPU still
# needs its processor; "assumed" is no measurement, and never chosen unless asked for.
SCOPES = ("system", "package", "GPU", "rail", "assumed")
MOST_SLEEP = 0.1  # seconds of suspend in a run that still pass for jitter of the clocks


class MeterError(Exception):
    """A meter that cannot be had, in one line."""


@dataclass(frozen=True)
class Reading:
    """What a meter has to say about one run.

    `joules` and `watts` (the mean over the run) are None if there is no figure; the reason is then
    the first of the notes. `seconds` is the time that the joules cover, or, without a figure, the
    time from start to stop.
    """

    joules: float | None
    seconds: float
    watts: float | None
    scope: str
    meter: str
    samples: int
    notes: list[str] = field(default_factory=list)
    method: str = "counter"


@dataclass(frozen=True)
class MeterInfo:
    """One line of a list of meters: `state` is "usable", or says why the meter is not."""

    spec: str
    name: str
    scope: str
    state: str


class NoFigure(Exception):
    """The reason why a run has no figure, in words that fit into a note."""


@dataclass(frozen=True)
class Energy:
    """What a meter makes of a run: joules over seconds, from so many samples."""

    joules: float
    seconds: float
    samples: int
    notes: list[str] = field(default_factory=list)


class Measurement:
    """What `Meter.measuring` hands out; the reading is there once the block has ended."""

    reading: Reading | None = None


class Meter:
    """Measures the energy of a run between start() and stop(), as often as one likes.

    Neither of the two ever raises: whatever goes wrong becomes a Reading without a figure. Kinds of
    meters define _begin and _finish, which may raise, and _release, which undoes what _begin did.
    """

    method = "counter"

    def __init__(self, name: str, scope: str, detail: str, clock: Clock) -> None:
        self.name = name
        self.scope = scope
        self.detail = detail
        self.clock = clock
        self._running = False
        self._failure: str | None = None
        self._started = self._slept = 0.0

    def state(self) -> str:
        """"usable", or why the meter is not."""
        return "usable"

    def settling(self) -> float:
        """Seconds that start() will take until the source is ready."""
        return 0.0

    def start(self) -> None:
        """Begin a run. One that was never stopped is dropped."""
        if self._running:
            self.stop()
        self._running, self._failure = True, None
        try:
            self._begin()
        except Exception as error:  # a run must not fail for it
            self._failure = explain(error)
        self._slept = self.clock.suspended()
        self._started = self.clock.monotonic()

    def stop(self) -> Reading:
        """End the run."""
        if not self._running:
            return self._without_figure("stop() without start(): no figure", 0.0)
        seconds = self.clock.monotonic() - self._started
        slept = self.clock.suspended() - self._slept
        self._running = False
        energy = None
        try:
            if self._failure is None:
                energy = self._finish(seconds)
        except Exception as error:  # as above
            self._failure = explain(error)
        try:
            self._release()
        except Exception as error:  # as above
            self._failure = self._failure or explain(error)
        if self._failure is None and slept > MOST_SLEEP:
            self._failure = f"the machine was suspended for {slept:.1f} s of the run"
        if self._failure is not None or energy is None:
            return self._without_figure(f"{self._failure}: no figure", seconds)
        return self._with_figure(energy)

    @contextmanager
    def measuring(self) -> Iterator[Measurement]:
        """Measure what is done in the block of a `with` statement."""
        measurement = Measurement()
        self.start()
        try:
            yield measurement
        finally:
            measurement.reading = self.stop()

    def _begin(self) -> None:
        """Get ready, settle, and begin to measure last of all."""

    def _finish(self, seconds: float) -> Energy | None:
        """End the measurement of a run that took so many seconds."""
        raise NotImplementedError

    def _release(self) -> None:
        """Undo what _begin did, also if it broke off half-way."""

    def _without_figure(self, note: str, seconds: float) -> Reading:
        return Reading(None, seconds, None, self.scope, self.name, 0, [note], self.method)

    def _with_figure(self, energy: Energy) -> Reading:
        watts = energy.joules / energy.seconds if energy.seconds > 0 else math.nan
        if not (math.isfinite(watts) and watts > 0):
            return self._without_figure(
                f"{energy.joules:.6g} J in {energy.seconds:.6g} s is no possible result (a dead "
                "sensor, or a run too short for it): no figure", energy.seconds)
        return Reading(energy.joules, energy.seconds, watts, self.scope, self.name,
                       energy.samples, energy.notes, self.method)


def explain(error: Exception) -> str:
    """An exception in one line."""
    if isinstance(error, PermissionError) and error.filename:
        return f"needs root: {error.filename} can't be {what_failed(error)}"
    if isinstance(error, OSError) and error.filename:
        return f"{error.filename} can't be {what_failed(error)}: {error.strerror}"
    if isinstance(error, (MeterError, NoFigure, ValueError, OSError)):
        return " ".join(str(error).split())
    return f"unexpected {type(error).__name__}: {' '.join(str(error).split())}"


def what_failed(error: OSError) -> str:
    """"read", or "written" for the errors of files.write_text."""
    return "written" if getattr(error, "writing", False) else "read"
