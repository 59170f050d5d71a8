#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""How many agent-steps a second stagesim and VMAS (pypi.org/project/vmas, PyTorch) make, in turn, in one run.

  python3 -m venv /tmp/vmas && /tmp/vmas/bin/pip install vmas          # brings PyTorch along
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/against_vmas.py --vmas /tmp/vmas/bin/python

The world is that of VMAS's scenario "navigation", with its lidar on: round agents of 0.1 m without walls, 12 rays
of 0.35 m all around, steps of 0.1 s; here as a world file with octagons in cells of 2 cm. Both get new
random commands in each step and hand out the readings of all rays as one array. VMAS also computes rewards and
observations; forces and bounces, where Stage blocks robots that touch.

Each figure is the median of repeats, with the least and the most; the ratio that of neighbouring runs. `--device
cuda` has VMAS run on a GPU; stagesim stays on the processor.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Callable

REACH, RADIUS = 0.35, 0.1
CASES = [(4, 12, 1), (4, 12, 64), (4, 12, 1024), (4, 12, 4096), (4, 64, 64), (16, 12, 64), (16, 64, 64),
         (32, 32, 16)]  # agents, rays of each, environments
COMMANDS = 8  # that are made beforehand


def rate(step: Callable[[int], None], envs: int, agents: int, seconds: float) -> float:
    """Agent-steps a second."""
    for i in range(3):
        step(i)
    count, start = 0, time.perf_counter()
    while time.perf_counter() - start < seconds:
        step(count)
        count += 1
    return count * envs * agents / (time.perf_counter() - start)


def half_width(agents: int) -> float:
    """Of the square that agents are placed in, metres: VMAS's 1, more where they would not find room."""
    return max(1.0, 0.6 * math.sqrt(agents))


def circle(corners: int = 8) -> str:
    """A block of a world file."""
    points = [(0.5 + 0.5 * math.cos(2 * math.pi * i / corners), 0.5 + 0.5 * math.sin(2 * math.pi * i / corners))
              for i in range(corners)]
    return f"block( points {corners} " + " ".join(
        f"point[{i}] [{x:.4f} {y:.4f}]" for i, (x, y) in enumerate(points)) + " )"


def world_file(agents: int, rays: int) -> str:
    """The scenario as a world file: agents at places like those that VMAS draws."""
    side = math.ceil(math.sqrt(agents))
    half = half_width(agents)
    apart = 2 * half / side
    lines = ["resolution 0.02", "interval_sim 100", "quit_time 0",
             f"define lidar ranger( size [0.02 0.02 0.1] sensor( range [0 {REACH}] fov {360 - 360 / rays:.6f} "
             f"samples {rays} ) )",
             f"define agent position( size [{2 * RADIUS} {2 * RADIUS} 0.3] drive \"omni\" {circle()} alwayson 1 "
             "lidar( pose [0 0 0 180] alwayson 1 ) )"]
    for i in range(agents):
        x, y = (i % side + 0.5) * apart - half, (i // side + 0.5) * apart - half
        lines.append(f"agent( name \"a{i}\" pose [{x:.3f} {y:.3f} 0 {i * 77 % 360}] )")
    return "\n".join(lines) + "\n"


def measure_stage(envs: int, agents: int, rays: int, threads: int, seconds: float) -> float:
    """This simulator."""
    import numpy as np
    import stagesim as st

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "navigation.world"
        file.write_text(world_file(agents, rays))
        batch = st.Batch(file, envs, threads=threads)
    chance = np.random.default_rng(1)
    commands = chance.uniform(-1, 1, (COMMANDS, *batch.cmd.shape))
    ranges = batch.ranges
    assert ranges.shape == (envs, agents, rays)

    def step(i: int) -> None:
        batch.cmd[:] = commands[i % COMMANDS]
        batch.step()

    return rate(step, envs, agents, seconds)


def measure_vmas(envs: int, agents: int, rays: int, threads: int, seconds: float, device: str) -> float:
    """The other one."""
    import torch
    from vmas import make_env

    torch.set_num_threads(threads)
    env = make_env(scenario="navigation", num_envs=envs, device=device, continuous_actions=True, seed=1,
                   n_agents=agents, n_lidar_rays=rays, world_spawning_x=half_width(agents),
                   world_spawning_y=half_width(agents))
    env.reset()
    commands = [[torch.rand(envs, 2, device=device) * 2 - 1 for _ in range(agents)] for _ in range(COMMANDS)]

    def step(i: int) -> None:
        seen = env.step(commands[i % COMMANDS])[0]
        if device != "cpu":
            torch.cuda.synchronize()
        assert len(seen) == agents

    with torch.no_grad():
        return rate(step, envs, agents, seconds)


def measured(python: str, kind: str, options: argparse.Namespace) -> list[float]:
    """All cases, in a process of its own."""
    words = [python, __file__, "--measure", kind, "--threads", str(options.threads), "--seconds",
             str(options.seconds), "--device", options.device]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(done.stderr)
    rates: list[float] = json.loads(done.stdout.splitlines()[-1])
    return rates


def span(values: tuple[float, ...]) -> str:
    """Median, least and most."""
    return f"{statistics.median(values):,.0f} ({min(values):,.0f} to {max(values):,.0f})"


def compare(options: argparse.Namespace) -> None:
    """Prints a table in Markdown."""
    ours, theirs = [], []
    for _ in range(options.repeats):
        ours.append(measured(sys.executable, "stage", options))
        theirs.append(measured(options.vmas, "vmas", options))
    print("| agents | rays | environments | stagesim, agent-steps/s | VMAS | ratio |\n|---|---|---|---|---|---|")
    for (agents, rays, envs), one, other in zip(CASES, zip(*ours), zip(*theirs)):
        ratio = statistics.median(a / b for a, b in zip(one, other))
        print(f"| {agents} | {rays} | {envs} | {span(one)} | {span(other)} | {ratio:.3g} |")


def main() -> None:
    """As the options say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vmas", default=sys.executable, metavar="PYTHON", help="a Python that has VMAS")
    parser.add_argument("--device", default="cpu", help="VMAS's: cpu or cuda")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1, help="(default: all processors)")
    parser.add_argument("--seconds", type=float, default=4, help="of each run (default 4)")
    parser.add_argument("--repeats", type=int, default=3, help="(default 3)")
    parser.add_argument("--measure", choices=["stage", "vmas"], help="all cases of one, as this program has others do")
    options = parser.parse_args()
    if options.measure is None:
        compare(options)
        return
    rates = []
    for agents, rays, envs in CASES:
        sizes = (envs, agents, rays, options.threads, options.seconds)
        rates.append(measure_stage(*sizes) if options.measure == "stage" else measure_vmas(*sizes, options.device))
    print(json.dumps(rates))


if __name__ == "__main__":
    main()
