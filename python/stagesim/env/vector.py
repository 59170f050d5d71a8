# SPDX-License-Identifier: GPL-2.0-or-later
"""The Gymnasium vector environment of many worlds."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from .._options import checked
from ..fleet import Bools, Floats
from ..pictures import Pixels
from ..world import World
from .episodes import AnyTask, Episodes, Moment, Observations, opened

Step = tuple[Observations, Floats, Bools, Bools, dict[str, Any]]


class StageVectorEnv(VectorEnv[Observations, npt.NDArray[np.float32], npt.NDArray[Any]]):
    """A Gymnasium vector environment of many worlds, which are one Batch stepped by several threads.

    Each world is bit-equal to a StageEnv. Observations have the shape (num_envs, robots * size), actions
    (num_envs, robots * numbers), rewards (float64), terminations and truncations (num_envs,). All returned
    arrays are copies.

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
        render_mode, render_size: as in StageEnv(); a window shows the first world.
        autoreset_mode: an AutoresetMode, or its value: "NextStep", "SameStep" or "Disabled".

    Raises the errors of StageEnv(), and TypeError or ValueError for an invalid reset_mask.
    """

    def __init__(self, num_envs: int = 1, world: str | os.PathLike[str] | World | None = None,
                 task: AnyTask = "Navigate", *, robots: str | None = None, threads: int | None = None,
                 autoreset_mode: AutoresetMode | str = "NextStep", render_mode: str | None = None,
                 render_size: tuple[int, int] = (640, 480), **options: Any) -> None:
        self.autoreset_mode = AutoresetMode(autoreset_mode)  #: how episodes are reset
        self._episodes: Episodes | None = Episodes(world, task, num_envs, robots, threads, options, render_mode,
                                                   render_size)
        self.metadata = {**self._episodes.metadata(), "autoreset_mode": self.autoreset_mode}
        self.render_mode = render_mode
        self.num_envs = self._episodes.batch.n
        num_envs = self.num_envs
        self.task = self._episodes.task  #: the task of the robots
        self.agents = self._episodes.batch.names  #: names of each world's robots, in the order of observations
        self.single_observation_space = self._episodes.observation_space(len(self.agents))
        self.single_action_space = self._episodes.action_space(len(self.agents))
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._randoms = [np_random() for _ in range(num_envs)]
        self._last = np.zeros((num_envs, len(self.agents) * self._episodes.size), np.float32)
        self._over = np.zeros(num_envs, bool)  # worlds whose episode is over

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The random generator of each world."""
        return tuple(random for random, _ in self._randoms)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """The last seed of each world."""
        return tuple(seed for _, seed in self._randoms)

    def reset(self, *, seed: int | Iterable[int | None] | None = None,
              options: dict[str, Any] | None = None) -> tuple[Observations, dict[str, Any]]:
        """Begins episodes: see the class. Returns the observations and an empty info."""
        which = self._mask((options or {}).get("reset_mask"))
        for i, number in enumerate(self._seeds(seed)):
            if which[i] and number is not None:
                self._randoms[i] = np_random(number)
        self._over[which] = False
        self._begin(which)
        return self._last.copy(), {}

    def step(self, actions: npt.ArrayLike) -> Step:
        """Applies an action in each world; returns observations, rewards, terminations, truncations, infos."""
        if self.autoreset_mode is AutoresetMode.DISABLED and self._over.any():
            raise ResetNeeded(f"the episodes {np.flatnonzero(self._over).tolist()} are over: call reset()")
        episodes, going, waiting = opened(self._episodes), ~self._over, self._over
        moment = episodes.step(actions, going)
        terminations, truncations = episodes.all_terminated(moment), moment.worlds_truncated
        self._last = moment.observations.reshape(self._last.shape)
        self._over = terminations | truncations
        infos = self._infos(moment, going)
        if waiting.any():
            self._begin(waiting)
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._over.any():
            infos = self._final_infos(moment)
            self._begin(self._over)
            self._over = np.zeros(self.num_envs, bool)
        return self._last.copy(), moment.rewards.sum(1), terminations, truncations, infos

    def vary(self, name: str, values: npt.ArrayLike | None) -> None:
        """Gives a property another value in each world, from its next episode on: see Batch.vary()."""
        opened(self._episodes).batch.vary(name, values)

    @property
    def varied(self) -> dict[str, npt.NDArray[Any]]:
        """The values that vary() was given, by name: copies."""
        return opened(self._episodes).batch.varied

    def render(self) -> tuple[Pixels, ...] | None:  # type: ignore[override]
        """Returns a picture of each world if render_mode is "rgb_array", else None."""
        episodes = opened(self._episodes)
        if self.render_mode != "rgb_array":
            return None
        return tuple(episodes.renderer.picture(episodes.batch, i) for i in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Frees the worlds and closes the window."""
        if self._episodes is not None:
            self._episodes.renderer.close()
        self._episodes = None

    def _begin(self, which: Bools) -> None:
        seen = opened(self._episodes).begin(which, self.np_random).reshape(self._last.shape)
        self._last[which] = seen[which]

    def _infos(self, moment: Moment, which: Bools) -> dict[str, Any]:
        """The infos of these worlds, and masks "_key" of worlds with a value, in the format of SyncVectorEnv."""
        infos: dict[str, Any] = {}
        if not which.any():
            return infos
        info = {name: values if len(self.agents) > 1 else values[:, 0] for name, values in moment.info.items()}
        if len(self.agents) > 1:
            info["rewards"] = moment.rewards
        for name, values in info.items():
            infos[name] = np.zeros_like(values)
            infos[name][which] = values[which]
            infos[f"_{name}"] = which.copy()
        return infos

    def _final_infos(self, moment: Moment) -> dict[str, Any]:
        """The infos of a step after which finished episodes are reset at once (SAME_STEP)."""
        over = self._over
        infos = self._infos(moment, ~over)
        final = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(over):
            final[i] = self._last[i].copy()
        return {**infos, "final_obs": final, "_final_obs": over.copy(),
                "final_info": self._infos(moment, over), "_final_info": over.copy()}

    def _seeds(self, seed: int | Iterable[int | None] | None) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if not isinstance(seed, Iterable):
            first = checked("seed", seed)
            return [first + i for i in range(self.num_envs)]
        seeds = [None if number is None else checked("seed", number) for number in seed]
        if len(seeds) != self.num_envs:
            raise ValueError(f"found {len(seeds)} seeds, expected {self.num_envs}")
        return seeds

    def _mask(self, mask: Any) -> Bools:
        if mask is None:
            return np.ones(self.num_envs, bool)
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            raise TypeError(f"found the reset_mask {mask!r}, expected an array of bools")
        if mask.shape != (self.num_envs,) or not mask.any():
            raise ValueError(f"found the reset_mask {mask}, expected {self.num_envs} bools, not all False")
        return mask
