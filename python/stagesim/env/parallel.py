# SPDX-License-Identifier: GPL-2.0-or-later
"""The PettingZoo parallel environment of one world."""

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
    """A PettingZoo parallel environment of one world, in which each robot is an agent.

    The agents have the names of the robots. Each observes a Box of shape (size,) and acts by a Box of shape
    (numbers,) from -1 to 1, both float32. A terminated agent leaves `agents` for the rest of the episode and
    stands still. After the task's `limit` of actions, all remaining agents are truncated.

    Seeds work as in StageEnv. step() takes actions of exactly the agents in `agents` and returns dictionaries
    with exactly these keys. All returned arrays are copies.

    The arguments are those of StageEnv().

    Raises:
        WorldError: the file can't be loaded.
        GoneError: there are no such robots, or they lack a sensor that the task needs.
        ValueError: an argument is out of range, two robots have the same name, or actions are for other
            agents, are not finite or have a wrong shape.
        ResetNeeded: (gymnasium.error) step() was called before reset().
    """

    metadata: dict[str, Any] = {"name": "stage_v0", "render_modes": list(MODES), "render_fps": 5}

    def __init__(self, world: str | os.PathLike[str] | World | None = None, task: AnyTask = "Navigate", *,
                 robots: str | None = None, threads: int = 1, render_mode: str | None = None,
                 render_size: tuple[int, int] = (640, 480), **options: Any) -> None:
        self._episodes: Episodes | None = Episodes(world, task, 1, robots, threads, options, render_mode,
                                                   render_size)
        self.metadata = {"name": "stage_v0", **self._episodes.metadata()}
        self.render_mode = render_mode
        self.task = self._episodes.task  #: the task of the robots
        self.possible_agents = list(self._episodes.batch.names)  #: names of all robots
        if len(set(self.possible_agents)) < len(self.possible_agents):
            raise ValueError(f"found {self.possible_agents}, expected names that differ")
        self.agents: list[str] = []  #: names of the robots that still take part
        self.observation_spaces = {agent: self._episodes.observation_space() for agent in self.possible_agents}
        self.action_spaces = {agent: self._episodes.action_space() for agent in self.possible_agents}
        self._rows = {agent: row for row, agent in enumerate(self.possible_agents)}
        self._random: np.random.Generator | None = None
        self._all = np.ones(1, bool)
        self._last: Observations | None = None

    def observation_space(self, agent: str) -> Box:
        """Returns the observation space of an agent; always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        """Returns the action space of an agent; always the same object."""
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[
            dict[str, Observations], dict[str, dict[str, Any]]]:
        """Begins an episode; returns observations and empty infos. `options` is ignored."""
        if seed is not None or self._random is None:
            self._random, _ = np_random(seed)
        self._last = opened(self._episodes).begin(self._all, [self._random])[0]
        self.agents = list(self.possible_agents)
        return self._observed(self.agents), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, npt.ArrayLike]) -> Step:
        """Applies an action of each agent; returns observations, rewards, terminations, truncations, infos."""
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
        """Returns the observations of all robots, including terminated ones: shape (robots * size,)."""
        if self._last is None:
            raise ResetNeeded("no episode has begun: call reset()")
        return self._last.reshape(-1).copy()

    def render(self) -> Pixels | None:
        """Returns a picture as World.render() does if render_mode is "rgb_array", else None."""
        episodes = opened(self._episodes)
        return episodes.renderer.picture(episodes.batch, 0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Frees the world and closes the window."""
        if self._episodes is not None:
            self._episodes.renderer.close()
        self._episodes = None

    def _observed(self, agents: list[str]) -> dict[str, Observations]:
        assert self._last is not None
        return {agent: self._last[self._rows[agent]].copy() for agent in agents}
