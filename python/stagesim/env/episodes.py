# SPDX-License-Identifier: GPL-2.0-or-later
"""Episodes of a task in a batch of worlds: the common engine of all environments."""

from __future__ import annotations

import contextlib
import inspect
import math
import os
from dataclasses import dataclass
from typing import Any, Callable, Union

import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded

from .. import _core
from .._checks import shown
from .._scene_variants import MapLike
from ..batch import Batch
from ..device_array import DeviceArray
from ..errors import StageError
from ..fleet import Bools, Floats
from ..pictures import Pixels
from ..scenes import Scene as SceneOfFile
from ..world import World
from .actions import Actions
from .arrays import Array, Arrays, on_host
from .delay import NAME, Delay
from .observed import Observed
from .randoms import Randoms, keys_of, mixed
from .rendering import Renderer, Rendering
from .scene import Scene
from .statistics import Statistics
from .task import Observations, Outcome, Task, checked_outcome
from .tasks import TASKS

#: A task, its class, or the name of a shipped one.
AnyTask = Union[Task, "type[Task]", str]
#: The world of an environment: a world file or its name, a scene, or a World; None: the world of the task.
AnyWorld = Union[str, "os.PathLike[str]", World, SceneOfFile, None]
#: Makes the map, or the scene, of a world for an episode.
MakeMap = Callable[[np.random.Generator], MapLike]
_SEED_OF_WORLD = np.uint64(0x5851F42D4C957F2D)  # makes a world's seed differ from the task's random numbers


def task_of(task: AnyTask) -> Task:
    """Converts the argument to a task. Raises ValueError if there is no task of that name."""
    if isinstance(task, str):
        if task not in TASKS:
            raise ValueError(f"found the task {task!r}, expected one of {', '.join(sorted(TASKS))}")
        return TASKS[task]()
    made = task() if isinstance(task, type) else task
    if not isinstance(made, Task):
        raise TypeError(f"found {shown(task)} as task, expected a Task of stagesim.env, its class, or the name of a shipped one")
    if len(inspect.signature(made.begin).parameters) != 2:
        raise TypeError(f"found {type(made).__name__}.begin{inspect.signature(made.begin)}, expected "
                        "begin(scene, randoms), which begins the episodes of all worlds of the scene")
    return made


@dataclass
class Ends:
    """Rewards of an action, and the ends of episodes.

    For robots that were not live and worlds that were not stepped, rewards are 0 and the flags are False.
    """

    rewards: Array                # (n, robots), float64
    terminated: Array             # (n, robots)
    truncated: Array              # (n, robots)
    over: Bools                   # (n,), on the host: the episode ended by this action
    worlds_terminated: Array      # (n,): the last live robot was terminated
    worlds_truncated: Array       # (n,): the episode was truncated


@dataclass
class Moment:
    """The result of an action in each of n worlds."""

    observations: Observations    # (n, robots, ...): new arrays
    info: dict[str, Array]        # (n, robots)
    ends: Ends


class Episodes:
    """The worlds and the task of an environment; environments only convert its arrays to their interface.

    Args:
        world: a world file, the name of a shipped world, a scene or a World; None: the world of the task.
        task: the task, its class, or the name of a shipped one.
        n: number of worlds.
        robots, threads, device: as in Batch().
        arrays: "numpy" or "torch"; None: PyTorch if the worlds are in the memory of a CUDA device, else NumPy.
        action_delay: the number of actions after which an action is obeyed.
        clip_actions: whether actions outside -1 to 1 are clipped and counted; False: they are errors.
        maps: makes the map, or the scene, of a world at the begin of each episode; None: maps stay.
        rendering: mode and size of pictures.
        options: options of World().
    """

    def __init__(self, world: AnyWorld, task: AnyTask, n: int, *, robots: str | None, threads: int | None,
                 options: dict[str, Any], device: str | None = None, arrays: str | None = None,
                 maps: MakeMap | None = None, action_delay: int = 0, clip_actions: bool = False,
                 rendering: Rendering = Rendering()) -> None:
        self.task = task_of(task)
        prototype = _prototype(self.task.world if world is None else world, options)
        self.batch = Batch.of(prototype, n, threads=threads, robots=robots, device=device,
                              placed=self.task.placed)
        self.arrays = Arrays(arrays, self.batch.pose)
        self.scene = Scene(self.batch, prototype, self.task.ranges, self.arrays)
        self.fps = 1 / (prototype.dt * self.task.steps)  #: actions per second of simulated time
        self.renderer = Renderer(rendering, self.fps)
        self.statistics = Statistics()  #: of the last episodes
        self._connect()
        self.task.prepare(self.scene)
        self.observed = Observed(self.task.observation_space(self.scene), self.scene, type(self.task).__name__)
        self.delay = Delay(self.scene, action_delay)  #: latency of commands
        self.actions = Actions(self.task.action_space(self.scene), self.scene, clip_actions)
        n = self.batch.n
        self._seeds = np.random.SeedSequence().generate_state(n, np.uint64)
        self._begun = np.zeros(n, np.uint64)  # number of episodes since the seed was set
        self.over = np.ones(n, bool)  #: True for worlds whose episode is over or has not begun, on the host: (n,)
        self._maps = maps
        self._has_observed = False
        self._returns = self.arrays.zeros((n,))
        self._flags: dict[str, Array] = {}

    def _connect(self) -> None:
        """Finds the live arrays of the batch."""
        self._commands = self.arrays.live(self.batch.cmd)
        self._ended = self.batch.ended
        on_card = isinstance(self.batch.pose, DeviceArray)
        self._starts = None if on_card else np.zeros((self.batch.n, len(self.batch), 3))
        self._moved = None if on_card else np.zeros((self.batch.n, len(self.batch)), bool)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items()
                if name not in ("_commands", "_ended", "_starts", "_moved")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._connect()

    def seed(self, ids: npt.NDArray[np.int64], seeds: npt.NDArray[np.uint64]) -> None:
        """Sets the seeds of worlds, whose next episodes are then the first ones of these seeds."""
        self._seeds[ids] = seeds
        self._begun[ids] = 0

    def begin(self, which: Bools) -> Observations:
        """Begins episodes in the m worlds of the mask `which`, shape (n,).

        Returns:
            The observations of these worlds: new arrays of shape (m, robots, ...).

        Raises:
            StageError: a world has failed, or there is not enough space.
        """
        known = set(self.scene.sensors)
        seen = self._begin(which)
        if self.scene.sensors != known:  # the task has just asked for sensors, which have had no readings yet
            self._begun[which] -= np.uint64(1)
            seen = self._begin(which)
        return seen

    def _begin(self, which: Bools) -> Observations:
        ids = None if which.all() else np.flatnonzero(which)
        chosen = slice(None) if ids is None else ids
        self.over[chosen] = True
        keys = keys_of(self._seeds[chosen], self._begun[chosen])
        self._begun[chosen] += np.uint64(1)
        # Seeds stay below 2**63, because some learners keep them as signed integers.
        seeds = mixed(keys ^ _SEED_OF_WORLD) >> np.uint64(1)
        if self._maps is not None:
            self.batch.set_map(ids, [self._made_map(seed) for seed in seeds.tolist()])
        self.batch.reset(seeds, ids=ids)
        self._check(ids)
        rows = None if ids is None else self.arrays.of(ids)
        part = self.scene.part(rows)
        # Few worlds begin at a time, so the host is faster than many small calls of a card.
        for_host = part.for_host()
        starts = self.task.begin(for_host, Randoms(keys))
        if not self._has_observed:  # asks for sensors before the first step: a device can't make them run later
            with contextlib.suppress(LookupError):  # notes of began()
                self.task.observe(part)
            self._has_observed = True
        if starts is not None:
            if np.shape(starts) != (part.n, part.robots, 3):
                raise ValueError(f"found poses of shape {np.shape(starts)} from {type(self.task).__name__}.begin(), expected "
                                 f"{(part.n, part.robots, 3)}: x, y and heading of each robot")
            self._move(rows, self.arrays.given(starts))
        self.batch.step(ids=ids)
        self._check(ids)
        self.scene.note_begin(rows)
        self._returns[slice(None) if rows is None else rows] = 0
        self.over[chosen] = False
        self.delay.begin(chosen)
        self.task.began(for_host)
        self.renderer.show(self.batch, self._marks)
        return self.observed.checked(self.task.observe(part), part)

    def _made_map(self, seed: int) -> MapLike:
        assert self._maps is not None
        made = self._maps(np.random.default_rng(seed))
        if made is None:
            raise TypeError("found None from maps(), expected an array, a GridMap or a Scene")
        return made

    def _move(self, rows: Array | None, starts: Array) -> None:
        """Moves the robots of worlds, all of them if `rows` is None, to their start poses."""
        chosen = slice(None) if rows is None else rows
        if self._starts is None or self._moved is None:
            xp = self.arrays.xp
            poses = xp.full_like(self.scene.pose, math.nan)
            poses[chosen] = starts
            return self.batch.teleport(poses, ~xp.isnan(poses[..., 0]))
        ids = chosen if rows is None else on_host(rows)
        self._starts[ids] = on_host(starts)
        self._moved[ids] = True
        self.batch.teleport(self._starts, self._moved)
        self._moved[ids] = False

    def step(self, actions: Any, going: Bools) -> Moment:
        """Applies an action in some worlds.

        Args:
            actions: n * robots actions of the task's space, in any shape.
            going: mask of the worlds, shape (n,).

        Raises:
            ResetNeeded: an episode of these worlds is over or has not begun.
            ValueError: the number of actions is wrong, or an action is not in its space.
            StageError: a world has failed.
        """
        if (self.over & going).any():
            raise ResetNeeded("an episode is over, or has not begun: call reset()")
        scene = self.scene
        ids = None if going.all() else np.flatnonzero(going)
        speeds = self.task.command(scene, self.actions.checked(actions, going))
        self._commands[...] = scene.xp.where(scene.live[..., None], self.delay.passed(speeds), 0.0)
        self.batch.step(self.task.steps, ids=ids)
        self._check(ids)
        self.renderer.show(self.batch, self._marks)
        scene.note_action(None if ids is None else self.arrays.of(ids))
        outcome = checked_outcome(self.task.judge(scene), scene, type(self.task).__name__)
        ends = self._settle(outcome, going) if self.arrays.is_numpy else self._settle_on_card(outcome, going)
        self.over |= ends.over
        self._note(outcome, ends)
        return Moment(self.observed.checked(self.task.observe(self.scene), self.scene), outcome.info, ends)

    def _settle(self, outcome: Outcome, going: Bools) -> Ends:
        """Ends the episodes of robots and worlds; the compiled form of _settle_on_card() for arrays of NumPy."""
        scene = self.scene
        shape = scene.n, scene.robots
        rewards, flags, of_worlds = np.empty(shape), np.empty((2, *shape), bool), np.empty((3, scene.n), bool)
        at_limit = scene.actions >= self.task.limit
        if self._ended.any():
            at_limit |= self._ended
        _core.settle(outcome.reward.astype(np.float64, copy=False), outcome.terminated, scene.pose, going, at_limit,
                     scene.live, rewards, *flags, of_worlds)
        return Ends(rewards, *flags, over=of_worlds[0], worlds_terminated=of_worlds[1], worlds_truncated=of_worlds[2])

    def _settle_on_card(self, outcome: Outcome, going: Bools) -> Ends:
        """Ends the episodes of robots and worlds."""
        scene, xp = self.scene, self.arrays.xp
        taking_part = scene.live if going.all() else scene.live & self.arrays.of(going)[:, None]
        terminated = taking_part & (outcome.terminated | xp.isnan(scene.pose[..., 0]))
        at_limit = (scene.actions >= self.task.limit) | self.arrays.given(np.asarray(self._ended))
        truncated = taking_part & ~terminated & at_limit[:, None]
        rewards = xp.where(taking_part & ~xp.isnan(outcome.reward), outcome.reward, 0.0)
        has_ended = terminated | truncated
        worlds_truncated = xp.any(truncated, axis=1)
        scene.note_end(has_ended)
        is_over = xp.any(has_ended, axis=1) & ~xp.any(scene.live, axis=1)
        return Ends(rewards, terminated, truncated, over=np.array(on_host(is_over)),
                    worlds_terminated=is_over & ~worlds_truncated, worlds_truncated=worlds_truncated)

    def _note(self, outcome: Outcome, ends: Ends) -> None:
        """Notes the results of robots, and of episodes that are over."""
        xp = self.arrays.xp
        self._returns += ends.rewards[:, 0] if self.scene.robots == 1 else xp.sum(ends.rewards, axis=1)
        is_over = ends.over.any()
        if self.scene.robots > 1 or is_over:
            has_ended = ends.terminated | ends.truncated
            for name, values in outcome.info.items():
                if values.dtype == xp.bool:
                    before = self._flags.get(name)
                    self._flags[name] = xp.where(has_ended, values, values if before is None else before)
        if is_over:
            rows = self.arrays.of(np.flatnonzero(ends.over))
            rates = {name: on_host(flags[rows]).mean(1) for name, flags in self._flags.items()}
            self.statistics.add(returns=on_host(self._returns[rows]), lengths=on_host(self.scene.actions[rows]), **rates)

    def vary(self, name: str, values: npt.ArrayLike | None) -> None:
        """Gives a property, or the latency of actions, another value in each world: see StageVectorEnv.vary()."""
        self.delay.set(values) if name == NAME else self.batch.vary(name, values)

    @property
    def varied(self) -> dict[str, npt.NDArray[Any]]:
        """The values that vary() was given, by name: copies."""
        delays = self.delay.values
        return {**self.batch.varied, **({NAME: delays} if delays.any() else {})}

    def picture(self, index: int) -> Pixels:
        """Renders world `index`."""
        return self.renderer.picture(self.batch, index, self._marks)

    def mosaic(self, most: int) -> Pixels:
        """Renders the first worlds side by side."""
        return self.renderer.mosaic(self.batch, range(min(most, self.batch.n)), self._marks)

    def _marks(self, index: int) -> Floats:
        """The places that the task marks in world `index`, shape (k, 2); none before its first episode."""
        found = self.task.marks(self.scene.part(self.arrays.of([index]))) if self._has_observed else None
        return np.zeros((0, 2)) if found is None else on_host(found).reshape(-1, 2)

    @property
    def returns(self) -> Array:
        """Sum of the rewards of the present or last episode of each world: shape (n,), live."""
        return self._returns

    def _check(self, ids: npt.NDArray[np.int64] | None) -> None:
        """Raises StageError if one of these worlds has failed; None: of all."""
        failed = self.batch._core.failures()
        for i in sorted(failed) if failed else ():
            if ids is None or i in ids:
                raise StageError(f"world number {i} has failed: {failed[i]}")


def opened(episodes: Episodes | None) -> Episodes:
    """The episodes of an environment. Raises ResetNeeded if the environment has been closed."""
    if episodes is None:
        raise ResetNeeded("the environment is closed: make another one")
    return episodes


def _prototype(world: AnyWorld, options: dict[str, Any]) -> World:
    if isinstance(world, World):
        if options:
            raise ValueError(f"found {sorted(options)} for a world that has been loaded")
        return world
    if isinstance(world, SceneOfFile):
        return World.of(world, threads=1, **options)
    if isinstance(world, Task) or (isinstance(world, type) and issubclass(world, Task)):
        raise TypeError(f"found the task {shown(world)} as world: give it by task=")
    assert world is not None
    return World(world, threads=1, **options)
