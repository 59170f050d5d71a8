#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Trains each task of a list over several seeds, and draws the learning curves.

  curves.py FOLDER                      # one robot, on the host
  curves.py FOLDER --only eight_cuda    # eight robots with a shared policy, on a card
  curves.py FOLDER --draw               # only draws what is there

Each training is a process of its own and writes FOLDER/NAME-SEED.csv when it has ended, so a second call with the same
FOLDER goes on where the first one was stopped. Afterwards FOLDER/summary.csv has a line for each training, and
FOLDER/curves.png shows all of them. Close other programs first: seconds are those of the clock.
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
import statistics
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
EIGHT = ["--world", str(HERE / "eight.world")]
OTHERS = ("Navigate8", "Navigate32", "Swap", "Cover", "Pursue", "PushT", "Disperse")
PUSH = ["--task", "PushT", "--until", "0.9", "--minibatches", "8"]
#: Options of ppo.py for each training. It stops above 0.9, so that other episodes give 0.9 as well.
RUNS = {
    "navigate": ["--until", "0.94", "--steps", "300000"],
    "eight": [*EIGHT, "--until", "0.92", "--envs", "64", "--steps", "6000000"],
    "eight_cuda": [*EIGHT, "--until", "0.94", "--envs", "2048", "--minibatches", "16", "--device", "cuda",
                   "--steps", "100000000"],
    **{task.lower(): ["--task", task, "--until", "0.9", "--envs", "64", "--steps", "2000000"] for task in OTHERS},
    **{f"{task.lower()}_cuda": ["--task", task, "--until", "0.9", "--envs", "2048", "--minibatches", "16",
                                "--device", "cuda", "--steps", "200000000"] for task in OTHERS},
    "pusht": [*PUSH, "--envs", "512", "--steps", "10000000"],
    # A block's pose goes through the host in each action, so worlds on the card take three times as long.
    "pusht_cuda": [*PUSH, "--envs", "1024", "--device", "cuda", "--worlds", "cpu", "--steps", "100000000"],
}
Row = dict[str, str]


def trained(options: Sequence[str]) -> dict[str, Any]:
    """Trains in this process. Returns the results of ppo.py and the processor time, in seconds."""
    sys.path.insert(0, str(HERE))
    import ppo

    begin = time.process_time()
    return {**ppo.main(options), "cpu": time.process_time() - begin}


def run(name: str, seed: int, folder: Path) -> None:
    """Makes a training in a new process, unless its result is there."""
    path = folder / f"{name}-{seed}.csv"
    if path.exists():
        return
    print(f"{name}, seed {seed}", flush=True)
    options = [*RUNS[name], "--seed", str(seed), "--curve", f"{path}.part"]
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        found = pool.apply(trained, (options,))
    last = found.pop("curve")[-1]
    figures = {"name": name, "seed": seed, "seconds": last["seconds"], "steps": last["steps"],
               "test": last.get("test", ""), "result": found.get("is_success", found["return"]), "cpu": found["cpu"]}
    with open(folder / "summary.csv", "a", newline="") as file:
        writer = csv.DictWriter(file, figures)
        if file.tell() == 0:
            writer.writeheader()
        writer.writerow(figures)
    Path(f"{path}.part").rename(path)


def read(path: Path) -> list[Row]:
    """The lines of a CSV file."""
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def tell(folder: Path, names: Sequence[str]) -> None:
    """Prints medians and ranges over the seeds."""
    rows = read(folder / "summary.csv")
    for name in names:
        found = [row for row in rows if row["name"] == name]
        for figure in ("seconds", "steps", "result", "cpu"):
            values = sorted(float(row[figure]) for row in found)
            if values:
                print(f"{name:<12} {figure:<8} median {statistics.median(values):.4g}"
                      f" ({values[0]:.4g} to {values[-1]:.4g}), {len(values)} seeds")


def draw(folder: Path, names: Sequence[str], over: str, path: Path) -> None:
    """Draws success over seconds or steps: a line for each seed, and a dot for each evaluation without noise."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, all_axes = pyplot.subplots(1, len(names), figsize=(5 * len(names), 3.6), squeeze=False)
    for axes, name in zip(all_axes[0], names):
        for i, file in enumerate(sorted(folder.glob(f"{name}-*.csv"))):
            rows = read(file)
            for column, style in (("score", "-"), ("test", "o")):
                points = [(float(row[over]), float(row[column])) for row in rows if row[column] not in ("", "nan")]
                axes.plot(*(zip(*points) if points else ((), ())), style, color=f"C{i}", markersize=4, linewidth=1)
        axes.axhline(0.9, color="gray", linewidth=0.5)
        axes.set(title=name, xlabel=over, ylim=(0, 1.02), xlim=(0, None))
    all_axes[0][0].set_ylabel("success (dots: deterministic policy)")
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="for the results")
    parser.add_argument("--only", nargs="+", choices=tuple(RUNS), default=["navigate"], help="(default: navigate)")
    parser.add_argument("--seeds", type=int, default=5, help="number of seeds (default: 5)")
    parser.add_argument("--over", choices=("seconds", "steps"), default="seconds", help="axis of the plot")
    parser.add_argument("--draw", action="store_true", help="train nothing")
    options = parser.parse_args(arguments)
    options.folder.mkdir(parents=True, exist_ok=True)
    for seed in range(1, 1 if options.draw else options.seeds + 1):
        for name in options.only:
            run(name, seed, options.folder)
    tell(options.folder, options.only)
    draw(options.folder, options.only, options.over, options.folder / "curves.png")


if __name__ == "__main__":
    main()
