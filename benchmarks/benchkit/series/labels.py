# SPDX-License-Identifier: GPL-2.0-or-later
"""What readers see instead of the short names of backends."""

from __future__ import annotations

import re

from benchkit.series.analysis import Series

# The only figures of the paper that this project has.
PAPER = "Jones et al."
PAPER_FASTER = 1.82  # "up to 82 % faster": r_ACC with OpenCL over that without, at most
PAPER_ENERGY = 0.70  # "30 % less energy": r_EPSS with OpenCL over that without, at best
PAPER_ROBOTS = 100  # about here its GPU began to win


def short_device(device: str) -> str:
    """`KIND NAME (PLATFORM)` of --stats, as short as it stays clear."""
    found = re.fullmatch(r"(gpu|cpu|accelerator) (.*) \((.*?)\)", device)
    if not found:
        return device
    if found[3] == "Portable Computing Language":
        return "PoCL on the CPU"
    return found[2]


def backend_name(series: Series, label: str) -> str:
    """For legends and tables."""
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
