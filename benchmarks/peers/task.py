# SPDX-License-Identifier: GPL-2.0-or-later
"""The task that all simulators carry out, and the exact geometry that their lidars are compared with."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

RADIUS = 0.1  # of an agent, metres
GAP = 0.05  # minimum distance between agents at the start of an episode, metres
STEP = 0.1  # simulated time of a step, seconds
TOP_SPEED = 0.4  # metres per second; VMAS's agents reach it at full force
LEG = 25  # steps until agents turn around, in which they drive about as far as their goals are away
GOAL_RADIUS = 0.05  # metres
FINAL_REWARD, PENALTY = 0.01, 1.0


@dataclass(frozen=True)
class Task:
    """The scenario "navigation" of VMAS: round agents without walls drive to goals of their own.

    Agents start at random places in a square, at least GAP apart; goals are placed in the same way. Agents drive
    towards their goals for LEG steps, then back, and so on, so that they stay close together. The observation of an
    agent is its position, its velocity, its position relative to the goal and the readings of its lidar; judge()
    computes the reward.
    """

    agents: int = 4
    rays: int = 12  # per agent, all around; the first one points forwards
    reach: float = 0.35  # range of the lidar, metres
    envs: int = 64
    episode: int = 100  # steps
    apart: bool = False  # environments end their episodes at different times, not all at once

    @property
    def half_width(self) -> float:
        """Half the width in metres of the square: 1 as in VMAS, more if the agents do not fit."""
        return max(1.0, 0.6 * math.sqrt(self.agents))

    @property
    def bearings(self) -> Floats:
        """Directions of the rays relative to the agent, radians."""
        return np.arange(self.rays) * (math.tau / self.rays)


def places(chance: np.random.Generator, envs: int, agents: int, half_width: float,
           taken: Floats | None = None) -> Floats:
    """Draws random places that are at least GAP apart, as VMAS does.

    Args:
        chance: source of the random numbers.
        envs: number of environments.
        agents: number of places in each.
        half_width: half the width of the square, metres.
        taken: further places to keep a distance from, shape (envs, any, 2).

    Returns:
        x and y in metres, shape (envs, agents, 2).
    """
    before = 0 if taken is None else taken.shape[1]
    found = np.empty((envs, before + agents, 2))
    if taken is not None:
        found[:, :before] = taken
    for i in range(before, before + agents):
        todo = np.arange(envs)
        while todo.size:
            found[todo, i] = chance.uniform(-half_width, half_width, (todo.size, 2))
            apart = found[todo, :i] - found[todo, i, None]
            close = (apart ** 2).sum(-1) < (2 * RADIUS + GAP) ** 2
            todo = todo[close.any(1)]
    return found[:, before:]


def exact_ranges(positions: Floats, headings: Floats, task: Task) -> Floats:
    """Returns what lidars of agents at these places read, by the intersections of rays and circles.

    Args:
        positions: x and y in metres, shape (envs, agents, 2).
        headings: radians, shape (envs, agents).
        task: has the rays and their range.

    Returns:
        Ranges in metres, shape (envs, agents, rays).
    """
    angles = headings[..., None] + task.bearings
    rays = np.stack([np.cos(angles), np.sin(angles)], -1)
    others = positions[:, None] - positions[:, :, None]
    along = np.einsum("eard,eaod->earo", rays, others)
    across = (others ** 2).sum(-1)[:, :, None] - along ** 2
    entry = along - np.sqrt(np.maximum(RADIUS ** 2 - across, 0))
    own = np.eye(positions.shape[1], dtype=bool)[None, :, None]
    missed = own | (across >= RADIUS ** 2) | (along <= 0)
    return np.where(missed, task.reach, np.clip(entry, 0, task.reach)).min(-1)


def expected_hits(task: Task) -> float:
    """Returns the fraction of rays that hit something at the start of an episode, by exact geometry."""
    positions = places(np.random.default_rng(1), 2000, task.agents, task.half_width)
    return float((exact_ranges(positions, np.zeros(positions.shape[:2]), task) < task.reach).mean())


def judge(before: Floats, distances: Floats, touched: npt.NDArray[np.bool_]) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Computes rewards and dones as VMAS's scenario does.

    Args:
        before: distances to the goals before the step, metres: shape (envs, agents).
        distances: those after it.
        touched: agents that touch another one.

    Returns:
        The rewards, shape (envs, agents): the progress of all agents to their goals, more if all have arrived, less if
        the agent touches another one. Then the dones, shape (envs,): all agents are close to their goals.
    """
    shared = (before - distances) @ np.ones(distances.shape[1])
    farthest = np.ascontiguousarray(distances.T).max(0)  # four times as fast as a maximum over the short last axis
    shared[farthest < GOAL_RADIUS] += FINAL_REWARD
    return shared[:, None] - PENALTY * touched, farthest < RADIUS


class Schedule:
    """Says in which environments an episode ends before a step, and in which agents turn around."""

    def __init__(self, task: Task) -> None:
        self._task = task
        numbers = np.arange(task.envs)
        self._ages = numbers * task.episode // task.envs if task.apart else np.zeros(task.envs, int)

    def ended(self, step: int) -> npt.NDArray[np.int64] | None:
        """The environments to reset before step number `step`, 1 or more; None: there are none."""
        return self._chosen(step, self._task.episode)

    def turning(self, step: int) -> npt.NDArray[np.int64] | None:
        """The environments whose agents turn around before step number `step`; None: there are none."""
        return self._chosen(step, LEG)

    def _chosen(self, step: int, period: int) -> npt.NDArray[np.int64] | None:
        if not self._task.apart and step % period != 0:
            return None
        chosen = np.nonzero((self._ages + step) % self._task.episode % period == 0)[0]
        return chosen if chosen.size else None


def unit(vectors: Any) -> Any:
    """Scales vectors, an array or a tensor of shape (..., 2), to the length 1."""
    lengths = (vectors ** 2).sum(-1) ** 0.5
    return vectors / lengths[..., None].clip(1e-6)
