#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Evolves a controller with CMA-ES: all trials of a generation are the worlds of one batch.

A genome holds the weights of a small controller for the five robots of arena.world. Its fitness is the distance
in metres that a robot drives without a stall, averaged over the robots of three trials with other headings.

With --executor, each worker gets a share of the genomes and a batch of its own, in threads or processes. The same
code distributes trials over machines, with an executor of Dask or mpi4py. Results do not depend on the executor.
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from typing import Callable, NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # other threads would wait for work on small matrices, and spin
import numpy as np  # noqa: E402
import stagesim as st  # noqa: E402

SECTORS = 8  # sectors of a scan
WEIGHTS = 2 * (SECTORS + 1)
WORLD = "arena.world"


class Trial(NamedTuple):
    """How each genome is tried."""

    repeats: int  #: with other headings of the robots
    seconds: float  #: of each repeat
    seed: int  #: of the headings


class Strategy:
    """CMA-ES: N. Hansen, The CMA Evolution Strategy: A Tutorial. It minimises; any optimiser with ask() and tell() fits.

    Args:
        size: how many numbers a genome has.
        sigma: the first standard deviation of each number, around 0.
        population: genomes per generation.
    """

    def __init__(self, size: int, sigma: float, population: int, seed: int) -> None:
        self.random, self.population, self.sigma = np.random.default_rng(seed), population, sigma
        self.mean, self.covariance = np.zeros(size), np.eye(size)
        self.path, self.sigma_path = np.zeros(size), np.zeros(size)
        ranks = np.log((population + 1) / 2) - np.log(np.arange(1, population // 2 + 1))
        self.weights = ranks / ranks.sum()
        self.mass = mass = 1 / (self.weights**2).sum()
        self.rate_path = (4 + mass / size) / (size + 4 + 2 * mass / size)
        self.rate_sigma = (mass + 2) / (size + mass + 5)
        self.damping = 1 + 2 * max(0, np.sqrt((mass - 1) / (size + 1)) - 1) + self.rate_sigma
        self.rate_one = 2 / ((size + 1.3)**2 + mass)
        self.rate_mu = min(1 - self.rate_one, 2 * (mass - 2 + 1 / mass) / ((size + 2)**2 + mass))
        self.length = np.sqrt(size) * (1 - 1 / (4 * size) + 1 / (21 * size**2))  # of a normally distributed vector
        self.generation = 0

    def ask(self) -> np.ndarray:
        """Returns genomes: shape (population, size)."""
        squares, self.axes = np.linalg.eigh(self.covariance)
        self.lengths = np.sqrt(squares)
        normal = self.random.standard_normal((self.population, len(self.mean)))
        return self.mean + self.sigma * (normal * self.lengths) @ self.axes.T

    def tell(self, genomes: np.ndarray, costs: np.ndarray) -> None:
        """Learns from the costs of the genomes that ask() has returned."""
        self.generation += 1
        steps = (genomes[np.argsort(costs)[:len(self.weights)]] - self.mean) / self.sigma
        step = self.weights @ steps
        self.mean = self.mean + self.sigma * step
        whitened = self.axes @ (self.axes.T @ step / self.lengths)
        keep = 1 - self.rate_sigma
        self.sigma_path = keep * self.sigma_path + np.sqrt((1 - keep**2) * self.mass) * whitened
        norm = np.linalg.norm(self.sigma_path) / self.length
        is_short = norm / np.sqrt(1 - keep**(2 * self.generation)) < 1.4 + 2 / (len(step) + 1)
        keep = 1 - self.rate_path
        self.path = keep * self.path + is_short * np.sqrt((1 - keep**2) * self.mass) * step
        forgotten = self.rate_one * (1 - (not is_short) * (1 - keep**2)) + self.rate_mu
        self.covariance = ((1 - forgotten) * self.covariance + self.rate_one * np.outer(self.path, self.path)
                           + self.rate_mu * (self.weights * steps.T) @ steps)
        self.sigma *= np.exp(self.rate_sigma / self.damping * (norm - 1))


def speeds(genomes: np.ndarray, ranges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns forward and turning speeds of robots: one layer of neurons, whose inputs tell how near things are.

    Args:
        genomes: shape (worlds, WEIGHTS), or (WEIGHTS,) for one world.
        ranges: shape (worlds, robots, samples), or (robots, samples).
    """
    # The worlds are the last axis, for speed. Summing in a fixed order makes results independent of their number.
    weights = genomes.T.reshape(2, SECTORS + 1, 1, *genomes.shape[:-1])
    scans = np.ascontiguousarray(ranges.T)
    near = 1 - scans.reshape(SECTORS, -1, *scans.shape[1:]).min(axis=1) / 4
    total = weights[:, SECTORS] + near[0] * weights[:, 0]
    for sector in range(1, SECTORS):
        total += near[sector] * weights[:, sector]
    forward, turn = np.tanh(total)
    return 0.5 * forward.T, 1.5 * turn.T


def starts(pose: np.ndarray, trial: Trial) -> np.ndarray:
    """Returns the poses at which the repeats begin, shape (repeats, robots, 3): at the places of the world file."""
    poses = np.repeat(pose[None], trial.repeats, axis=0)
    poses[1:, :, 2] = np.random.default_rng(trial.seed).uniform(-np.pi, np.pi, poses[1:, :, 2].shape)
    return poses


def worths(batch: st.Batch, genomes: np.ndarray, trial: Trial) -> np.ndarray:
    """Returns the fitness of each genome, shape (genomes,). Each has as many worlds of the batch as there are repeats."""
    batch.reset()
    batch.teleport(np.tile(starts(batch.pose[0], trial), (len(genomes), 1, 1)))
    genomes = np.repeat(genomes, trial.repeats, axis=0)
    ranges, command = batch.ranges, batch.cmd
    metres = np.zeros((batch.n, len(batch)))
    stalled = np.zeros((batch.n, len(batch)), int)
    batch.step()  # measures
    dt = float(batch.time[0])  # seconds of a step
    for _ in range(round(trial.seconds / dt)):
        command[..., 0], command[..., 2] = speeds(genomes, ranges)
        batch.step()
        metres += dt * batch.actual_velocity[..., 0]
        stalled += batch.stalled
    return (metres - 0.05 * stalled).reshape(-1, trial.repeats * len(batch)).mean(axis=1)


def worths_in_worker(genomes: np.ndarray, trial: Trial) -> np.ndarray:
    """Returns worths() with a batch of its own, on one thread."""
    return worths(st.Batch(WORLD, len(genomes) * trial.repeats, threads=1), genomes, trial)


def in_shares(genomes: np.ndarray, executor: Executor, workers: int, trial: Trial) -> np.ndarray:
    """Returns worths() of an executor's workers, each with a share of the genomes."""
    shares = np.array_split(genomes, min(workers, len(genomes)))
    return np.concatenate(list(executor.map(partial(worths_in_worker, trial=trial), shares)))


def evolve(worth: Callable[[np.ndarray], np.ndarray], generations: int, population: int,
           seed: int) -> dict[str, float]:
    """Returns the mean fitness of the first and the last generation, and the fitness of the best genome."""
    strategy = Strategy(WEIGHTS, 0.5, population, seed)
    means, bests = [], []
    for generation in range(generations):
        genomes = strategy.ask()
        values = worth(genomes)
        strategy.tell(genomes, -values)
        means.append(float(values.mean()))
        bests.append(float(values.max()))
        print(f"generation {generation + 1}: {means[-1]:.2f} m, best {bests[-1]:.2f} m")
    return {"first": means[0], "last": means[-1], "best": max(bests)}


def main(arguments: list[str] | None = None) -> dict[str, float]:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--generations", type=int, default=26)
    parser.add_argument("--population", type=int, default=40)
    parser.add_argument("--repeats", type=int, default=3, help="trials of each genome (3)")
    parser.add_argument("--seconds", type=float, default=10.0, help="of each trial (10)")
    parser.add_argument("--executor", choices=("threads", "processes"), help="otherwise one batch has all trials")
    parser.add_argument("--workers", type=int, default=2, help="threads of the batch, or workers of the executor (2)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--short", action="store_true", help="8 generations of 16 genomes")
    options = parser.parse_args(arguments)
    if options.short:
        options.generations, options.population = 8, 16
    trial = Trial(options.repeats, options.seconds, options.seed)
    if options.executor:
        kind = ThreadPoolExecutor if options.executor == "threads" else ProcessPoolExecutor
        with kind(options.workers) as executor:
            worth = partial(in_shares, executor=executor, workers=options.workers, trial=trial)
            figures = evolve(worth, options.generations, options.population, options.seed)
    else:
        batch = st.Batch(WORLD, options.population * options.repeats, threads=options.workers)
        figures = evolve(partial(worths, batch, trial=trial), options.generations, options.population, options.seed)
    figures["tried"] = options.generations * options.population
    print("{tried} genomes: the mean fitness rose from {first:.2f} m to {last:.2f} m, best {best:.2f} m".format(**figures)
          + f", {sum(os.times()[:4]):.1f} s of processor time")
    return figures


if __name__ == "__main__":
    main()
