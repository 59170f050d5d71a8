# SPDX-License-Identifier: GPL-2.0-or-later
"""What readers see instead of the short names of backends, and numbers as they read them."""

from __future__ import annotations

import re

from harness.analysis import Series, Summary

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


def number(value: float) -> str:
    """Three significant digits, but never less than the whole number; thin spaces in thousands."""
    if value == 0:
        return "0"
    size = abs(value)
    if size >= 100:
        text = f"{value:,.0f}"
        return text.replace(",", " ") if size >= 10_000 else text.replace(",", "")
    if size < 0.001:
        return f"{value:.2e}"
    decimals = 1 if size >= 10 else 2 if size >= 1 else 3 if size >= 0.1 else 4
    return f"{value:.{decimals}f}"


def spread(value: Summary | None) -> str:
    """Median (least to greatest)."""
    if value is None:
        return ""
    if value.count == 1:
        return number(value.median)
    return f"{number(value.median)} ({number(value.least)} to {number(value.greatest)})"
