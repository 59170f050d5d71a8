# SPDX-License-Identifier: GPL-2.0-or-later
"""One run of the stage program, and the record of it. Nothing is tried twice."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from harness.machine import ROOT
from harness.store import NAN, PHASES, Key, one_line

# Empty kernel caches, by driver: PoCL, NVIDIA, Mesa, Intel. {} is a fresh folder.
NO_KERNEL_CACHE = {
    "POCL_CACHE_DIR": "{}", "CUDA_CACHE_DISABLE": "1", "CUDA_CACHE_PATH": "{}",
    "MESA_SHADER_CACHE_DISABLE": "true", "NEO_CACHE_PERSISTENT": "0",
}


class RunError(Exception):
    """Why a run gave no figures, in one line."""


@dataclass(frozen=True)
class Backend:
    """A way to trace the rays, and the options of the program that choose it."""

    label: str  # host1, hostN, host:THREADS, cl:DEVICE or auto
    options: tuple[str, ...]

    @property
    def is_device(self) -> bool:
        return self.label.startswith("cl:")


@dataclass(frozen=True)
class Job:
    """A run to be done."""

    purpose: str
    world: str
    population: int
    backend: Backend
    repeat: int
    simulated_seconds: float

    @property
    def key(self) -> Key:
        return (self.purpose, self.world, self.population, self.backend.label, self.repeat)


@dataclass(frozen=True)
class Outcome:
    """What one run of the program left."""

    stats: dict  # as of --stats
    state_hash: str
    process_seconds: float
    warnings: str


def why(done: subprocess.CompletedProcess) -> str:
    """The program's own words about its failure, if it has any."""
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    end = f"ended by signal {-done.returncode}" if done.returncode < 0 else \
        f"exit status {done.returncode}"
    return one_line(f"{end}: {lines[-1]}" if lines else end)


def run_command(command: list[str], environment: dict[str, str], time_limit: float | None
                ) -> subprocess.CompletedProcess:
    """The program's output, once it has succeeded."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace",
                              check=False, stdin=subprocess.DEVNULL, timeout=time_limit,
                              env=environment)
    except subprocess.TimeoutExpired:
        raise RunError(f"ended by us after {time_limit:.0f} s, far longer than expected") from None
    except OSError as error:
        raise RunError(f"cannot run {command[0]}: {error.strerror}") from None
    if done.returncode in (-signal.SIGINT, 128 + signal.SIGINT):
        raise KeyboardInterrupt  # the terminal's Ctrl-C went to the program, too
    if done.returncode != 0:
        raise RunError(why(done))
    return done


def run_stage(stage: Path, world: Path, seconds: float, options: list[str],
              environment: dict[str, str] | None = None,
              time_limit: float | None = None) -> Outcome:
    """Runs the program on a world without a window; RunError unless there are statistics."""
    with tempfile.TemporaryDirectory(prefix="stage-run-") as folder:
        stats = Path(folder) / "stats.json"
        command = [str(stage), "-g", "--no-progress", str(world), "--duration", f"{seconds:g}",
                   "--state-hash", "--stats", str(stats), *options]
        started = time.monotonic()
        done = run_command(command, {**os.environ, **(environment or {})}, time_limit)
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


class Worlds:
    """World files of any population, each written once by tools/populate."""

    def __init__(self, folder: Path, seed: int) -> None:
        self._folder = folder
        self._seed = seed

    def path(self, world: str, population: int) -> Path:
        file = self._folder / f"{world}-{population}.world"
        if not file.exists():
            done = subprocess.run(
                [ROOT / "tools/populate", world, str(population), "--seed", str(self._seed), "-o",
                 file], capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise RunError(one_line(done.stderr) or "tools/populate failed")
        return file


def check_outcome(job: Job, outcome: Outcome) -> None:
    """A run that quietly did something else is no measurement."""
    stats, opencl = outcome.stats, outcome.stats["opencl"]
    if stats["robots"] != job.population:
        raise RunError(f"{stats['robots']} robots were simulated, expected {job.population}")
    if not math.isclose(stats["simulated_seconds"], job.simulated_seconds, abs_tol=1e-6):
        raise RunError(f"{stats['simulated_seconds']:g} seconds were simulated, expected "
                       f"{job.simulated_seconds:g}")
    uses_opencl = any(option.startswith("--opencl") for option in job.backend.options)
    if uses_opencl and opencl is None:
        raise RunError("no OpenCL device was used: " + (outcome.warnings or "none found"))
    if job.backend.is_device and opencl["steps_on_device"] < stats["steps"]:
        raise RunError(f"{opencl['steps_on_device']} of {stats['steps']} steps were made on the "
                       f"device, expected all: {outcome.warnings or 'no warning'}")


def figures_of(outcome: Outcome) -> dict:
    """The columns of a record that come from the program."""
    stats, opencl = outcome.stats, outcome.stats["opencl"] or {}
    steps = stats["steps"]
    figures = {
        "device": opencl.get("device", ""), "threads": stats["threads"], "steps": steps,
        "wall_seconds": stats["wall_seconds"], "load_seconds": stats["load_seconds"],
        "process_seconds": outcome.process_seconds, "r_acc": stats["r_acc"],
        "rays_per_step": stats["rays"] / steps,
        "potential_hits_per_ray": stats["potential_hits_per_ray"],
        "peak_memory_mb": stats["peak_memory_mb"],
        "compile_seconds": opencl.get("compile_seconds", NAN),
        "steps_on_device": opencl.get("steps_on_device", NAN),
        "mb_sent_per_step": opencl.get("bytes_sent", NAN) / steps / 1e6,
        "mb_fetched_per_step": opencl.get("bytes_fetched", NAN) / steps / 1e6,
        "state_hash": outcome.state_hash, "notes": outcome.warnings,
    }
    for phase in PHASES:
        figures[f"{phase}_ms"] = stats["phases_ms_per_step"][phase]
    return figures
