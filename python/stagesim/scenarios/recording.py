# SPDX-License-Identifier: GPL-2.0-or-later
"""Paths of a run, and what the metrics say of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..batch import Batch
from ..world import World
from . import metrics
from .scenario import Scenario

Floats = npt.NDArray[np.float64]


class Recording(NamedTuple):
    """Paths of all robots and people of a run.

    Attributes:
        pose: x, y and heading: shape (t, n, 3) of a world, (t, worlds, n, 3) of a batch.
        stalled: whether each was stopped by an obstacle: shape (t, n) or (t, worlds, n).
        dt: seconds between two poses.
    """

    pose: Floats
    stalled: npt.NDArray[np.bool_]
    dt: float


def record(worlds: World | Batch, seconds: float) -> Recording:
    """Steps a world or a batch and records paths, the present poses included.

    Controllers run; commands that a robot has got stay in force.

    Args:
        worlds: a World or a Batch.
        seconds: simulated time, at least one step.

    Returns:
        The recording, with a pose for each step.

    Raises:
        ValueError: `seconds` is negative or no number.
    """
    if not 0 <= seconds < float("inf"):
        raise ValueError(f"found {seconds} seconds, expected 0 or more")
    robots = worlds if isinstance(worlds, Batch) else worlds.fleet()
    pose, stalled = [np.array(robots.pose)], [np.array(robots.stalled)]
    begin = float(np.ravel(worlds.time)[0])
    dt, steps = 0.0, 1
    while len(pose) <= steps:
        worlds.step()
        pose.append(np.array(robots.pose))
        stalled.append(np.array(robots.stalled))
        if not dt:
            dt = float(np.ravel(worlds.time)[0]) - begin
            steps = round(seconds / dt)
    return Recording(np.stack(pose), np.stack(stalled).astype(bool), dt)


def measures(scenario: Scenario | Sequence[Scenario], run: Recording) -> dict[str, npt.NDArray[np.float64]]:
    """Applies all metrics to a recording of a scenario.

    Args:
        scenario: the scenario, or that of each world of a batch, with equally many people.
        run: its recording, or one of another run in the same scene, such as a branch.

    Returns:
        By name, a number for each world, or a single one:

        * arrived: share of people that were within 0.5 m of their last goals; NaN if nobody stays at one.
        * flow: persons per second through the gate; NaN without a gate.
        * stopped: how often people were stopped by obstacles.
        * time_to_goal, path_length, collisions: those of the robot.
        * closest: the distance of the robot's outline to the nearest person's at any time, metres.
        * personal, intimate: seconds with a person's centre within 1.2 and 0.45 m of the robot's outline.

        Those of the robot are absent without one.
    """
    if not isinstance(scenario, Scenario):
        if run.pose.ndim != 4 or len(scenario) != run.pose.shape[1]:
            raise ValueError(f"found {len(scenario)} scenarios and poses of shape {run.pose.shape}, expected one for each "
                             "world of a batch")
        several = [measures(each, Recording(run.pose[:, i], run.stalled[:, i], run.dt)) for i, each in enumerate(scenario)]
        return {name: np.array([found[name] for found in several]) for name in several[0]}
    first = 0 if scenario.robot is None else 1
    people = run.pose[..., first:, :]
    stays = np.isfinite(scenario.goals).all(-1)
    times = metrics.arrival_times(people[..., stays, :], scenario.goals[stays], run.dt)
    nan = np.full(run.pose.shape[1:-2], np.nan)
    found: dict[str, npt.NDArray[np.float64]] = {
        "arrived": np.isfinite(times).mean(-1) if stays.any() else nan,
        "flow": nan if scenario.gate is None else metrics.flow(metrics.crossing_times(people, scenario.gate, run.dt)),
        "stopped": metrics.collisions(run.stalled[..., first:]).sum(-1).astype(float)}
    if scenario.robot is None:
        return found
    robot, radius, radii = run.pose[..., 0, :], scenario.radii[0], scenario.radii[1:]
    return found | {
        "time_to_goal": metrics.arrival_times(robot, scenario.goal, run.dt),
        "path_length": metrics.path_lengths(robot),
        "collisions": metrics.collisions(run.stalled[..., 0]).astype(float),
        "closest": metrics.closest_distances(robot, people, radius + radii).min(-1),
        "personal": metrics.intrusion_times(robot, people, run.dt, metrics.PERSONAL, radius),
        "intimate": metrics.intrusion_times(robot, people, run.dt, metrics.INTIMATE, radius)}

