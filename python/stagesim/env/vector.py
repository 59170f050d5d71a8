# SPDX-License-Identifier: GPL-2.0-or-later
"""The Gymnasium vector environment of many worlds."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from .._scene_variants import MapLike
from ..batch import Which
from ..fleet import Bools
from ..pictures import Pixels
from . import adapters
from .arrays import Array, copied, on_host, put, wide
from .episodes import AnyTask, AnyWorld, Episodes, MakeMap, Moment, opened
from .rendering import MODES, Rendering
from .seeds import Seeds, seeds_of
from .statistics import Statistics

Step = tuple[Any, Array, Array, Array, dict[str, Any]]


class StageVectorEnv(VectorEnv[Any, Any, Any]):
    """A Gymnasium vector environment of many worlds, which are one Batch stepped by several threads.

    Each world is bit-equal to a StageEnv. Observations have the shape (num_envs, robots * size), actions
    (num_envs, robots * numbers), rewards (float64), terminations and truncations (num_envs,). All returned
    arrays are copies. See StageEnv for other spaces, and StageArrayEnv for an axis of the robots.

    With `device`, whole steps are made on an OpenCL device; if CUDA has it, all arrays are tensors of PyTorch in its
    memory, and nothing is copied to the host but which episodes are over. `infos["final_obs"]` is then a tensor of all
    worlds, of which the mask `infos["_final_obs"]` chooses.

    Seeds: `reset(seed=s)` gives world i the seed s + i. A list has a seed per world, or None to continue its
    random sequence. `reset(options={"reset_mask": mask})` resets only the worlds in the mask; the others
    return their last observations.

    Autoreset works as in `gymnasium.vector.SyncVectorEnv`. NEXT_STEP: the step after the end of an episode
    ignores the action and begins a new episode. SAME_STEP: the last step itself does, and puts its final
    observation and info into `infos["final_obs"]` and `infos["final_info"]`. DISABLED: call reset() yourself.

    Args:
        num_envs: number of worlds, 1 or more.
        world, task, robots, options: as in StageEnv().
        threads: number of threads that the worlds are distributed over, 1 to 1024; None: one per available
            processor.
        autoreset_mode: an AutoresetMode, or its value: "NextStep", "SameStep" or "Disabled".
        device: as in Batch(): "opencl:gpu"; None: the host makes the steps.
        arrays: "numpy", or "torch" for tensors of PyTorch, with which the task computes as well; None: "torch" for
            worlds in the memory of a CUDA device.
        maps: a function that is called with a generator of NumPy at the begin of each episode and returns the map, or
            the scene, of its world, as in Batch.set_map(); None: maps stay.
        episode_info: True: `infos["episode"]` has "r" (return), "l" (length) and "t" (simulated seconds) of episodes
            that end, as of gymnasium.wrappers.vector.RecordEpisodeStatistics. `statistics` is there without it.
        render_mode, render_size: as in StageEnv().
        render_worlds: number of worlds that a window shows side by side.
        action_delay: latency: the number of actions after which an action is obeyed, 0 to 1000.
        clip_actions: as in StageEnv().

    Raises the errors of StageEnv(), and TypeError or ValueError for an invalid reset_mask.
    """

    def __init__(self, num_envs: int = 1, world: AnyWorld = None, task: AnyTask = "Navigate", *,
                 robots: str | None = None, threads: int | None = None, autoreset_mode: AutoresetMode | str = "NextStep",
                 device: str | None = None, arrays: str | None = None, maps: MakeMap | None = None, action_delay: int = 0,
                 episode_info: bool = False, render_mode: str | None = None, render_size: tuple[int, int] = (640, 480),
                 render_worlds: int = 1, clip_actions: bool = False, **options: Any) -> None:
        self.autoreset_mode = AutoresetMode(autoreset_mode)  #: how episodes are reset
        episodes = Episodes(world, task, num_envs, robots=robots, threads=threads, options=options, device=device,
                            arrays=arrays, maps=maps, action_delay=action_delay, clip_actions=clip_actions,
                            rendering=Rendering(render_mode, render_size, render_worlds))
        self._episodes: Episodes | None = episodes
        self.metadata = {"render_modes": list(MODES), "render_fps": episodes.fps,
                         "autoreset_mode": self.autoreset_mode}
        self.render_mode = render_mode
        self.num_envs = num_envs = episodes.batch.n
        self.task = episodes.task  #: the task of the robots
        self.agents = episodes.batch.names  #: names of each world's robots, in the order of observations
        self.single_observation_space = episodes.observed.of_team()
        self.single_action_space = episodes.actions.of_team()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._has_episode_info = episode_info
        self._np_seeds = np.full(num_envs, -1, object)
        self._generators: tuple[np.random.Generator, ...] | None = None
        self._last: Any = None
        self._over = np.zeros(num_envs, bool)  # worlds whose episode is over

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """A random generator for each world, from its seed. Tasks don't use it, but streams of their own."""
        if self._generators is None:
            seeds = [None if seed == -1 else seed for seed in self._np_seeds]
            self._generators = tuple(np_random(seed)[0] for seed in seeds)
        return self._generators

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """The last seed of each world; -1: it has had none."""
        return tuple(self._np_seeds.tolist())

    @property
    def statistics(self) -> Statistics:
        """Returns, lengths and success of the last episodes."""
        return opened(self._episodes).statistics

    @property
    def clipped(self) -> int:
        """How many numbers of actions have been clipped."""
        return opened(self._episodes).actions.clipped

    def reset(self, *, seed: Seeds = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begins episodes: see the class. Returns the observations and an empty info."""
        which = self._mask((options or {}).get("reset_mask"))
        ids, seeds = seeds_of(seed, self.num_envs)
        ids, seeds = ids[which[ids]], seeds[which[ids]]
        opened(self._episodes).seed(ids, seeds)
        if len(ids):
            self._np_seeds[ids] = seeds.tolist()
            self._generators = None
        self._over[which] = False
        self._begin(which)
        return copied(self._last), {}

    def step(self, actions: Any) -> Step:
        """Applies an action in each world; returns observations, rewards, terminations, truncations, infos."""
        if self.autoreset_mode is AutoresetMode.DISABLED and self._over.any():
            raise ResetNeeded(f"the episodes {np.flatnonzero(self._over).tolist()} are over: call reset()")
        episodes, going, waiting = opened(self._episodes), ~self._over, self._over
        moment = episodes.step(actions, going)
        self._last = episodes.observed.team(moment.observations)
        self._over = moment.ends.over
        begins_now = self.autoreset_mode is AutoresetMode.SAME_STEP and bool(self._over.any())
        infos = self._final_infos(moment) if begins_now else self._infos(moment, going)
        if waiting.any():
            self._begin(waiting)
        if begins_now:
            self._begin(self._over)
            self._over = np.zeros(self.num_envs, bool)
        rewards = moment.ends.rewards[:, 0] if len(self.agents) == 1 else moment.ends.rewards.sum(1)
        return copied(self._last), rewards, moment.ends.worlds_terminated, moment.ends.worlds_truncated, infos

    def vary(self, name: str, values: npt.ArrayLike | None) -> None:
        """Gives a property another value in each world, from its next episode on: see Batch.vary().

        "action.delay" is the latency of actions: `values` has a number of actions for each world, shape (num_envs,).
        """
        opened(self._episodes).vary(name, values)

    @property
    def varied(self) -> dict[str, npt.NDArray[Any]]:
        """The values that vary() was given, by name: copies."""
        return opened(self._episodes).varied

    def set_map(self, ids: Which, map: MapLike | list[MapLike]) -> None:
        """Gives worlds another map, or another scene, from their next episodes on: see Batch.set_map()."""
        opened(self._episodes).batch.set_map(ids, map)

    def render(self) -> tuple[Pixels, ...] | None:  # type: ignore[override]
        """Returns a picture of each world if render_mode is "rgb_array", else None."""
        episodes = opened(self._episodes)
        if self.render_mode != "rgb_array":
            return None
        return tuple(episodes.picture(i) for i in range(self.num_envs))

    def mosaic(self, worlds: int = 16) -> Pixels:
        """Returns one picture of size `render_size` that shows the first worlds side by side."""
        return opened(self._episodes).mosaic(worlds)

    def to_sb3(self) -> Any:
        """Makes a vector environment of Stable-Baselines3: see stagesim.env.to_sb3()."""
        return adapters.to_sb3(self)

    def to_torchrl(self, device: Any = "cpu") -> Any:
        """Makes a batched environment of TorchRL: see stagesim.env.to_torchrl()."""
        return adapters.to_torchrl(self, device)

    def to_jax(self) -> Any:
        """Makes a vector environment with arrays of JAX: see stagesim.env.to_jax()."""
        return adapters.to_jax(self)

    def close_extras(self, **kwargs: Any) -> None:
        """Frees the worlds and closes the window."""
        if self._episodes is not None:
            self._episodes.renderer.close()
        self._episodes = None

    def _begin(self, which: Bools) -> None:
        episodes = opened(self._episodes)
        seen = episodes.observed.team(episodes.begin(which))
        if which.all():
            self._last = seen
        else:
            if self._last is None:
                self._last = episodes.observed.team(episodes.observed.nothing(episodes.scene))
            put(self._last, episodes.arrays.of(np.flatnonzero(which)), seen)

    def _infos(self, moment: Moment, which: Bools) -> dict[str, Any]:
        """The infos of these worlds, and masks "_key" of worlds with a value, in the format of SyncVectorEnv."""
        infos: dict[str, Any] = {}
        if not which.any():
            return infos
        info = {name: values if len(self.agents) > 1 else values[:, 0] for name, values in moment.info.items()}
        if len(self.agents) > 1:
            info["rewards"] = moment.ends.rewards
        others = None if which.all() else opened(self._episodes).arrays.of(np.flatnonzero(~which))
        for name, values in info.items():
            infos[name] = wide(values)
            if others is not None:
                infos[name][others] = 0
            infos[f"_{name}"] = which.copy()
        if self._has_episode_info and moment.ends.over.any():
            infos.update(self._episode_infos(moment.ends.over))
        return infos

    def _episode_infos(self, over: Bools) -> dict[str, Any]:
        """Returns, lengths and times of the episodes that have ended."""
        episodes = opened(self._episodes)
        lengths = np.where(over, on_host(episodes.scene.actions), 0)
        return {"episode": {"r": np.where(over, on_host(episodes.returns), 0), "l": lengths,
                            "t": lengths / episodes.fps}, "_episode": over.copy()}

    def _final_infos(self, moment: Moment) -> dict[str, Any]:
        """The infos of a step after which finished episodes are reset at once (SAME_STEP)."""
        over = self._over
        infos = self._infos(moment, ~over)
        final_info = self._infos(moment, over)
        for name in ("episode", "_episode"):
            infos.update({name: final_info.pop(name)} if name in final_info else {})
        return {**infos, "final_obs": self._final(over), "_final_obs": over.copy(), "final_info": final_info,
                "_final_info": over.copy()}

    def _final(self, over: Bools) -> Any:
        """The last observations of these episodes: an object per world, or tensors of all worlds."""
        if not opened(self._episodes).arrays.is_numpy:
            return copied(self._last)
        final = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(over):
            final[i] = ({name: values[i].copy() for name, values in self._last.items()} if isinstance(self._last, dict)
                        else self._last[i].copy())
        return final

    def _mask(self, mask: Any) -> Bools:
        if mask is None:
            return np.ones(self.num_envs, bool)
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            raise TypeError(f"found the reset_mask {mask!r}, expected an array of bools")
        if mask.shape != (self.num_envs,) or not mask.any():
            raise ValueError(f"found the reset_mask {mask}, expected {self.num_envs} bools, not all False")
        return mask
