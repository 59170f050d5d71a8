# SPDX-License-Identifier: GPL-2.0-or-later
"""Statistics: summaries, intervals by resampling, tests. Pure functions."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass
from typing import Iterable, Sequence

import numpy as np

# ---- summaries ----------------------------------------------------------------------------------

@dataclass(frozen=True)
class Summary:
    """Summary of the repeats of a figure."""

    median: float
    least: float
    greatest: float
    count: int


def summary(values: Iterable[float]) -> Summary | None:
    """Summarizes values, ignoring NaN. Returns None if there are none."""
    known = [value for value in values if not math.isnan(value)]
    if not known:
        return None
    return Summary(statistics.median(known), min(known), max(known), len(known))


def quotient(value: float, base: float) -> float:
    """NaN where a figure is missing or too small for its meter."""
    return value / base if value > 0 and base > 0 else math.nan


def percentile(values: Iterable[float], share: float) -> float:
    """The smallest of the values that at least that share of all do not exceed; NaN of none."""
    ordered = sorted(values)
    if not ordered:
        return math.nan
    return ordered[max(math.ceil(share * len(ordered)), 1) - 1]


# ---- how sure medians of a few repeats are: their scatter is drawn from again and again ----------

DRAWS = 2000
LEVEL = 0.95
SEED = 1
# Repeats are few, so a point borrows the scatter of the points next to it, on each side.
NEIGHBOURS = 2


def has_scatter(logs: list[np.ndarray]) -> bool:
    """Whether there is anything to draw from: a point with two repeats."""
    return any(len(log) > 1 for log in logs)


def resampled(logs: list[np.ndarray], middles: np.ndarray) -> np.ndarray:
    """Medians as other repeats might have given them: a row for each draw.

    `logs`: for each point, the logarithms of a figure in its repeats; has_scatter(logs) is true.
    """
    random = np.random.default_rng(SEED)
    # Residuals about a mean of n are too small by sqrt((n - 1) / n).
    residuals = [(log - log.mean()) * math.sqrt(len(log) / (len(log) - 1)) if len(log) > 1
                 else np.zeros(0) for log in logs]
    draws = np.empty((DRAWS, len(logs)))
    for i, log in enumerate(logs):
        pool = np.concatenate(residuals[max(0, i - NEIGHBOURS):i + NEIGHBOURS + 1])
        if pool.size == 0:
            pool = np.concatenate(residuals)
        chosen = random.integers(0, pool.size, (DRAWS, len(log)))
        draws[:, i] = middles[i] + np.median(pool[chosen], axis=1)
    return draws


def bounds(draws: np.ndarray) -> tuple[float, float]:
    """Between which LEVEL of the draws lie."""
    found = np.sort(draws)
    cut = int((1 - LEVEL) / 2 * len(found))
    return float(found[cut]), float(found[len(found) - 1 - cut])


# ---- tests --------------------------------------------------------------------------------------

def t_test(differences: Sequence[float]) -> float:
    """How likely differences so far from 0 are if their mean is 0: Student's test, two-sided."""
    n = len(differences)
    if n < 2:
        return math.nan
    mean, deviation = statistics.fmean(differences), statistics.stdev(differences)
    if deviation == 0:
        return 1.0 if mean == 0 else 0.0
    t = abs(mean) / (deviation / math.sqrt(n))
    # With t = sqrt(n - 1) tan(angle), the density is a power of the cosine.
    start = math.atan(t / math.sqrt(n - 1))

    def integral(low: float) -> float:
        angles = np.linspace(low, math.pi / 2, 4001)
        heights = np.cos(angles) ** (n - 2)
        return float(((heights[1:] + heights[:-1]) / 2).sum() * (angles[1] - angles[0]))

    return integral(start) / integral(0.0)


def holm(probabilities: Sequence[float]) -> list[float]:
    """Holm's correction: with so many tests at once, some come out by chance."""
    order = sorted(range(len(probabilities)), key=lambda i: probabilities[i])
    corrected = [math.nan] * len(probabilities)
    greatest = 0.0
    for rank, i in enumerate(order):
        greatest = max(greatest, min(1.0, probabilities[i] * (len(order) - rank)))
        corrected[i] = greatest
    return corrected


# ---- means of runs that differ by their seed alone -----------------------------------------------

FEWEST = 5  # values of which a test says something
TEST_DRAWS = 10_000
MOST_DRAWN = 1_000_000  # values at a time


def mean_bounds(values: np.ndarray) -> tuple[float, float]:
    """Between which the mean lies, as resampling the values says; NaN of less than two."""
    if len(values) < 2:
        return math.nan, math.nan
    return bounds(moments_of_samples(values, DRAWS, np.random.default_rng(SEED))[0])


def moments_of_samples(values: np.ndarray, draws: int,
                       random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Means and variances of so many samples of the values, as large as these; in little memory."""
    means, variances = np.empty(draws), np.empty(draws)
    at_once = max(1, MOST_DRAWN // len(values))
    for at in range(0, draws, at_once):
        count = min(at_once, draws - at)
        sample = values[random.integers(0, len(values), (count, len(values)))]
        means[at:at + count] = sample.mean(axis=1)
        variances[at:at + count] = sample.var(axis=1, ddof=1)
    return means, variances


@dataclass(frozen=True)
class Contrast:
    """How far the means of two groups are apart."""

    difference: float
    low: float  # of the interval: NaN if there are too few values
    high: float
    probability: float  # of a difference so large if there is none: NaN as well
    count: int  # of the values


def contrast(more: Sequence[np.ndarray], less: Sequence[np.ndarray] = ()) -> Contrast:
    """The mean of the means of the groups `more` minus that of `less`, by a studentised bootstrap.

    For pairs give their differences as `more` alone. Each group is resampled on its own, so groups
    may differ in whatever they like. That it is studentised keeps it honest with few values.
    """
    weights = [1 / len(more)] * len(more) + [-1 / len(less) for _ in less]
    groups = [*more, *less]
    count = sum(map(len, groups))
    difference = sum(weight * float(group.mean()) for weight, group in zip(weights, groups))
    if min(map(len, groups)) < FEWEST:
        return Contrast(difference, math.nan, math.nan, math.nan, count)
    error = math.sqrt(sum(weight**2 * float(group.var(ddof=1)) / len(group)
                          for weight, group in zip(weights, groups)))
    rounding = 1e-12 * max(float(np.abs(group).max()) for group in groups)
    if error <= rounding:  # the same in all runs
        return Contrast(difference, difference, difference,
                        1.0 if abs(difference) <= rounding else 1 / TEST_DRAWS, count)
    sizes = studentised(groups, weights, difference)
    reach = float(sizes[math.ceil(LEVEL * len(sizes)) - 1]) * error
    probability = (1 + np.count_nonzero(sizes >= abs(difference) / error)) / (TEST_DRAWS + 1)
    return Contrast(difference, difference - reach, difference + reach, float(probability), count)


def studentised(groups: Sequence[np.ndarray], weights: Sequence[float],
                difference: float) -> np.ndarray:
    """How many standard errors the differences of resampled groups are off, sorted."""
    random = np.random.default_rng(SEED)
    drawn, variance = np.zeros(TEST_DRAWS), np.zeros(TEST_DRAWS)
    for weight, group in zip(weights, groups):
        means, variances = moments_of_samples(group, TEST_DRAWS, random)
        drawn += weight * means
        variance += weight**2 * variances / len(group)
    off = np.abs(drawn - difference)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sort(np.where(off > 0, off / np.sqrt(variance), 0.0))
