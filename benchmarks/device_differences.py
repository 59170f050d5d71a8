#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Counts worlds whose state differs between host and device, in many steps of random worlds.

  tools/test -R python_package       # builds what is needed
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/device_differences.py --device opencl:gpu

Each scene is drawn at random: its resolution, walls, boxes, drives, bodies, odometry, noise, energy, sensors of both
ray models, and controllers. Many worlds of it get random commands and resets, on the host and on the device. After
each round, the state hashes of all worlds are compared. Fails at the first difference, with the seed of its scene, or
unless robots moved and stalled and rays hit something.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
import time

import numpy as np
import stagesim as st

STEPS_OF_ROUND = 40


def body(rng: random.Random) -> str:
    """Returns the size and the blocks of a robot."""
    corners = rng.randint(3, 9)
    points = " ".join(f"point[{i}] [{math.cos(i * math.tau / corners) * rng.uniform(0.6, 1):.3f} "
                      f"{math.sin(i * math.tau / corners) * rng.uniform(0.6, 1):.3f}]" for i in range(corners))
    size = f"size [{rng.uniform(0.1, 0.5):.3f} {rng.uniform(0.1, 0.5):.3f} 0.3]"
    return size + (f" block( points {corners} {points} z [0 1] )" if rng.random() < 0.6 else "")


def sensor(rng: random.Random) -> str:
    """Returns a ranger with one or two sensors."""
    sensors = "".join(
        f" sensor( range [0 {rng.choice((0.35, 1, 2.5, 8))}] fov {rng.choice((0, 30, 180, 360))} "
        f"samples {rng.randint(1, 40)} ray_model \"{rng.choice(('cell', 'exact'))}\""
        + (" noise [0.01 0.02 0.1]" if rng.random() < 0.2 else "") + " )" for _ in range(rng.randint(1, 2)))
    return f" ranger( pose [{rng.uniform(-0.1, 0.1):.2f} 0 {rng.choice((-0.1, -0.2))} {rng.uniform(-90, 90):.0f}]{sensors} )"


def robot(rng: random.Random, place: tuple[float, float]) -> str:
    """Returns a robot at a place."""
    parts = [f'drive "{rng.choice(("diff", "omni", "car"))}"', body(rng)]
    if rng.random() < 0.3:
        parts.append('localization "odom" odom_noise [0.02 0.01 0.03 0.02]')
    if rng.random() < 0.2:
        parts.append("joules 30 joules_capacity 40")
    if rng.random() < 0.3:
        parts.append("acceleration_bounds [-1 1 -1 1 0 0 -90 90]")
    if rng.random() < 0.2:
        parts.append(f'ctrl "stage/{rng.choice(("wander", "disperse", "pedestrian x=1 y=0"))}"')
        parts.append("ranger( pose [0 0 -0.1 0] sensor( range [0 2] fov 270 samples 16 ) )")
    parts += [sensor(rng) for _ in range(rng.choice((0, 1, 1, 1, 2)))]
    return f"position( pose [{place[0]:.2f} {place[1]:.2f} 0 {rng.uniform(-180, 180):.0f}] {' '.join(parts)} )\n"


def world_text(rng: random.Random, contacts: str) -> str:
    """Returns a closed room with boxes and 1 to 12 robots."""
    half = rng.uniform(1.2, 4)
    text = f'resolution {rng.choice((0.01, 0.02, 0.05))}\ncontacts "{contacts}"\n'
    for x, y, dx, dy in ((0, half, 2 * half, 0.05), (0, -half, 2 * half, 0.05), (half, 0, 0.05, 2 * half),
                         (-half, 0, 0.05, 2 * half)):
        text += f"model( pose [{x} {y} 0 {rng.uniform(-3, 3):.1f}] size [{dx} {dy} 1] )\n"
    side = math.ceil(math.sqrt(16))
    places = [(2 * half * (i % side + 0.5) / side - half, 2 * half * (i // side + 0.5) / side - half)
              for i in range(side * side)]
    rng.shuffle(places)
    robots = rng.randint(1, 12)
    for x, y in places[robots:]:
        if rng.random() < 0.5:
            text += (f"model( pose [{x:.2f} {y:.2f} 0 {rng.uniform(0, 90):.0f}] size [0.2 {rng.uniform(0.1, 0.5):.2f} "
                     f"{rng.choice((0.1, 0.3, 1))}] ranger_return {rng.choice((-1, 0.5, 1))} )\n")
    return text + "".join(robot(rng, place) for place in places[:robots])


class Counts:
    """Counts of the comparisons so far."""

    def __init__(self) -> None:
        self.steps = self.hashes = self.scenes = self.refused = self.stalls = self.moves = self.hits = 0

    def run(self, seed: int, device: str, contacts: str, worlds: int, rounds: int) -> None:
        """Compares worlds of one scene. Exits at a difference."""
        world = st.World.from_text(world_text(random.Random(seed), contacts))
        host = st.Batch.of(world, worlds)
        try:
            other = st.Batch.of(world, worlds, device=device)
        except st.WorldError:  # devices refuse bodies with large outlines
            self.refused += 1
            return
        rng = np.random.default_rng(seed)
        for _ in range(rounds):
            reset = np.flatnonzero(rng.random(worlds) < 0.1)
            before = np.array(host.pose)
            for batch in (host, other):
                batch.reset(ids=reset)
            for steps in (1, 1, STEPS_OF_ROUND - 2):
                commands = rng.uniform(-1.5, 1.5, host.cmd.shape)
                for batch in (host, other):
                    batch.cmd[...] = commands
                    batch.step(steps)
            if host.state_hashes() != other.state_hashes():
                sys.exit(f"found a difference in the scene of seed {seed}, contacts {contacts}")
            self.steps += host.pose[..., 0].size * STEPS_OF_ROUND
            self.hashes += worlds
            self.stalls += int(np.asarray(host.stalled).sum())
            self.moves += int((before != host.pose).any(-1).sum())
        self.hits += self.count_hits(host)
        self.scenes += 1

    @staticmethod
    def count_hits(batch: st.Batch) -> int:
        """Returns the number of rays of the first rangers that are shorter than the longest."""
        try:
            ranges = batch.ranges  # live
        except st.GoneError:
            return 0
        batch.step()
        return int((ranges < np.nanmax(ranges)).sum())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device", default="opencl", help="as in stagesim.Batch (default: opencl)")
    parser.add_argument("--steps", type=float, default=1e6, help="steps of robots to compare (default: 1e6)")
    parser.add_argument("--seconds", type=float, default=500, help="limit (default: 500)")
    parser.add_argument("--worlds", type=int, default=1000, help="of a scene")
    parser.add_argument("--rounds", type=int, default=20, help="of 40 steps, with each scene")
    parser.add_argument("--contacts", default="cells", choices=("cells", "outlines"))
    parser.add_argument("--seed", type=int, default=1, help="of the first scene")
    options = parser.parse_args()
    counts, start = Counts(), time.perf_counter()
    while counts.steps < options.steps and time.perf_counter() - start < options.seconds:
        counts.run(options.seed + counts.scenes + counts.refused, options.device, options.contacts, options.worlds, options.rounds)
    print(f"{counts.scenes} scenes, {counts.refused} refused, {counts.steps:.4g} steps of robots, {counts.hashes} states compared, 0 differences "
          f"in {time.perf_counter() - start:.0f} s; {counts.moves} robots moved, {counts.stalls} stalled, "
          f"{counts.hits} rays hit")
    assert counts.scenes > counts.refused, "the device refuses most scenes"
    assert counts.moves > 0 and counts.stalls > 0 and counts.hits > 0, "the robots did too little"


if __name__ == "__main__":
    main()
