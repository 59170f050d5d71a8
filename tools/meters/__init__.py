# SPDX-License-Identifier: GPL-2.0-or-later
"""Energy meters: what a run of a program costs in joules, as far as this machine can tell.

    with open_meter("auto").measuring() as measurement:
        ...
    print(measurement.reading.joules)

Meters are named by specs, which `tools/power --help` and benchmarks/power.md explain. A meter that
cannot be had raises MeterError when it is opened; from then on it never fails a run, but gives a
Reading without a figure that says why.
"""

from .reading import SCOPES, Meter, MeterError, MeterInfo, Reading
from .sources import list_meters, list_sources, open_meter

__all__ = ["SCOPES", "Meter", "MeterError", "MeterInfo", "Reading", "list_meters", "list_sources",
           "open_meter"]
