# SPDX-License-Identifier: GPL-2.0-or-later
"""The knobs, their settings, and the extent of the benchmark."""

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
    """A value for each knob. 0 means the default of the world or program."""

    cell: float = 0.02  # metres
    ray_model: str = "cell"
    samples: int = 0  # per laser
    interval: int = 100  # milliseconds between readings of a sensor
    step: int = 100  # milliseconds
    hits: int = 0  # length of a hit list; 0: no OpenCL
    threads: int = 1

    def label(self, knob: str) -> str:
        """Name among the settings of one knob."""
        return {
            "cells": f"{self.cell:g} m, {self.ray_model}",
            "samples": f"{self.samples} samples" if self.samples else "default samples",
            "interval": f"{self.interval} ms",
            "step": f"{self.step} ms",
            "hits": f"{self.hits} hits" if self.hits else "no OpenCL",
            "threads": f"{self.threads} threads" if self.threads > 1 else "1 thread",
        }[knob]

    def columns(self) -> dict[str, object]:
        """The values for the CSV files."""
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
    """The extent of the benchmark."""

    name: str
    cells: tuple[float, ...]
    samples: tuple[int, ...]
    intervals: tuple[int, ...]
    steps: tuple[int, ...]
    hits: tuple[int, ...] = (1, 2, 4, 8)
    threads: tuple[int, ...] = (1, 2)
    robots: dict[str, int] = field(default_factory=dict)  # per scene
    repeats: int = 3  # per timed run
    seconds: float = 15  # simulated seconds per timed run
    truth_seeds: int = 2  # number of populations whose readings are compared with the truth
    moving_seconds: float = 10  # simulated seconds for errors by age of the readings
    bearings: int = 1441  # rays of the dense fan that samples between the beams
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
    """The settings of one knob, with the others fixed, and the finest of them."""

    knob: str
    settings: tuple[Setting, ...]
    finest: Setting


def base_of(models: tuple[str, ...]) -> Setting:
    """The fixed settings of the other knobs: the best available ray model, so that only the
    knob's own error is measured."""
    return Setting(ray_model=models[-1])


def sweeps(plan: Plan, models: tuple[str, ...], cores: int, opencl: bool) -> dict[str, Sweep]:
    """Sweeps by knob. `models` are the ray models that the program supports."""
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
