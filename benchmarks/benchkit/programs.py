# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs programs, mainly the stage program. Failed runs are not repeated."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Sequence

from benchkit.machine import ROOT
from benchkit.store import one_line


class RunError(Exception):
    """The reason in one line why a run gave no figures."""


@dataclass(frozen=True)
class Outcome:
    """The output of one run of the program."""

    stats: dict  # the output of --stats
    state_hash: str
    process_seconds: float
    warnings: str


def why(done: subprocess.CompletedProcess) -> str:
    """The program's error message, if there is one."""
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    end = f"ended by signal {-done.returncode}" if done.returncode < 0 else \
        f"exit status {done.returncode}"
    return one_line(f"{end}: {lines[-1]}" if lines else end)


def run_command(command: list[str], environment: dict[str, str] | None = None,
                time_limit: float | None = None) -> subprocess.CompletedProcess:
    """Returns the output of a successful program. `environment` is added to that of this
    process."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace",
                              check=False, stdin=subprocess.DEVNULL, timeout=time_limit,
                              env={**os.environ, **(environment or {})})
    except subprocess.TimeoutExpired:
        raise RunError(f"stopped after {time_limit:.0f} s, far longer than expected") from None
    except OSError as error:
        raise RunError(f"cannot run {command[0]}: {error.strerror}") from None
    if done.returncode in (-signal.SIGINT, 128 + signal.SIGINT):
        raise KeyboardInterrupt  # Ctrl-C in the terminal also reached the program
    if done.returncode != 0:
        raise RunError(why(done))
    return done


def run_stage(stage: Path, world: Path, seconds: float, options: list[str],
              environment: dict[str, str] | None = None,
              time_limit: float | None = None) -> Outcome:
    """Runs a world without a window; raises RunError if there are no statistics."""
    with tempfile.TemporaryDirectory(prefix="stage-run-") as folder:
        stats = Path(folder) / "stats.json"
        command = [str(stage), "-g", "--no-progress", str(world), "--duration", f"{seconds:g}",
                   "--state-hash", "--stats", str(stats), *options]
        started = time.monotonic()
        done = run_command(command, environment, time_limit)
        took = time.monotonic() - started
        try:
            figures = json.loads(stats.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            raise RunError("the program wrote no statistics") from None
    found = re.search(r"^state-hash (\w+)", done.stdout, re.MULTILINE)
    if not found:
        raise RunError("the program wrote no state hash")
    warnings = [line for line in done.stderr.splitlines() if "warning" in line.lower()]
    return Outcome(figures, found[1], took, one_line("; ".join(warnings)))


def figures(stage: Path, world: Path, seconds: float, options: list[str]) -> dict:
    """Runs a world; returns its statistics with the state hash."""
    outcome = run_stage(stage, world, seconds, options)
    return {**outcome.stats, "state_hash": outcome.state_hash}


def explain(stage: Path, world: Path, options: Sequence[str] = ()) -> dict:
    """Returns the output of --explain for a world."""
    return json.loads(run_command([str(stage), "--explain=json", *options, str(world)]).stdout)


def populate(target: Path, series: str, robots: int, *options: str) -> Path:
    """Writes a world of a series with the given number of robots."""
    run_command([str(ROOT / "tools/populate"), series, str(robots), *options, "-o", str(target)])
    return target
