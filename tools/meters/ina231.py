# SPDX-License-Identifier: GPL-2.0-or-later
"""The four power sensors of the Odroid XU3 and XU+E (the XU4 has none)."""

from __future__ import annotations

import atexit
import os
from dataclasses import dataclass
from pathlib import Path

from .clock import Clock
from .files import read_decimal, read_text, write_text
from .reading import MeterError, explain
from .sensors import SensorMeter, power

FOLDER = Path("sys/bus/i2c/drivers/INA231")
RAILS = {"40": "a15", "41": "memory", "44": "gpu", "45": "a7"}  # by address on the bus
OTHER_NAMES = {"big": "a15", "little": "a7", "mem": "memory"}
SETTLE_SECONDS = 2.0
UPDATE_SECONDS = 0.26
MOST_WATTS = 100.0  # far above the board's supply of 20 W


@dataclass(frozen=True)
class Rail:
    """One sensor."""

    folder: Path
    name: str

    def enable_file(self) -> Path:
        """File that contains "1" while the sensor is on."""
        return self.folder / "enable"

    def watts(self) -> float:
        """The present power; the sensor must be on."""
        return read_decimal(self.folder / "sensor_W")

    def trouble(self) -> str | None:
        """Reason why the sensor cannot be used, or None."""
        try:
            is_on = read_text(self.enable_file()) == "1"
            self.watts()
        except (OSError, ValueError) as error:
            return explain(error)
        if not is_on and not os.access(self.enable_file(), os.W_OK):
            return f"needs root: {self.enable_file()} can't be written"
        return None


class Ina231Access:
    """Switches on the sensors that are off, and off again at the end."""

    def __init__(self, rails: list[Rail], clock: Clock) -> None:
        self._rails = rails
        self._clock = clock
        self._switched_on: list[tuple[Rail, str]] = []  # with the value to restore

    def open(self) -> None:
        """Switches the sensors on, and waits until their first values are valid."""
        atexit.register(self.close)  # restores the sensors if the program ends during a run
        for rail in self._rails:
            before = read_text(rail.enable_file())
            if before != "1":
                self._switched_on.append((rail, before))
                write_text(rail.enable_file(), "1")
        if self._switched_on:
            self._clock.sleep(SETTLE_SECONDS)

    def close(self) -> None:
        """Restores the original state of the sensors."""
        atexit.unregister(self.close)
        error = None
        while self._switched_on:
            rail, before = self._switched_on.pop()
            try:
                write_text(rail.enable_file(), before)
            except OSError as problem:
                error = problem
        if error is not None:
            raise error

    def settling(self) -> float:
        """Seconds that open() takes."""
        try:
            is_on = all(read_text(rail.enable_file()) == "1" for rail in self._rails)
        except OSError:
            is_on = True  # open() fails immediately
        return 0.0 if is_on else SETTLE_SECONDS


def find_rails(root: Path) -> list[Rail]:
    """The sensors, ordered by address."""
    rails = []
    for folder in sorted((root / FOLDER).glob("*-00??"), key=lambda folder: folder.name[-2:]):
        if folder.name[-2:] in RAILS:
            rails.append(Rail(folder, RAILS[folder.name[-2:]]))
    return rails


def find(root: Path, clock: Clock) -> list[SensorMeter]:
    """The sum of the rails, and each rail."""
    rails = find_rails(root)
    if not rails:
        return []
    missing = set(RAILS.values()) - {rail.name for rail in rails}
    trouble = (f"{root / FOLDER} lacks the rail {', '.join(sorted(missing))}, so the sum would be "
               "incomplete" if missing else None)
    meters = [make_meter("ina231", rails, clock, trouble)]
    return meters + [make_meter(f"ina231:{rail.name}", [rail], clock, None) for rail in rails]


def make_meter(spec: str, rails: list[Rail], clock: Clock, trouble: str | None) -> SensorMeter:
    """A meter of one rail or of all."""
    for rail in rails:
        trouble = trouble or rail.trouble()
    sensors = [power(f"INA231 {rail.name}", rail.watts, scale=1.0, most_watts=MOST_WATTS,
                     update_seconds=UPDATE_SECONDS) for rail in rails]
    detail = "INA231 " + " + ".join(rail.name for rail in rails)
    return SensorMeter(spec, "rail", detail, clock, sensors, access=Ina231Access(rails, clock),
                       trouble=trouble)


def choose(argument: str, root: Path, clock: Clock) -> SensorMeter:
    """The meter for the spec "ina231" or "ina231:ARGUMENT"."""
    spec = f"ina231:{argument}" if argument else "ina231"
    wanted = f"ina231:{OTHER_NAMES.get(argument, argument)}" if argument else "ina231"
    meters = find(root, clock)
    if not meters:
        raise MeterError(f"meter '{spec}': found no sensor in {root / FOLDER} (the Odroid XU3 and "
                         "XU+E have them, the XU4 has none)")
    for meter in meters:
        if meter.name == wanted:
            return meter
    raise MeterError(f"meter '{spec}': found no such rail, expected one of "
                     + ", ".join(meter.name for meter in meters))
