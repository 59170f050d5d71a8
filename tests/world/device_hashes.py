#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Compares state hashes with and without an OpenCL device: all shipped worlds with both ray models, and the test worlds
of controllers.

    tests/world/device_hashes.py --seconds 60 --device gpu

It runs each world of worlds/ and tests/data/controllers once on the host and, --repeat times, with every step on the
device. Prints a table. Exit status: 0 if all hashes of a world are equal, 1 if not or if a run failed, 2 for a wrong
command line.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from hash_runs import KINDS, ROOT, Run, RunError, controller_worlds, hash_of, shipped_worlds


def read_command_line() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description="Compare state hashes on the host and on an OpenCL device, for every shipped "
                    "world and stock controller.")
    parser.add_argument("--binary", type=Path, default=ROOT / "build" / "release" / "bin" / "stage",
                        metavar="FILE", help="the program (default: build/release/bin/stage)")
    parser.add_argument("--seconds", type=int, default=60, metavar="N",
                        help="simulated seconds of each run (default: 60)")
    parser.add_argument("--device", default="gpu", help="as after --opencl= (default: gpu)")
    parser.add_argument("--repeat", type=int, default=2, metavar="N",
                        help="runs with the device (default: 2)")
    parser.add_argument("worlds", nargs="*", metavar="WORLD",
                        help="from the top of the source tree (default: all)")
    options = parser.parse_args()
    if options.seconds < 1 or options.repeat < 1:
        parser.error("--seconds and --repeat want a number from 1 on")
    return options


def runs_of(options: argparse.Namespace) -> list[Run]:
    """The runs to compare."""
    worlds = options.worlds or shipped_worlds()
    runs = [Run(world, options.seconds, kind) for world in worlds for kind in KINDS]
    if not options.worlds:
        runs += [Run(world, options.seconds) for world in controller_worlds()]
    return runs


def compare(options: argparse.Namespace, run: Run) -> bool:
    """A line of the table; true if all hashes are equal."""
    on_device = [f"--opencl={options.device}", "--opencl-always"]
    try:
        host = hash_of(options.binary, run, ["--threads", "1"])
        device = [hash_of(options.binary, run, on_device) for _ in range(options.repeat)]
    except RunError as error:
        print(f"FAILED     {error}", flush=True)
        return False
    same = set(device) == {host}
    print(f"{'same' if same else 'DIFFERENT':10} {run.world:48} {run.kind:8} {host} {' '.join(device)}",
          flush=True)
    return same


def main() -> int:
    options = read_command_line()
    print(f"{options.seconds} s of each world: host, then {options.repeat} x {options.device}")
    outcomes = [compare(options, run) for run in runs_of(options)]
    print(f"{sum(outcomes)} of {len(outcomes)} runs have the same state hashes")
    return 0 if all(outcomes) else 1


if __name__ == "__main__":
    sys.exit(main())
