# SPDX-License-Identifier: GPL-2.0-or-later
"""Helpers for tests of energy meters: a fake clock, and folders like sysfs."""

from __future__ import annotations

import sys
import tempfile
import unittest
from pathlib import Path
from typing import Callable

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from meters.clock import Clock
from meters.nvml import NvmlError

EPOCH = 1_760_000_000.0  # start of the fake clock, seconds


class FalseRepeater:
    """Performs its action without a thread, whenever the fake clock passes its time."""

    def __init__(self, clock: FalseClock, period: float, action: Callable[[], None]) -> None:
        self.clock, self.period, self.action = clock, period, action
        self.due = 0.0

    def start(self) -> bool:
        self.clock.show()
        self.action()
        self.due = self.clock.now + self.period
        self.clock.running.append(self)
        return True

    def stop(self) -> bool:
        self.clock.running.remove(self)
        self.clock.show()
        self.action()
        return True


class FalseClock(Clock):
    """A clock that advances only on request. It calls `world` with the time before any sensor is
    read."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.set_by = 0.0
        self.slept = 0.0
        self.world: Callable[[float], None] = lambda now: None
        self.running: list[FalseRepeater] = []
        self.periods: list[float] = []

    def monotonic(self) -> float:
        return self.now

    def epoch(self) -> float:
        return EPOCH + self.now - 1000.0 + self.set_by

    def suspended(self) -> float:
        return self.slept

    def sleep(self, seconds: float) -> None:
        self.advance(seconds)

    def repeat(self, period: float, action: Callable[[], None]) -> FalseRepeater:
        self.periods.append(period)
        return FalseRepeater(self, period, action)

    def show(self) -> None:
        self.world(self.now)

    def advance(self, seconds: float) -> None:
        """Advances the clock and performs all actions that become due."""
        end = self.now + seconds
        while self.running:
            first = min(self.running, key=lambda repeater: repeater.due)
            if first.due > end + 1e-9:  # the sum of ten times 0.1 is not exactly 1
                break
            self.now = max(self.now, first.due)
            self.show()
            first.action()
            first.due += first.period
        self.now = max(self.now, end)
        self.show()

    def stall(self, seconds: float) -> None:
        """Advances the clock without performing actions, as if this process did not run."""
        self.now += seconds
        for repeater in self.running:
            repeater.due = max(repeater.due, self.now)


class FalseNvml:
    """Fake GPUs for NVML, each with a name, joules or None, and watts or None."""

    def __init__(self, *gpus: tuple[str, float | None, float | None]) -> None:
        self.gpus = list(gpus)
        self.inits = 0
        self.lost = False
        self.init_code = 0

    def init(self) -> None:
        if self.init_code:
            raise NvmlError("nvmlInit_v2", self.init_code)
        self.inits += 1

    def shutdown(self) -> None:
        self.inits -= 1

    def count(self) -> int:
        return len(self.gpus)

    def gpu_name(self, index: int) -> str:
        return self.gpus[index][0]

    def energy_mj(self, index: int) -> int:
        return self.value(index, 1)

    def power_mw(self, index: int) -> int:
        return self.value(index, 2)

    def value(self, index: int, column: int) -> int:
        if self.inits <= 0:
            raise NvmlError("call", 1)
        if self.lost:
            raise NvmlError("call", 15)
        value = self.gpus[index][column]
        if value is None:
            raise NvmlError("call", 3)
        return round(value * 1000)


class MeterTestCase(unittest.TestCase):
    """A folder that replaces the root of the file system, and a fake clock."""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory(prefix="power_test.")
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        self.clock = FalseClock()

    def write(self, name: str, value: object) -> Path:
        """Writes a file below the root, as in sysfs."""
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{value}\n", encoding="utf-8")
        return path

    def zone(self, number: str, name: str, joules: float = 0.0, wrap: float = 262143.32885,
             kind: str = "intel-rapl") -> Path:
        """Makes a zone of RAPL; returns its counter."""
        folder = f"sys/class/powercap/{kind}:{number}"
        self.write(f"{folder}/name", name)
        self.write(f"{folder}/max_energy_range_uj", round(wrap * 1e6))
        return self.write(f"{folder}/energy_uj", round(joules * 1e6))

    def chip(self, number: int, name: str, **values: object) -> Path:
        """Makes a chip of hwmon with files such as power1_input=12; returns its folder."""
        for file, value in {"name": name, **values}.items():
            self.write(f"sys/class/hwmon/hwmon{number}/{file}", value)
        return self.root / f"sys/class/hwmon/hwmon{number}"

    def assert_no_figure(self, reading: object, pattern: str) -> None:
        """Expects a reading without joules and watts, with a note that gives the reason."""
        self.assertIsNone(reading.joules, reading)
        self.assertIsNone(reading.watts, reading)
        self.assertRegex(reading.notes[0], pattern)
        self.assertTrue(reading.notes[0].endswith("no figure"), reading.notes)
        self.assertNotIn("\n", reading.notes[0])
