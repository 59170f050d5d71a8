#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures the speed of batches of up to 16 384 worlds, and whether idle worlds slow others down.

  tools/test -R python_package       # builds what is needed
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/batch_scaling.py

Prints a Markdown table of agent-steps per second: medians, with minimum and maximum in brackets. Fails unless
robots move and rays hit something in every world, and each state is bit-equal to that of a run with one thread.
"""

from __future__ import annotations

import argparse
import gc
import statistics
import time

import numpy as np
import stagesim as st
from stagesim import _core

#: A small room with four robots of 12 rays each, typical of reinforcement learning.
ROOM = """
resolution 0.05
model( size [8 0.2 1] pose [0 4 0 0] ) model( size [8 0.2 1] pose [0 -4 0 0] )
model( size [0.2 8 1] pose [4 0 0 0] ) model( size [0.2 8 1] pose [-4 0 0 0] )
define bot position( size [0.3 0.3 0.4] ranger( pose [0 0 -0.2 0] sensor( range [0 12] fov 330 samples 12 ) ) )
bot( pose [2 2 0 45] ) bot( pose [-2 2 0 135] ) bot( pose [-2 -2 0 -135] ) bot( pose [2 -2 0 -45] )
"""
STEPS = 5  # steps per call, typical of reinforcement learning


def batch_of(worlds: int, threads: int) -> st.Batch:
    """Worlds whose robots drive in circles without touching a wall."""
    batch = st.Batch.of(st.World.from_text(ROOM), worlds, threads=threads)
    batch.cmd[..., 0] = 0.4
    batch.cmd[..., 2] = np.linspace(0.6, 1.0, worlds)[:, None]
    return batch


def check(batch: st.Batch, before: np.ndarray) -> None:
    """Asserts that robots have moved since the poses `before`, of shape (n, robots, 4), and that their rays
    hit something.

    Call it within a few steps: a robot that drives in a circle returns to its start.
    """
    moved = np.hypot(*(batch.pose[..., :2] - before[..., :2]).transpose(2, 0, 1))
    assert (moved > 0.01).all(), "found a robot that has not moved"
    assert (batch.ranges < 12).all(axis=-1).all(), "found rays that hit nothing in a closed room"
    assert batch.failed == [None] * batch.n


def speeds(batch: st.Batch, seconds: float, repeats: int) -> list[float]:
    """Returns agent-steps per second of each repeat."""
    _ = batch.ranges
    found = []
    for _ in range(repeats):
        calls, begin = 0, time.perf_counter()
        while time.perf_counter() - begin < seconds or calls == 0:
            batch.step(STEPS)
            calls += 1
        found.append(calls * STEPS * batch.n * len(batch) / (time.perf_counter() - begin))
        before = batch.pose.copy()
        batch.step(STEPS)
        check(batch, before)
    return found


def same_as_one_thread(worlds: int, threads: int) -> None:
    """Asserts equal states after a few steps with `threads` and with one thread."""
    batches = [batch_of(worlds, count) for count in (threads, 1)]
    for batch in batches:
        _ = batch.ranges
        batch.step(STEPS)
    assert batches[0].state_hashes() == batches[1].state_hashes(), "found states that depend on the threads"


def row(*cells: str) -> None:
    print("| " + " | ".join(cells) + " |", flush=True)


def span(values: list[float]) -> str:
    return f"{statistics.median(values):,.0f} ({min(values):,.0f} to {max(values):,.0f})".replace(",", " ")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", default="64,1024,4096,16384",
                        help="numbers of worlds, separated by commas (default %(default)s)")
    parser.add_argument("--threads", help="numbers of threads, separated by commas (default: 1 and "
                                          "all processors)")
    parser.add_argument("--idle", type=int, default=16000, help="idle worlds beside a batch of 64 (default %(default)s)")
    parser.add_argument("--seconds", type=float, default=2,
                        help="seconds per repeat (default %(default)s)")
    parser.add_argument("--repeats", type=int, default=5, help="(default %(default)s)")
    chosen = parser.parse_args()
    most = _core.count_processors()
    threads = [int(count) for count in chosen.threads.split(",")] if chosen.threads else sorted({1, most})
    same_as_one_thread(64, max(2, most))
    row("worlds", "threads", "agent-steps per second")
    row("---", "---", "---")
    for worlds in (int(count) for count in chosen.worlds.split(",")):
        for count in threads:
            row(str(worlds), str(count), span(speeds(batch_of(worlds, count), chosen.seconds, chosen.repeats)))
            gc.collect()
    if chosen.idle > 0:
        idle = batch_of(chosen.idle, most)
        beside = speeds(batch_of(64, most), chosen.seconds, chosen.repeats)
        row(f"64, besides {idle.n} idle ones", str(most), span(beside))


if __name__ == "__main__":
    main()
