# SPDX-License-Identifier: GPL-2.0-or-later
"""The base class of tasks."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Sequence, Union

import numpy as np
from gymnasium.spaces import Box, Discrete, Space

from .arrays import Array, wide
from .randoms import Randoms
from .scene import Scene

if TYPE_CHECKING:
    from .. import scenes
    from ..world import World

#: Observations of robots: an array, or arrays by name.
Observations = Union[Array, dict[str, Array]]


@dataclass
class Outcome:
    """The result of an action.

    Attributes:
        reward: reward of each robot: shape (n, robots).
        terminated: True for robots whose episode is terminated: shape (n, robots).
        info: further values of each robot by name: numbers or bools, shape (n, robots).
    """

    reward: Array
    terminated: Array
    info: dict[str, Array] = field(default_factory=dict)


def checked_outcome(outcome: Any, scene: Scene, task: str) -> Outcome:
    """The outcome with copies of its info, because live arrays change when the next episodes begin.

    Raises TypeError or ValueError if it is none, or if an array has a wrong shape or type.
    """
    if not isinstance(outcome, Outcome):
        raise TypeError(f"found {type(outcome).__name__} from {task}.judge(), expected Outcome(reward, terminated)")
    shape = scene.n, scene.robots
    named = {"reward": outcome.reward, "terminated": outcome.terminated, **outcome.info}
    for name, values in named.items():
        if tuple(getattr(values, "shape", ())) != shape:
            raise ValueError(f"found {name!r} of shape {tuple(getattr(values, 'shape', ()))} from {task}.judge(), expected "
                             f"{shape}: a value for each robot of each world")
    if outcome.terminated.dtype != scene.xp.bool:
        raise TypeError(f"found 'terminated' of the type {outcome.terminated.dtype} from {task}.judge(), expected bools")
    return Outcome(outcome.reward, outcome.terminated, {name: wide(values) for name, values in outcome.info.items()})


class Task:
    """Base class of tasks. Override `size`, `begin`, `observe` and `judge`.

    The methods process arrays of many worlds at once, of the library `scene.xp`: NumPy on the host, PyTorch on a card.
    The results of a world must not depend on the other worlds. A task keeps the state of an episode in `scene.notes`,
    so that one object can serve several environments. Its only random numbers are those that begin() gets.

    Attributes:
        world: the default world: a file, the name of a shipped world, a stagesim.scenes.Scene, or a World.
        steps: steps of the world per action.
        limit: max number of actions of an episode, after which it is truncated.
        top_speed: speeds forwards, to the left (m/s) and turning (rad/s) for an action of 1. An action has a
            number from -1 to 1 for each of them that is not 0.
        choices: for discrete actions the speeds that each of them sets, such as ((0.5, 0, 0), (0, 0, 1)); None:
            actions are continuous.
        ranges: the array that Scene.ranges returns, as in Batch.array(): that of the first ranger, or of another
            sensor, such as "sonar_ring.ranges" of a plug-in.
        placed: a pattern of names or types of models that are no robots, such as things to push. Scene.place() moves them
            at the begin of episodes, and Scene.placed_pose has their poses; None: none.
        bounds: min and max of observations. Values outside are errors, unless the environment clips them.
    """

    world: str | os.PathLike[str] | World | scenes.Scene = "arena.world"
    steps: int = 2
    limit: int = 300
    top_speed: tuple[float, float, float] = (0.5, 0.0, 1.5)
    choices: Sequence[tuple[float, float, float]] | None = None
    ranges: str = "ranger.ranges"
    placed: str | None = None
    bounds: tuple[float, float] = (-1.0, 1.0)

    def prepare(self, scene: Scene) -> None:
        """Called once per environment, with all of its worlds: checks them, and sets constants in `scene.notes`."""

    def size(self, scene: Scene) -> int:
        """Returns the number of elements of a robot's observation."""
        raise NotImplementedError(f"{type(self).__name__} lacks size(), the number of elements of an observation, or "
                                  "observation_space()")

    def observation_space(self, scene: Scene) -> Space[Any]:
        """Returns the space of a robot's observations: a Box, or a Dict of boxes.

        The default is a Box of `size` numbers (float32) within `bounds`. A Box may have more axes, and the type uint8
        for images.
        """
        return Box(*self.bounds, (self.size(scene),), np.float32)

    def action_space(self, scene: Scene) -> Space[Any]:
        """Returns the space of a robot's actions: a Box of numbers from -1 to 1, or Discrete with `choices`."""
        if self.choices is not None:
            return Discrete(len(self.choices))
        return Box(-1, 1, (int(np.count_nonzero(self.top_speed)),), np.float32)

    def begin(self, scene: Scene, randoms: Randoms) -> Array | None:
        """Begins episodes in the worlds of `scene`, which have just been reset.

        Sets what the episode needs in `scene.notes`, for these worlds only: `scene.notes["goal"] = goals`. Arrays are of
        NumPy here, also if the worlds are on a card.

        Returns:
            Start poses x, y (metres) and heading (radians): shape (n, robots, 3); None: the poses in the file. The
            robots then stand still for one step, in which their sensors measure.
        """
        return None

    def began(self, scene: Scene) -> None:
        """Called after the first step of these episodes, before observe(): notes what can only be read then."""

    def observe(self, scene: Scene) -> Observations:
        """Returns the observations of the worlds of `scene`: a new array of shape (n, robots, size).

        With a space that is a Dict it returns such arrays by name. NaN becomes 0. Nothing is changed by it.
        """
        raise NotImplementedError

    def judge(self, scene: Scene) -> Outcome:
        """Returns the result of the last action; called once after each. A reward of NaN becomes 0.

        Rows of robots that are not live and of worlds whose episode is over are ignored.
        """
        raise NotImplementedError

    def marks(self, scene: Scene) -> Array | None:
        """Returns places that pictures mark with crosses, such as goals: x, y, metres, shape (n, k, 2); None: none."""
        return None

    def command(self, scene: Scene, actions: Array) -> Array:
        """Converts actions to speeds forwards, to the left (m/s) and turning (rad/s): shape (n, robots, 3).

        Args:
            scene: all worlds.
            actions: numbers from -1 to 1, shape (n, robots, numbers); or indices of `choices`, int64, shape
                (n, robots).
        """
        if self.choices is not None:
            return scene.arrays.of(self.choices, np.float64)[actions]
        speeds = scene.arrays.zeros((scene.n, scene.robots, 3))
        for number, axis in enumerate(np.flatnonzero(self.top_speed).tolist()):
            speeds[..., axis] = actions[..., number] * self.top_speed[axis]
        return speeds
