# SPDX-License-Identifier: GPL-2.0-or-later
"""How sure medians of a few repeats are: their scatter is drawn from again and again."""

from __future__ import annotations

import math

import numpy as np

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
