# SPDX-License-Identifier: GPL-2.0-or-later
"""Energy of measurements, and how busy others keep the machine meanwhile."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import benchkit  # noqa: F401  pylint: disable=unused-import
from meters import Meter, MeterError, Reading, open_meter  # in tools, which benchkit has added to the path


class Energy:
    """The energy meter of this machine, if it has one that covers the measured device."""

    def __init__(self, spec: str, device: str) -> None:
        self._meter: Meter | None = None
        self.reason = "no meter"  # why there are no figures
        self.scope = ""
        if spec == "none":
            return
        try:
            meter = open_meter(spec)
        except MeterError:
            if spec != "auto":
                raise
            return
        if device == "cpu" and meter.scope == "GPU":
            self.reason = "no meter of the processor"
            return
        self._meter, self.scope = meter, meter.scope

    @contextmanager
    def measuring(self) -> Iterator[list[Reading]]:
        """Measures a block; the list has one reading afterwards, or none without a meter."""
        readings: list[Reading] = []
        if self._meter is None:
            yield readings
            return
        with self._meter.measuring() as measurement:
            yield readings
        if measurement.reading is not None:
            readings.append(measurement.reading)


class Others:
    """Measures the processor time that other programs use."""

    def __init__(self) -> None:
        self._busy, self._time = busy_seconds(), time.monotonic()

    def processors(self, own_seconds: float) -> float:
        """Returns the mean number of processors that others used since the beginning.

        `own_seconds` is the processor time of the measured process meanwhile.
        """
        wall = time.monotonic() - self._time
        return max(0.0, busy_seconds() - self._busy - own_seconds) / wall


def busy_seconds() -> float:
    """Processor time that all programs of the machine have used, seconds; 0 if unknown."""
    try:
        fields = [int(field) for field in Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()[1:]]
    except (OSError, ValueError):
        return 0.0
    user, nice, system, _, _, irq, softirq, steal = (fields + [0] * 8)[:8]
    return (user + nice + system + irq + softirq + steal) / os.sysconf("SC_CLK_TCK")
