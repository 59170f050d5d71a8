# SPDX-License-Identifier: GPL-2.0-or-later
"""Compares --opencl, which chooses the faster path itself, with the fastest fixed backend."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from benchkit.series.analysis import Series
from benchkit.inference import bounds, has_scatter, resampled


@dataclass(frozen=True)
class Nearness:
    """Ratio of r_ACC of --opencl to that of the fastest other backend, within repeats."""

    ratio: float  # the median
    low: float  # lower bound of the confidence interval; NaN if there is only one repeat
    high: float


@dataclass(frozen=True)
class NearnessOfWorld:
    """A world's populations, and the geometric mean over them."""

    points: dict[int, Nearness]
    fastest: dict[int, str]  # the fastest other backend
    mean: Nearness


def fastest_other(series: Series, world: str, population: int) -> str | None:
    """The backend with the greatest median r_ACC that has a repeat in common with --opencl. It
    is chosen by the figures that it is compared by, so of two equally fast backends the luckier
    one wins."""
    speeds = {}
    for backend in series.backends:
        speed = series.column(world, population, backend, "r_acc")
        if backend != "auto" and speed and series.ratios(world, population, "auto", backend):
            speeds[backend] = speed.median
    return max(speeds, key=lambda backend: speeds[backend]) if speeds else None


def nearness(series: Series, world: str) -> NearnessOfWorld | None:
    """Returns None unless --opencl and another backend were measured."""
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
