# SPDX-License-Identifier: GPL-2.0-or-later
"""The belief of the robot and its engine, by the parameters of the node and by messages."""

from __future__ import annotations

from typing import Any, Mapping

import numpy as np

from ...belief import Belief, ConsequenceEngine, Decision
from ..covariance import Array
from .others import Arrays
from .plane import Moving, pose_of, shown
from .plans import dynamic_window, grid

_MOST_CELLS = 10000  #: on a side of a map


class Decider:
    """Chooses the next velocity of the robot.

    Args:
        values: those of the node's parameters.

    Raises:
        StageError: the world file can't be used.
        ValueError: it isn't named, or parameters contradict each other.
    """

    def __init__(self, values: Mapping[str, Any]) -> None:
        if not values["world_file"]:
            raise ValueError("found no world, expected one on the command line or in the parameter world_file")
        self._values = values
        self._map: tuple[Any, ...] | None = None  # the shape, resolution and origin of the map that the belief has
        self._make()
        self._errors = np.diag(np.square(values["model_errors"]))
        self._grid = grid(values["speeds"], values["sideways"], values["turns"], values["hold"] > 0)

    @property
    def has_map(self) -> bool:
        """Whether a map has been taken."""
        return self._map is not None

    def take_map(self, message: Any) -> None:
        """Takes a nav_msgs/OccupancyGrid: into the belief, or into a new one if its size or its place differs.

        Raises:
            ValueError, StageError: it makes no sense; the map that was there stays.
        """
        info, cells = message.info, np.frombuffer(memoryview(message.data), np.int8)
        shape = (info.height, info.width)
        if not all(1 <= side <= _MOST_CELLS for side in shape) or len(cells) != shape[0] * shape[1]:
            raise ValueError(f"found {len(cells)} cells for {shape[0]} rows of {shape[1]} cells, expected as many, and at most "
                             f"{_MOST_CELLS} on a side")
        if not 0 < info.resolution < 1000:
            raise ValueError(f"found a resolution of {info.resolution:.4g}, expected metres")
        # The message has a float of 32 bits: 0.05 is meant, and not 0.0500000007.
        place = (shape, float(f"{info.resolution:.7g}"), tuple(pose_of(info.origin).tolist()))
        if place != self._map:
            self._make(grid=shape, resolution=place[1], origin=place[2])
            self._map = place
        self._belief.set_grid(cells.reshape(shape), self._values["occupied"])

    def decide(self, robot: Moving, others: Arrays, goal: Array, seed: int, seconds: float) -> tuple[Array, Decision]:
        """Decides by what is believed of the time at which the robot will obey.

        Args:
            robot: in the map, with the velocity in its own frame.
            others: in the map.
            goal: x and y.
            seed: of the samples.
            seconds: budget; 0: no limit.

        Returns:
            The plans, shape (p, m, 3), and the decision.

        Raises:
            StageError: there can be no decision.
        """
        values = self._values
        self._belief.set_robot(robot.pose, robot.velocity, robot.pose_covariance + self._errors, robot.velocity_covariance)
        self._belief.set_others(*others)
        plans = self._grid
        if values["accelerations"]:
            plans = dynamic_window(values["speeds"], values["turns"], robot.velocity, values["accelerations"], values["window"])
        return plans, self._engine.choose(
            plans, goal, radius=values["robot_radius"], horizon=values["horizon"], hold=values["hold"], seed=seed,
            seconds=seconds, penalty=values["penalty"], tolerance=values["tolerance"])

    def _make(self, **of_grid: Any) -> None:
        values = self._values
        belief = Belief(values["world_file"], values["robot"], other_radius=values["other_radius"],
                        others_clear_cells=values["others_clear_cells"], **of_grid)
        samples = values["samples"]
        engine = ConsequenceEngine(belief, samples=samples, most_samples=max(samples, values["most_samples"]),
                                   max_risk=values["max_risk"], threads=values["threads"] or None)
        self._belief, self._engine = belief, engine


def goal_of(message: Any) -> Array:
    """The goal in a geometry_msgs/PoseStamped: x and y. Raises ValueError if it isn't finite."""
    goal = np.array([message.pose.position.x, message.pose.position.y])
    if not np.isfinite(goal).all():
        raise ValueError(f"found the goal {shown(goal)}, expected finite numbers")
    return goal
