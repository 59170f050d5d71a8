# SPDX-License-Identifier: GPL-2.0-or-later
"""Compares batches of stagesim with other simulators, after checking that each of them does the work.

  python3 -m venv /tmp/peers && /tmp/peers/bin/pip install -r benchmarks/peers/requirements.txt
  PYTHONPATH=build/release/python /tmp/peers/bin/python benchmarks/peers -o benchmarks/results/NAME

The scene "navigation" is that of VMAS: round agents of 0.1 m radius without walls, with a lidar that detects other
agents, and with VMAS's rewards, observations and resets. The scene "cave" has rays in the map of worlds/cave.world,
compared with a plain caster over an occupancy grid. Simulators run in turns, each in its own process.

A missing simulator gets a row "not installed". The exit status is 1 if a row fails its checks.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from . import caster, table
from .energy import Energy, MeterError
from .rows import Race, Rounds, Row, cast_rows
from .simulators import PEERS, Peer
from .task import Task

ENVIRONMENTS = (1, 64, 1024, 4096, 16384)
RECORDED = ("seconds", "repeats", "threads", "device", "meter")  # options in the results


def numbers(text: str) -> list[int]:
    """Parses whole numbers separated by commas, each at least 1."""
    found = [int(word) for word in text.split(",")]
    if min(found) < 1:
        raise argparse.ArgumentTypeError(f"found {min(found)}, expected 1 or more")
    return found


def options_of(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Parses the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="print the simulators and whether they are installed")
    parser.add_argument("--peer", action="append", choices=[peer.name for peer in PEERS],
                        help="measure only this simulator; can be repeated (default: all)")
    parser.add_argument("--scene", action="append", choices=("navigation", "cave"),
                        help="only this scene (default: both)")
    parser.add_argument("--agents", type=numbers, default=[4], help="per environment, separated by commas (default 4)")
    parser.add_argument("--envs", type=numbers, default=list(ENVIRONMENTS),
                        help="numbers of environments, separated by commas (default 1,64,1024,4096,16384)")
    parser.add_argument("--rays", type=int, default=12, help="of each lidar (default %(default)s)")
    parser.add_argument("--reach", type=float, default=0.35, help="range of the lidars in metres (default %(default)s)")
    parser.add_argument("--apart", action="store_true",
                        help="environments end their episodes at different times, not all at once")
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu",
                        help="where VMAS computes and where tensors are (default %(default)s)")
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)), help="(default: all processors)")
    parser.add_argument("--seconds", type=float, default=3,
                        help="minimum duration of a measurement, which has whole episodes (default %(default)s)")
    parser.add_argument("--repeats", type=int, default=3, help="measurements of each row (default %(default)s)")
    parser.add_argument("--meter", default="auto", help="energy meter as in tools/power, or none (default %(default)s)")
    parser.add_argument("-o", "--output", type=Path, help="folder to write peers.md and peers.json to")
    return parser.parse_args(arguments)


def print_list() -> None:
    """Prints the simulators."""
    for peer in PEERS:
        state = f"not installed: {peer.missing()}" if peer.missing() else f"{peer.version()} installed".strip()
        most = f", up to {peer.most_envs} environments" if peer.most_envs < 1 << 20 else ""
        print(f"{peer.name:12} {peer.title}: {state}{most}{', cpu and cuda' if peer.cards else ', cpu'}")
    state = f"not installed: {caster.missing()}" if caster.missing() else "installed"
    print(f"{'caster':12} plain caster with numba, in the scene cave: {state}")


def peers_for(options: argparse.Namespace, envs: int) -> list[Peer]:
    """The simulators that are measured with so many environments."""
    return [peer for peer in PEERS if envs <= peer.most_envs and (not options.peer or peer.name in options.peer)
            and (options.device == "cpu" or peer.cards)]


def results(options: argparse.Namespace, rounds: Rounds) -> Iterator[list[Row]]:
    """Yields the rows of one task after the other."""
    scenes = options.scene or ["navigation", "cave"]
    common = Task(rays=options.rays, reach=options.reach, apart=options.apart)
    for agents in options.agents if "navigation" in scenes else []:
        for envs in options.envs:
            task = replace(common, agents=agents, envs=envs)
            yield Race(task, peers_for(options, envs), options.device, options.threads, rounds).run()
    if "cave" in scenes and options.device == "cpu" and not options.peer:
        yield cast_rows(caster.CastTask(), options.threads, rounds)


def say(text: str) -> None:
    """Tells what is being done."""
    if sys.stderr.isatty():
        print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the program; returns the exit status."""
    options = options_of(arguments)
    if options.list:
        print_list()
        return 0
    try:
        energy = Energy(options.meter, options.device)
    except MeterError as error:
        print(f"peers: {error}", file=sys.stderr)
        return 2
    rows: list[Row] = []
    facts = table.conditions({name: getattr(options, name) for name in RECORDED})
    print(table.head(), flush=True)
    for some in results(options, Rounds(options.repeats, options.seconds, energy, say)):
        say("")
        print("\n".join(map(table.line, some)), flush=True)
        rows += some
        if options.output:
            table.write(options.output, rows, facts)
    if not any(row.measured for row in rows):
        print("peers: nothing was measured", file=sys.stderr)
        return 1
    return 1 if any(row.failures for row in rows) else 0
