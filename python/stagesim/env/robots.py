# SPDX-License-Identifier: GPL-2.0-or-later
"""The environment that keeps the robots of many worlds as arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .._scene_variants import MapLike
from ..batch import Batch, Which
from ..pictures import Pixels
from .arrays import Array, copied, put
from .episodes import AnyTask, AnyWorld, Episodes, MakeMap
from .rendering import Rendering
from .seeds import Seeds, seeds_of
from .statistics import Statistics


class ArrayStep(NamedTuple):
    """The result of an action of every robot in n worlds. All arrays are new."""

    observations: Any             #: (n, robots, ...): of new episodes where the one before is over
    rewards: Array                #: (n, robots), float64: 0 for robots that did not take part
    terminated: Array             #: (n, robots): the robot's episode was terminated by this action
    truncated: Array              #: (n, robots): it was cut off, by the limit of actions
    took_part: Array              #: (n, robots): False for robots whose episode had ended earlier; ignore their rows
    final_observations: Any       #: (n, robots, ...): before new episodes began
    over: npt.NDArray[np.bool_]   #: (n,), on the host: a new episode has begun
    info: dict[str, Array]        #: (n, robots): values of the task


class StageArrayEnv:
    """Every robot of every world as arrays, for learners with one policy for all robots.

    A robot whose episode has been terminated stands still until the episodes of all robots of its world have ended.
    Then the next episode of the world begins within the same step.

    On the host arrays are of NumPy. With `device` they are tensors of PyTorch in the memory of the card, and nothing is
    copied to the host but which episodes are over.

    Args:
        num_envs: number of worlds, 1 or more.

    All other arguments are those of StageVectorEnv(), and so are the errors.
    """

    def __init__(self, num_envs: int, world: AnyWorld = None, task: AnyTask = "Navigate", *, robots: str | None = None,
                 threads: int | None = None, device: str | None = None, arrays: str | None = None,
                 maps: MakeMap | None = None, action_delay: int = 0, clip_actions: bool = False,
                 render_size: tuple[int, int] = (640, 480), **options: Any) -> None:
        self._episodes = Episodes(world, task, num_envs, robots=robots, threads=threads, options=options, device=device,
                                  arrays=arrays, maps=maps, action_delay=action_delay, clip_actions=clip_actions,
                                  rendering=Rendering(None, render_size))
        self.num_envs = self._episodes.batch.n
        self.task = self._episodes.task  #: the task of the robots
        self.agents = self._episodes.batch.names  #: names of each world's robots
        self.single_observation_space = self._episodes.observed.space  #: the space of a robot's observations
        self.single_action_space = self._episodes.actions.space  #: the space of a robot's actions
        self._all = np.ones(self.num_envs, bool)

    @property
    def batch(self) -> Batch:
        """The worlds. Only read them; the environment steps and resets them."""
        return self._episodes.batch

    @property
    def statistics(self) -> Statistics:
        """Returns, lengths and success of the last episodes."""
        return self._episodes.statistics

    @property
    def clipped(self) -> int:
        """How many numbers of actions have been clipped."""
        return self._episodes.actions.clipped

    def reset(self, seed: Seeds = None) -> Any:
        """Begins an episode in each world and returns the observations: shape (n, robots, ...).

        Args:
            seed: world i gets the seed `seed` + i; a list has a seed or None for each world. None: their sequences of
                random numbers go on.
        """
        self._episodes.seed(*seeds_of(seed, self.num_envs))
        return self._episodes.begin(self._all)

    def step(self, actions: Any) -> ArrayStep:
        """Applies an action of each robot: shape (n, robots, numbers), or (n, robots) if they are discrete."""
        episodes = self._episodes
        took_part = copied(episodes.scene.live)
        moment = episodes.step(actions, self._all)
        final, seen = moment.observations, moment.observations
        if moment.ends.over.any():
            seen = copied(final)
            put(seen, episodes.arrays.of(np.flatnonzero(moment.ends.over)), episodes.begin(moment.ends.over))
        return ArrayStep(seen, moment.ends.rewards, moment.ends.terminated, moment.ends.truncated, took_part, final, moment.ends.over,
                         moment.info)

    def vary(self, name: str, values: npt.ArrayLike | None) -> None:
        """Gives a property another value in each world, from its next episode on: see StageVectorEnv.vary()."""
        self._episodes.vary(name, values)

    @property
    def varied(self) -> dict[str, npt.NDArray[Any]]:
        """The values that vary() was given, by name: copies."""
        return self._episodes.varied

    def set_map(self, ids: Which, map: MapLike | list[MapLike]) -> None:
        """Gives worlds another map, or another scene, from their next episodes on: see Batch.set_map()."""
        self.batch.set_map(ids, map)

    def mosaic(self, worlds: int = 16) -> Pixels:
        """Returns one picture of size `render_size` that shows the first worlds side by side."""
        return self._episodes.mosaic(worlds)
