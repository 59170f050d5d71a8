# SPDX-License-Identifier: GPL-2.0-or-later
"""One world as a parallel environment of PettingZoo."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from gymnasium.utils.seeding import np_random
from pettingzoo import ParallelEnv

from ..pictures import Pixels
from ..world import World
from .episodes import AnyTask, Episodes, Observations, opened
from .rendering import MODES

Step = tuple[dict[str, Observations], dict[str, float], dict[str, bool], dict[str, bool],
             dict[str, dict[str, Any]]]


class StageParallelEnv(ParallelEnv[str, Observations, npt.NDArray[np.float32]]):
    """One world as a parallel environment of PettingZoo: each robot is an agent of its own.

    Agents are called as the robots are. Each observes a Box of shape (size,) and acts by one of shape
    (numbers,) from -1 to 1, both float32. One that has come to its end is gone from `agents` for the rest of
    the episode, and stands still. After `limit` actions of the task, all that are left are truncated.

    Seeds are as in StageEnv. step() takes actions of exactly the agents that are left, and returns
    dictionaries of exactly these, copies all.

    The arguments are those of StageEnv().

    Raises:
        WorldError: the file can't be loaded.
        GoneError: there are no such robots, or they lack what the task needs.
        ValueError: an argument is out of range, two robots have the same name, actions are not those of the
            agents that are left, are not finite or have another shape.
        ResetNeeded: of gymnasium.error: step() before reset().
    """

    metadata: dict[str, Any] = {"name": "stage_v0", "render_modes": list(MODES), "render_fps": 5}

    def __init__(self, world: str | os.PathLike[str] | World | None = None, task: AnyTask = "Navigate", *,
                 robots: str | None = None, threads: int = 1, render_mode: str | None = None,
                 render_size: tuple[int, int] = (640, 480), **options: Any) -> None:
        self._episodes: Episodes | None = Episodes(world, task, 1, robots, threads, options, render_mode,
                                                   render_size)
        self.metadata = {"name": "stage_v0", **self._episodes.metadata()}
        self.render_mode = render_mode
        self.task = self._episodes.task  #: what the robots are to do
        self.possible_agents = list(self._episodes.batch.names)  #: all robots
        if len(set(self.possible_agents)) < len(self.possible_agents):
            raise ValueError(f"found {self.possible_agents}, expected names that differ")
        self.agents: list[str] = []  #: those that are left
        self.observation_spaces = {agent: self._episodes.observation_space() for agent in self.possible_agents}
        self.action_spaces = {agent: self._episodes.action_space() for agent in self.possible_agents}
        self._rows = {agent: row for row, agent in enumerate(self.possible_agents)}
        self._random: np.random.Generator | None = None
        self._all = np.ones(1, bool)
        self._last: Observations | None = None

    def observation_space(self, agent: str) -> Box:
        """What an agent observes; always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        """How an agent acts; always the same object."""
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[
            dict[str, Observations], dict[str, dict[str, Any]]]:
        """Begins an episode: observations and infos. `options` are ignored."""
        if seed is not None or self._random is None:
            self._random, _ = np_random(seed)
        self._last = opened(self._episodes).begin(self._all, [self._random])[0]
        self.agents = list(self.possible_agents)
        return self._observed(self.agents), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, npt.ArrayLike]) -> Step:
        """One action of each agent: observations, rewards, terminations, truncations and infos of each."""
        episodes, agents = opened(self._episodes), self.agents
        if self._last is None:
            raise ResetNeeded("no episode has begun: call reset()")
        if set(actions) != set(agents):
            raise ValueError(f"found actions of {sorted(actions)}, expected {sorted(agents)}")
        if not agents:
            return {}, {}, {}, {}, {}
        given = np.zeros((len(self._rows), episodes.action_size))
        for agent, action in actions.items():
            if np.shape(action) != given[0].shape:
                raise ValueError(f"found an action of shape {np.shape(action)}, expected {given[0].shape}")
            given[self._rows[agent]] = action
        moment = episodes.step(given, self._all)
        self._last = moment.observations[0]
        rows = {agent: self._rows[agent] for agent in agents}
        terminated = {agent: bool(moment.terminated[0, row]) for agent, row in rows.items()}
        truncated = {agent: bool(moment.truncated[0, row]) for agent, row in rows.items()}
        self.agents = [agent for agent in agents if not (terminated[agent] or truncated[agent])]
        return (self._observed(agents), {agent: float(moment.rewards[0, row]) for agent, row in rows.items()},
                terminated, truncated,
                {agent: {name: values[0, row].item() for name, values in moment.info.items()}
                 for agent, row in rows.items()})

    def state(self) -> Observations:
        """What all robots observe, those that have come to their end too: shape (robots * size,)."""
        if self._last is None:
            raise ResetNeeded("no episode has begun: call reset()")
        return self._last.reshape(-1).copy()

    def render(self) -> Pixels | None:
        """With render_mode "rgb_array" a picture as World.render() makes it; else None."""
        episodes = opened(self._episodes)
        return episodes.renderer.picture(episodes.batch, 0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Gives the world back, and closes the window."""
        if self._episodes is not None:
            self._episodes.renderer.close()
        self._episodes = None

    def _observed(self, agents: list[str]) -> dict[str, Observations]:
        assert self._last is not None
        return {agent: self._last[self._rows[agent]].copy() for agent in agents}
