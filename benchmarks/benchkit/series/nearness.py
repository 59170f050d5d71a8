# SPDX-License-Identifier: GPL-2.0-or-later
"""How near --opencl, which finds the faster path by itself, comes to the fastest backend."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from benchkit.series.analysis import Series
from benchkit.inference import bounds, has_scatter, resampled


@dataclass(frozen=True)
class Nearness:
    """r_ACC of --opencl over that of the fastest other backend, within repeats."""

    ratio: float  # the median
    low: float  # of its interval; NaN if there is only one repeat
    high: float


@dataclass(frozen=True)
class NearnessOfWorld:
    """A world's populations, and the geometric mean over these."""

    points: dict[int, Nearness]
    fastest: dict[int, str]  # the other backend
    mean: Nearness


def fastest_other(series: Series, world: str, population: int) -> str | None:
    """Of those that have a repeat in common with --opencl, by the median of r_ACC. It is chosen by
    the figures that it is then compared by: where two are equally fast, the lucky one is."""
    speeds = {}
    for backend in series.backends:
        speed = series.column(world, population, backend, "r_acc")
        if backend != "auto" and speed and series.ratios(world, population, "auto", backend):
            speeds[backend] = speed.median
    return max(speeds, key=lambda backend: speeds[backend]) if speeds else None


def nearness(series: Series, world: str) -> NearnessOfWorld | None:
    """None if --opencl was not measured, or nothing else."""
    fastest = {n: other for n in series.populations(world, "auto")
               if (other := fastest_other(series, world, n))}
    if not fastest:
        return None
    logs = [np.log(series.ratios(world, n, "auto", other)) for n, other in fastest.items()]
    middles = np.array([np.median(log) for log in logs])
    if has_scatter(logs):
        draws = resampled(logs, middles)
        intervals = [bounds(column) for column in draws.T] + [bounds(draws.mean(axis=1))]
    else:
        intervals = [(math.nan, math.nan)] * (len(logs) + 1)
    found = [Nearness(*map(math.exp, (middle, *interval)))
             for middle, interval in zip([*middles, middles.mean()], intervals)]
    return NearnessOfWorld(dict(zip(fastest, found)), fastest, found[-1])
