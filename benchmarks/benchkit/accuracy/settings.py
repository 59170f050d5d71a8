# SPDX-License-Identifier: GPL-2.0-or-later
"""The knobs, their positions, and how much of it all a run of the benchmark measures."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

RAY_MODELS = ("cell", "exact")
KNOBS = {
    "cells": "cell size and ray model",
    "samples": "samples of a sensor",
    "interval": "update interval of a sensor",
    "step": "length of a step",
    "hits": "length of the lists of potential hits (OpenCL)",
    "threads": "threads",
}


@dataclass(frozen=True)
class Setting:
    """One position of all knobs. What is 0 is left as the world or the program has it."""

    cell: float = 0.02  # metres
    ray_model: str = "cell"
    samples: int = 0  # of each laser
    interval: int = 100  # of the sensors, milliseconds
    step: int = 100  # milliseconds
    hits: int = 0  # in a ray's list; 0: no OpenCL
    threads: int = 1

    def label(self, knob: str) -> str:
        """What to call it among the settings of one knob."""
        return {
            "cells": f"{self.cell:g} m, {self.ray_model}",
            "samples": f"{self.samples} samples" if self.samples else "samples as they come",
            "interval": f"{self.interval} ms",
            "step": f"{self.step} ms",
            "hits": f"{self.hits} hits" if self.hits else "no OpenCL",
            "threads": f"{self.threads} threads" if self.threads > 1 else "1 thread",
        }[knob]

    def columns(self) -> dict[str, object]:
        """As they stand in the CSV files."""
        return {"cell": f"{self.cell:g}", "ray_model": self.ray_model, "samples": self.samples,
                "interval_ms": self.interval, "step_ms": self.step, "hits": self.hits,
                "threads": self.threads}

    @staticmethod
    def from_columns(row: dict[str, str]) -> "Setting":
        return Setting(float(row["cell"]), row["ray_model"], int(row["samples"]),
                       int(row["interval_ms"]), int(row["step_ms"]), int(row["hits"]),
                       int(row["threads"]))


@dataclass(frozen=True)
class Plan:
    """How much is measured."""

    name: str
    cells: tuple[float, ...]
    samples: tuple[int, ...]
    intervals: tuple[int, ...]
    steps: tuple[int, ...]
    hits: tuple[int, ...] = (1, 2, 4, 8)
    threads: tuple[int, ...] = (1, 2)
    robots: dict[str, int] = field(default_factory=dict)  # of each scene
    repeats: int = 3  # of each timed run
    seconds: float = 15  # simulated, of each timed run
    truth_seeds: int = 2  # populations whose readings are compared with the truth
    moving_seconds: float = 10  # simulated, for the age of readings
    bearings: int = 1441  # of the dense fan between the beams
    score_seeds: int = 5
    score_robots: int = 24
    score_seconds: float = 40
    knob_scenes: tuple[str, ...] = ("cave",)  # for the knobs other than cells


PLANS = {
    "tiny": Plan("tiny", cells=(0.05, 0.2), samples=(16, 64), intervals=(100, 500),
                 steps=(100, 500), hits=(1, 4), threads=(1, 2), robots={"boxes": 3}, repeats=2,
                 seconds=1, truth_seeds=1, moving_seconds=2, bearings=101, score_seeds=3,
                 score_robots=3, score_seconds=5, knob_scenes=("boxes",)),
    "short": Plan("short", cells=(0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5),
                  samples=(45, 90, 180, 360, 720), intervals=(100, 200, 500, 1000),
                  steps=(10, 20, 50, 100, 200, 500),
                  robots={"boxes": 36, "cave": 100, "hospital": 100}),
    "long": Plan("long", cells=(0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5),
                 samples=(23, 45, 90, 180, 360, 720, 1440),
                 intervals=(100, 200, 300, 500, 1000, 2000),
                 steps=(10, 20, 50, 100, 200, 500),
                 robots={"boxes": 36, "cave": 100, "hospital": 100}, repeats=7, seconds=30,
                 truth_seeds=5, moving_seconds=30, score_seeds=20, score_robots=36,
                 score_seconds=120, knob_scenes=("boxes", "cave", "hospital")),
}


@dataclass(frozen=True)
class Sweep:
    """The settings of one knob, all others left alone, and the finest of them."""

    knob: str
    settings: tuple[Setting, ...]
    finest: Setting


def base_of(models: tuple[str, ...]) -> Setting:
    """What the other knobs are left at while one is turned: the best ray model that there is, so
    that what is seen is the knob's own error."""
    return Setting(ray_model=models[-1])


def sweeps(plan: Plan, models: tuple[str, ...], cores: int, opencl: bool) -> dict[str, Sweep]:
    """By knob. `models`: the ray models that the program knows."""
    base = base_of(models)
    by_knob = {
        "cells": [Setting(cell=c, ray_model=m) for m in models for c in plan.cells],
        "samples": [replace(base, samples=n) for n in plan.samples],
        "interval": [replace(base, interval=t) for t in plan.intervals],
        "step": [replace(base, step=t) for t in plan.steps],
        "hits": [replace(base, hits=n) for n in (0, *plan.hits)] if opencl else [],
        "threads": [replace(base, threads=n)
                    for n in sorted({*plan.threads, cores}) if n <= cores or n in plan.threads],
    }
    finest = {
        "cells": Setting(cell=min(plan.cells), ray_model=models[-1]),
        "samples": replace(base, samples=max(plan.samples)),
        "interval": replace(base, interval=min(plan.intervals)),
        "step": replace(base, step=min(plan.steps)),
        "hits": base,
        "threads": replace(base, threads=1),
    }
    return {knob: Sweep(knob, tuple(settings), finest[knob])
            for knob, settings in by_knob.items() if settings}
