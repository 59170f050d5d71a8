#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures the speed of batches whose worlds are stepped on a device, with commands and readings in each step.

  tools/test -R python_package       # builds what is needed
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/device_batch.py --device opencl:gpu

With CUDA and PyTorch, commands are written on the device, and arrays stay there. Otherwise they are arrays of NumPy.
Prints a Markdown table of robot-steps per second and microseconds per call, without resets and with a tenth of the
worlds reset in each step: once with lists from the host and, with CUDA, once with masks on the card. All worlds are
reset every 100 steps. Fails unless robots move and stall, rays hit something, and the states of a smaller batch
equal those of the host, to the bit.
"""

from __future__ import annotations

import argparse
import math
import time
from typing import Any

import numpy as np
import stagesim as st

try:
    import torch
except ImportError:
    torch = None


EPISODE = 100  #: steps until all worlds are reset


def world_text(robots: int, rays: int, reach: float) -> str:
    """Returns robots with eight corners in a square of 2 m, without walls."""
    corners = " ".join(f"point[{i}] [{math.cos((i + 0.5) * math.pi / 4)} {math.sin((i + 0.5) * math.pi / 4)}]"
                       for i in range(8))
    side = math.ceil(math.sqrt(robots))
    places = (f"robot( pose [{2 * (i % side + 0.5) / side - 1} {2 * (i // side + 0.5) / side - 1} 0 {37 * i}] )\n"
              for i in range(robots))
    return f"""resolution 0.02
contacts "cells"
define robot position( drive "omni" size [0.2 0.2 0.2] block( points 8 {corners} z [0 1] )
  ranger( pose [0 0 -0.1 0] sensor( range [0 {reach}] fov 330 samples {rays} ) ) )
""" + "".join(places)


class Run:
    """A batch, and what a learner reads and writes."""

    def __init__(self, text: str, worlds: int, device: str | None, asynchronous: bool = False) -> None:
        self.batch = st.Batch.of(st.World.from_text(text), worlds, device=device)
        self.arrays = [self.batch.pose, self.batch.ranges, self.batch.stalled]
        self.on_card = isinstance(self.batch.cmd, st.DeviceArray)
        if self.on_card:
            self.cmd = torch.from_dlpack(self.batch.cmd)
            self.arrays = [torch.from_dlpack(array) for array in self.arrays]
        self.random = np.random.default_rng(1)
        self.way = self.random.uniform(-2, 2, self.batch.cmd.shape) * [1, 1, 0]
        if self.on_card:
            self.way = torch.as_tensor(self.way, device=self.cmd.device)
            self.batch.synchronous = not asynchronous
        self.steps = 0

    def command(self) -> None:
        """Sends robots to and fro, so that they stay near each other. Commands are calculated where the arrays are."""
        sign = 1 if (self.steps + 5) // 10 % 2 == 0 else -1
        self.steps += 1
        if self.on_card:
            torch.mul(self.way, sign, out=self.cmd)
        else:
            np.multiply(self.way, sign, out=self.batch.cmd)

    def resets(self, share: float, masks: bool) -> list[Any]:
        """Returns ten lists of `share` of the worlds, or masks on the card."""
        lists = [np.sort(self.random.permutation(self.batch.n)[:round(share * self.batch.n)]) for _ in range(10)]
        if not masks:
            return lists
        return [torch.as_tensor(np.isin(np.arange(self.batch.n), list_), device=self.cmd.device) for list_ in lists]

    def seconds_of_step(self, seconds: float, share: float, masks: bool = False) -> float:
        """Returns the mean duration of a step, of which `share` of the worlds are reset."""
        resets = self.resets(share, masks)
        count, begin = 0, time.perf_counter()
        while time.perf_counter() - begin < seconds or count % 10 != 0:
            if self.steps % EPISODE == 0:
                self.batch.reset()
            if share > 0:
                self.batch.reset(ids=resets[count % 10])
            self.command()
            self.batch.step()
            count += 1
            if count % 10 == 0:
                self.wait()
        return (time.perf_counter() - begin) / count

    def wait(self) -> None:
        """Waits until the device has done its work."""
        if self.on_card:
            torch.cuda.synchronize()

    def check(self, before: np.ndarray, reach: float) -> None:
        """Asserts that the robots did what is measured."""
        self.batch.reset()
        self.steps = 0
        for _ in range(5):  # until they turn around
            self.command()
            self.batch.step()
        pose, ranges, stalled = (np.asarray(array.cpu() if self.on_card else array) for array in self.arrays)
        assert (pose != before).any(axis=-1).mean() > 0.9, "found robots that do not move"
        share = (ranges < reach).mean()
        assert share > 0.001, f"found too few rays that hit something: {share:.5f}"
        assert stalled.any(), "found no robot that stalls"


def compare(text: str, device: str) -> None:
    """Asserts that worlds on the device equal those on the host."""
    host, other = Run(text, 100, None), Run(text, 100, device)
    for _ in range(50):
        host.command()
        other.command()
        host.batch.step()
        other.batch.step()
    assert host.batch.state_hashes() == other.batch.state_hashes(), "the device differs from the host"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device", default="opencl", help="as in stagesim.Batch (default: opencl)")
    parser.add_argument("--worlds", default="1,1024,16384,65536", help="numbers of worlds")
    parser.add_argument("--robots", default="4x12x0.35,16x128x1.2", help="robots x rays x metres of reach")
    parser.add_argument("--asynchronous", action="store_true", help="start work in CUDA's default stream, without waiting")
    parser.add_argument("--seconds", type=float, default=1.0, help="of each measurement")
    options = parser.parse_args()
    print("| robots × rays | worlds | million robot-steps per second | microseconds per step | with resets of a tenth | "
          "by masks on the card |")
    print("|---|---|---|---|---|---|")
    for scene in options.robots.split(","):
        robots, rays, reach = int(scene.split("x")[0]), int(scene.split("x")[1]), float(scene.split("x")[2])
        text = world_text(robots, rays, reach)
        compare(text, options.device)
        for worlds in map(int, options.worlds.split(",")):
            run: Any = Run(text, worlds, options.device, options.asynchronous)
            before = np.array(run.batch.pose)
            run.seconds_of_step(0.2, 0)
            step = run.seconds_of_step(options.seconds, 0)
            if worlds > 1:
                run.check(before, reach)
            reset = run.seconds_of_step(options.seconds, 0.1)
            masks = f"{run.seconds_of_step(options.seconds, 0.1, True) * 1e6:.0f}" if run.on_card else "-"
            print(f"| {robots} × {rays} | {worlds} | {worlds * robots / step / 1e6:.2f} | {step * 1e6:.0f} | "
                  f"{reset * 1e6:.0f} | {masks} |", flush=True)


if __name__ == "__main__":
    main()
