# SPDX-License-Identifier: GPL-2.0-or-later
"""Episodes of a task in a batch of worlds: the common engine of all environments."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass
from typing import Any, Sequence, Union

import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box

from ..batch import Batch
from ..errors import StageError
from ..fleet import Bools, Floats
from ..world import World
from .rendering import MODES, Renderer
from .task import Scene, Task
from .tasks import TASKS

Observations = npt.NDArray[np.float32]
#: A task, its class, or the name of a shipped one.
AnyTask = Union[Task, "type[Task]", str]


def task_of(task: AnyTask) -> Task:
    """Converts the argument to a task. Raises ValueError if there is no task of that name."""
    if isinstance(task, str):
        if task not in TASKS:
            raise ValueError(f"found the task {task!r}, expected one of {', '.join(sorted(TASKS))}")
        return TASKS[task]()
    return task() if isinstance(task, type) else task


@dataclass
class Moment:
    """The result of an action in each of n worlds.

    For robots that were not live and worlds that were not stepped, rewards are 0 and the flags are False.
    """

    observations: Observations  # (n, robots, size): a new array
    rewards: Floats             # (n, robots)
    terminated: Bools           # (n, robots)
    truncated: Bools            # (n, robots)
    info: dict[str, npt.NDArray[Any]]  # (n, robots): bools, int64 or float64

    @property
    def worlds_truncated(self) -> Bools:
        """True for worlds whose episode was truncated: shape (n,)."""
        return self.truncated.any(1)


class Episodes:
    """The worlds and the task of an environment; environments only convert its arrays to their interface."""

    def __init__(self, world: str | os.PathLike[str] | World | None, task: AnyTask, n: int,
                 robots: str | None, threads: int | None, options: dict[str, Any],
                 render_mode: str | None = None, render_size: tuple[int, int] = (640, 480)) -> None:
        self.task = task_of(task)
        if isinstance(world, World):
            if options:
                raise ValueError(f"found {sorted(options)} for a world that has been loaded")
            prototype = world
        else:
            prototype = World(self.task.world if world is None else world, threads=1, **options)
        self.batch = Batch.of(prototype, n, threads=threads, robots=robots)
        self.scene = Scene(self.batch, prototype, self.task.ranges)
        self._commands = self.batch.cmd
        self._ended = self.batch.ended
        self.task.prepare(self.scene)
        self.size = self.task.size(self.scene)
        self.action_size = int(np.count_nonzero(self.task.top_speed))
        self.fps = 1 / (prototype.dt * self.task.steps)  #: actions per second of simulated time
        self.renderer = Renderer(render_mode, render_size, self.fps)
        self._has_clipped = False

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in ("_commands", "_ended")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._commands = self.batch.cmd
        self._ended = self.batch.ended

    def metadata(self) -> dict[str, Any]:
        """The metadata about rendering for Gymnasium and PettingZoo."""
        return {"render_modes": list(MODES), "render_fps": self.fps}

    def observation_space(self, robots: int = 1) -> Box:
        """The observation space of `robots` robots, concatenated."""
        low, high = self.task.bounds
        return Box(low, high, (robots * self.size,), np.float32)

    def action_space(self, robots: int = 1) -> Box:
        """The action space of `robots` robots, concatenated."""
        return Box(-1, 1, (robots * self.action_size,), np.float32)

    def begin(self, which: Bools, randoms: Sequence[np.random.Generator]) -> Observations:
        """Begins episodes in the worlds of the mask `which`; `randoms` has a generator per world of the batch.

        Returns:
            The observations of all worlds, a new array of shape (n, robots, size).
        """
        scene, chosen = self.scene, np.flatnonzero(which).tolist()
        # Seeds stay below 2**63, because some learners keep them as signed integers.
        self.batch.reset([int(randoms[i].integers(2**63)) for i in chosen], ids=chosen)
        self._check(chosen)
        poses, moved = np.zeros((scene.n, scene.robots, 3)), np.zeros(scene.n, bool)
        for i in chosen:
            starts = self.task.begin(scene, i, randoms[i])
            if starts is not None:
                poses[i], moved[i] = starts, True
        if moved.any():
            self.batch.teleport(poses, moved[:, None])
        self.batch.step(ids=chosen)
        self._check(chosen)
        scene.actions[chosen] = 0
        scene.live[chosen] = True
        self.renderer.show(self.batch)
        return self._observe()

    def step(self, actions: npt.ArrayLike, which: Bools) -> Moment:
        """Applies an action in some worlds.

        Args:
            actions: n * robots * action_size numbers in any shape; they are clipped to -1 to 1.
            which: mask of the worlds, shape (n,).

        Raises:
            ResetNeeded: an episode of these worlds is over or has not begun.
            ValueError: the number of actions is wrong, or an action is not finite.
            StageError: a world has failed.
        """
        scene = self.scene
        if not scene.live[which].any(1).all():
            raise ResetNeeded("an episode is over, or has not begun: call reset()")
        self._command(actions, which)
        self.batch.step(self.task.steps, ids=which)
        self._check(np.flatnonzero(which).tolist())
        self.renderer.show(self.batch)
        scene.actions[which] += 1
        outcome = self.task.judge(scene)
        live = scene.live & which[:, None]
        terminated = live & (outcome.terminated | np.isnan(scene.pose[..., 0]))
        over = (scene.actions >= self.task.limit) | self._ended
        truncated = live & ~terminated & over[:, None]
        rewards = np.where(live & ~np.isnan(outcome.reward), outcome.reward, 0.0)
        scene.live &= ~(terminated | truncated)
        info = {name: _wide(values) for name, values in outcome.info.items()}
        return Moment(self._observe(), rewards, terminated, truncated, info)

    def all_terminated(self, moment: Moment) -> Bools:
        """True for worlds whose last live robot was terminated by this action: shape (n,)."""
        return moment.terminated.any(1) & ~self.scene.live.any(1) & ~moment.worlds_truncated

    def _command(self, actions: npt.ArrayLike, which: Bools) -> None:
        scene = self.scene
        given = np.asarray(actions, np.float64)
        shape = (scene.n, scene.robots, self.action_size)
        if given.size != np.prod(shape):
            raise ValueError(f"found actions of shape {given.shape}, expected {shape} or as many numbers")
        given = given.reshape(shape)
        if not np.isfinite(given[which]).all():
            raise ValueError("found an action that is not finite")
        speeds = self.task.command(scene, np.clip(given, -1, 1))
        self._commands[which] = np.where(scene.live[..., None], speeds, 0)[which]

    def _observe(self) -> Observations:
        seen = np.array(self.task.observe(self.scene), np.float32)
        shape = (self.scene.n, self.scene.robots, self.size)
        if seen.shape != shape:
            raise ValueError(f"found observations of shape {seen.shape}, expected {shape}")
        seen[np.isnan(seen)] = 0
        low, high = self.task.bounds
        if not self._has_clipped and not ((seen >= low) & (seen <= high)).all():
            self._has_clipped = True
            self._warn_of_clipping(seen, low, high)
        return np.clip(seen, low, high, out=seen)

    def _warn_of_clipping(self, seen: Observations, low: float, high: float) -> None:
        world, robot, place = np.argwhere((seen < low) | (seen > high))[0].tolist()
        warnings.warn(
            f"found {seen[world, robot, place]:g} as number {place} of what {self.batch.names[robot]} observes in world "
            f"{world}, expected {low:g} to {high:g}; it is clipped, and so are all others outside: scale them, or "
            f"change the bounds of the task {type(self.task).__name__}", RuntimeWarning, stacklevel=2)

    def _check(self, chosen: list[int]) -> None:
        failed = self.batch._core.failures()
        for i in sorted(failed.keys() & chosen) if failed else ():
            raise StageError(f"world number {i} has failed: {failed[i]}")


def opened(episodes: Episodes | None) -> Episodes:
    """The episodes of an environment. Raises ResetNeeded if the environment has been closed."""
    if episodes is None:
        raise ResetNeeded("the environment is closed: make another one")
    return episodes


def _wide(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Converts to bool, int64 or float64, whose elements become plain Python values by item()."""
    kind = values.dtype.kind
    return np.array(values, np.bool_ if kind == "b" else np.int64 if kind in "iu" else np.float64)
