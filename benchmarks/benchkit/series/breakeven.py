# SPDX-License-Identifier: GPL-2.0-or-later
"""Finds the number of rays per step from which on a device is faster than the host.

Between measured populations, the logarithm of host time over device time is interpolated linearly
in the logarithm of the rays, which is exact for power laws. There is no extrapolation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from benchkit.inference import bounds, has_scatter, resampled


@dataclass(frozen=True)
class Point:
    """A population: its rays per step, and host time over device time in each repeat."""

    rays: float
    robots: float
    ratios: tuple[float, ...]


@dataclass(frozen=True)
class BreakEven:
    """The result. -inf stands for "below the range", +inf for "none in the range"."""

    rays: float
    low: float  # lower bound of the interval; NaN if there is only one repeat
    high: float
    robots: float  # NaN unless `rays` is finite
    crossings: int  # number of crossings of the two curves; more than one means noise or a complex
                    # dependency
    range_low: float
    range_high: float
    wins: tuple[float, ...]  # rays of the points where the device was faster

    @property
    def found(self) -> bool:
        return math.isfinite(self.rays)


def crossing(log_rays: np.ndarray, advantages: np.ndarray) -> np.ndarray:
    """For each row of advantages, the logarithm of the rays from which on the device stays faster.

    -inf: it is always faster. +inf: it is not faster at the greatest number of rays.
    """
    rows, points = advantages.shape
    slower = advantages <= 0
    result = np.full(rows, -np.inf)
    last = points - 1 - np.argmax(slower[:, ::-1], axis=1)
    any_slower = slower.any(axis=1)
    result[any_slower & (last == points - 1)] = np.inf
    between = np.flatnonzero(any_slower & (last < points - 1))
    i = last[between]
    below, above = advantages[between, i], advantages[between, i + 1]
    share = -below / (above - below)
    result[between] = log_rays[i] + share * (log_rays[i + 1] - log_rays[i])
    return result


def interval(log_rays: np.ndarray, logs: list[np.ndarray], middles: np.ndarray
             ) -> tuple[float, float]:
    """Bounds of the break-even in rays."""
    if not has_scatter(logs):
        return math.nan, math.nan
    low, high = bounds(crossing(log_rays, resampled(logs, middles)))
    return rays_of(low), rays_of(high)


def rays_of(logarithm: float) -> float:
    """Infinities are kept: they mean that the break-even is outside the measured range."""
    return float(logarithm) if math.isinf(logarithm) else math.exp(logarithm)


def break_even(points: list[Point]) -> BreakEven | None:
    """Returns None if there are fewer than two points."""
    points = sorted((point for point in points if point.ratios), key=lambda point: point.rays)
    if len(points) < 2:
        return None
    log_rays = np.log([point.rays for point in points])
    logs = [np.log(point.ratios) for point in points]
    middles = np.array([np.median(log) for log in logs])
    at = float(crossing(log_rays, middles[np.newaxis, :])[0])
    low, high = interval(log_rays, logs, middles)
    faster = middles > 0
    robots = math.nan
    if math.isfinite(at):
        robots = math.exp(np.interp(at, log_rays, np.log([point.robots for point in points])))
    return BreakEven(
        rays=rays_of(at), low=low, high=high, robots=robots,
        crossings=int(np.count_nonzero(faster[1:] != faster[:-1])),
        range_low=points[0].rays, range_high=points[-1].rays,
        wins=tuple(point.rays for point, fast in zip(points, faster) if fast))
