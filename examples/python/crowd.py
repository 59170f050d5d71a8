#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Drives all robots of a world with one controller in NumPy.

Each robot turns away from obstacles and slows down near them. There is no loop over robots: every line
processes all of them at once.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import stagesim as st


def commands(bearings: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """Return speeds of n robots (m/s forwards, m/s left, rad/s) from scans of shape (n, samples)."""
    near = np.nan_to_num(1 / np.maximum(ranges, 0.05), nan=0.0)
    ahead = np.abs(bearings) < np.radians(40)
    free = np.nanmin(np.where(ahead, ranges, np.inf), axis=1, initial=8.0)
    # Near things repel, more strongly in front than behind.
    push = -(near**2 * np.sin(bearings) * (1 + np.cos(bearings))).mean(axis=1)
    turn = np.clip(2 * push, -1.2, 1.2)
    blocked = free < 0.5
    # Blocked robots turn at full speed: two that meet head-on would otherwise wait for each other.
    turn[blocked] = np.where(turn[blocked] < 0, -1.2, 1.2)
    speed = np.where(blocked, 0.0, np.clip(0.5 * (free - 0.4), 0.05, 0.5))
    return np.stack([speed, np.zeros_like(speed), turn], axis=1)


def run(file: str, seconds: float, seed: int, threads: int, film: str | None) -> dict[str, float]:
    """Return metres driven per robot, the fraction of blocked robots at the end, and steps per second."""
    world = st.World(file, seed=seed, threads=threads, controllers=False)
    fleet = world.fleet()
    scan = fleet.ranger(0)
    pictures = st.Film(film, world, every=0.5, fps=10, width=960) if film else None
    way = np.zeros(len(fleet))
    before = fleet.pose.copy()
    steps = round(seconds / world.dt)
    start = time.perf_counter()
    for _ in range(steps):
        fleet.cmd[:] = commands(scan.bearings, scan.ranges)
        world.step()
        way += np.hypot(*(fleet.pose - before)[:, :2].T)
        before[:] = fleet.pose
        if pictures:
            pictures.take()
    rate = steps / (time.perf_counter() - start)
    if pictures:
        pictures.close()
    return {"robots": len(fleet), "metres": way.mean(), "stalled": fleet.stalled.mean(), "rate": rate}


def main(arguments: list[str] | None = None) -> dict[str, float]:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("world", nargs="?", default="hospital.world")
    parser.add_argument("--seconds", type=float, default=60.0, help="of simulated time (60)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--film", metavar="FILE", help="a .gif or .mp4 to be made")
    parser.add_argument("--short", action="store_true", help="10 seconds only")
    options = parser.parse_args(arguments)
    seconds = 10.0 if options.short else options.seconds
    figures = run(options.world, seconds, options.seed, options.threads, options.film)
    print("{robots} robots drove {metres:.2f} m on average, {stalled:.0%} are blocked; "
          "{rate:.0f} steps a second".format(**figures))
    return figures


if __name__ == "__main__":
    main()
