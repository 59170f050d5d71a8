#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Compares rays that are cast from robots among robots with rays from random free places near them.

  tools/test -R python_package       # builds what is needed
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/cast_speed.py

Prints a Markdown table of millions of rays per second of processor time: the best of several rounds, in which all
kinds take turns. Rays from robots pass the robot that they start from. Fails unless the ranges of Batch.cast() are
those of World.cast(), rays hit walls and robots, and no ray ends at its own robot.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence

import numpy as np
import stagesim as st

RANGE, RAYS = 5.0, 36  # metres; rays of a pose
COPIES = 200  # poses in a call of World.cast(), which ignores one robot
FREE = 0.3  # metres around a free place
OWN = 0.25  # metres from the middle of a robot: its outline is nearer

#: A closed room with 16 robots.
ROOM = """
resolution 0.05
model( size [8 0.2 1] pose [0 4 0 0] ) model( size [8 0.2 1] pose [0 -4 0 0] )
model( size [0.2 8 1] pose [4 0 0 0] ) model( size [0.2 8 1] pose [-4 0 0 0] )
define bot position( size [0.4 0.3 0.4] )
""" + "".join(f"bot( pose [{x} {y} 0 {90 * x + 40 * y}] ) " for x in (-3, -1, 1, 3) for y in (-3, -1, 1, 3))

BEARINGS = np.linspace(-np.pi, np.pi, RAYS, endpoint=False)


def free_places(batch: st.Batch, count: int) -> np.ndarray:
    """Random poses in each world that are not in a robot, of shape (n, count, 3)."""
    random = np.random.default_rng(1)
    places = np.full((batch.n, count, 3), np.nan)
    while np.isnan(places).any():
        tried = random.uniform([-3.5, -3.5, -np.pi], [3.5, 3.5, np.pi], places.shape)
        gap = np.linalg.norm(tried[:, :, None, :2] - batch.pose[:, None, :, :2], axis=-1).min(-1)
        places = np.where((np.isnan(places[..., 0]) & (gap > FREE))[..., None], tried, places)
    return places


def cast_in(world: st.World, poses: np.ndarray, ignored: Sequence[st.Model | None]) -> np.ndarray:
    """The ranges of rays that pass a model, which are cast COPIES times at once: shape (poses, COPIES, RAYS)."""
    return np.array([world.cast(np.repeat(pose[None], COPIES, 0), BEARINGS, RANGE, robots=True, ignore=robot)
                     for pose, robot in zip(poses, ignored)])


def rates(calls: dict[str, Callable[[], np.ndarray]], rounds: int) -> dict[str, float]:
    """Millions of rays per second of processor time for each call."""
    best = dict.fromkeys(calls, 0.0)
    for _ in range(rounds):
        for name, call in calls.items():
            start = time.process_time()
            rays = call().size
            best[name] = max(best[name], rays / (time.process_time() - start) / 1e6)
    return best


def check(ranges: np.ndarray, world: np.ndarray, least: float) -> None:
    """Asserts that rays hit something, but not before `least`, as in the world of its own."""
    assert (ranges[0] == world).all(), "found ranges other than those of World.cast()"
    assert (ranges > least).all(), "found rays that end at their start"
    assert 0.5 < ranges.mean() < 3, "found rays that pass robots or walls"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--worlds", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=15)
    arguments = parser.parse_args()
    print("| rays of the model | robots: Batch | free places: Batch | ratio | robots: World | free places: World | ratio |")
    print("|---|---|---|---|---|---|---|")
    for model in ("cell", "exact"):
        batch = st.Batch.of(st.World.from_text(f'ray_model "{model}"' + ROOM), arguments.worlds, threads=1)
        batch.cmd[...] = [0.2, 0, 0.4]
        batch.step(4)
        places, own, world = free_places(batch, len(batch)), batch.pose.copy(), batch.fork(0)
        models = [world.model(name) for name in batch.names]
        calls: dict[str, Callable[[], np.ndarray]] = {
            "own": lambda: batch.cast(own, BEARINGS, RANGE, robots=True, ignore=True),
            "free": lambda: batch.cast(places, BEARINGS, RANGE, robots=True),
            "world own": lambda: cast_in(world, own[0], models),
            "world free": lambda: cast_in(world, places[0], [None] * len(models))}
        check(calls["own"](), calls["world own"]()[:, 0], OWN)
        check(calls["free"](), calls["world free"]()[:, 0], 0)
        found = rates(calls, arguments.rounds)
        print(f"| {model} | {found['own']:.1f} | {found['free']:.1f} | {found['own'] / found['free']:.2f} "
              f"| {found['world own']:.1f} | {found['world free']:.1f} | {found['world own'] / found['world free']:.2f} |",
              flush=True)


if __name__ == "__main__":
    main()
