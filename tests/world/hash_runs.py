# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs of all shipped worlds, and of one world for each stock controller, and their state hashes."""

from __future__ import annotations

import os
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
SEED = 5


# The options of the stage program for each kind of run. The defaults are rays through cells and contacts of outlines.
KINDS = {"default": [], "exact": ["--ray-model", "exact"], "cells": ["--contacts", "cells"]}


class Run(NamedTuple):
    """A world, simulated for some seconds."""

    world: str  # from the top of the tree
    seconds: int
    kind: str = "default"  # one of KINDS

    def __str__(self) -> str:
        return f"{self.world} {self.seconds} s, {self.kind}"


def shipped_worlds() -> list[str]:
    """The worlds in the folder worlds."""
    return sorted(f"worlds/{path.name}" for path in (ROOT / "worlds").glob("*.world"))


def controller_worlds() -> list[str]:
    """One world for each stock controller."""
    folder = ROOT / "tests" / "data" / "controllers"
    return sorted(f"tests/data/controllers/{path.name}" for path in folder.glob("*.world"))


class RunError(Exception):
    """A run that gave no hash."""


def hash_of(stage: Path, run: Run, options: list[str], environment: dict[str, str] | None = None,
            time_limit: float = 600) -> str:
    """The state hash at the end of the run."""
    command = [str(stage), "-g", "--no-progress", "--seed", str(SEED), "--duration",
               str(run.seconds), "--state-hash", *KINDS[run.kind], *options, str(ROOT / run.world)]
    try:
        result = subprocess.run(command, env=dict(os.environ, **(environment or {})), text=True,
                                capture_output=True, timeout=time_limit, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RunError(f"{run}: {error}") from None
    hashes = [line.split()[1] for line in result.stdout.splitlines()
              if line.startswith("state-hash ")]
    if result.returncode != 0 or len(hashes) != 1:
        last = (result.stderr.strip() or result.stdout.strip() or "no output").splitlines()[-1]
        raise RunError(f"{run}: status {result.returncode}: {last}")
    return hashes[0]


def hashes_of(stage: Path, runs: list[Run], options: list[str],
              environment: dict[str, str] | None = None) -> dict[Run, str]:
    """Computes the hash of each run, in parallel on all processors, starting with the longest
    runs."""
    first = sorted(runs, key=lambda run: -run.seconds)
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        found = pool.map(lambda run: hash_of(stage, run, options, environment), first)
        return dict(zip(first, found))
