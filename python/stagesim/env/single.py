# SPDX-License-Identifier: GPL-2.0-or-later
"""The Gymnasium environment of one world."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from .._options import checked
from ..pictures import Pixels
from .episodes import AnyTask, AnyWorld, Episodes, MakeMap, opened
from .rendering import MODES, Rendering


class StageEnv(gymnasium.Env[Any, npt.NDArray[Any]]):
    """A Gymnasium environment of one world, whose robots are one team with one learner.

    Usually the observation space is a Box of shape (robots * size,), and the action space a Box of shape
    (robots * numbers,) from -1 to 1. Both are float32, robot after robot. If a task observes images or a
    dictionary, each array has an axis for the robots in front if there are several; discrete actions of several
    robots are MultiDiscrete. The reward is the sum over the robots. An episode is terminated when the task has terminated all robots, and truncated after the task's
    `limit` of actions or when a controller asks the world to quit. Terminated robots stand still. `info` has
    the values of the task: numbers for a single robot, else arrays of shape (robots,) and also `rewards`.

    Episodes with the same `reset(seed=s)` are bit-equal. Without a seed, the next episode differs from the one
    before. All returned arrays are copies. Tasks don't use `np_random`, but streams of their own.

    Environments can be pickled and deep-copied, even within an episode: see World.

    Args:
        world: a world file, the name of a shipped world, a stagesim.scenes.Scene, or a World; None: the default
            world of the task.
        task: a Task, its class, or the name of a shipped one: "Navigate", "Disperse", "Forage" or "Measured".
        robots: a pattern of names or types as in World.fleet(): the robots that take part. All others are
            left to their controllers.
        threads: number of threads that share a step, 1 to 1024.
        render_mode: "rgb_array": render() returns a picture. "human": each action is shown in a window, in
            real time; this needs pygame. None: no pictures.
        render_size: width and height of pictures, pixels.
        maps: a function that is called with a generator of NumPy at the begin of each episode and returns its map, or
            its scene, as in Batch.set_map(); None: the map stays.
        action_delay: latency: the number of actions after which an action is obeyed, 0 to 1000.
        clip_actions: True: actions outside -1 to 1 are clipped, and `clipped` counts them. False: they are errors.
        options: options of World() but `seed` and `threads`.

    Raises:
        WorldError: the file can't be loaded.
        GoneError: there are no such robots, or they lack a sensor that the task needs.
        ValueError: an argument is out of range, or an action is outside its space or has a wrong shape; or the
            task observes something outside its space.
        ResetNeeded: (gymnasium.error) step() was called before reset(), or after the end of an episode.
        DependencyNotInstalled: (gymnasium.error) "human" without pygame.
    """

    metadata: dict[str, Any] = {"render_modes": list(MODES), "render_fps": 5}

    def __init__(self, world: AnyWorld = None, task: AnyTask = "Navigate", *, robots: str | None = None,
                 threads: int = 1, render_mode: str | None = None, render_size: tuple[int, int] = (640, 480),
                 maps: MakeMap | None = None, action_delay: int = 0, clip_actions: bool = False, **options: Any) -> None:
        self._episodes: Episodes | None = Episodes(
            world, task, 1, robots=robots, threads=threads, options=options, maps=maps, action_delay=action_delay,
            clip_actions=clip_actions,
            rendering=Rendering(render_mode, render_size))
        self.metadata = {"render_modes": list(MODES), "render_fps": self._episodes.fps}
        self.render_mode = render_mode
        self.task = self._episodes.task  #: the task of the robots
        self.agents = self._episodes.batch.names  #: names of the robots, in the order of observations
        self.observation_space = self._episodes.observed.of_team()
        self.action_space = self._episodes.actions.of_team()
        self._all = np.ones(1, bool)

    @property
    def clipped(self) -> int:
        """How many numbers of actions have been clipped."""
        return opened(self._episodes).actions.clipped

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begins an episode and returns its first observation and an empty info. `options` is ignored."""
        super().reset(seed=seed)
        episodes = opened(self._episodes)
        if seed is not None:
            episodes.seed(np.zeros(1, np.int64), np.array([checked("seed", seed)], np.uint64))
        return _first(episodes.observed.team(episodes.begin(self._all))), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Applies an action; returns observation, reward, terminated, truncated and info."""
        episodes = opened(self._episodes)
        moment = episodes.step(action, self._all)
        info = {name: values[0] if values.shape[1] > 1 else values[0, 0].item()
                for name, values in moment.info.items()}
        if len(self.agents) > 1:
            info["rewards"] = moment.ends.rewards[0]
        return (_first(episodes.observed.team(moment.observations)), float(moment.ends.rewards[0].sum()),
                bool(moment.ends.worlds_terminated[0]), bool(moment.ends.worlds_truncated[0]), info)

    def render(self) -> Pixels | None:  # type: ignore[override]
        """Returns a picture as World.render() does if render_mode is "rgb_array", else None."""
        episodes = opened(self._episodes)
        return episodes.picture(0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Frees the world and closes the window."""
        if self._episodes is not None:
            self._episodes.renderer.close()
        self._episodes = None


def _first(seen: Any) -> Any:
    """The observations of the first world."""
    return {name: values[0] for name, values in seen.items()} if isinstance(seen, dict) else seen[0]
