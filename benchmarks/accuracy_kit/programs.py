# SPDX-License-Identifier: GPL-2.0-or-later
"""The three programs that the benchmark runs, and what they know."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from .settings import RAY_MODELS, Setting
from .worlds import ROOT


class RunError(Exception):
    """A program failed; one line says which and why."""


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
        """The CPU's, which is where lists of different lengths are tried; empty: there is none."""
        done = subprocess.run([self.stage, "--opencl=list"], capture_output=True, text=True,
                              check=False)
        devices = [line.strip() for line in done.stdout.splitlines()]
        return next((line for line in devices if line.startswith("cpu")), "")

    def version(self) -> str:
        return self._run([self.stage, "--version"]).stdout.strip()

    def speed(self, world: Path, seconds: float, setting: Setting) -> dict[str, object]:
        """A timed run of the stage program: its statistics and its state hash."""
        command = [self.stage, "-g", world, "--duration", f"{seconds:g}", "--state-hash",
                   "--threads", str(setting.threads), "--no-progress"]
        environment = dict(os.environ)
        if setting.hits:
            command += ["--opencl=cpu", "--opencl-always"]
            environment["STAGE_CL_HITS"] = str(setting.hits)
        with tempfile.NamedTemporaryFile(suffix=".json") as stats:
            done = self._run([*command, "--stats", stats.name], environment)
            # By name: the program replaces the file.
            result = json.loads(Path(stats.name).read_text(encoding="utf-8"))
        result["state_hash"] = next((line.split()[-1] for line in done.stdout.splitlines()
                                     if line.startswith("state-hash")), "")
        if setting.hits and not (result.get("opencl") or {}).get("steps_on_device"):
            raise RunError("the OpenCL device did no step: " + done.stderr.strip()[:200])
        return result

    def truth(self, world: Path, options: list[str], seed: int) -> dict[str, object]:
        """What ray_truth says."""
        with tempfile.NamedTemporaryFile(suffix=".json") as summary:
            self._run([self.ray_truth, *options, "--seed", str(seed), "--quiet", "--json",
                       summary.name, world])
            return json.loads(Path(summary.name).read_text(encoding="utf-8"))

    def poses(self, world: Path, options: list[str]) -> "Poses":
        with tempfile.NamedTemporaryFile(suffix=".csv") as table:
            self._run([self.pose_log, *options, "--output", table.name, world])
            return Poses.read(Path(table.name))

    def _run(self, command: list[object], environment: dict[str, str] | None = None
             ) -> "subprocess.CompletedProcess[str]":
        words = [str(word) for word in command]
        done = subprocess.run(words, capture_output=True, text=True, check=False, env=environment,
                              cwd=ROOT)
        if done.returncode != 0:
            lines = done.stderr.strip().splitlines() or ["no message"]
            raise RunError(f"{' '.join(words)}: exit status {done.returncode}: {lines[-1]}")
        return done


class Poses:
    """Where the robots of a run were: times[t]; x, y, a (heading), stalled [t, robot]."""

    def __init__(self, times: np.ndarray, x: np.ndarray, y: np.ndarray, a: np.ndarray,
                 stalled: np.ndarray) -> None:
        self.times, self.x, self.y, self.a, self.stalled = times, x, y, a, stalled

    @staticmethod
    def read(path: Path) -> "Poses":
        """A table of pose_log: all robots of one time, then those of the next."""
        table = np.loadtxt(path, delimiter=",", skiprows=1, usecols=(0, 2, 3, 4, 5), ndmin=2)
        robots = int(np.count_nonzero(table[:, 0] == table[0, 0]))
        grid = table.reshape(-1, robots, 5)
        return Poses(grid[:, 0, 0], grid[:, :, 1], grid[:, :, 2], grid[:, :, 3],
                     grid[:, :, 4])
