# SPDX-License-Identifier: GPL-2.0-or-later
"""Temperature and clock of a chip: observes them during a run, and waits until the chip has cooled
down.

Boards slow down a chip that is hot or has a weak supply, and report it in different places of /sys.
The firmware of a Raspberry Pi sets flags. The kernel has cooling devices that limit the clock and
lower scaling_max_freq.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Iterable

from benchkit.machine import read_text
from meters.clock import Clock

PERIOD = 1.0  # seconds between two samples during a run
COOL_PERIOD = 5.0  # seconds between two samples while cooling down
STEADY_SECONDS = 60.0  # the chip counts as cool if its temperature has not fallen for so long
STEADY_CELSIUS = 0.5
MOST_COOLING = 600.0
COOL_CELSIUS = 50.0
SENSIBLE = -40.0, 150.0  # degrees Celsius; sensors that are off or broken report other values
FLAGS = ("low voltage", "clock capped by firmware", "throttled by firmware",
         "soft temperature limit")
SINCE_BOOT = 16  # shift of the flags that stay set until the next boot
LIMITERS = re.compile(r"cpufreq|devfreq|Processor")


@dataclass(frozen=True)
class Look:
    """A sample of the chip's state. Figures that the system does not report are NaN."""

    celsius: float  # of the hottest zone
    clock: float  # of the fastest processor, relative to its maximum
    limits: dict[str, float]  # scaling_max_freq of each processor
    flags: int  # of a Raspberry Pi
    limiters: tuple[str, ...]  # cooling devices that limit something now


def number_in(path: Path, base: int = 10) -> float:
    """The integer in a file; NaN if there is none."""
    try:
        return int(read_text(str(path)), base)
    except ValueError:
        return math.nan


class Chip:
    """Reads the state of this machine's chip from files below `root`."""

    def __init__(self, root: Path = Path("/")) -> None:
        thermal = root / "sys/class/thermal"
        self._zones = sorted(thermal.glob("thermal_zone*/temp"))
        self._clocks = sorted((root / "sys/devices/system/cpu").glob("cpu[0-9]*/cpufreq"))
        self._flags = sorted((root / "sys/devices/platform").glob("soc*/*:firmware/get_throttled"))
        self._limiters = [folder for folder in sorted(thermal.glob("cooling_device*"))
                          if LIMITERS.search(read_text(str(folder / "type")))]

    def celsius(self) -> float:
        """Temperature of the hottest zone."""
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
    """Describes the causes that slowed the chip down between the first sample and the last."""
    first, *rest = looks
    found: dict[str, None] = {}
    for look in (first, *rest):
        # Flags that were already set before the run are ignored.
        since = (look.flags >> SINCE_BOOT) & ~(first.flags >> SINCE_BOOT)
        for bit, name in enumerate(FLAGS):
            if (look.flags | since) >> bit & 1:
                found[name] = None
        found.update(dict.fromkeys(look.limiters))
        if any(limit < first.limits[cpu] for cpu, limit in look.limits.items()):
            found["clock limit lowered"] = None
    return list(found)


class HeatWatch:
    """Observes the chip during runs, and lets it cool down before them."""

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
        """Waits until the chip is cool or gets no cooler, at most MOST_COOLING seconds."""
        begun = self._clock.monotonic()
        history: list[float] = []
        steady = round(STEADY_SECONDS / COOL_PERIOD)
        while self._chip.celsius() > self._cool_celsius:  # never if there is no sensor
            history.append(self._chip.celsius())
            if len(history) > steady and history[-steady - 1] - min(history[-steady:]) \
                    < STEADY_CELSIUS:
                break
            if self._clock.monotonic() - begun + COOL_PERIOD > self._most_cooling:
                break
            self._clock.sleep(COOL_PERIOD)
        self._cooling = round(self._clock.monotonic() - begun, 1)

    def begin(self) -> None:
        """Call right before a run."""
        self._looks = []
        self._repeater = self._clock.repeat(PERIOD, self._take_look)
        self._repeater.start()

    def end(self) -> dict[str, object]:
        """Call right after the run; returns the columns of its record."""
        self._repeater.stop()
        looks = list(self._looks)
        if not looks:  # a sensor that hangs must not delay the run
            return {"throttled": "unknown: the sensors did not answer"}
        # The first sample shows an idle chip, whose clock may be low.
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
