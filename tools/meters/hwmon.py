# SPDX-License-Identifier: GPL-2.0-or-later
"""Power and energy sensors of Linux's hwmon subsystem in /sys/class/hwmon.

A chip is a folder hwmonN with a file `name`. Its channel K has a label and some of energyK_input
(µJ), powerK_average and powerK_input (µW). The INA3221 instead has the voltage inK_input (mV) and
current currK_input (mA) of each of its three channels.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from .clock import Clock
from .files import read_text, read_whole_number
from .reading import MeterError
from .sensors import Sensor, SensorMeter, counter, power
from .tracks import MOST_GAP

FOLDER = Path("sys/class/hwmon")
MICRO = 1e-6
MOST_WATTS = 20_000.0
UPDATE_SECONDS = 1.0  # a conservative guess for drivers that do not report it
INA3221_CHANNELS = (1, 2, 3)
# Drivers whose channels cover a whole GPU, not only a rail of a board.
GPU_CHIPS = ("amdgpu", "i915", "nouveau", "xe")


@dataclass(frozen=True)
class Channel:
    """One sensor of a chip."""

    folder: Path
    chip: str
    label: str  # content of the label file, or else "power1", "energy1", "in1"
    number: int

    def file(self, what: str) -> Path:
        """Path of a file of this channel, such as .../hwmon3/power1_input for "power{}_input"."""
        return self.folder / what.format(self.number)

    def scope(self) -> str:
        """The scope of the channel: a rail, unless more is known about the chip."""
        if self.chip in GPU_CHIPS:
            return "GPU"
        if self.chip == "power_meter" or (self.chip, self.label) == ("corsairpsu", "power total"):
            return "system"
        if self.chip == "fam15h_power" or (
                self.chip == "amd_energy" and self.label.startswith("Esocket")):
            return "package"
        return "rail"

    def sensor(self) -> Sensor:
        """Prefers an energy counter if it can be read."""
        energy = self.file("energy{}_input")
        if energy.exists() and (can_be_read(energy) or not self.power_file().exists()):
            return counter(f"{self.chip}/{self.label}", lambda: read_whole_number(energy),
                           scale=MICRO, most_watts=MOST_WATTS,
                           update_seconds=self.update_seconds())
        name, path, seconds = f"{self.chip}/{self.label}", self.power_file(), self.update_seconds()
        if not path.exists():
            return power(name, self._read_product, scale=MICRO, most_watts=MOST_WATTS,
                         update_seconds=seconds)
        if path.name.endswith("average"):
            seconds = self.average_seconds()
        return power(name, lambda: read_whole_number(path), scale=MICRO, most_watts=MOST_WATTS,
                     update_seconds=seconds, most_gap=max(MOST_GAP, seconds))

    def power_file(self) -> Path:
        """Prefers the average, which misses nothing between two samples, unless its interval is
        too long."""
        average, momentary = self.file("power{}_average"), self.file("power{}_input")
        if average.exists() and (self.average_seconds() <= MOST_GAP or not momentary.exists()):
            return average
        return momentary

    def average_seconds(self) -> float:
        """Interval that powerK_average covers."""
        return seconds_in(self.file("power{}_average_interval"))

    def update_seconds(self) -> float:
        """Interval between updates of the chip's values."""
        return seconds_in(self.folder / "update_interval")

    def _read_product(self) -> float:
        """Power in µW: mV times mA."""
        return (read_whole_number(self.file("in{}_input"))
                * read_whole_number(self.file("curr{}_input")))


def seconds_in(path: Path) -> float:
    """Reads an interval in milliseconds; returns the default if the file is missing or has 0."""
    try:
        return read_whole_number(path) / 1000 or UPDATE_SECONDS
    except (OSError, ValueError):
        return UPDATE_SECONDS


def can_be_read(path: Path) -> bool:
    """True if the file can be read now."""
    try:
        read_text(path)
    except OSError:
        return False
    return True


def find_channels(root: Path) -> list[Channel]:
    """All channels of all chips except batteries, whose power may be that of the charger."""
    folders = sorted((root / FOLDER).glob("hwmon*"),
                     key=lambda folder: (len(folder.name), folder.name))
    channels = []
    for folder in folders:
        try:
            chip = read_text(folder / "name")
        except OSError:
            continue  # useless without a name
        if not chip.startswith("BAT"):
            channels += channels_of(folder, chip)
    return channels


def channels_of(folder: Path, chip: str) -> list[Channel]:
    """A chip's channels. Energy and power of one number are one channel unless their labels
    differ."""
    found: dict[tuple[int, str], Channel] = {}
    for path in sorted(folder.glob("*_*")):  # energy before power
        match = re.fullmatch(r"(energy|power)(\d+)_(input|average)", path.name)
        if match:
            add_channel(found, folder, chip, match[1], int(match[2]))
    if chip == "ina3221":
        for number in INA3221_CHANNELS:
            if (folder / f"in{number}_input").exists():
                add_channel(found, folder, chip, "in", number)
    return sorted(found.values(), key=lambda channel: channel.number)


def add_channel(found: dict[tuple[int, str], Channel], folder: Path, chip: str, kind: str,
                number: int) -> None:
    """Adds the channel of this kind and number unless it is known."""
    stem = f"{kind}{number}"
    try:
        label = read_text(folder / f"{stem}_label")
    except OSError:
        label = ""
    if not label and any(known == number for known, _ in found):
        return
    found.setdefault((number, label), Channel(folder, chip, label or stem, number))


def find(root: Path, clock: Clock) -> list[SensorMeter]:
    """A meter per channel, with unambiguous specs."""
    channels = find_channels(root)
    specs = [f"{channel.chip}/{channel.label}" for channel in channels]
    meters = []
    for channel, spec in zip(channels, specs):
        if specs.count(spec) > 1:
            spec = f"{channel.folder.name}/{channel.label}"
        meters.append(make_meter(f"hwmon:{spec}", channel, clock))
    return meters


def make_meter(spec: str, channel: Channel, clock: Clock) -> SensorMeter:
    """A meter of one channel."""
    detail = f"hwmon {channel.chip} {channel.label} ({channel.folder.name})"
    return SensorMeter(spec, channel.scope(), detail, clock, [channel.sensor()])


def choose(argument: str, root: Path, clock: Clock) -> SensorMeter:
    """The meter for "hwmon:ARGUMENT": CHIP, CHIP/LABEL, hwmonN, hwmonN/LABEL, or the only channel.

    Channels are never added up, because one channel of a chip often includes another.
    """
    spec = f"hwmon:{argument}" if argument else "hwmon"
    channels = find_channels(root)
    if not channels:
        raise MeterError(f"meter '{spec}': found no sensor of power or energy in {root / FOLDER}")
    chip, _, label = argument.partition("/")
    wanted = [channel for channel in channels
              if chip in ("", channel.chip, channel.folder.name) and label in ("", channel.label)]
    if len(wanted) == 1:
        return make_meter(spec, wanted[0], clock)
    known = ", ".join(meter.name for meter in find(root, clock))
    if not wanted:
        raise MeterError(f"meter '{spec}': found no such sensor, expected one of {known}")
    raise MeterError(f"meter '{spec}': found {len(wanted)} sensors that it could mean, expected "
                     f"one of {known}")
