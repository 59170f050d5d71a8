# SPDX-License-Identifier: GPL-2.0-or-later
"""A scenario: a scene with people, perhaps with a robot and its goal."""

from __future__ import annotations

import os
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..scenes import Scene

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scenario:
    """A scene with people. World.of() and Batch.of() take its `scene`.

    Attributes:
        name: that of the scenario.
        seed: the seed of places, goals and speeds.
        scene: the world. The robot, if there is one, is its first robot; then come the people.
        robot: the name of the robot, or None.
        start: x, y and heading of the robot at first.
        via: places on the way of the robot, such as a door.
        goal: x and y of the robot's goal.
        horizon: seconds in which the robot and most people arrive.
        radii: that of the robot, or NaN, and those of the people, metres: shape (1 + m,) for m people.
        people: the names of the people.
        goals: where each person stays at last: shape (m, 2). People who never stay have NaN.
        speeds: at which people want to walk, m/s: shape (m,).
        gate: x and y of both posts of a door, shape (2, 2), or None; people go through it from right to left.
    """

    name: str
    seed: int
    scene: Scene = field(repr=False)
    robot: str | None
    start: tuple[float, float, float]
    via: tuple[tuple[float, float], ...]
    goal: tuple[float, float]
    horizon: float
    radii: Floats = field(repr=False)
    people: tuple[str, ...] = field(repr=False)
    goals: Floats = field(repr=False)
    speeds: Floats = field(repr=False)
    gate: Floats | None = field(repr=False)

    def save(self, folder: str | os.PathLike[str]) -> str:
        """Writes the world file NAME.world to a folder, which is made if it does not exist, and returns its path."""
        return self.scene.save(folder, self.name)
