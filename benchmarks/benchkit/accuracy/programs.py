# SPDX-License-Identifier: GPL-2.0-or-later
"""The three programs that the benchmark runs, and the capabilities of their build."""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from benchkit.programs import RunError, run_command, run_stage

from .settings import RAY_MODELS, Setting


class Programs:
    """The programs of one build."""

    def __init__(self, build: Path) -> None:
        self.stage = build / "bin" / "stage"
        self.ray_truth = build / "benchmarks" / "ray_truth"
        self.pose_log = build / "benchmarks" / "pose_log"
        for program in (self.stage, self.ray_truth, self.pose_log):
            if not program.exists():
                raise RunError(f"found no {program}; build it first: cmake --preset release && "
                               "cmake --build --preset release")
        help_text = self._run([self.stage, "--help"]).stdout
        self.has_ray_models = "--ray-model" in help_text
        self.models = RAY_MODELS if self.has_ray_models else RAY_MODELS[:1]

    def opencl_device(self) -> str:
        """The OpenCL device of the CPU, used to compare hit lists of different lengths; empty if
        there is none."""
        done = run_command([str(self.stage), "--opencl=list"])
        devices = [line.strip() for line in done.stdout.splitlines()]
        return next((line for line in devices if line.startswith("cpu")), "")

    def version(self) -> str:
        return self._run([self.stage, "--version"]).stdout.strip()

    def speed(self, world: Path, seconds: float, setting: Setting) -> dict[str, object]:
        """Runs the stage program and returns its statistics with the state hash."""
        options, environment = ["--threads", str(setting.threads)], {}
        if setting.hits:
            options += ["--opencl=cpu", "--opencl-always"]
            environment["STAGE_CL_HITS"] = str(setting.hits)
        done = run_stage(self.stage, world, seconds, options, environment)
        if setting.hits and not (done.stats.get("opencl") or {}).get("steps_on_device"):
            raise RunError("the OpenCL device computed no step: " + done.warnings[:200])
        return {**done.stats, "state_hash": done.state_hash}

    def truth(self, world: Path, options: list[str], seed: int) -> dict[str, object]:
        """Runs ray_truth and returns its output."""
        with tempfile.NamedTemporaryFile(suffix=".json") as summary:
            self._run([self.ray_truth, *options, "--seed", str(seed), "--quiet", "--json",
                       summary.name, world])
            return json.loads(Path(summary.name).read_text(encoding="utf-8"))

    def poses(self, world: Path, options: list[str]) -> "Poses":
        with tempfile.NamedTemporaryFile(suffix=".csv") as table:
            self._run([self.pose_log, *options, "--output", table.name, world])
            return Poses.read(Path(table.name))

    def _run(self, command: list[object]) -> "subprocess.CompletedProcess[str]":
        words = [str(word) for word in command]
        try:
            return run_command(words)
        except RunError as error:
            raise RunError(f"{' '.join(words)}: {error}") from None


class Poses:
    """Poses of the robots in a run: times[t]; x, y, a (heading) and stalled, each [t, robot]."""

    def __init__(self, times: np.ndarray, x: np.ndarray, y: np.ndarray, a: np.ndarray,
                 stalled: np.ndarray) -> None:
        self.times, self.x, self.y, self.a, self.stalled = times, x, y, a, stalled

    @staticmethod
    def read(path: Path) -> "Poses":
        """Reads a table of pose_log, which lists all robots time by time."""
        table = np.loadtxt(path, delimiter=",", skiprows=1, usecols=(0, 2, 3, 4, 5), ndmin=2)
        robots = int(np.count_nonzero(table[:, 0] == table[0, 0]))
        grid = table.reshape(-1, robots, 5)
        return Poses(grid[:, 0, 0], grid[:, :, 1], grid[:, :, 2], grid[:, :, 3],
                     grid[:, :, 4])
