#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Evolves a controller with CMA-ES, on any executor of concurrent.futures.

A genome holds the weights of a small controller for the five robots of arena.world. Its fitness is the
distance that they drive without a stall. Each genome runs in its own world, in threads or processes;
results do not depend on the executor. Needs `pip install cma`.
"""

from __future__ import annotations

import argparse
import functools
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor

import cma
import numpy as np
import stagesim as st

SECTORS = 8  # sectors of a scan
WEIGHTS = 2 * (SECTORS + 1)


def commands(genome: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """Return speeds from scans: one layer of neurons, whose inputs tell how near things are per sector."""
    near = 1 - ranges.reshape(len(ranges), SECTORS, -1).min(axis=2) / 4
    seen = np.concatenate([near, np.ones((len(near), 1))], axis=1)
    # Summing in a fixed order keeps results independent of a matrix library.
    out = np.tanh((seen[:, None, :] * genome.reshape(1, 2, SECTORS + 1)).sum(axis=2))
    return np.stack([0.5 * out[:, 0], np.zeros(len(out)), 1.5 * out[:, 1]], axis=1)


def worth(genome: np.ndarray, seconds: float) -> float:
    """Return the mean forward distance of a robot in metres, minus a penalty for stalled steps."""
    world = st.World("arena.world")
    fleet = world.fleet()
    scan = fleet.ranger(0)
    world.step()
    start = fleet.pose.copy()
    total = 0.0
    for _ in range(round(seconds / world.dt)):
        fleet.cmd[:] = commands(genome, np.nan_to_num(scan.ranges, nan=4.0))
        world.step()
        moved = fleet.pose - start
        start[:] = fleet.pose
        ahead = moved[:, 0] * np.cos(start[:, 2]) + moved[:, 1] * np.sin(start[:, 2])
        total += float(ahead.sum() - 0.05 * fleet.stalled.sum())
    return total / len(fleet)


def evolve(executor: Executor, generations: int, population: int, seconds: float,
           seed: int) -> dict[str, float]:
    """Return the fitness of the first mean and of the best genome."""
    strategy = cma.CMAEvolutionStrategy(WEIGHTS * [0.0], 0.5, {
        "seed": seed, "popsize": population, "verbose": -9})
    value = functools.partial(worth, seconds=seconds)
    first = -np.inf
    for generation in range(generations):
        genomes = strategy.ask()
        values = list(executor.map(value, genomes))
        strategy.tell(genomes, [-value for value in values])
        first = float(np.mean(values)) if generation == 0 else first
        print(f"generation {generation + 1}: {np.mean(values):.2f} m, best {max(values):.2f} m")
    return {"first": first, "best": float(-strategy.result.fbest), "tried": generations * population}


def main(arguments: list[str] | None = None) -> dict[str, float]:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--generations", type=int, default=30)
    parser.add_argument("--population", type=int, default=16)
    parser.add_argument("--seconds", type=float, default=30.0, help="of each trial (30)")
    parser.add_argument("--executor", choices=("threads", "processes"), default="processes")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--short", action="store_true", help="8 generations of 8 trials of 10 seconds")
    options = parser.parse_args(arguments)
    if options.short:
        options.generations, options.population, options.seconds = 8, 8, 10.0
    kind = ThreadPoolExecutor if options.executor == "threads" else ProcessPoolExecutor
    with kind(options.workers) as executor:
        figures = evolve(executor, options.generations, options.population, options.seconds, options.seed)
    print("{tried} trials: fitness rose from {first:.2f} m (first mean) to {best:.2f} m (best genome)"
          .format(**figures))
    return figures


if __name__ == "__main__":
    main()
