# SPDX-License-Identifier: GPL-2.0-or-later
"""A meter that reads one or several sensors of this machine in a thread and adds them up."""

from __future__ import annotations

import errno
from dataclasses import dataclass
from typing import Callable, Protocol

from .clock import HANG_SECONDS, Clock, Repeater
from .reading import Energy, Meter, NoFigure, explain
from .tracks import CounterTrack, PowerTrack, Track

SAMPLING_PERIOD = 0.1  # seconds, of power
COUNTER_PERIOD = 1.0  # at most: a counter loses nothing between two samples, but may vanish
WRAP_SAFETY = 4  # samples before the greatest possible power could have wrapped a counter
GONE = (errno.ENOENT, errno.ENODEV, errno.ENXIO)
# A run of so many updates of its source is that much more than its uncertainty at both ends.
COARSE_UPDATES = 20
SLOW_READ = 0.05  # share of the run that its first and last read may take without a note


@dataclass(frozen=True)
class Sensor:
    """One value that can be read, and what is known of it."""

    name: str
    read: Callable[[], float]  # raises OSError, which names a file, or ValueError
    new_track: Callable[[], Track]
    period: float  # seconds from one sample to the next
    counts: bool  # joules, rather than watts
    update_seconds: float  # between the source's own updates, or the time that it averages over
    may_rest: bool = True  # nothing at all used in a run is no sign of a dead sensor


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
    """What must be done before and after sensors are read."""

    def open(self) -> None:
        """Get ready; may take its time."""

    def close(self) -> None:
        """Undo open(), also if that broke off half-way or was never called."""

    def settling(self) -> float:
        """Seconds that open() would take."""


class Run:
    """One run of a SensorMeter: takes a round of all sensors whenever it is told to."""

    def __init__(self, sensors: list[Sensor], clock: Clock) -> None:
        self._sensors = sensors
        self._clock = clock
        self._tracks = [sensor.new_track() for sensor in sensors]
        self._times: tuple[float, float] = (0.0, 0.0)  # of the first and the last round
        self._slowest_end = [0.0, 0.0]  # how long these two took
        self._began = clock.monotonic()
        self._last_error: str | None = None  # of the last round, if it could not be read
        self._misses = 0
        self.rounds = 0
        self.failure: str | None = None  # once there is one, nothing more is read

    def take_round(self) -> None:
        """Read all sensors once. Never raises."""
        if self.failure is not None:
            return
        try:
            self._take_round()
        except NoFigure as reason:
            self.failure = str(reason)
        except Exception as error:  # would end the thread unseen
            self.failure = explain(error)

    def _take_round(self) -> None:
        before = self._clock.monotonic()
        values = self._read_all() or self._read_all()  # buses fail now and then; once is forgiven
        if values is None and self.rounds == 0:
            raise NoFigure(f"{self._last_error} (at the start of the run)")
        if values is None:
            self._misses += 1
            return
        after = self._clock.monotonic()
        # One time for all sensors: what each is off by is the same at both ends of the run.
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
        """None if that failed in a way that may pass."""
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
        """The result. Raises NoFigure."""
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
    """Adds up sensors. `trouble` says why it cannot be used, where that is known beforehand."""

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
        """"usable", or why the meter is not."""
        if self._trouble is not None:
            return self._trouble
        if self._access is not None:
            return "usable"  # who makes an access looks for trouble
        for sensor in self._sensors:
            try:
                sensor.read()
            except (OSError, ValueError) as error:
                return explain(error)
        return "usable"

    def settling(self) -> float:
        """Seconds that start() will take until the source is ready."""
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
        repeater, self._repeater = self._repeater, None  # left where _begin broke off
        if repeater is not None and not repeater.stop():
            self._hung = True
        # What hangs in a read would most likely hang in this, too.
        if self._access and not self._hung:
            self._access.close()
