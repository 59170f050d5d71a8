# SPDX-License-Identifier: GPL-2.0-or-later
"""Energy meters: measure the joules that a run of a program costs, as far as this machine can.

    with open_meter("auto").measuring() as measurement:
        ...
    print(measurement.reading.joules)

Meters are named by specs, which `tools/power --help` and benchmarks/power.md explain. Opening a
meter that is not available raises MeterError. Once open, a meter never fails a run; if it cannot
measure, it returns a Reading without a figure, with the reason.
"""

from .reading import SCOPES, Meter, MeterError, MeterInfo, Reading
from .sources import list_meters, list_sources, open_meter

__all__ = ["SCOPES", "Meter", "MeterError", "MeterInfo", "Reading", "list_meters", "list_sources",
           "open_meter"]
