# SPDX-License-Identifier: GPL-2.0-or-later
"""Many worlds as a vector environment of Gymnasium."""

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

from .. import _checks
from ..fleet import Bools, Floats
from ..pictures import Pixels
from ..world import World
from .episodes import AnyTask, Episodes, Moment, Observations, opened

Step = tuple[Observations, Floats, Bools, Bools, dict[str, Any]]


class StageVectorEnv(VectorEnv[Observations, npt.NDArray[np.float32], npt.NDArray[Any]]):
    """Many worlds as a vector environment of Gymnasium: one Batch, so that threads step them.

    Each of the `num_envs` worlds is to the last bit what a StageEnv is: observations have the shape
    (num_envs, robots * size), actions (num_envs, robots * numbers), rewards (float64), terminations and
    truncations (num_envs,). All that is returned is copied.

    Seeds: `reset(seed=s)` gives world i the seed s + i; a list has one for each, None to go on.
    `reset(options={"reset_mask": mask})` begins anew in some worlds only; others observe what they did.

    Autoreset, as `gymnasium.vector.SyncVectorEnv` does it: with NEXT_STEP, the step after the end of an
    episode begins another one, whatever the action; with SAME_STEP the same step does, and its last
    observation and info are `infos["final_obs"]` and `infos["final_info"]`; with DISABLED, you do.

    Args:
        num_envs: how many worlds, 1 or more.
        world, task, robots, options: as in StageEnv().
        threads: that work on them, each on other worlds; None: one for each processor that the process
            may use.
        render_mode, render_size: as in StageEnv(); a window shows the first world.
        autoreset_mode: an AutoresetMode, or its value: "NextStep", "SameStep", "Disabled".

    Raises what StageEnv() does; TypeError and ValueError for a reset_mask that is none.
    """

    def __init__(self, num_envs: int = 1, world: str | os.PathLike[str] | World | None = None,
                 task: AnyTask = "Navigate", *, robots: str | None = None, threads: int | None = None,
                 autoreset_mode: AutoresetMode | str = "NextStep", render_mode: str | None = None,
                 render_size: tuple[int, int] = (640, 480), **options: Any) -> None:
        self.autoreset_mode = AutoresetMode(autoreset_mode)  #: which of the three
        self._episodes: Episodes | None = Episodes(world, task, num_envs, robots, threads, options, render_mode,
                                                   render_size)
        self.metadata = {**self._episodes.metadata(), "autoreset_mode": self.autoreset_mode}
        self.render_mode = render_mode
        self.num_envs = self._episodes.batch.n
        num_envs = self.num_envs
        self.task = self._episodes.task  #: what the robots are to do
        self.agents = self._episodes.batch.names  #: of the robots of each world, in their order
        self.single_observation_space = self._episodes.observation_space(len(self.agents))
        self.single_action_space = self._episodes.action_space(len(self.agents))
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._randoms = [np_random() for _ in range(num_envs)]
        self._last = np.zeros((num_envs, len(self.agents) * self._episodes.size), np.float32)
        self._over = np.zeros(num_envs, bool)  # the next step begins an episode there

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """Of each world."""
        return tuple(random for random, _ in self._randoms)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """What each world was seeded with last."""
        return tuple(seed for _, seed in self._randoms)

    def reset(self, *, seed: int | Iterable[int | None] | None = None,
              options: dict[str, Any] | None = None) -> tuple[Observations, dict[str, Any]]:
        """Begins episodes: see the class."""
        which = self._mask((options or {}).get("reset_mask"))
        for i, number in enumerate(self._seeds(seed)):
            if which[i] and number is not None:
                self._randoms[i] = np_random(number)
        self._over[which] = False
        self._begin(which)
        return self._last.copy(), {}

    def step(self, actions: npt.ArrayLike) -> Step:
        """One action in each world: observations, rewards, terminations, truncations, infos."""
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

    def render(self) -> tuple[Pixels, ...] | None:  # type: ignore[override]
        """With render_mode "rgb_array" a picture of each world; else None."""
        episodes = opened(self._episodes)
        if self.render_mode != "rgb_array":
            return None
        return tuple(episodes.renderer.picture(episodes.batch, i) for i in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Gives the worlds back, and closes the window."""
        if self._episodes is not None:
            self._episodes.renderer.close()
        self._episodes = None

    def _begin(self, which: Bools) -> None:
        seen = opened(self._episodes).begin(which, self.np_random).reshape(self._last.shape)
        self._last[which] = seen[which]

    def _infos(self, moment: Moment, which: Bools) -> dict[str, Any]:
        """What these worlds have to say, and for each key who has: as SyncVectorEnv puts it."""
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
        """The infos of a step that begins other episodes where one is over."""
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
            first = _checks.seed(seed)
            return [first + i for i in range(self.num_envs)]
        seeds = [None if number is None else _checks.seed(number) for number in seed]
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
