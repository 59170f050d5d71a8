# SPDX-License-Identifier: GPL-2.0-or-later
"""Common parts of all energy meters: the Meter itself, and its result, a Reading."""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Iterator

from .clock import Clock

# From the widest to the narrowest. "GPU" follows "package" because a run without a GPU still needs
# its processor. "assumed" is no measurement and must be requested explicitly.
SCOPES = ("system", "package", "GPU", "rail", "assumed")
MOST_SLEEP = 0.1  # seconds of suspend in a run that may be jitter of the clocks


class MeterError(Exception):
    """The reason in one line why a meter is not available."""


@dataclass(frozen=True)
class Reading:
    """Result of a meter for one run.

    `joules` and `watts` (the mean over the run) are None if there is no figure; the first note then
    gives the reason. `seconds` is the time that the joules cover or, without a figure, the time
    from start to stop.
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
    """An entry in a list of meters. `state` is "usable", or the reason why the meter is not."""

    spec: str
    name: str
    scope: str
    state: str


class NoFigure(Exception):
    """The reason why a run has no figure, worded as a note."""


@dataclass(frozen=True)
class Energy:
    """Measured energy of a run, with its duration and number of samples."""

    joules: float
    seconds: float
    samples: int
    notes: list[str] = field(default_factory=list)


class Measurement:
    """Result of `Meter.measuring`; its reading is set when the block has ended."""

    reading: Reading | None = None


class Meter:
    """Measures the energy of runs, each between start() and stop().

    Neither function raises: any failure becomes a Reading without a figure. Subclasses define
    _begin and _finish, which may raise, and _release, which undoes _begin.
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
        """"usable", or the reason why the meter is not."""
        return "usable"

    def settling(self) -> float:
        """Seconds that start() takes until the source is ready."""
        return 0.0

    def start(self) -> None:
        """Begins a run, and drops one that was not stopped."""
        if self._running:
            self.stop()
        self._running, self._failure = True, None
        try:
            self._begin()
        except Exception as error:  # a failing meter must not fail the run
            self._failure = explain(error)
        self._slept = self.clock.suspended()
        self._started = self.clock.monotonic()

    def stop(self) -> Reading:
        """Ends the run."""
        if not self._running:
            return self._without_figure("stop() without start(): no figure", 0.0)
        seconds = self.clock.monotonic() - self._started
        slept = self.clock.suspended() - self._slept
        self._running = False
        energy = None
        try:
            if self._failure is None:
                energy = self._finish(seconds)
        except Exception as error:  # a failing meter must not fail the run
            self._failure = explain(error)
        try:
            self._release()
        except Exception as error:  # a failing meter must not fail the run
            self._failure = self._failure or explain(error)
        if self._failure is None and slept > MOST_SLEEP:
            self._failure = f"the machine was suspended for {slept:.1f} s of the run"
        if self._failure is not None or energy is None:
            return self._without_figure(f"{self._failure}: no figure", seconds)
        return self._with_figure(energy)

    @contextmanager
    def measuring(self) -> Iterator[Measurement]:
        """Measures the block of a `with` statement."""
        measurement = Measurement()
        self.start()
        try:
            yield measurement
        finally:
            measurement.reading = self.stop()

    def _begin(self) -> None:
        """Prepares the source, waits until it is ready, and begins to measure last."""

    def _finish(self, seconds: float) -> Energy | None:
        """Ends the measurement of a run that took this many seconds."""
        raise NotImplementedError

    def _release(self) -> None:
        """Undoes _begin, even if that failed half-way."""

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
    """Describes an exception in one line."""
    if isinstance(error, PermissionError) and error.filename:
        return f"needs root: {error.filename} can't be {what_failed(error)}"
    if isinstance(error, OSError) and error.filename:
        return f"{error.filename} can't be {what_failed(error)}: {error.strerror}"
    if isinstance(error, (MeterError, NoFigure, ValueError, OSError)):
        return " ".join(str(error).split())
    return f"unexpected {type(error).__name__}: {' '.join(str(error).split())}"


def what_failed(error: OSError) -> str:
    """The verb for an error: "written" for errors of files.write_text, or "read"."""
    return "written" if getattr(error, "writing", False) else "read"
