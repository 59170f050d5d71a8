# SPDX-License-Identifier: GPL-2.0-or-later
"""Executes one run of the stage program and makes its record. Failed runs are not repeated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from benchkit.programs import Outcome, RunError, populate
from benchkit.series.records import NAN, PHASES, Key

# Empty kernel caches, by driver: PoCL, NVIDIA, Mesa, Intel. {} is a new folder.
NO_KERNEL_CACHE = {
    "POCL_CACHE_DIR": "{}", "CUDA_CACHE_DISABLE": "1", "CUDA_CACHE_PATH": "{}",
    "MESA_SHADER_CACHE_DISABLE": "true", "NEO_CACHE_PERSISTENT": "0",
}


@dataclass(frozen=True)
class Backend:
    """A way to trace rays, with the options of the program that select it."""

    label: str  # host1, hostN, host:THREADS, cl:DEVICE or auto
    options: tuple[str, ...]

    @property
    def is_device(self) -> bool:
        return self.label.startswith("cl:")


@dataclass(frozen=True)
class Job:
    """A run that is to be executed."""

    purpose: str
    world: str
    population: int
    backend: Backend
    repeat: int
    simulated_seconds: float

    @property
    def key(self) -> Key:
        return (self.purpose, self.world, self.population, self.backend.label, self.repeat)


class Worlds:
    """World files of any population, each written once by tools/populate."""

    def __init__(self, folder: Path, seed: int) -> None:
        self._folder = folder
        self._seed = seed

    def path(self, world: str, population: int) -> Path:
        file = self._folder / f"{world}-{population}.world"
        if not file.exists():
            populate(file, world, population, "--seed", str(self._seed))
        return file


def check_outcome(job: Job, outcome: Outcome) -> None:
    """Rejects a run in which the program silently used another backend."""
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
    """Columns of a record that come from the program."""
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
