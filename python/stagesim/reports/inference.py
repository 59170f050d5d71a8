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
    """Returns NaN if a figure is missing or too small to measure."""
    return value / base if value > 0 and base > 0 else math.nan


def percentile(values: Iterable[float], share: float) -> float:
    """The quantile: the smallest value such that at least the fraction `share` of all values do
    not exceed it; NaN if there are none."""
    ordered = sorted(values)
    if not ordered:
        return math.nan
    return ordered[max(math.ceil(share * len(ordered)), 1) - 1]


# ---- confidence intervals of medians of a few repeats, by resampling their scatter ---------------

DRAWS = 2000
LEVEL = 0.95
SEED = 1
# Repeats are few, so a point also uses the scatter of this many points on each side.
NEIGHBOURS = 2


def has_scatter(logs: list[np.ndarray]) -> bool:
    """True if a point has two repeats or more, so that there are residuals to resample."""
    return any(len(log) > 1 for log in logs)


def resampled(logs: list[np.ndarray], middles: np.ndarray) -> np.ndarray:
    """Resamples the medians: one row per draw.

    `logs` has the logarithms of a figure in the repeats of each point; has_scatter(logs) must be
    true.
    """
    random = np.random.default_rng(SEED)
    # Residuals about a mean of n values are too small by the factor sqrt((n - 1) / n).
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
    """Returns the interval that contains the fraction LEVEL of the draws."""
    found = np.sort(draws)
    cut = int((1 - LEVEL) / 2 * len(found))
    return float(found[cut]), float(found[len(found) - 1 - cut])


# ---- tests --------------------------------------------------------------------------------------

def t_test(differences: Sequence[float]) -> float:
    """Probability of differences at least this far from 0 if their mean is 0 (Student's
    two-sided test)."""
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
    """Holm's correction for multiple tests, some of which would otherwise be significant by
    chance."""
    order = sorted(range(len(probabilities)), key=lambda i: probabilities[i])
    corrected = [math.nan] * len(probabilities)
    greatest = 0.0
    for rank, i in enumerate(order):
        greatest = max(greatest, min(1.0, probabilities[i] * (len(order) - rank)))
        corrected[i] = greatest
    return corrected


# ---- means of runs that differ by their seed alone -----------------------------------------------

FEWEST = 5  # minimum number of values for a meaningful test
TEST_DRAWS = 10_000
MOST_DRAWN = 1_000_000  # maximum number of values drawn at once


def mean_bounds(values: np.ndarray) -> tuple[float, float]:
    """Confidence interval of the mean, by resampling the values; NaN for fewer than two."""
    if len(values) < 2:
        return math.nan, math.nan
    return bounds(moments_of_samples(values, DRAWS, np.random.default_rng(SEED))[0])


def moments_of_samples(values: np.ndarray, draws: int,
                       random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Means and variances of `draws` samples, each as large as `values`. Limits the memory used
    at once."""
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
    """Difference between the means of two groups."""

    difference: float
    low: float  # lower bound of the interval; NaN if there are too few values
    high: float
    probability: float  # probability of a difference at least as large by chance; NaN if there are
                        # too few values
    count: int  # number of values


def contrast(more: Sequence[np.ndarray], less: Sequence[np.ndarray] = ()) -> Contrast:
    """Mean of the means of the groups `more` minus that of the groups `less`, by a studentised
    bootstrap.

    For paired values, pass their differences as `more` and nothing as `less`. Each group is
    resampled separately, so groups may differ in size and spread. Studentising keeps the intervals
    valid with few values.
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
    if error <= rounding:  # equal in all runs
        return Contrast(difference, difference, difference,
                        1.0 if abs(difference) <= rounding else 1 / TEST_DRAWS, count)
    sizes = studentised(groups, weights, difference)
    reach = float(sizes[math.ceil(LEVEL * len(sizes)) - 1]) * error
    probability = (1 + np.count_nonzero(sizes >= abs(difference) / error)) / (TEST_DRAWS + 1)
    return Contrast(difference, difference - reach, difference + reach, float(probability), count)


def studentised(groups: Sequence[np.ndarray], weights: Sequence[float],
                difference: float) -> np.ndarray:
    """Sorted absolute errors of the resampled differences, in standard errors."""
    random = np.random.default_rng(SEED)
    drawn, variance = np.zeros(TEST_DRAWS), np.zeros(TEST_DRAWS)
    for weight, group in zip(weights, groups):
        means, variances = moments_of_samples(group, TEST_DRAWS, random)
        drawn += weight * means
        variance += weight**2 * variances / len(group)
    off = np.abs(drawn - difference)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sort(np.where(off > 0, off / np.sqrt(variance), 0.0))
