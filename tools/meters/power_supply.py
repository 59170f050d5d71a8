# SPDX-License-Identifier: GPL-2.0-or-later
"""Batteries that supply the machine, in /sys/class/power_supply of Linux.

Drivers report power_now (µW), or current_now (µA) and voltage_now (µV). Some count discharge as
negative. While a battery is charged or the mains help, its power does not show that of the machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from .clock import Clock
from .files import read_text, read_whole_number
from .reading import MeterError
from .sensors import SensorMeter, power

FOLDER = Path("sys/class/power_supply")
MICRO = 1e-6
MOST_WATTS = 1000.0
UPDATE_SECONDS = 10.0  # a guess: the kernel does not report the interval over which fuel gauges
                       # average


@dataclass(frozen=True)
class Battery:
    """A battery of the machine."""

    folder: Path

    @property
    def name(self) -> str:
        return self.folder.name

    def watts(self) -> float:
        """Discharging power. Raises ValueError while the battery is not discharging."""
        status = read_text(self.folder / "status")
        if status != "Discharging":
            raise ValueError(f"{self.folder / 'status'}: found '{status[:20]}', expected "
                             "Discharging: unplug the charger")
        if (self.folder / "power_now").exists():
            return abs(read_whole_number(self.folder / "power_now")) * MICRO
        return (abs(read_whole_number(self.folder / "current_now")) * MICRO
                * read_whole_number(self.folder / "voltage_now") * MICRO)


def is_battery(folder: Path) -> bool:
    """True for a battery of the machine; that of a device such as a mouse has the scope Device."""
    try:
        if read_text(folder / "type") != "Battery":
            return False
        return not (folder / "scope").exists() or read_text(folder / "scope") != "Device"
    except OSError:
        return False


def find(root: Path, clock: Clock) -> list[SensorMeter]:
    """A meter for the sum of the batteries, and one per battery if there are several."""
    batteries = [Battery(folder) for folder in sorted((root / FOLDER).glob("*"))
                 if is_battery(folder)]
    if not batteries:
        return []
    if len(batteries) == 1:
        return [make_meter("power_supply", "system", batteries, clock)]
    # The machine switches between its batteries, so only their sum covers the system.
    return [make_meter("power_supply", "system", batteries, clock)] + [
        make_meter(f"power_supply:{one.name}", "rail", [one], clock) for one in batteries]


def make_meter(spec: str, scope: str, batteries: list[Battery], clock: Clock) -> SensorMeter:
    """A meter of one battery or of all."""
    sensors = [power(f"battery {one.name}", one.watts, scale=1.0, most_watts=MOST_WATTS,
                     update_seconds=UPDATE_SECONDS) for one in batteries]
    detail = "battery " + " + ".join(one.name for one in batteries)
    # Gauges are slow and coarse, so they are never chosen automatically.
    return SensorMeter(spec, scope, detail, clock, sensors, automatic=False)


def choose(argument: str, root: Path, clock: Clock) -> SensorMeter:
    """The meter for the spec "power_supply" or "power_supply:ARGUMENT"."""
    spec = f"power_supply:{argument}" if argument else "power_supply"
    meters = find(root, clock)
    if not meters:
        raise MeterError(f"meter '{spec}': found no battery in {root / FOLDER}")
    for meter in meters:
        if meter.name == spec or (len(meters) == 1 and meter.detail == f"battery {argument}"):
            return meter
    raise MeterError(f"meter '{spec}': found no such battery, expected one of "
                     + ", ".join(meter.name for meter in meters))
