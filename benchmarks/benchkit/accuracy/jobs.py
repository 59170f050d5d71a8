# SPDX-License-Identifier: GPL-2.0-or-later
"""Jobs of the benchmark and their result rows. A job that has its rows is not repeated."""

from __future__ import annotations

import concurrent.futures
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Iterable, Iterator

import numpy as np

from benchkit.inference import percentile
from benchkit.programs import RunError
from benchkit.progress import Progress
from benchkit.store import Table

from . import analysis, worlds
from .programs import Poses, Programs
from .settings import Plan, Setting, Sweep

SETTING = ["cell", "ray_model", "samples", "interval_ms", "step_ms", "hits", "threads"]
FIGURES = [*analysis.COUNTS, *analysis.MEDIANS, "max"]
TASKS = {"disperse": "disperse", "wander": "wander"}  # and their controllers
# Fractions of a run's length at which trajectories are compared.
DRIFT_SHARES = (0.05, 0.125, 0.25, 0.5, 1.0)
# Speeds in m/s and rad/s of the robot that drives without obstacles.
COMMANDS = ((0.2, 0.2), (0.4, 0.5), (0.4, 1.5), (0.6, 1.0), (1.0, 0.3))
NUDGE = 1e-6  # metres
SPEED_COLUMNS = ["scene", *SETTING, "repeat", "robots", "seconds", "r_acc", "ms_per_step",
                 "rays_per_step", "trace_ms", "prefilter_ms", "peak_memory_mb", "load_seconds",
                 "state_hash"]
ERROR_COLUMNS = ["sweep", "scene", *SETTING, "seed", "group", "bin", *FIGURES]
SCORE_COLUMNS = ["sweep", "task", *SETTING, "nudge", "seed", "score", "stalled",
                 *(f"drift_{share:g}" for share in DRIFT_SHARES)]
CONTACT_COLUMNS = ["cell", "robots", "gap_least", "gap_p50", "gap_p95", "gap_most"]
DRIVE_COLUMNS = [*SETTING, "speed", "turn", "seconds", "error_p50", "error_p95", "error_max"]


@dataclass(frozen=True)
class Job:
    """Jobs that are `timed` run alone."""

    name: str
    weight: float  # approximate duration in seconds
    table: str
    key: tuple[tuple[str, object], ...]
    run: Callable[[], list[dict[str, object]]]
    timed: bool = False
    first: bool = False  # other jobs need its results


def key_of(**columns: object) -> tuple[tuple[str, object], ...]:
    return tuple(columns.items())


class Benchmark:
    """All jobs of a plan and the tables of their results."""

    def __init__(self, plan: Plan, programs: Programs, sweeps: dict[str, Sweep], folder: Path,
                 scratch: Path) -> None:
        self.plan, self.programs, self.sweeps, self.scratch = plan, programs, sweeps, scratch
        self._kept = folder / "work"  # poses of the finest settings, for resumed benchmarks
        self._numbers = iter(range(10 ** 9))
        self._lock = threading.Lock()
        self._warm: set[int] = set()
        self.tables = {
            "speed": Table(folder / "raw" / "speed.csv", SPEED_COLUMNS),
            "error": Table(folder / "raw" / "error.csv", ERROR_COLUMNS),
            "score": Table(folder / "raw" / "score.csv", SCORE_COLUMNS),
            "drive": Table(folder / "raw" / "drive.csv", DRIVE_COLUMNS),
            "contact": Table(folder / "raw" / "contact.csv", CONTACT_COLUMNS),
        }

    # ---- worlds ----

    def _write_world(self, text: str) -> Path:
        with self._lock:
            path = self.scratch / f"{next(self._numbers)}.world"
        path.write_text(text, encoding="utf-8")
        return path

    def _world(self, scene: str, seed: int, setting: Setting, controller: str) -> Path:
        return self._write_world(worlds.scene_world(scene, self.plan.robots[scene], seed, setting,
                                                    controller))

    # ---- speed ----

    def _speed_settings(self) -> list[tuple[str, Setting]]:
        """Scenes and settings without duplicates."""
        wanted: dict[tuple[str, Setting], None] = {}
        for knob, sweep in self.sweeps.items():
            scenes = self.plan.robots if knob == "cells" else self.plan.knob_scenes
            for scene in scenes:
                for setting in sweep.settings:
                    wanted[(scene, setting)] = None
        return list(wanted)

    def _speed_jobs(self) -> Iterator[Job]:
        # Repeats alternate between settings, so that a drift of the machine's speed affects all of
        # them.
        for repeat in range(self.plan.repeats):
            for scene, setting in self._speed_settings():
                key = key_of(scene=scene, **setting.columns(), repeat=repeat)
                yield Job(f"speed of {scene}, repeat {repeat + 1}", self.plan.seconds / 10, "speed",
                          key, self._speed_runner(scene, setting, dict(key)), timed=True)

    def _speed_runner(self, scene: str, setting: Setting, key: dict[str, object]
                      ) -> Callable[[], list[dict[str, object]]]:
        def run() -> list[dict[str, object]]:
            world = self._world(scene, 1, setting, "disperse")
            self._warm_up(world, setting)
            stats = self.programs.speed(world, self.plan.seconds, setting)
            steps = stats["steps"]
            phases = stats["phases_ms_per_step"]
            return [{**key, "robots": stats["robots"], "seconds": stats["simulated_seconds"],
                     "r_acc": stats["r_acc"], "ms_per_step": stats["wall_seconds"] / steps * 1e3,
                     "rays_per_step": stats["rays"] / steps, "trace_ms": phases["trace"],
                     "prefilter_ms": phases["prefilter"],
                     "peak_memory_mb": stats["peak_memory_mb"],
                     "load_seconds": stats["load_seconds"], "state_hash": stats["state_hash"]}]
        return run

    def _warm_up(self, world: Path, setting: Setting) -> None:
        """Lets PoCL compile its kernels before the measurement."""
        if setting.hits and setting.hits not in self._warm:
            self.programs.speed(world, 0.5, setting)
            self._warm.add(setting.hits)

    # ---- errors of readings ----

    def _error_jobs(self) -> Iterator[Job]:
        plan = self.plan
        yield from self._truth_jobs("cells", plan.robots, "disperse", ["--still"])
        yield from self._truth_jobs("samples", plan.knob_scenes, "disperse",
                                    ["--still", "--between", str(plan.bearings)])
        # After 2 s, every sensor has a reading and robots drive. Seven divides none of the
        # intervals, so readings of all ages occur.
        yield from self._truth_jobs("interval", plan.knob_scenes, "wander",
                                    ["--held", "--from", f"{min(2, plan.moving_seconds / 2):g}",
                                     "--seconds", f"{plan.moving_seconds:g}", "--every", "7"])

    def _truth_jobs(self, knob: str, scenes: Iterable[str], controller: str, options: list[str]
                    ) -> Iterator[Job]:
        for scene in scenes:
            for seed in range(1, self.plan.truth_seeds + 1):
                for setting in self.sweeps[knob].settings:
                    key = key_of(sweep=knob, scene=scene, **setting.columns(), seed=seed)
                    yield Job(f"error in {scene}, {setting.label(knob)}", 1.0, "error", key,
                              self._truth_runner(scene, seed, setting, controller, options,
                                                 dict(key)))

    def _truth_runner(self, scene: str, seed: int, setting: Setting, controller: str,
                      options: list[str], key: dict[str, object]
                      ) -> Callable[[], list[dict[str, object]]]:
        def run() -> list[dict[str, object]]:
            world = self._world(scene, seed, setting, controller)
            summary = self.programs.truth(world, options, seed)
            return [{**key, **{name: bin_[name] for name in ("group", "bin", *FIGURES)}}
                    for bin_ in summary["groups"]]
        return run

    # ---- driving without obstacles ----

    def _drive_jobs(self) -> Iterator[Job]:
        for setting in self.sweeps["step"].settings:
            for speed, turn in COMMANDS:
                key = key_of(**setting.columns(), speed=speed, turn=turn)
                yield Job(f"drive, {setting.label('step')}", 0.1, "drive", key,
                          self._drive_runner(setting, speed, turn, dict(key)))

    def _drive_runner(self, setting: Setting, speed: float, turn: float, key: dict[str, object]
                      ) -> Callable[[], list[dict[str, object]]]:
        def run() -> list[dict[str, object]]:
            seconds = 60
            world = self._write_world(worlds.drive_world(setting.step))
            poses = self.programs.poses(world, ["--seconds", str(seconds), "--every", "1",
                                                "--speed", str(speed), "--turn", str(turn)])
            errors = []
            for time, x, y in zip(poses.times[1:], poses.x[1:, 0], poses.y[1:, 0]):
                true_x, true_y = analysis.arc(speed, turn, float(time))
                errors.append(float(np.hypot(x - true_x, y - true_y)))
            return [{**key, "seconds": seconds, "error_p50": percentile(errors, 0.5),
                     "error_p95": percentile(errors, 0.95), "error_max": max(errors)}]
        return run

    # ---- driving at a wall ----

    def _contact_jobs(self) -> Iterator[Job]:
        for cell in self.plan.cells:
            key = key_of(cell=f"{cell:g}")
            yield Job(f"contact, {cell:g} m", 0.5, "contact", key, self._contact_runner(cell))

    def _contact_runner(self, cell: float) -> Callable[[], list[dict[str, object]]]:
        def run() -> list[dict[str, object]]:
            wanted = worlds.approaches(100, seed=1)
            world = self._write_world(worlds.contact_world(Setting(cell=cell), wanted))
            poses = self.programs.poses(world, ["--seconds", "12", "--every", "12", "--speed",
                                                "0.2"])
            if not poses.stalled[-1].all():
                raise RunError(f"contact, cells of {cell:g} m: found robots that were not stopped "
                               "by a wall, expected none")
            gaps = [a.gap(*pose) for a, pose in zip(wanted, zip(poses.x[-1], poses.y[-1],
                                                                poses.a[-1]))]
            return [{"cell": f"{cell:g}", "robots": len(gaps), "gap_least": min(gaps),
                     "gap_p50": percentile(gaps, 0.5),
                     "gap_p95": percentile(gaps, 0.95), "gap_most": max(gaps)}]
        return run

    # ---- trajectories and scores ----

    def _score_jobs(self) -> Iterator[Job]:
        for knob in ("cells", "samples", "interval", "step"):
            sweep = self.sweeps[knob]
            for task in TASKS:
                for seed in range(1, self.plan.score_seeds + 1):
                    # The finest setting comes first, because others are compared with it.
                    others = [s for s in sweep.settings if s != sweep.finest]
                    for setting in [sweep.finest, *others]:
                        yield self._score_job(sweep, task, seed, setting, 0.0)
                    if knob == "cells":
                        yield self._score_job(sweep, task, seed, sweep.finest, NUDGE)

    def _score_job(self, sweep: Sweep, task: str, seed: int, setting: Setting, nudge: float) -> Job:
        key = key_of(sweep=sweep.knob, task=task, **setting.columns(), nudge=nudge, seed=seed)

        def run() -> list[dict[str, object]]:
            poses = self._score_poses(sweep, task, seed, setting, nudge)
            finest = self._finest_poses(sweep, task, seed)
            apart = analysis.drift(poses.x, poses.y, finest.x, finest.y)
            at = [round(share * (len(apart) - 1)) for share in DRIFT_SHARES]
            score = (analysis.nearest_neighbour_distance(poses.x[-1], poses.y[-1])
                     if task == "disperse" else analysis.visited_area(poses.x, poses.y))
            return [{**dict(key), "score": score, "stalled": float(poses.stalled[-1].mean()),
                     **{f"drift_{share:g}": float(apart[i])
                        for share, i in zip(DRIFT_SHARES, at)}}]
        return Job(f"{task}, {setting.label(sweep.knob)}", self.plan.score_seconds / 40, "score",
                   key, run, first=setting == sweep.finest and nudge == 0)

    def _score_poses(self, sweep: Sweep, task: str, seed: int, setting: Setting, nudge: float
                     ) -> Poses:
        if setting == sweep.finest and nudge == 0:
            return self._finest_poses(sweep, task, seed)
        return self._run_task(task, seed, setting, nudge)

    def _run_task(self, task: str, seed: int, setting: Setting, nudge: float) -> Poses:
        world = self._write_world(worlds.scene_world(
            "boxes", self.plan.score_robots, seed, setting, TASKS[task], corner=True))
        return self.programs.poses(world, ["--seconds", f"{self.plan.score_seconds:g}", "--every",
                                           "0.5", "--seed", str(seed), "--nudge", f"{nudge:.9f}"])

    def _finest_poses(self, sweep: Sweep, task: str, seed: int) -> Poses:
        """Poses of the finest setting, computed once and kept until the benchmark is complete."""
        path = self._kept / f"{sweep.knob}-{task}-{seed}.npz"
        if not path.exists():
            poses = self._run_task(task, seed, sweep.finest, 0.0)
            unfinished = path.with_name(f"{path.stem}.{threading.get_ident()}.part.npz")
            np.savez_compressed(unfinished, times=poses.times, x=poses.x, y=poses.y,
                                a=poses.a, stalled=poses.stalled)
            unfinished.replace(path)
        with np.load(path) as kept:
            return Poses(kept["times"], kept["x"], kept["y"], kept["a"], kept["stalled"])

    # ---- running ----

    def jobs(self) -> list[Job]:
        """All jobs of the plan."""
        return [*self._speed_jobs(), *self._error_jobs(), *self._drive_jobs(),
                *self._contact_jobs(), *self._score_jobs()]

    def run(self, workers: int) -> int:
        """Runs the remaining jobs and returns their number."""
        left = [job for job in self.jobs() if not self.tables[job.table].has(dict(job.key))]
        progress = Progress(total=sum(job.weight / (1 if job.timed else workers) for job in left))
        self._kept.mkdir(parents=True, exist_ok=True)

        def do(job: Job) -> None:
            self.tables[job.table].add(job.run())
            progress.advance(job.weight / (1 if job.timed else workers), job.name)

        try:
            for job in left:
                if job.timed:
                    do(job)
            untimed = [job for job in left if not job.timed]
            for first in (True, False):
                with concurrent.futures.ThreadPoolExecutor(workers) as pool:
                    finish([pool.submit(do, job) for job in untimed if job.first == first])
        finally:
            progress.clear()
        for file in self._kept.glob("*.npz"):
            file.unlink()
        if not any(self._kept.iterdir()):  # other files do not belong to the benchmark
            self._kept.rmdir()
        return len(left)


def finish(pending: list["concurrent.futures.Future[None]"]) -> None:
    """Waits for all. After a failure or an interrupt, pending jobs are cancelled."""
    try:
        for future in concurrent.futures.as_completed(pending):
            future.result()
    finally:
        for future in pending:
            future.cancel()
