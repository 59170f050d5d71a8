# SPDX-License-Identifier: GPL-2.0-or-later
"""Metrics of how robots move among people, from arrays of places and times.

The first axis of a path is time; the last one has x and y in metres, and may have more. Axes between them, such as worlds
or people, are kept. Distances between a robot and people are those of their centres unless radii are given.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

# Distances in metres by E. T. Hall, The Hidden Dimension, 1966.
INTIMATE = 0.45
PERSONAL = 1.2


def arrival_times(path: npt.ArrayLike, goal: npt.ArrayLike, dt: float, near: float = 0.5) -> Floats:
    """Finds when paths first come near their goals.

    Args:
        path: places: shape (t, ..., 2 or more).
        goal: of each path: a shape that fits (..., 2).
        dt: seconds between two places.
        near: metres.

    Returns:
        Seconds after the first place; NaN where a path never comes near. Shape (...).
    """
    places = _path(path)
    return _first(_lengths(places - np.asarray(goal, float)[..., :2]) <= near, dt)


def path_lengths(path: npt.ArrayLike) -> Floats:
    """Measures the lengths of paths.

    Args:
        path: places: shape (t, ..., 2 or more).

    Returns:
        Metres: shape (...).
    """
    lengths: Floats = _lengths(np.diff(_path(path), axis=0)).sum(0)
    return lengths


def closest_distances(robot: npt.ArrayLike, people: npt.ArrayLike, radii: npt.ArrayLike = 0) -> Floats:
    """Finds the closest distance of a robot to each person.

    Args:
        robot: shape (t, ..., 2 or more).
        people: shape (t, ..., m, 2 or more) for m people.
        radii: the sum of the radii of the robot and of each person, metres, which is subtracted.

    Returns:
        Metres: shape (..., m).
    """
    closest: Floats = _distances(robot, people, radii).min(0)
    return closest


def intrusion_times(robot: npt.ArrayLike, people: npt.ArrayLike, dt: float, distance: float = PERSONAL,
                    radii: npt.ArrayLike = 0) -> Floats:
    """Measures for how long a robot is in the space of any person.

    Args:
        robot: shape (t, ..., 2 or more).
        people: shape (t, ..., m, 2 or more) for m people.
        dt: seconds between two places.
        distance: metres; INTIMATE and PERSONAL are those of E. T. Hall.
        radii: the sum of the radii of the robot and of each person, metres, which is subtracted from distances.

    Returns:
        Seconds: shape (...).
    """
    times: Floats = (_distances(robot, people, radii) < distance).any(-1).sum(0) * float(dt)
    return times


def collisions(stalled: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """Counts how often robots are stopped by obstacles.

    Args:
        stalled: whether a robot is stopped: truth values of shape (t, ...).

    Returns:
        Whole numbers of shape (...).
    """
    stops = np.asarray(stalled, bool)
    before = np.concatenate([np.zeros_like(stops[:1]), stops[:-1]])
    counts: npt.NDArray[np.int64] = (stops & ~before).sum(0)
    return counts


def crossing_times(path: npt.ArrayLike, gate: npt.ArrayLike, dt: float) -> Floats:
    """Finds when paths first cross a gate from its right to its left, as seen from its first post to its second one.

    Args:
        path: places: shape (t, ..., 2 or more).
        gate: x and y of both posts, metres: shape (2, 2).
        dt: seconds between two places.

    Returns:
        Seconds after the first place; NaN where a path never crosses. Shape (...).
    """
    places = _path(path)
    first, second = np.asarray(gate, float)
    along = second - first
    side = along[0] * (places[..., 1] - first[1]) - along[1] * (places[..., 0] - first[0])
    before, after = side[:-1], side[1:]
    crosses = (before < 0) & (after >= 0)
    share = before / np.where(crosses, before - after, 1)
    meets = places[:-1] + share[..., None] * np.diff(places, axis=0)
    place = ((meets - first) * along).sum(-1)
    times = _first(np.concatenate([np.zeros_like(crosses[:1]), crosses & (place >= 0) & (place <= along @ along)]), dt)
    return times


def flow(times: npt.ArrayLike) -> Floats:
    """Finds the flow of people through a gate between the first person and the last one.

    Args:
        times: those of crossing_times(): shape (..., m) for m people.

    Returns:
        Persons per second: shape (...); NaN if fewer than two cross, or all at once.
    """
    given = np.asarray(times, float)
    crossed = np.isfinite(given)
    count = crossed.sum(-1)
    least = np.where(crossed, given, np.inf).min(-1, initial=np.inf)
    most = np.where(crossed, given, -np.inf).max(-1, initial=-np.inf)
    duration = np.where(count > 1, most - least, 0.0)
    rate: Floats = np.where(duration > 0, (count - 1) / np.where(duration > 0, duration, 1), np.nan)
    return rate


def _path(path: npt.ArrayLike) -> Floats:
    """The places of paths, without their headings."""
    places = np.asarray(path, float)
    if places.ndim < 2 or places.shape[0] < 1 or places.shape[-1] < 2:
        raise ValueError(f"found a path of shape {places.shape}, expected (t, ..., 2 or more) with t from 1 on")
    return places[..., :2]


def _lengths(vectors: Floats) -> Floats:
    lengths: Floats = np.sqrt((vectors**2).sum(-1))
    return lengths


def _distances(robot: npt.ArrayLike, people: npt.ArrayLike, radii: npt.ArrayLike) -> Floats:
    """Distances of a robot to people: shape (t, ..., m)."""
    own, others = _path(robot), _path(people)
    if others.ndim != own.ndim + 1 or others.shape[:-2] != own.shape[:-1]:
        raise ValueError(f"found a robot of shape {own.shape} and people of shape {others.shape}, expected (t, ..., 2) and "
                         "(t, ..., m, 2)")
    distances: Floats = _lengths(others - own[..., None, :]) - np.asarray(radii, float)
    return distances


def _first(happens: Any, dt: float) -> Floats:
    """The time at which something first happens; NaN if it never does."""
    times: Floats = np.where(happens.any(0), happens.argmax(0) * float(dt), np.nan)
    return times
