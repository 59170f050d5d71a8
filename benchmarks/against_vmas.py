#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Compares stagesim and VMAS (pypi.org/project/vmas, PyTorch) in agent-steps per second, in alternating runs.

  python3 -m venv /tmp/vmas && /tmp/vmas/bin/pip install vmas          # brings PyTorch along
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/against_vmas.py --vmas /tmp/vmas/bin/python

The world is that of VMAS's scenario "navigation" with its lidar on: round agents of 0.1 m radius without walls, 12
rays of 0.35 m all around, and steps of 0.1 s. Here it is a world file with octagons in cells of 2 cm. Agents start
at random places, at least 0.05 m apart, in a square of the same size. Both simulators receive random commands in
each step, which cancel each other over eight steps so that agents stay close together, and both return all readings
as one array. VMAS also computes rewards, observations, forces and bounces; Stage blocks robots that touch.

Before the measurement, each simulator counts over some steps how often an agent has another one within the range of
its lidar, and how often the lidar detects it. Rays may miss a neighbour. A simulator that detects less than half of
them, or has no agent in range, is rejected, because its lidars do not work.

Each figure is the median of the repeats, with minimum and maximum. Ratios are those of consecutive runs. With
`--device cuda`, VMAS runs on a GPU; stagesim stays on the processor.
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
from typing import Any, Callable

REACH, RADIUS = 0.35, 0.1
CASES = [(4, 12, 1), (4, 12, 64), (4, 12, 1024), (4, 12, 4096), (4, 64, 64), (16, 12, 64), (16, 64, 64),
         (32, 32, 16)]  # number of agents, rays per agent, environments
COMMANDS = 8  # commands prepared in advance; the second half undoes the first
LOOKS = 40  # steps after a reset in which detections are counted
LOOKED_AT = 64  # minimum number of environments in which detections are counted, over several
                # rounds if needed


def rate(step: Callable[[int], None], envs: int, agents: int, seconds: float) -> float:
    """Returns agent-steps per second."""
    for i in range(3):
        step(i)
    count, start = 0, time.perf_counter()
    while time.perf_counter() - start < seconds:
        step(count)
        count += 1
    return count * envs * agents / (time.perf_counter() - start)


def half_width(agents: int) -> float:
    """Half the width in metres of the square in which agents start: 1 as in VMAS, more if they do not
    fit."""
    return max(1.0, 0.6 * math.sqrt(agents))


def circle(corners: int = 8) -> str:
    """Returns a block of a world file."""
    points = [(0.5 + 0.5 * math.cos(2 * math.pi * i / corners), 0.5 + 0.5 * math.sin(2 * math.pi * i / corners))
              for i in range(corners)]
    return f"block( points {corners} " + " ".join(
        f"point[{i}] [{x:.4f} {y:.4f}]" for i, (x, y) in enumerate(points)) + " )"


def world_file(agents: int, rays: int) -> str:
    """The scenario as a world file. As in VMAS, agents start at random places, different in each
    environment."""
    half = half_width(agents)
    return "\n".join([
        "resolution 0.02", "interval_sim 100", "quit_time 0",
        f"define lidar ranger( size [0.02 0.02 0.1] sensor( range [0 {REACH}] fov {360 - 360 / rays:.6f} "
        f"samples {rays} ) )",
        f"define agent position( size [{2 * RADIUS} {2 * RADIUS} 0.3] drive \"omni\" {circle()} alwayson 1 "
        "lidar( pose [0 0 -0.2 180] alwayson 1 ) )",
        f"population( name \"agents\" model \"agent\" count {agents} area [{-half} {-half} {half} {half}] gap 0.05 )",
        ""])


def neighbours(positions: Any) -> Any:
    """Tells which agents have another one in range of their lidars. `positions` has the shape (environments,
    agents, 2), in metres."""
    import numpy as np

    apart = np.linalg.norm(positions[:, :, None] - positions[:, None], axis=-1)
    apart[:, np.arange(apart.shape[1]), np.arange(apart.shape[1])] = np.inf
    return apart.min(axis=2) < REACH + RADIUS


def rounds(envs: int) -> int:
    """How often all environments are reset and examined."""
    return max(1, LOOKED_AT // envs)


class Sight:
    """Counts agent-steps with a neighbour in range, and those in which the lidar detects it."""

    def __init__(self) -> None:
        self.near = self.seen = self.readings = 0

    def add(self, positions: Any, ranges: Any) -> None:
        """Adds one step: positions (environments, agents, 2) and readings (environments, agents, rays), in
        metres."""
        near, hits = neighbours(positions), ranges < REACH - 1e-4
        self.near += int(near.sum())
        self.seen += int((near & hits.any(axis=2)).sum())
        self.readings += int(hits.sum())

    def check(self, who: str) -> list[int]:
        """Returns [agent-steps with a neighbour in range, those among them with a reading below the maximum, all
        readings below the maximum]."""
        if self.near == 0 or self.seen < self.near / 2:
            sys.exit(f"against_vmas.py: {who}: the lidar saw a neighbour in {self.seen} of "
                     f"{self.near} agent-steps with a neighbour in range, expected at least half")
        return [self.near, self.seen, self.readings]


def measure_stage(envs: int, agents: int, rays: int, threads: int, seconds: float) -> tuple[float, list[int]]:
    """Returns the speed of stagesim and the counts of detections."""
    import numpy as np
    import stagesim as st

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "navigation.world"
        file.write_text(world_file(agents, rays))
        batch = st.Batch(file, envs, threads=threads)
    chance = np.random.default_rng(1)
    half = chance.uniform(-1, 1, (COMMANDS // 2, *batch.cmd.shape))
    commands = np.concatenate([half, -half])
    ranges = batch.ranges
    assert ranges.shape == (envs, agents, rays)

    def step(i: int) -> None:
        batch.cmd[:] = commands[i % COMMANDS]
        batch.step()

    sight = Sight()
    for episode in range(rounds(envs)):
        batch.reset(seeds=range(1 + episode * envs, 1 + (episode + 1) * envs))
        for i in range(LOOKS):
            before = np.array(batch.pose[..., :2])  # readings belong to the positions before the
                                                    # move
            step(i)
            if i > 0:  # the first reading may not exist yet
                sight.add(before, ranges)
    return rate(step, envs, agents, seconds), sight.check("stagesim")


def measure_vmas(envs: int, agents: int, rays: int, threads: int, seconds: float,
                 device: str) -> tuple[float, list[int]]:
    """Returns the speed of VMAS and the counts of detections."""
    import numpy as np
    import torch
    from vmas import make_env

    torch.set_num_threads(threads)
    env = make_env(scenario="navigation", num_envs=envs, device=device, continuous_actions=True, seed=1,
                   n_agents=agents, n_lidar_rays=rays, world_spawning_x=half_width(agents),
                   world_spawning_y=half_width(agents))
    env.reset()
    half = [[torch.rand(envs, 2, device=device) * 2 - 1 for _ in range(agents)] for _ in range(COMMANDS // 2)]
    commands = half + [[-command for command in one] for one in half]

    def step(i: int) -> None:
        seen = env.step(commands[i % COMMANDS])[0]
        if device != "cpu":
            torch.cuda.synchronize()
        assert len(seen) == agents

    with torch.no_grad():
        sight = Sight()
        for i in range(LOOKS * rounds(envs)):
            if i % LOOKS == 0:
                env.reset()
            step(i)
            positions = np.stack([agent.state.pos.cpu().numpy() for agent in env.agents], axis=1)
            ranges = np.stack([agent.sensors[0].measure().cpu().numpy() for agent in env.agents], axis=1)
            sight.add(positions, ranges)
        return rate(step, envs, agents, seconds), sight.check("VMAS")


def measured(python: str, kind: str, options: argparse.Namespace) -> tuple[list[float], list[list[int]]]:
    """Measures all cases in a separate process; returns speeds and counts of detections."""
    words = [python, __file__, "--measure", kind, "--threads", str(options.threads), "--seconds",
             str(options.seconds), "--device", options.device]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(done.stderr)
    results = json.loads(done.stdout.splitlines()[-1])
    return [rate for rate, _ in results], [sight for _, sight in results]


def span(values: tuple[float, ...]) -> str:
    """Formats median, minimum and maximum."""
    return f"{statistics.median(values):,.0f} ({min(values):,.0f} to {max(values):,.0f})"


def compare(options: argparse.Namespace) -> None:
    """Prints a table in Markdown."""
    ours, theirs = [], []
    our_sight: list[list[int]] = []
    their_sight: list[list[int]] = []
    for _ in range(options.repeats):
        rates, our_sight = measured(sys.executable, "stage", options)
        ours.append(rates)
        rates, their_sight = measured(options.vmas, "vmas", options)
        theirs.append(rates)
    print("| agents | rays | environments | stagesim, agent-steps/s | VMAS | ratio | in range, "
          "seen: stagesim | VMAS |")
    print("|---|---|---|---|---|---|---|---|")
    for (agents, rays, envs), one, other, our, their in zip(CASES, zip(*ours), zip(*theirs), our_sight, their_sight):
        ratio = statistics.median(a / b for a, b in zip(one, other))
        print(f"| {agents} | {rays} | {envs} | {span(one)} | {span(other)} | {ratio:.3g} | {counts(our)} | "
              f"{counts(their)} |")


def counts(sight: list[int]) -> str:
    """Formats the number of agent-steps with a neighbour in range and the fraction in which the
    lidar detected it."""
    near, seen, _ = sight
    return f"{near:,}, {100 * seen / near:.0f} %"


def main() -> None:
    """Runs the comparison, or one measurement in its own process, as the options say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vmas", default=sys.executable, metavar="PYTHON",
                        help="a Python interpreter with VMAS")
    parser.add_argument("--device", default="cpu", help="device for VMAS: cpu or cuda")
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)), help="(default: all processors)")
    parser.add_argument("--seconds", type=float, default=4, help="seconds per run (default 4)")
    parser.add_argument("--repeats", type=int, default=3, help="(default 3)")
    parser.add_argument("--measure", choices=["stage", "vmas"],
                        help="measure only this simulator, in this process; used by the program "
                             "itself")
    options = parser.parse_args()
    if options.measure is None:
        compare(options)
        return
    results = []
    for agents, rays, envs in CASES:
        sizes = (envs, agents, rays, options.threads, options.seconds)
        results.append(measure_stage(*sizes) if options.measure == "stage" else measure_vmas(*sizes, options.device))
    print(json.dumps(results))


if __name__ == "__main__":
    main()
