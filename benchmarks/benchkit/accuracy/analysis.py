# SPDX-License-Identifier: GPL-2.0-or-later
"""Analysis of the raw results: pure functions that use neither files nor programs."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass
from typing import Callable, Iterable, Sequence

import numpy as np

from benchkit.inference import holm, t_test


# ---- errors and speeds --------------------------------------------------------------------------

NOTHING = 1e-6  # metres; smaller errors count as this one, because no user can tell them apart


def pareto_front(points: Sequence[tuple[float, float]]) -> list[bool]:
    """For each (speed, error), tells whether it is on the Pareto front: no other point is at
    least as good in both and better in one. Errors below NOTHING count as NOTHING."""
    points = [(speed, max(error, NOTHING)) for speed, error in points]

    def beats(a: tuple[float, float], b: tuple[float, float]) -> bool:
        return a[0] >= b[0] and a[1] <= b[1] and a != b

    return [not any(beats(other, point) for other in points) for point in points]


COUNTS = ("readings", "true_hits", "missed", "false", "wrong_object", "object_unknown", "errors")
MEDIANS = ("bias", "p50", "p95", "p99", "over_0.001", "over_0.01", "over_0.05", "over_0.1")


def merge_bins(rows: Sequence[dict[str, str]]) -> dict[str, float]:
    """Merges a bin of several populations: sums of counts, medians of percentiles and fractions,
    the greatest maximum."""
    merged: dict[str, float] = {name: sum(float(row[name]) for row in rows) for name in COUNTS}
    measured = [row for row in rows if float(row["errors"]) > 0]
    for name in MEDIANS:
        merged[name] = statistics.median(float(r[name]) for r in measured) if measured else math.nan
    merged["max"] = max((float(r["max"]) for r in measured), default=math.nan)
    return merged


@dataclass(frozen=True)
class Speed:
    """The repeats of one timed run."""

    median: float  # r_ACC: robots times simulated seconds per real second
    least: float
    most: float
    ms_per_step: float
    memory_mb: float
    hashes: frozenset[str]

    @staticmethod
    def of(rows: Sequence[dict[str, str]]) -> "Speed":
        speeds = [float(row["r_acc"]) for row in rows]
        return Speed(statistics.median(speeds), min(speeds), max(speeds),
                     statistics.median(float(row["ms_per_step"]) for row in rows),
                     max(float(row["peak_memory_mb"]) for row in rows),
                     frozenset(row["state_hash"] for row in rows))


# ---- trajectories and scores --------------------------------------------------------------------

def arc(speed: float, turn: float, seconds: float) -> tuple[float, float]:
    """Position of a robot that started along x and drives at constant speed and turn rate."""
    if turn == 0:
        return speed * seconds, 0.0
    radius = speed / turn
    return radius * math.sin(turn * seconds), radius * (1 - math.cos(turn * seconds))


def nearest_neighbour_distance(x: np.ndarray, y: np.ndarray) -> float:
    """Mean distance of a robot to its nearest neighbour."""
    apart = np.hypot(x[:, None] - x[None, :], y[:, None] - y[None, :])
    np.fill_diagonal(apart, np.inf)
    return float(apart.min(axis=1).mean())


def visited_area(x: np.ndarray, y: np.ndarray, side: float = 0.5) -> float:
    """Total area, in square metres, of the squares of width `side` that robots have visited."""
    squares = set(zip(np.floor(x.ravel() / side).astype(int).tolist(),
                      np.floor(y.ravel() / side).astype(int).tolist()))
    return len(squares) * side * side


def drift(x: np.ndarray, y: np.ndarray, other_x: np.ndarray, other_y: np.ndarray) -> np.ndarray:
    """Median over the robots of their distance between two runs, for each time."""
    return np.median(np.hypot(x - other_x, y - other_y), axis=1)


@dataclass(frozen=True)
class ScoreRow:
    """A setting's scores compared with those of the finest setting, seed by seed."""

    label: str
    score: float  # mean over the seeds
    difference: float  # mean of the differences from the finest
    spread: float  # standard deviation of the finest setting's scores over the seeds
    probability: float  # corrected for multiple tests; NaN for the finest setting
    stalled: float  # fraction of robots that are blocked at the end

    @property
    def distinguishable(self) -> bool:
        return self.probability < 0.05


def score_rows(finest: dict[int, float], others: Sequence[tuple[str, dict[int, float], float]]
               ) -> list[ScoreRow]:
    """Compares `others` (label, scores, stalled fraction) with `finest`. Scores are given by
    seed; only common seeds count."""
    spread = statistics.stdev(finest.values()) if len(finest) > 1 else math.nan
    paired = [[scores[s] - finest[s] for s in sorted(set(scores) & set(finest))]
              for _, scores, _ in others]
    corrected = holm([t_test(differences) for differences in paired])
    return [ScoreRow(label, statistics.fmean(scores.values()), statistics.fmean(differences),
                     spread, probability, stalled)
            for (label, scores, stalled), differences, probability
            in zip(others, paired, corrected)]


# ---- recommendation -----------------------------------------------------------------------------

@dataclass(frozen=True)
class Candidate:
    """A setting with its measured figures by name. Figures that were not measured are missing."""

    label: str
    speed: float
    figures: dict[str, float]


@dataclass(frozen=True)
class Limit:
    """An upper limit of a figure."""

    figure: str
    most: float
    text: str  # the limit in words

    def holds(self, candidate: Candidate) -> bool:
        value = candidate.figures.get(self.figure, math.nan)
        return value <= self.most  # false for NaN: a setting that was not measured is not
                                   # recommended


def recommend(candidates: Sequence[Candidate], limits: Sequence[Limit]) -> Candidate | None:
    """The fastest candidate within all limits, the first of several; None if there is none."""
    good = [c for c in candidates if all(limit.holds(c) for limit in limits)]
    return max(good, key=lambda c: c.speed, default=None)


def lost_share(figures: dict[str, float], names: Sequence[str] = ("missed", "false",
                                                                  "wrong_object")) -> float:
    """Fraction of readings that are entirely wrong."""
    readings = figures.get("readings", 0)
    return sum(figures[name] for name in names) / readings if readings else math.nan


def group_by(rows: Iterable[dict[str, str]], key: Callable[[dict[str, str]], object]
             ) -> dict[object, list[dict[str, str]]]:
    """Groups rows by key, in order of first appearance."""
    groups: dict[object, list[dict[str, str]]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return groups
