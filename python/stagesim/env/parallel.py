# SPDX-License-Identifier: GPL-2.0-or-later
"""The PettingZoo parallel environment of one world."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Space
from pettingzoo import ParallelEnv

from .._options import checked
from ..pictures import Pixels
from .episodes import AnyTask, AnyWorld, Episodes, MakeMap, opened
from .rendering import MODES, Rendering

Step = tuple[dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool],
             dict[str, dict[str, Any]]]


class StageParallelEnv(ParallelEnv[str, Any, npt.NDArray[Any]]):
    """A PettingZoo parallel environment of one world, in which each robot is an agent.

    The agents have the names of the robots. Usually each observes a Box of shape (size,) and acts by a Box of shape
    (numbers,) from -1 to 1, both float32; a task may have other spaces. A terminated agent leaves `agents` for the rest of
    the episode and stands still. After the task's `limit` of actions, all remaining agents are truncated.

    Seeds work as in StageEnv. step() takes actions of exactly the agents in `agents` and returns dictionaries
    with exactly these keys. All returned arrays are copies.

    The arguments are those of StageEnv().

    Raises:
        WorldError: the file can't be loaded.
        GoneError: there are no such robots, or they lack a sensor that the task needs.
        ValueError: an argument is out of range, two robots have the same name, or actions are for other
            agents, are outside their space or have a wrong shape.
        ResetNeeded: (gymnasium.error) step() was called before reset().
    """

    metadata: dict[str, Any] = {"name": "stage_v0", "render_modes": list(MODES), "render_fps": 5}

    def __init__(self, world: AnyWorld = None, task: AnyTask = "Navigate", *, robots: str | None = None,
                 threads: int = 1, render_mode: str | None = None, render_size: tuple[int, int] = (640, 480),
                 maps: MakeMap | None = None, action_delay: int = 0, clip_actions: bool = False, **options: Any) -> None:
        episodes = Episodes(world, task, 1, robots=robots, threads=threads, options=options, maps=maps,
                            action_delay=action_delay, clip_actions=clip_actions, rendering=Rendering(render_mode, render_size))
        self._episodes: Episodes | None = episodes
        self.metadata = {"name": "stage_v0", "render_modes": list(MODES), "render_fps": episodes.fps}
        self.render_mode = render_mode
        self.task = episodes.task  #: the task of the robots
        self.possible_agents = list(episodes.batch.names)  #: names of all robots
        if len(set(self.possible_agents)) < len(self.possible_agents):
            raise ValueError(f"found {self.possible_agents}, expected names that differ")
        self.agents: list[str] = []  #: names of the robots that still take part
        # A space per agent, because each has random numbers of its own.
        self.observation_spaces = {agent: deepcopy(episodes.observed.space) for agent in self.possible_agents}
        self.action_spaces = {agent: deepcopy(episodes.actions.space) for agent in self.possible_agents}
        self._rows = {agent: row for row, agent in enumerate(self.possible_agents)}
        self._all = np.ones(1, bool)
        self._last: Any = None

    def observation_space(self, agent: str) -> Space[Any]:
        """Returns the observation space of an agent; always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Space[Any]:
        """Returns the action space of an agent; always the same object."""
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[
            dict[str, Any], dict[str, dict[str, Any]]]:
        """Begins an episode; returns observations and empty infos. `options` is ignored."""
        episodes = opened(self._episodes)
        if seed is not None:
            episodes.seed(np.zeros(1, np.int64), np.array([checked("seed", seed)], np.uint64))
        self._last = episodes.begin(self._all)
        self.agents = list(self.possible_agents)
        return self._observed(self.agents), {agent: {} for agent in self.agents}

    @property
    def clipped(self) -> int:
        """How many numbers of actions have been clipped."""
        return opened(self._episodes).actions.clipped

    def step(self, actions: dict[str, npt.ArrayLike]) -> Step:
        """Applies an action of each agent; returns observations, rewards, terminations, truncations, infos."""
        episodes, agents = opened(self._episodes), self.agents
        if self._last is None:
            raise ResetNeeded("no episode has begun: call reset()")
        if set(actions) != set(agents):
            raise ValueError(f"found actions of {sorted(actions)}, expected {sorted(agents)}")
        if not agents:
            return {}, {}, {}, {}, {}
        space = episodes.actions.space
        given = np.zeros((len(self._rows), *(space.shape or ())), np.int64 if episodes.actions.is_discrete else np.float64)
        for agent, action in actions.items():
            if np.shape(action) != given.shape[1:]:
                raise ValueError(f"found an action of shape {np.shape(action)}, expected {given.shape[1:]}")
            if episodes.actions.is_discrete and np.asarray(action).dtype.kind not in "iu":
                raise TypeError(f"found the action {action!r} of {agent}, expected a whole number, which is a choice")
            given[self._rows[agent]] = action
        moment = episodes.step(given, self._all)
        self._last = moment.observations
        rows = {agent: self._rows[agent] for agent in agents}
        terminated = {agent: bool(moment.ends.terminated[0, row]) for agent, row in rows.items()}
        truncated = {agent: bool(moment.ends.truncated[0, row]) for agent, row in rows.items()}
        self.agents = [agent for agent in agents if not (terminated[agent] or truncated[agent])]
        return (self._observed(agents), {agent: float(moment.ends.rewards[0, row]) for agent, row in rows.items()},
                terminated, truncated,
                {agent: {name: values[0, row].item() for name, values in moment.info.items()}
                 for agent, row in rows.items()})

    def state(self) -> npt.NDArray[Any]:
        """Returns the observations of all robots, including terminated ones: shape (robots * size,)."""
        if self._last is None:
            raise ResetNeeded("no episode has begun: call reset()")
        parts = self._last.values() if isinstance(self._last, dict) else [self._last]
        return np.concatenate([values.reshape(-1) for values in parts])

    def render(self) -> Pixels | None:
        """Returns a picture as World.render() does if render_mode is "rgb_array", else None."""
        episodes = opened(self._episodes)
        return episodes.picture(0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Frees the world and closes the window."""
        if self._episodes is not None:
            self._episodes.renderer.close()
        self._episodes = None

    def _observed(self, agents: list[str]) -> dict[str, Any]:
        return {agent: _row(self._last, self._rows[agent]) for agent in agents}


def _row(seen: Any, row: int) -> Any:
    """A copy of the observations of a robot of the first world."""
    if isinstance(seen, dict):
        return {name: values[0, row].copy() for name, values in seen.items()}
    return seen[0, row].copy()
