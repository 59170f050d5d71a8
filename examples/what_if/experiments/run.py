#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Experiments with robots that decide by what-if, and with others. Writes tables in Markdown.

    python run.py corridor crossing --seeds 100 --jobs 16 --out tables.md

All figures but those of time are the same in each run on a machine."""

from __future__ import annotations

import argparse
import math
import os
import platform
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import corridor
import crossing
import ethical
import reliability

EXPERIMENTS: dict[str, Any] = {"corridor": corridor.EXPERIMENT, "crossing": crossing.EXPERIMENT, "samples": crossing.SAMPLES,
                               "ethical": ethical.EXPERIMENT, "reliability": reliability.EXPERIMENT}


def work(name: str, task: Any, patience: float) -> Any:
    """Does a part of an experiment in this process."""
    return EXPERIMENTS[name].work(task, patience)


def run(names: list[str], seeds: int, jobs: int, patience: float = math.inf) -> dict[str, dict[Any, Any]]:
    """The results of experiments, by name and part. Parts that take longest begin first."""
    with ProcessPoolExecutor(jobs) as pool:
        begun = {(name, task): pool.submit(work, name, task, patience)
                 for name in reversed(names) for task in EXPERIMENTS[name].tasks(seeds)}
        results: dict[str, dict[Any, Any]] = {name: {} for name in names}
        for (name, task), future in begun.items():
            results[name][task] = future.result()
    return results


def processor() -> str:
    """The name of the processor, if the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def main(arguments: list[str] | None = None) -> None:
    """Runs the experiments and writes the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="EXPERIMENT", help=f"any of {', '.join(EXPERIMENTS)} (default: all)")
    parser.add_argument("--seeds", type=int, default=100, help="trips of each robot, a tenth of the decisions of reliability")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes (default: one for each processor)")
    parser.add_argument("--patience", type=float, default=math.inf, help="the longest trip, simulated seconds")
    parser.add_argument("--watts", type=float, default=5.0, help="of a processor core, to estimate joules (default 5)")
    parser.add_argument("--out", type=Path, help="a file for the tables (default: the terminal)")
    options = parser.parse_args(arguments)
    names = options.names or list(EXPERIMENTS)
    if unknown := [name for name in names if name not in EXPERIMENTS]:
        parser.error(f"found {unknown[0]!r}, expected any of {', '.join(EXPERIMENTS)}")
    begin = time.perf_counter()
    results = run(names, options.seeds, options.jobs, options.patience)
    lines = [f"{options.seeds} seeds, {options.jobs} processes on {processor()}, {time.perf_counter() - begin:.0f} s; "
             f"joules are {options.watts:g} W times seconds."]
    for name in names:
        lines += ["", f"### {EXPERIMENTS[name].title}", "", *EXPERIMENTS[name].table(results[name], options.watts)]
    text = "\n".join(lines) + "\n"
    if options.out:
        options.out.write_text(text)
    else:
        print(text, end="")


if __name__ == "__main__":
    main()
