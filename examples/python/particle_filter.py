#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Localizes a robot by Monte Carlo localization with World.cast().

A robot of cave.world drives with its own controller. The filter gets its laser scans and its motion with
errors, but not its pose. It starts with a wrong guess and particles around it, and prints the distance of
its guess from the truth.
"""

from __future__ import annotations

import argparse

import numpy as np
import stagesim as st

RAYS = 24  # rays of a scan that are used
SIGMA = 0.3  # standard deviation of a reading, metres
ASTRAY = np.array([1.5, -1.0, 0.3])  # error of the first guess: metres, radians
SPREAD = np.array([2.0, 2.0, 0.5])  # standard deviation of the first particles
DRIFT = np.array([0.02, 0.02, 0.02])  # standard deviation of a motion: metres, radians


class Filter:
    """A particle filter; particles are possible poses of the robot."""

    def __init__(self, world: st.World, around: np.ndarray, count: int, seed: int) -> None:
        self.map = world
        self.random = np.random.default_rng(seed)
        self.poses = around + self.random.normal(size=(count, 3)) * SPREAD

    def move(self, forwards: float, left: float, turn: float) -> None:
        """Move the particles by odometry, each with a random error."""
        x, y, heading = self.poses.T
        c, s = np.cos(heading), np.sin(heading)
        self.poses += np.stack([forwards * c - left * s, forwards * s + left * c,
                                np.full_like(x, turn)], axis=1)
        self.poses += self.random.normal(size=self.poses.shape) * DRIFT

    def see(self, bearings: np.ndarray, ranges: np.ndarray, most: float, ahead: float) -> None:
        """Resample the particles by how well their expected scans match this one."""
        eyes = self.poses.copy()
        eyes[:, :2] += ahead * np.stack([np.cos(eyes[:, 2]), np.sin(eyes[:, 2])], axis=1)
        expected = self.map.cast(eyes, bearings, most, z=0.32)
        # Large errors, for example by another robot in the way, count as 1.5 m at most.
        wrong = np.minimum(np.abs(expected - ranges), 1.5) / SIGMA
        likelihood = -0.5 * (wrong**2).mean(axis=1) * 6
        weights = np.exp(likelihood - likelihood.max())
        # Systematic resampling.
        count = len(weights)
        marks = (self.random.random() + np.arange(count)) / count
        chosen = np.searchsorted(np.cumsum(weights) / weights.sum(), marks)
        self.poses = self.poses[np.minimum(chosen, count - 1)]

    def guess(self) -> np.ndarray:
        return np.array([*self.poses[:, :2].mean(axis=0),
                         np.angle(np.exp(1j * self.poses[:, 2]).mean())])


def motion(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return the motion between two poses: forwards, left, turn."""
    dx, dy, turn = after - before
    c, s = np.cos(before[2]), np.sin(before[2])
    return np.array([dx * c + dy * s, dy * c - dx * s, (turn + np.pi) % (2 * np.pi) - np.pi])


def distance(one: np.ndarray, other: np.ndarray) -> float:
    """Return the distance between two poses in metres."""
    return float(np.hypot(*(one - other)[:2]))


def run(robot: str, rounds: int, count: int, seed: int) -> dict[str, float]:
    """Return the first and the last error in metres."""
    world = st.World("cave.world", seed=seed, threads=2)
    fleet = world.fleet(robot)
    laser = fleet.ranger(1)
    world.step(5)
    random = np.random.default_rng(seed + 1)
    most = float(np.nanmax(laser.ranges))
    some = np.linspace(0, laser.ranges.shape[1] - 1, RAYS).astype(int)
    ahead = float(laser.origins[0, 0, 0])
    filter_ = Filter(world, fleet.pose[0] + ASTRAY, count, seed + 2)
    errors: list[float] = []
    last = fleet.pose[0].copy()
    for number in range(rounds):
        world.step(4)
        here = fleet.pose[0].copy()  # the next step's scan is taken here
        world.step()
        moved = motion(last, here)
        last = here
        filter_.move(*(moved + random.normal(size=3) * DRIFT / 2))
        if number == 0:
            errors.append(distance(filter_.guess(), here))
            print(f"{world.time:6.1f} s  error {errors[0]:.2f} m, before the first scan")
        filter_.see(laser.bearings[0, some], laser.ranges[0, some], most, ahead)
        errors.append(distance(filter_.guess(), here))
        if number % 5 == 0 or number == rounds - 1:
            print(f"{world.time:6.1f} s  error {errors[-1]:.2f} m")
    return {"first": errors[0], "last": float(np.mean(errors[-3:])), "particles": count}


def main(arguments: list[str] | None = None) -> dict[str, float]:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="r0", help="the name of the one that is lost (r0)")
    parser.add_argument("--particles", type=int, default=4000)
    parser.add_argument("--rounds", type=int, default=40, help="of half a second (40)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--short", action="store_true", help="1000 particles, 12 rounds")
    options = parser.parse_args(arguments)
    count, rounds = (1000, 12) if options.short else (options.particles, options.rounds)
    figures = run(options.robot, rounds, count, options.seed)
    print("{particles} particles: the error fell from {first:.2f} m to {last:.2f} m".format(**figures))
    return figures


if __name__ == "__main__":
    main()
