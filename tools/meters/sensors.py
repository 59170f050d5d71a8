# SPDX-License-Identifier: GPL-2.0-or-later
"""A meter that reads one or several sensors of this machine in a thread and adds them up."""

from __future__ import annotations

import errno
from dataclasses import dataclass
from typing import Callable, Protocol

from .clock import HANG_SECONDS, Clock, Repeater
from .reading import Energy, Meter, NoFigure, explain
from .tracks import CounterTrack, PowerTrack, Track

SAMPLING_PERIOD = 0.1  # seconds between samples of power
COUNTER_PERIOD = 1.0  # maximum seconds between samples of a counter; it loses nothing in between,
                      # but may vanish
WRAP_SAFETY = 4  # minimum number of samples per range of a counter at the maximum power
GONE = (errno.ENOENT, errno.ENODEV, errno.ENXIO)
# Runs shorter than this many updates of the source get a note, because of the uncertainty at both
# ends.
COARSE_UPDATES = 20
SLOW_READ = 0.05  # maximum fraction of the run that its first and last read may take without a note


@dataclass(frozen=True)
class Sensor:
    """A readable value and its properties."""

    name: str
    read: Callable[[], float]  # raises ValueError, or OSError with a file name
    new_track: Callable[[], Track]
    period: float  # seconds between samples
    counts: bool  # true for joules, false for watts
    update_seconds: float  # seconds between updates of the source, or that it averages over
    may_rest: bool = True  # 0 J in a run does not mean that the sensor is defective


def counter(name: str, read: Callable[[], float], *, scale: float, most_watts: float,
            update_seconds: float, wrap: float | None = None, may_rest: bool = False) -> Sensor:
    """A sensor that counts energy in units of `scale` joules, modulo `wrap` units."""
    period = COUNTER_PERIOD
    if wrap is not None:
        period = min(period, wrap * scale / most_watts / WRAP_SAFETY)
    return Sensor(name, read, lambda: CounterTrack(scale, wrap, most_watts, update_seconds),
                  period, True, update_seconds, may_rest)


def power(name: str, read: Callable[[], float], *, scale: float, most_watts: float,
          update_seconds: float, most_gap: float = 1.0) -> Sensor:
    """A sensor of power in units of `scale` watts."""
    return Sensor(name, read, lambda: PowerTrack(scale, most_watts, most_gap), SAMPLING_PERIOD,
                  False, update_seconds)


class Access(Protocol):
    """Actions before and after sensors are read."""

    def open(self) -> None:
        """Prepares the sensors; may take long."""

    def close(self) -> None:
        """Undoes open(), even if that failed half-way or was never called."""

    def settling(self) -> float:
        """Seconds that open() takes."""


class Run:
    """One run of a SensorMeter: reads all sensors on request."""

    def __init__(self, sensors: list[Sensor], clock: Clock) -> None:
        self._sensors = sensors
        self._clock = clock
        self._tracks = [sensor.new_track() for sensor in sensors]
        self._times: tuple[float, float] = (0.0, 0.0)  # of the first and the last round
        self._slowest_end = [0.0, 0.0]  # durations of these two
        self._began = clock.monotonic()
        self._last_error: str | None = None  # why the last round failed, if it did
        self._misses = 0
        self.rounds = 0
        self.failure: str | None = None  # after a failure, nothing is read any more

    def take_round(self) -> None:
        """Reads all sensors once. Never raises."""
        if self.failure is not None:
            return
        try:
            self._take_round()
        except NoFigure as reason:
            self.failure = str(reason)
        except Exception as error:  # otherwise it would end the thread silently
            self.failure = explain(error)

    def _take_round(self) -> None:
        before = self._clock.monotonic()
        values = self._read_all() or self._read_all()  # retries once, because buses fail
                                                       # occasionally
        if values is None and self.rounds == 0:
            raise NoFigure(f"{self._last_error} (at the start of the run)")
        if values is None:
            self._misses += 1
            return
        after = self._clock.monotonic()
        # All sensors share one time, so that the error of each is the same at both ends of the run.
        time = (before + after) / 2
        for sensor, track, value in zip(self._sensors, self._tracks, values):
            try:
                track.add(time, value)
            except NoFigure as reason:
                raise NoFigure(f"{sensor.name} {reason} after {self._age():.1f} s") from None
        self._last_error = None
        self.rounds += 1
        self._times = (self._times[0] if self.rounds > 1 else time, time)
        self._slowest_end[0 if self.rounds == 1 else 1] = after - before

    def _age(self) -> float:
        return self._clock.monotonic() - self._began

    def _read_all(self) -> list[float] | None:
        """Returns None after a failure that may be temporary."""
        values = []
        for sensor in self._sensors:
            try:
                values.append(sensor.read())
            except (OSError, ValueError) as error:
                if isinstance(error, OSError) and error.errno in GONE and self.rounds > 0:
                    raise NoFigure(f"{sensor.name} vanished after {self._age():.1f} s") from None
                self._last_error = explain(error)
                return None
        return values

    def energy(self) -> Energy:
        """Returns the result. Raises NoFigure."""
        if self.failure is not None:
            raise NoFigure(self.failure)
        if self._last_error is not None:
            raise NoFigure(f"{self._last_error} (at the end of the run)")
        seconds = self._times[1] - self._times[0]
        if seconds <= 0:
            raise NoFigure("the run took no time")
        for sensor, track in zip(self._sensors, self._tracks):
            if not sensor.may_rest and track.joules() == 0:
                raise NoFigure(f"{sensor.name} did not move in {seconds:.3g} s (it is updated "
                               f"about every {sensor.update_seconds:g} s)")
        return Energy(sum(track.joules() for track in self._tracks), seconds, self.rounds,
                      self._notes(seconds))

    def _notes(self, seconds: float) -> list[str]:
        notes = []
        update = max(sensor.update_seconds for sensor in self._sensors)
        if seconds < COARSE_UPDATES * update:
            notes.append(f"short run: the source is updated or averages over about {update:g} s, "
                         f"so the figure may be off by {min(1.0, update / seconds):.0%}")
        if self._misses:
            notes.append(f"{self._misses} of {self._misses + self.rounds} samples failed and were "
                         "bridged")
        if max(self._slowest_end) > SLOW_READ * seconds:
            notes.append(f"reading the source took {max(self._slowest_end):.2f} s, by which the "
                         "ends of the run are uncertain")
        return notes


class SensorMeter(Meter):
    """Adds up sensors. `trouble` is the reason why the meter cannot be used, if known in
    advance."""

    def __init__(self, name: str, scope: str, detail: str, clock: Clock, sensors: list[Sensor],
                 *, access: Access | None = None, trouble: str | None = None,
                 automatic: bool = True, notes: tuple[str, ...] = ()) -> None:
        super().__init__(name, scope, detail, clock)
        self.automatic = automatic  # may be chosen by the spec "auto"
        self._sensors = sensors
        self._access = access
        self._trouble = trouble
        self._notes = notes
        self._run = Run([], clock)
        self._repeater: Repeater | None = None
        self._hung = False
        self.method = "counter" if all(sensor.counts for sensor in sensors) else "sampled"

    def state(self) -> str:
        """"usable", or the reason why the meter is not."""
        if self._trouble is not None:
            return self._trouble
        if self._access is not None:
            return "usable"  # an Access reports problems itself
        for sensor in self._sensors:
            try:
                sensor.read()
            except (OSError, ValueError) as error:
                return explain(error)
        return "usable"

    def settling(self) -> float:
        """Seconds that start() takes until the source is ready."""
        return self._access.settling() if self._access else 0.0

    def _begin(self) -> None:
        self._repeater, self._hung = None, False
        if self._access:
            self._access.open()
        self._run = Run(self._sensors, self.clock)
        repeater = self.clock.repeat(min(sensor.period for sensor in self._sensors),
                                     self._run.take_round)
        in_time = repeater.start()
        self._repeater = repeater
        if not in_time:
            self._hang()

    def _finish(self, seconds: float) -> Energy:
        repeater, self._repeater = self._repeater, None
        if repeater is not None and not repeater.stop():
            self._hang()
        energy = self._run.energy()
        return Energy(energy.joules, energy.seconds, energy.samples,
                      energy.notes + list(self._notes))

    def _hang(self) -> None:
        self._hung = True
        raise NoFigure(f"{self.name} was not read within {HANG_SECONDS:g} s")

    def _release(self) -> None:
        repeater, self._repeater = self._repeater, None  # kept if _begin failed
        if repeater is not None and not repeater.stop():
            self._hung = True
        # If a read hangs, closing would most likely hang as well.
        if self._access and not self._hung:
            self._access.close()
