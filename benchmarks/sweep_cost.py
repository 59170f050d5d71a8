#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures the cost of sweeps: overhead per run, comparison with xargs, resuming, and losses by
killed workers.

  tools/test -R cli_sweep && benchmarks/sweep_cost.py            # all of it: some minutes
  benchmarks/sweep_cost.py --runs 5000 kills                     # one part

Parts:
  empty    runs without anything in them: seconds for each
  xargs    the same runs by `stage sweep` and by `xargs -P`, in turn
  kills    empty runs whose workers, and now and then the whole sweep, are killed at random: what has to be
           done again, and whether the table is that of an undisturbed sweep
  resume   --resume where everything is done; the merged table
Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import os
import random
import shlex
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BUILD = Path(os.environ.get("STAGE_BINARY_DIR", ROOT / "build" / "release"))
STAGE = BUILD / "bin" / "stage"
COUNTS = BUILD / "tests" / "plugins" / "counts.so"
JOBS = 2
REPEATS = 5


def stage(*words: object) -> None:
    """Runs the program; if it fails, ends with its error message."""
    done = subprocess.run([STAGE, *map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr)


def seconds(do: Callable[[], None]) -> float:
    """Duration of a call in seconds."""
    start = time.perf_counter()
    do()
    return time.perf_counter() - start


def row(figure: str, value: str) -> None:
    """Prints a row of the table."""
    print(f"| {figure} | {value} |", flush=True)


def median(values: list[float], unit: str) -> str:
    """Formats the median with minimum and maximum."""
    return f"{statistics.median(values):.3g} {unit} ({min(values):.3g} to {max(values):.3g})"


def empty_world(folder: Path) -> Path:
    """Writes a world without models that takes one step."""
    world = folder / "empty.world"
    world.write_text("quit_time 0.1\n")
    return world


def empty(folder: Path, runs: int) -> None:
    """Measures the overhead per run."""
    cases = [("nothing in it", empty_world(folder), ()),
             ("the cave, 10 robots, one step", ROOT / "worlds" / "cave.world",
              ("--set", "robots=10", "--duration", "0.1"))]
    for name, world, options in cases:
        for jobs in (1, JOBS):
            count = runs if not options else max(200, runs // 50)
            took = [seconds(lambda: stage("sweep", world, *options, "--runs", f"0:{count}", "--jobs", jobs,
                                          "-o", folder / f"empty-{name[:4]}-{jobs}-{i}")) / count
                    for i in range(REPEATS)]
            row(f"a run with {name}, --jobs {jobs}", median([t * 1e3 for t in took], "ms"))


def commands(folder: Path, count: int) -> Iterator[str]:
    """The replay commands of the records, each with its statistics in a file."""
    import json
    for index in range(count):
        record = json.loads((folder / "runs" / f"{index // 1000:03}" / f"{index:06}.json").read_text())
        words = shlex.split(record["replay"])[1:]
        yield shlex.join([str(STAGE), *words, "--stats", str(folder / f"{index}.stats")])


def xargs(folder: Path, _: int) -> None:
    """Compares a sweep with a separate process per run."""
    cases = [("cave", 0.5, 300), ("cave", 1.5, 300), ("cave", 4, 200), ("cave", 40, 60),
             ("hospital", 0.5, 300), ("hospital", 1.5, 200), ("hospital", 40, 60)]
    for name, duration, count in cases:
        world, ratios, runs = ROOT / "worlds" / f"{name}.world", [], []
        for i in range(REPEATS):
            out = folder / f"xargs-{name}-{duration}-{i}"
            ours = seconds(lambda: stage("sweep", world, "--set", "robots=20", "--duration", duration,
                                         "--runs", f"0:{count}", "--jobs", JOBS, "-o", out))
            lines = "\n".join(commands(out, count))
            theirs = seconds(lambda: subprocess.run(
                ["xargs", "-P", str(JOBS), "-d", "\n", "-I", "{}", "sh", "-c", "{} >/dev/null 2>&1"],
                input=lines, text=True, check=True))
            ratios.append(theirs / ours)
            runs.append(ours * JOBS / count * 1e3)
        row(f"time of xargs -P {JOBS} relative to a sweep, {name}, runs of {statistics.median(runs):.0f} ms",
            median(ratios, "times"))


def children(pid: int) -> list[int]:
    """Child processes of a process."""
    try:
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def disturb(process: subprocess.Popen[bytes], chance: random.Random) -> int:
    """Kills workers, and with a probability of one fifth the sweep itself, until the sweep has ended.
    Returns the number of kills."""
    killed = 0
    while process.poll() is None:
        time.sleep(chance.uniform(0.05, 0.6))
        workers = children(process.pid)
        if not workers or process.poll() is not None:
            continue
        if chance.random() < 0.2:
            killed += len(workers)
            process.kill()
        else:
            killed += 1
            os.kill(chance.choice(workers), signal.SIGKILL)
    return killed


def kills(folder: Path, runs: int) -> None:
    """Measures a sweep whose workers are killed."""
    world, starts, out = folder / "counted.world", folder / "starts", folder / "killed"
    world.write_text(f'quit_time 0.1\nmodel( ctrl "{COUNTS} {starts}" )\n')
    stage("sweep", world, "--runs", f"0:{runs}", "--jobs", JOBS, "-o", folder / "whole")
    starts.unlink()
    stage("sweep", world, "--runs", f"0:{runs}", "-o", out, "--plan-only")
    before, killed, sessions, chance = starts.stat().st_size, 0, 0, random.Random(1)
    while True:
        process = subprocess.Popen([STAGE, "sweep", "--resume", out, "--jobs", str(JOBS)],
                                   stdout=subprocess.DEVNULL)
        killed += disturb(process, chance)
        sessions += 1
        if process.wait() == 0:
            break
    again = starts.stat().st_size - before - runs
    for name in ("whole", "killed"):
        stage("merge", folder / name, "-o", folder / f"{name}.csv")
    same = (folder / "whole.csv").read_bytes() == (folder / "killed.csv").read_bytes()
    row(f"{runs} runs, {killed} workers killed in {sessions} sessions: repeated runs", f"{again}")
    row("same table as that of an undisturbed sweep", "yes" if same else "NO")


def resume(folder: Path, runs: int) -> None:
    """Measures resuming a finished sweep."""
    out = folder / "resume"
    stage("sweep", empty_world(folder), "--runs", f"0:{runs}", "--jobs", JOBS, "-o", out)
    bytes_each = sum(file.stat().st_size for file in out.rglob("*.json")) / runs
    row(f"--resume of {runs} finished runs",
        median([seconds(lambda: stage("sweep", "--resume", out)) for _ in range(REPEATS)], "s"))
    row(f"--status of {runs} finished runs", f"{seconds(lambda: stage('sweep', '--status', out)):.3g} s")
    row(f"merge of {runs} runs",
        median([seconds(lambda: stage("merge", out, "-o", folder / "all.csv")) for _ in range(REPEATS)], "s"))
    row("bytes per record", f"{bytes_each:.0f}")


PARTS = {"empty": empty, "xargs": xargs, "kills": kills, "resume": resume}


def main() -> None:
    """Measures the requested parts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", choices=[*PARTS, []], help="(default: all)")
    parser.add_argument("--runs", type=int, default=100_000,
                        help="number of runs, for the parts with many runs")
    chosen = parser.parse_args()
    print("| figure | value |\n|---|---|")
    for name in chosen.parts or PARTS:
        with tempfile.TemporaryDirectory(prefix="stage-sweep-cost-") as folder:
            PARTS[name](Path(folder), min(chosen.runs, 10_000) if name == "empty" else chosen.runs)


if __name__ == "__main__":
    main()
