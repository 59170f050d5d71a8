#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Compares the speed of the Python package with that of the program and the library, in alternating
runs.

  tools/test -R python_package       # builds what is needed
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/python_speed.py

Prints a Markdown table of medians, with minimum and maximum of the repeats in brackets. Ratios are medians
over the repeats, whose two runs are consecutive.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Callable

import numpy as np
import stagesim as st
from stagesim.env import StageVectorEnv

ROOT = Path(__file__).resolve().parents[1]
BUILD = Path(os.environ.get("STAGE_BINARY_DIR") or ROOT / "build" / "release")

Row = tuple[str, str, str]


def span(values: list[float], unit: str) -> str:
    """Formats median, minimum and maximum."""
    return (f"{statistics.median(values):.4g} {unit} "
            f"({min(values):.4g} to {max(values):.4g})")


def in_turn(repeats: int, one: Callable[[], float], other: Callable[[], float]) -> tuple[
        list[float], list[float], list[float]]:
    """Runs both alternately, each first in half of the repeats. Returns their results and the
    ratios."""
    ones, others = [], []
    for repeat in range(repeats):
        if repeat % 2:
            others.append(other())
        ones.append(one())
        if not repeat % 2:
            others.append(other())
    return ones, others, [a / b for a, b in zip(ones, others)]


def run(*command: str | Path) -> str:
    """Returns the standard output of a command."""
    return subprocess.run([str(part) for part in command], capture_output=True, text=True,
                          check=True).stdout


def crowd_steps(world_file: Path, threads: int, seconds: float, repeats: int) -> Row:
    """Steps per second of a self-driven crowd whose arrays are read in each step."""
    def package() -> float:
        world = st.World(world_file, threads=threads)
        fleet = world.fleet()
        scan = fleet.ranger(1)
        views = (fleet.pose, fleet.velocity, fleet.stalled, fleet.energy, scan.ranges,
                 scan.intensities)
        steps = round(seconds / world.dt)
        nearest = np.empty(len(fleet))
        start = time.perf_counter()
        for _ in range(steps):
            world.step()
            views[4].min(1, out=nearest)
        return steps / (time.perf_counter() - start)

    def program() -> float:
        text = run(BUILD / "bin" / "stage", "-g", "--no-progress", "--threads", str(threads),
                   "--duration", str(seconds), "--stats", "-", world_file)
        stats = json.loads(text)
        return stats["steps"] / stats["wall_seconds"]

    ours, theirs, ratios = in_turn(repeats, package, program)
    return (f"steps of 1000 robots in the cave, arrays read, {threads} threads",
            f"{span(ours, 'steps/s')}; the program {span(theirs, 'steps/s')}",
            f"ratio {span(ratios, '')}")


def batch_steps(worlds: int, steps: int, threads: int, seconds: float, repeats: int) -> Row:
    """Steps per second of all worlds, with poses and ranges updated."""
    arena = next(Path(folder) / "arena.world" for folder in st._paths.WORLDS
                 if (Path(folder) / "arena.world").exists())
    turns = ((np.arange(worlds)[:, None] * 7 + np.arange(5)[None] * 3) % 11 - 5) * 0.1

    def package() -> float:
        batch = st.Batch(arena, worlds, threads=threads)
        views = (batch.pose, batch.ranges)
        batch.cmd[..., 0] = 0.3
        batch.cmd[..., 2] = turns
        batch.step(n=20)
        made = 0
        start = time.perf_counter()
        while time.perf_counter() - start < seconds:
            batch.step(n=steps)
            made += steps
        assert len(views[0]) == worlds
        return made * worlds / (time.perf_counter() - start)

    def rows() -> float:
        return float(run(BUILD / "benchmarks" / "rows", arena, str(worlds), str(steps),
                         str(threads), str(seconds)).split()[-1])

    ours, theirs, ratios = in_turn(repeats, package, rows)
    return (f"{worlds} worlds of 5 robots of 32 rays, {steps} steps per call, {threads} threads",
            f"{span(ours, 'steps/s')}; rows in C++ {span(theirs, 'steps/s')}",
            f"ratio {span(ratios, '')}")


def env_steps(task: str, worlds: int, threads: int, seconds: float, repeats: int) -> Row:
    """Agent-steps per second of the vector environment, and its overhead over the batch."""
    rates, shares = [], []
    for _ in range(repeats):
        env = StageVectorEnv(worlds, task=task, threads=threads)
        in_batch = seconds_in_batch(env)
        env.reset(seed=1)
        actions = np.random.default_rng(1).uniform(-1, 1, (50, *env.action_space.shape)).astype(np.float32)
        for action in actions:
            env.step(action)
        made, before, start = 0, sum(in_batch), time.perf_counter()
        while time.perf_counter() - start < seconds:
            env.step(actions[made % 50])
            made += 1
        whole = time.perf_counter() - start
        rates.append(made * worlds * len(env.agents) / whole)
        shares.append(100 * (1 - (sum(in_batch) - before) / whole))
    return (f"environment {task}, {worlds} worlds of {len(env.agents)} agents, {env.task.steps} "
            f"steps per action, {threads} threads",
            span(rates, "agent steps/s"), f"{span(shares, '%')} of the time outside the batch")


def seconds_in_batch(env: StageVectorEnv) -> list[float]:
    """Returns a list to which the duration of each call of the batch is appended."""
    batch = env._episodes.batch
    taken: list[float] = []

    def timed(call: Callable[..., None]) -> Callable[..., None]:
        def wrapper(*arguments: Any, **named: Any) -> None:
            start = time.perf_counter()
            call(*arguments, **named)
            taken.append(time.perf_counter() - start)
        return wrapper

    for name in ("step", "reset", "teleport"):
        setattr(batch, name, timed(getattr(batch, name)))
    return taken


def cast_rays(spread: float | None, poses: int, rays: int, max_range: float, repeats: int) -> Row:
    """Millions of rays per second on one thread, around a robot or anywhere in the building."""
    world = st.World("hospital.world", threads=1)
    random = np.random.default_rng(1)
    start = np.concatenate([random.uniform([-260, -105], [260, 105], (poses, 2)) if spread is None
                            else random.normal([100, 60], spread, (poses, 2)),
                            random.uniform(-3, 3, (poses, 1))], axis=1)
    bearings = np.linspace(-np.pi, np.pi, rays, endpoint=False)
    out = np.empty((poses, rays))
    speeds = []
    for _ in range(repeats + 1):
        begin, calls = time.perf_counter(), 0
        while time.perf_counter() - begin < 0.5:
            world.cast(start, bearings, max_range, out=out)
            calls += 1
        speeds.append(calls * out.size / (time.perf_counter() - begin) / 1e6)
    where = "anywhere" if spread is None else f"within {spread:g} m"
    return (f"cast, hospital, {poses} poses {where}, {rays} rays of {max_range:g} m, 1 thread",
            span(speeds[1:], "M rays/s"), f"mean range {out.mean():.2f} m")


def import_seconds(repeats: int) -> Row:
    """Seconds of a process that imports the package, minus those of an empty process."""
    code = "import time; s = time.perf_counter(); import {}; print(time.perf_counter() - s)"
    ours, numpy, _ = in_turn(
        repeats, lambda: 1000 * float(run(sys.executable, "-c", code.format("stagesim"))),
        lambda: 1000 * float(run(sys.executable, "-c", code.format("numpy"))))
    return "import stagesim", f"{span(ours, 'ms')}; NumPy alone {span(numpy, 'ms')}", ""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--short", action="store_true", help="short runs, about a minute in total")
    options = parser.parse_args()
    repeats, seconds = (2, 0.5) if options.short else (options.repeats, 2.0)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        crowd = Path(folder) / "cave.world"
        run(ROOT / "tools" / "populate", "cave", "1000", "--seed", "1", "-o", crowd)
        for threads in (1, 2):
            rows.append(crowd_steps(crowd, threads, 10 * seconds, repeats))
    for steps in (1, 5, 50):
        for threads in (1, 2):
            rows.append(batch_steps(64, steps, threads, seconds, repeats))
    for task in ("Navigate", "Disperse"):
        for threads in (1, 2):
            rows.append(env_steps(task, 64, threads, seconds, repeats))
    for spread, poses, rays, reach in ((0.5, 4000, 60, 30), (5, 4000, 60, 30),
                                       (None, 4000, 60, 8), (None, 600, 360, 8),
                                       (None, 100000, 1, 8)):
        rows.append(cast_rays(spread, poses, rays, reach, repeats))
    rows.append(import_seconds(2 * repeats))
    print("| what | found | |\n|---|---|---|")
    for row in rows:
        print("| " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()
