#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Drives a robot to a goal among obstacles by model predictive path integral control (MPPI).

Twice a second, 500 worlds become forks of the present state. Each tries the planned commands with other random changes
for six seconds. The mean of their commands, weighted by their costs, is the new plan, whose first part the robot
executes. Forks are worlds of a batch: load() puts all of them into a state by one call."""

from __future__ import annotations

import argparse
import time

import numpy as np
import stagesim as st

ROOM = """
resolution 0.05
define wall model( size [0.2 10 1] )
wall( pose [5 0 0 0] ) wall( pose [-5 0 0 0] ) wall( pose [0 5 0 90] ) wall( pose [0 -5 0 90] )
define crate model( size [1.5 1.5 1] )
crate( pose [-2 -2.5 0 20] ) crate( pose [0.5 0 0 45] ) crate( pose [2.5 2.8 0 10] ) crate( pose [-1.5 1.8 0 70] )
position( name "r" pose [-4 -4 0 0] size [0.4 0.3 0.3] )
"""
GOAL = np.array([4, 4])
FORKS, MOMENTS, STEPS = 500, 12, 5  # a moment is half a second
SPREAD = np.array([0.4, 0, 0.8])  # of random changes: m/s and rad/s
LOW, HIGH = np.array([-0.2, 0, -1.5]), np.array([1.0, 0, 1.5])


def costs_of(record: dict[str, np.ndarray]) -> np.ndarray:
    """The cost of each fork: metres from the goal, mean over the moments, and one for each moment at an obstacle."""
    distance = np.linalg.norm(record["pose"][:, :, 0, :2] - GOAL, axis=-1)
    return (distance + 3 * record["stalled"][:, :, 0]).mean(0) + distance[-1]


def main(arguments: list[str] | None = None) -> dict[str, float]:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--short", action="store_true", help="use 200 forks instead of 500")
    forks = 200 if parser.parse_args(arguments).short else FORKS
    world, random, begin = st.World.from_text(ROOM), np.random.default_rng(1), time.perf_counter()
    real, tried = st.Batch.of(world, 1), st.Batch.of(world, forks)
    plan, hits = np.zeros((MOMENTS, 3)), 0
    while (distance := np.linalg.norm(real.pose[0, 0, :2] - GOAL)) > 0.3 and real.time[0] < 60:
        commands = np.clip(plan[:, None] + SPREAD * random.normal(size=(MOMENTS, forks, 3)), LOW, HIGH)
        tried.load(real.state())
        costs = costs_of(tried.rollout(commands[:, :, None], n=STEPS, record=("pose", "stalled")))
        weights = np.exp((costs.min() - costs) / 0.1)
        plan = np.tensordot(weights / weights.sum(), commands, (0, 1))
        real.cmd[...] = plan[0]
        real.step(STEPS)
        hits += int(real.stalled[0, 0])
        plan = np.vstack([plan[1:], plan[-1:]])
    print(f"{distance:.2f} m from the goal after {real.time[0]:.1f} s with {hits} hits; {forks} forks for each of "
          f"{real.time[0] / 0.1 / STEPS:.0f} decisions took {time.perf_counter() - begin:.1f} s")
    return {"distance": float(distance), "seconds": float(real.time[0]), "hits": hits}


if __name__ == "__main__":
    main()
