# SPDX-License-Identifier: GPL-2.0-or-later
"""Heat and clock of a chip: what a run met, and waiting until the chip has cooled down.

Boards slow their chip down when it gets hot or when the supply is weak, and say so in different
places of /sys: the firmware of a Raspberry Pi has flags, the kernel has cooling devices that limit
the clock, and lowers scaling_max_freq while they do.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Iterable

from benchkit.machine import read_text
from meters.clock import Clock

PERIOD = 1.0  # seconds between two looks in a run
COOL_PERIOD = 5.0  # and while cooling
STEADY_SECONDS = 60.0  # for which it must not have fallen to count as as cool as it gets
STEADY_CELSIUS = 0.5
MOST_COOLING = 600.0
COOL_CELSIUS = 50.0
SENSIBLE = -40.0, 150.0  # degrees Celsius; sensors that are off or broken show others
FLAGS = ("low voltage", "clock capped by firmware", "throttled by firmware",
         "soft temperature limit")
SINCE_BOOT = 16  # the same flags, this many bits higher, stay set
LIMITERS = re.compile(r"cpufreq|devfreq|Processor")


@dataclass(frozen=True)
class Look:
    """The chip at one moment. A figure that the system does not tell is NaN."""

    celsius: float  # of the hottest zone
    clock: float  # of the fastest processor, relative to its greatest
    limits: dict[str, float]  # scaling_max_freq of each processor
    flags: int  # of a Raspberry Pi
    limiters: tuple[str, ...]  # cooling devices that limit something now


def number_in(path: Path, base: int = 10) -> float:
    """The whole number in a file; NaN where there is none."""
    try:
        return int(read_text(str(path)), base)
    except ValueError:
        return math.nan


class Chip:
    """Where the chip of this machine is to be looked at, below `root`."""

    def __init__(self, root: Path = Path("/")) -> None:
        thermal = root / "sys/class/thermal"
        self._zones = sorted(thermal.glob("thermal_zone*/temp"))
        self._clocks = sorted((root / "sys/devices/system/cpu").glob("cpu[0-9]*/cpufreq"))
        self._flags = sorted((root / "sys/devices/platform").glob("soc*/*:firmware/get_throttled"))
        self._limiters = [folder for folder in sorted(thermal.glob("cooling_device*"))
                          if LIMITERS.search(read_text(str(folder / "type")))]

    def celsius(self) -> float:
        """Of the hottest zone."""
        degrees = [number_in(zone) / 1000 for zone in self._zones]
        return max((d for d in degrees if SENSIBLE[0] < d < SENSIBLE[1]), default=math.nan)

    def look(self) -> Look:
        shares, limits = [], {}
        for folder in self._clocks:
            limits[folder.parent.name] = number_in(folder / "scaling_max_freq")
            shares.append(number_in(folder / "scaling_cur_freq") /
                          (number_in(folder / "cpuinfo_max_freq") or math.nan))
        flags = 0
        for file in self._flags:
            value = number_in(file, 16)
            flags |= 0 if math.isnan(value) else int(value)
        return Look(self.celsius(),
                    max((share for share in shares if not math.isnan(share)), default=math.nan),
                    limits, flags,
                    tuple(f"cooling by {read_text(str(folder / 'type'))}"
                          for folder in self._limiters if number_in(folder / "cur_state") > 0))


def throttling(looks: Iterable[Look]) -> list[str]:
    """What slowed the chip down between the first look and the last, in words."""
    first, *rest = looks
    found: dict[str, None] = {}
    for look in (first, *rest):
        # Flags that were set before the run say nothing of it.
        since = (look.flags >> SINCE_BOOT) & ~(first.flags >> SINCE_BOOT)
        for bit, name in enumerate(FLAGS):
            if (look.flags | since) >> bit & 1:
                found[name] = None
        found.update(dict.fromkeys(look.limiters))
        if any(limit < first.limits[cpu] for cpu, limit in look.limits.items()):
            found["clock limit lowered"] = None
    return list(found)


class HeatWatch:
    """Watches the chip around runs, and lets it cool down before."""

    def __init__(self, chip: Chip, clock: Clock, cool_celsius: float = COOL_CELSIUS,
                 most_cooling: float = MOST_COOLING) -> None:
        self._chip = chip
        self._clock = clock
        self._cool_celsius = cool_celsius
        self._most_cooling = most_cooling
        self._looks: list[Look] = []
        self._cooling = 0.0
        self._repeater = clock.repeat(PERIOD, self._take_look)

    def cool_down(self) -> None:
        """Waits until the chip is cool, gets no cooler, or has had its time."""
        begun = self._clock.monotonic()
        history: list[float] = []
        steady = round(STEADY_SECONDS / COOL_PERIOD)
        while self._chip.celsius() > self._cool_celsius:  # never where there is no sensor
            history.append(self._chip.celsius())
            if len(history) > steady and history[-steady - 1] - min(history[-steady:]) \
                    < STEADY_CELSIUS:
                break
            if self._clock.monotonic() - begun + COOL_PERIOD > self._most_cooling:
                break
            self._clock.sleep(COOL_PERIOD)
        self._cooling = round(self._clock.monotonic() - begun, 1)

    def begin(self) -> None:
        """Just before a run."""
        self._looks = []
        self._repeater = self._clock.repeat(PERIOD, self._take_look)
        self._repeater.start()

    def end(self) -> dict[str, object]:
        """Just after it: the columns of its record."""
        self._repeater.stop()
        looks = list(self._looks)
        if not looks:  # sensors that hang cost their figures, not the run's
            return {"throttled": "unknown: the sensors did not answer"}
        # The first look is that of a chip at rest, whose clock may be low.
        clocks = [look.clock for look in looks[1:-1] if not math.isnan(look.clock)]
        return {
            "celsius_before": looks[0].celsius, "celsius_after": looks[-1].celsius,
            "celsius_most": max((look.celsius for look in looks if not math.isnan(look.celsius)),
                                default=math.nan),
            "cooling_seconds": self._cooling, "clock_least": min(clocks, default=math.nan),
            "throttled": ", ".join(throttling(looks)),
        }

    def _take_look(self) -> None:
        self._looks.append(self._chip.look())
