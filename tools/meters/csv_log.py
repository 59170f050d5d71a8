# SPDX-License-Identifier: GPL-2.0-or-later
"""Logs of an external logger: lines of time, volts and amps (or the voltage across a shunt).

A logger on this machine or in a shared folder may still be writing the log during a run. A log can
also be read later, for a known interval.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Iterator

from .clock import Clock
from .reading import Energy, Meter, MeterError

MOST_GAP = 1.0  # seconds between two lines of the interval
MOST_WATTS = 100_000.0
MOST_CLOCK_STEP = 0.05  # maximum adjustment of the machine's clock during a run, in seconds
PATIENCE = 3.0  # seconds to wait for a logger's last lines
PATIENCE_STEP = 0.25
COLUMNS = ("time", "volts", "amps")


class LogEndsEarly(MeterError):
    """The log does not reach the end of the interval yet; more lines may follow."""


@dataclass(frozen=True)
class Row:
    """A line; `cells` is unchecked text."""

    line: int
    time: float
    cells: tuple[str, str]


@dataclass(frozen=True)
class Log:
    """A file with its format."""

    path: Path
    offset: float = 0.0  # seconds to add to the file's times for times since 1970
    shunt: float | None = None  # ohms; None if the third column is amps

    def integrate(self, start: float, stop: float) -> tuple[float, int]:
        """Returns the joules from start to stop (seconds since 1970), and the number of lines
        between them.

        Raises MeterError with file and line if the log does not cover the interval or is invalid.
        """
        joules, samples = 0.0, 0
        before: tuple[Row, float] | None = None  # a row and its watts
        previous: Row | None = None
        for row in self._rows():
            if row.time > start:
                if previous is None:
                    raise self._error(row, f"the log begins {row.time - start:.3f} s after the "
                                           "run, expected one that covers it")
                before = before or (previous, self._watts(previous))
                watts = self._watts(row)
                joules += self._area(before, (row, watts), start, stop)
                before = (row, watts)
            samples += start <= row.time <= stop
            if row.time >= stop:
                return joules, samples
            previous = row
        if previous is None:
            raise LogEndsEarly(f"{self.path}: found no line of time, volts and amps")
        raise LogEndsEarly(f"{self.path}:{previous.line}: the log ends {stop - previous.time:.3f} "
                           "s before the run, expected one that covers it")

    def _area(self, left: tuple[Row, float], right: tuple[Row, float], start: float,
              stop: float) -> float:
        """Joules of the part of a segment within the interval."""
        (row0, watts0), (row1, watts1) = left, right
        length = row1.time - row0.time
        if length > MOST_GAP:
            raise self._error(row1, f"found a gap of {length:.3f} s, expected at most "
                                    f"{MOST_GAP:g} s")
        if length == 0:
            return 0.0
        begin, end = max(row0.time, start), min(row1.time, stop)
        slope = (watts1 - watts0) / length
        middle = watts0 + slope * ((begin + end) / 2 - row0.time)
        return middle * (end - begin)

    def _rows(self) -> Iterator[Row]:
        """The data lines, with valid times. An incomplete last line is skipped."""
        order, last = None, -math.inf
        with self.path.open(encoding="utf-8-sig", errors="replace", newline="\n") as file:
            for number, line in enumerate(file, 1):
                text = line.strip()
                if not text or text.startswith("#"):
                    continue
                if not line.endswith("\n"):
                    return  # incomplete: "12." may become "12.5"
                cells = cells_of(text)
                if order is None:
                    order = self._column_order(number, cells)
                    if not is_number(cells[0]):
                        continue
                row = self._row(number, cells, order)
                if row.time < last:
                    raise self._error(row, f"found time running backwards by {last - row.time:g} s")
                last = row.time
                yield row

    def _column_order(self, line: int, cells: list[str]) -> tuple[int, int, int]:
        """Reads the columns from the first line. A header with unknown names means the usual
        three columns."""
        names = [cell.strip('"').lower() for cell in cells]
        third = "drop" if self.shunt is not None else "amps"
        wanted = COLUMNS[:2] + (third,)
        if all(name in names for name in wanted):
            return (names.index(wanted[0]), names.index(wanted[1]), names.index(wanted[2]))
        if "drop" in names or (self.shunt is not None and "amps" in names):
            raise MeterError(f"{self.path}:{line}: found the columns {', '.join(names)}, expected "
                             f"time, volts, {third} (with shunt=OHMS a drop in volts, else amps)")
        return (0, 1, 2)

    def _row(self, line: int, cells: list[str], order: tuple[int, int, int]) -> Row:
        if len(cells) <= max(order):
            raise MeterError(f"{self.path}:{line}: found {len(cells)} columns, expected time, "
                             f"volts, {'amps' if self.shunt is None else 'drop'}")
        time = self._number(line, cells[order[0]], "a time in seconds")
        return Row(line, time + self.offset, (cells[order[1]], cells[order[2]]))

    def _watts(self, row: Row) -> float:
        volts = self._number(row.line, row.cells[0], "volts")
        third = self._number(row.line, row.cells[1], "amps" if self.shunt is None else "volts")
        watts = volts * (third if self.shunt is None else third / self.shunt)
        if watts < 0:
            raise self._error(row, f"found {watts:g} W, expected none below 0 (is the sign of the "
                                   "current the wrong way round?)")
        if watts > MOST_WATTS:
            raise self._error(row, f"found {watts:g} W, expected at most {MOST_WATTS:g} W (are the "
                                   "columns time, volts, amps?)")
        return watts

    def _number(self, line: int, text: str, what: str) -> float:
        value = float(text) if is_number(text) else math.nan
        if not math.isfinite(value):
            raise MeterError(f"{self.path}:{line}: found '{text[:20]}', expected {what}")
        return value

    def _error(self, row: Row, text: str) -> MeterError:
        return MeterError(f"{self.path}:{row.line}: {text}")


def cells_of(text: str) -> list[str]:
    """The cells of a line. Only one kind of separator splits it, so that decimal commas do not."""
    separator = next((sign for sign in ";\t," if sign in text), None)
    return [cell.strip() for cell in text.split(separator)]


def is_number(text: str) -> bool:
    """True if Python parses the text as a float, including NaN and infinities."""
    try:
        float(text)
    except ValueError:
        return False
    return True


class CsvMeter(Meter):
    """Integrates a log over exactly the time from start() to stop()."""

    method = "sampled"

    def __init__(self, spec: str, log: Log, clock: Clock) -> None:
        super().__init__(spec, "system", f"log {log.path}", clock)
        self._log = log
        self._epoch = 0.0

    def state(self) -> str:
        """"usable" if the file exists."""
        try:
            with self._log.path.open("rb"):
                return "usable"
        except OSError as error:
            return f"{self._log.path} can't be read: {error.strerror}"

    def _begin(self) -> None:
        self._epoch = self.clock.epoch()

    def _finish(self, seconds: float) -> Energy:
        step = self.clock.epoch() - self._epoch - seconds
        if abs(step) > MOST_CLOCK_STEP:
            raise MeterError(f"the clock was set by {step:.3f} s during the run, so its times do "
                             "not fit the log's")
        deadline = self.clock.monotonic() + PATIENCE
        while True:
            try:
                joules, samples = self._log.integrate(self._epoch, self._epoch + seconds)
                return Energy(joules, seconds, samples)
            except LogEndsEarly:
                if self.clock.monotonic() >= deadline:
                    raise
            self.clock.sleep(PATIENCE_STEP)


def parse_log(argument: str) -> Log:
    """Opens the log of the spec "csv:ARGUMENT": FILE[@EPOCH_OFFSET][?shunt=OHMS]."""
    name, question, option = argument.partition("?shunt=")
    shunt = None
    if question:
        shunt = float(option) if is_number(option) else math.nan
        if not 0 < shunt < math.inf:
            raise MeterError(f"meter 'csv:{argument}': found shunt={option}, expected ohms, such "
                             "as ?shunt=0.05")
    file, at, offset = name.rpartition("@")
    if not at or not is_number(offset):
        return Log(Path(name), shunt=shunt)
    if not math.isfinite(float(offset)):
        raise MeterError(f"meter 'csv:{argument}': found '@{offset}', expected the seconds since "
                         "the epoch at which the log's time is 0")
    return Log(Path(file), float(offset), shunt)


def choose(argument: str, clock: Clock) -> CsvMeter:
    """The meter for the spec "csv:ARGUMENT"."""
    log = parse_log(argument)
    if log.path == Path():
        raise MeterError("meter 'csv:': found no file, expected csv:FILE")
    return CsvMeter(f"csv:{argument}", log, clock)
