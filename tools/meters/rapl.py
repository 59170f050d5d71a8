# SPDX-License-Identifier: GPL-2.0-or-later
"""RAPL, the energy counters of Intel and AMD processors, through Linux's powercap files.

A zone is a folder /sys/class/powercap/intel-rapl:N (a package, or "psys") or intel-rapl:N:M (a part
of package N: core, uncore, dram). AMD's processors use the same names. The folders intel-rapl-mmio
count the same packages again and are ignored.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from .clock import Clock
from .files import read_text, read_whole_number
from .reading import MeterError, explain
from .sensors import Sensor, SensorMeter, counter

FOLDER = Path("sys/class/powercap")
ZONE = re.compile(r"intel-rapl:\d+(:\d+)*")
MICRO = 1e-6
# Upper limit for a zone: today's largest processors are specified for 500 W.
MOST_WATTS = 2000.0
UPDATE_SECONDS = 0.001
LEAST_RANGE = 100.0  # joules; real ranges are at least 65 kJ
PSYS_NOTE = "what psys covers depends on the board's maker: compare it with a wall meter"


@dataclass(frozen=True)
class Zone:
    """An energy counter."""

    folder: Path
    name: str  # package-0, package-1-die-0, psys, core, ...

    def is_top(self) -> bool:
        """True unless the zone is part of another one."""
        return self.folder.name.count(":") == 1

    def is_package(self) -> bool:
        """True for a whole processor, or one of its dies."""
        return self.name.startswith("package")

    def sensor(self) -> Sensor:
        """Raises OSError or ValueError if the counter's range is unknown."""
        path = self.folder / "max_energy_range_uj"
        wrap = read_whole_number(path)
        if wrap * MICRO < LEAST_RANGE:
            raise ValueError(f"{path}: found {wrap}, expected at least {LEAST_RANGE / MICRO:.0f}")
        return counter(f"RAPL {self.name}", lambda: read_whole_number(self.folder / "energy_uj"),
                       scale=MICRO, wrap=wrap, most_watts=MOST_WATTS,
                       update_seconds=UPDATE_SECONDS, may_rest=not self.is_top())


def find(root: Path, clock: Clock) -> list[SensorMeter]:
    """Meters for the sum of the packages, each package, psys, and the parts of packages."""
    zones = find_zones(root)
    packages = [zone for zone in zones if zone.is_package()]
    meters = [make_meter("rapl", packages, clock)] if packages else []
    names = dict.fromkeys(zone.name for zone in sorted(zones, key=lambda zone: not zone.is_top()))
    for name in names:
        meters.append(make_meter(f"rapl:{name}", [z for z in zones if z.name == name], clock))
    return meters


def find_zones(root: Path) -> list[Zone]:
    """All zones, ordered by number."""
    zones = []
    for folder in (root / FOLDER).glob("*"):
        if ZONE.fullmatch(folder.name):
            try:
                zones.append(Zone(folder, read_text(folder / "name")))
            except OSError:
                continue  # useless without a name
    return sorted(zones, key=lambda zone: [int(n) for n in zone.folder.name.split(":")[1:]])


def make_meter(spec: str, zones: list[Zone], clock: Clock) -> SensorMeter:
    """A meter of zones of one kind; parts of other zones are left out."""
    sensors, trouble = [], None
    for zone in without_parts(zones):
        try:
            sensors.append(zone.sensor())
        except (OSError, ValueError) as error:
            trouble = trouble or explain(error)
    name = zones[0].name
    scope = ("package" if zones[0].is_package() else "system" if name == "psys" else "rail")
    notes = (PSYS_NOTE,) if name == "psys" else ()
    # psys may count nothing, or less than the machine, so it is never chosen automatically.
    return SensorMeter(spec, scope, describe(spec, zones), clock, sensors, trouble=trouble,
                       automatic=name != "psys", notes=notes)


def without_parts(zones: list[Zone]) -> list[Zone]:
    """Removes zones within another one, whose energy includes theirs."""
    return [zone for zone in zones
            if not any(zone.folder.name.startswith(f"{other.folder.name}:") for other in zones)]


def describe(spec: str, zones: list[Zone]) -> str:
    """Describes what is counted."""
    if spec == "rapl":
        return "RAPL " + " + ".join(zone.name for zone in zones)
    of_how_many = f" of {len(zones)} packages" if len(zones) > 1 else ""
    return f"RAPL {zones[0].name}{of_how_many}"


def choose(argument: str, root: Path, clock: Clock) -> SensorMeter:
    """The meter for the spec "rapl" or "rapl:ARGUMENT"."""
    meters = find(root, clock)
    spec = f"rapl:{argument}" if argument else "rapl"
    if not meters:
        raise MeterError(f"meter '{spec}': found no zone in {root / FOLDER}, expected "
                         "intel-rapl:0 (containers and virtual machines have none)")
    for meter in meters:
        if meter.name == spec:
            return meter
    raise MeterError(f"meter '{spec}': found no such zone, expected one of "
                     + ", ".join(meter.name for meter in meters))
