# SPDX-License-Identifier: GPL-2.0-or-later
"""Readable names of backends."""

from __future__ import annotations

import re

from benchkit.series.analysis import Series

# The figures of the paper.
PAPER = "Jones et al."
PAPER_FASTER = 1.82  # "up to 82 % faster": greatest ratio of r_ACC with OpenCL to that without
PAPER_ENERGY = 0.70  # "30 % less energy": best ratio of r_EPSS with OpenCL to that without
PAPER_ROBOTS = 100  # approximate number of robots below which its GPU was slower


def short_device(device: str) -> str:
    """Shortens `KIND NAME (PLATFORM)` of --stats without loss of clarity."""
    found = re.fullmatch(r"(gpu|cpu|accelerator) (.*) \((.*?)\)", device)
    if not found:
        return device
    if found[3] == "Portable Computing Language":
        return "PoCL on the CPU"
    return found[2]


def backend_name(series: Series, label: str) -> str:
    """Name for legends and tables."""
    record = next((r for r in series.measured if r.backend == label), None)
    if label.startswith("host"):
        threads = int(record.threads) if record else 0
        return "host, 1 thread" if threads == 1 else f"host, {threads} threads"
    if label == "auto":
        return "OpenCL where faster (auto)"
    name = short_device(record.device) if record else ""
    taken = [short_device(r.device) for r in series.measured
             if r.backend.startswith("cl:") and r.backend != label]
    return f"OpenCL, {name}" if name and name not in taken else f"OpenCL, {label[3:]} {name}"
