# SPDX-License-Identifier: GPL-2.0-or-later
"""One world as an environment of Gymnasium."""

from __future__ import annotations

import os
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from ..pictures import Pixels
from ..world import World
from .episodes import AnyTask, Episodes, Observations, opened
from .rendering import MODES


class StageEnv(gymnasium.Env[Observations, npt.NDArray[np.float32]]):
    """One world as an environment of Gymnasium: its robots are one team with one learner.

    Observations are a Box of shape (robots * size,), actions one of shape (robots * numbers,) from -1 to 1,
    both float32, one robot after the other; the reward is the sum of the robots'. It is terminated when all
    robots have come to their end, and truncated after `limit` actions of the task, or when a controller
    wants the world to quit. Robots that have come to their end stand still. `info` has what the task says:
    numbers if there is one robot, or else arrays of shape (robots,), and then the robots' rewards, too.

    `reset(seed=s)` gives the same episode each time, to the last bit; other seeds give others, and without
    a seed another episode follows. All that is returned is copied.

    Environments can be pickled and deep-copied, in the middle of an episode too: see World.

    Args:
        world: a world file, a plain name as in World(), or a World; None: the task's own.
        task: a Task, its class, or "Navigate", "Disperse" or "Forage".
        robots: a pattern of names or types: who takes part, as in World.fleet(); others are left to their
            controllers.
        threads: that work on it.
        render_mode: "rgb_array": render() returns a picture; "human": each action is shown in a window, in
            real time, which needs pygame; None: neither.
        render_size: width and height of pictures, pixels.
        options: `opencl`, `ray_model`, `controllers`, `settings` as in World().

    Raises:
        WorldError: the file can't be loaded.
        GoneError: there are no such robots, or they lack what the task needs.
        ValueError: an argument is out of range, or an action is not finite or has another shape.
        ResetNeeded: of gymnasium.error: step() before reset(), or after the end of an episode.
        DependencyNotInstalled: of gymnasium.error: "human" without pygame.
    """

    metadata: dict[str, Any] = {"render_modes": list(MODES), "render_fps": 5}

    def __init__(self, world: str | os.PathLike[str] | World | None = None, task: AnyTask = "Navigate", *,
                 robots: str | None = None, threads: int = 1, render_mode: str | None = None,
                 render_size: tuple[int, int] = (640, 480), **options: Any) -> None:
        self._episodes: Episodes | None = Episodes(world, task, 1, robots, threads, options, render_mode,
                                                   render_size)
        self.metadata = self._episodes.metadata()
        self.render_mode = render_mode
        self.task = self._episodes.task  #: what the robots are to do
        self.agents = self._episodes.batch.names  #: of the robots, in their order
        self.observation_space = self._episodes.observation_space(len(self.agents))
        self.action_space = self._episodes.action_space(len(self.agents))
        self._all = np.ones(1, bool)

    def reset(self, *, seed: int | None = None,
              options: dict[str, Any] | None = None) -> tuple[Observations, dict[str, Any]]:
        """Begins an episode: see the class. `options` are ignored."""
        super().reset(seed=seed)
        return opened(self._episodes).begin(self._all, [self.np_random]).reshape(-1), {}

    def step(self, action: npt.ArrayLike) -> tuple[Observations, float, bool, bool, dict[str, Any]]:
        """One action: observation, reward, terminated, truncated, info."""
        episodes = opened(self._episodes)
        moment = episodes.step(action, self._all)
        info = {name: values[0] if values.shape[1] > 1 else values[0, 0].item()
                for name, values in moment.info.items()}
        if len(self.agents) > 1:
            info["rewards"] = moment.rewards[0]
        return (moment.observations.reshape(-1), float(moment.rewards[0].sum()),
                bool(episodes.all_terminated(moment)[0]), bool(moment.worlds_truncated[0]), info)

    def render(self) -> Pixels | None:  # type: ignore[override]
        """With render_mode "rgb_array" a picture as World.render() makes it; else None."""
        episodes = opened(self._episodes)
        return episodes.renderer.picture(episodes.batch, 0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Gives the world back, and closes the window."""
        if self._episodes is not None:
            self._episodes.renderer.close()
        self._episodes = None
