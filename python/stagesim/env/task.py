# SPDX-License-Identifier: GPL-2.0-or-later
"""What a task is, and what it sees of the worlds."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..batch import Batch
from ..errors import StageError
from ..fleet import Bools, Floats
from .places import reachable_places

if TYPE_CHECKING:
    from ..world import World


class Scene:
    """The worlds of an environment, as a task sees them: `n` worlds of `robots` robots; n is 1 if it is single.

    Attributes:
        batch: the worlds. To be looked at; the environment steps and resets them.
        world: one more of the same file, as it was loaded: for models of the map, and for cast().
        n: how many worlds.
        robots: how many robots in each.
        actions: how many actions each world has seen in this episode: integers, shape (n,).
        live: which robots take part still: bools, shape (n, robots).
        notes: arrays of the task's own, the first axis that of the worlds.
    """

    def __init__(self, batch: Batch, world: World) -> None:
        self.batch = batch
        self.world = world
        self.n = batch.n
        self.robots = len(batch)
        self.actions = np.zeros(self.n, np.int64)
        self.live = np.zeros((self.n, self.robots), bool)
        self.notes: dict[str, npt.NDArray[Any]] = {}
        self._start = batch.pose[0, 0, :2].copy()
        self._places: Floats | None = None

    @property
    def pose(self) -> Floats:
        """x, y (metres) and heading (radians): shape (n, robots, 3), live."""
        return self.batch.pose

    @property
    def velocity(self) -> Floats:
        """Forwards, to the left (m/s) and turning (rad/s): shape (n, robots, 3), live."""
        return self.batch.velocity

    @property
    def stalled(self) -> Bools:
        """Blocked at the last attempt to move: shape (n, robots), live."""
        return self.batch.stalled

    @property
    def ranges(self) -> Floats:
        """Those of the first ranger, metres: shape (n, robots, samples), live."""
        return self.batch.ranges

    @property
    def metrics(self) -> dict[str, Floats]:
        """What the metrics of the world file come to since the episode began: by name, shape (n,), new arrays. NaN where
        there is no value."""
        return self.batch.metrics

    @property
    def places(self) -> Floats:
        """Where the first of the robots can get to from where the file puts it: x, y, shape (m, 2).

        On a grid of 0.25 m, with 0.3 m around each place free; the nearest come first.
        """
        if self._places is None:
            self._places = reachable_places(self.world, self._start)
        return self._places

    def scatter(self, random: np.random.Generator, count: int, gap: float = 0.7,
                choice: Floats | None = None) -> Floats:
        """Some of the places, by chance, no two nearer to each other than `gap` metres.

        Args:
            random: the generator of the world that it is for.
            count: how many.
            gap: metres.
            choice: places to choose from, shape (m, 2); None: all of `places`.

        Returns:
            x, y: shape (count, 2).

        Raises:
            StageError: there is no room.
        """
        left = self.places if choice is None else choice
        found = np.empty((count, 2))
        for i in range(count):
            if len(left) == 0:
                raise StageError(f"found room for {i} robots or goals {gap:g} m apart, expected {count}")
            found[i] = left[random.integers(len(left))]
            left = left[((left - found[i]) ** 2).sum(1) >= gap * gap]
        return found


@dataclass
class Outcome:
    """What a task says after an action.

    Attributes:
        reward: of each robot: shape (n, robots).
        terminated: which robots have come to their end: bools, shape (n, robots).
        info: more about each robot, by name: numbers or bools, shape (n, robots).
    """

    reward: Floats
    terminated: Bools
    info: dict[str, npt.NDArray[Any]] = field(default_factory=dict)


class Task:
    """What robots are to do: a base class. Override `size`, `begin`, `observe` and `judge`.

    All work on arrays of all worlds at once; nothing in them may depend on the number of worlds. A task
    keeps what it knows of an episode in `scene.notes`, so that the same object can serve several
    environments. What it draws by chance comes from the generator that begin() is given.

    Attributes:
        world: the world file that is taken if none is given.
        steps: steps of the world for each action.
        limit: actions after which an episode is cut off (truncated).
        top_speed: forwards, to the left (m/s) and turning (rad/s) at an action of 1. An action has a
            number from -1 to 1 for each of these that is not 0.
        bounds: the smallest and the largest number of an observation. Others are clipped; the first one
            is told by a RuntimeWarning.
    """

    world: str = "arena.world"
    steps: int = 2
    limit: int = 300
    top_speed: tuple[float, float, float] = (0.5, 0.0, 1.5)
    bounds: tuple[float, float] = (-1.0, 1.0)

    def prepare(self, scene: Scene) -> None:
        """Called once: makes arrays in `scene.notes`, and reads what doesn't change."""

    def size(self, scene: Scene) -> int:
        """How many numbers a robot observes."""
        raise NotImplementedError

    def begin(self, scene: Scene, index: int, random: np.random.Generator) -> npt.ArrayLike | None:
        """An episode begins in world number `index`, which has just been reset.

        Returns:
            x, y, heading where the robots are put: shape (robots, 3); None: they stay where the file has
            them. They stand still for one step then, so that sensors have measured.
        """
        return None

    def observe(self, scene: Scene) -> npt.NDArray[Any]:
        """What each robot observes: a new array of shape (n, robots, size). NaN becomes 0."""
        raise NotImplementedError

    def judge(self, scene: Scene) -> Outcome:
        """What has come of the last action; called once after each. NaN becomes a reward of 0.

        Rows of robots that are not live, and of worlds whose episode is over, don't count.
        """
        raise NotImplementedError

    def command(self, scene: Scene, actions: Floats) -> Floats:
        """Speeds for actions of shape (n, robots, numbers), -1 to 1: shape (n, robots, 3)."""
        speeds = np.zeros((scene.n, scene.robots, 3))
        driven = np.flatnonzero(self.top_speed)
        speeds[..., driven] = actions * np.asarray(self.top_speed)[driven]
        return speeds


def seen_from(pose: Floats, point: Floats) -> tuple[Floats, Floats]:
    """Where points are for robots.

    Args:
        pose: x, y, heading: shape (..., 3).
        point: x, y: shape (..., 2).

    Returns:
        The distance (metres, shape (...)), and the cosine and sine of the bearing, relative to the
        heading: shape (..., 2). A point right where the robot is lies ahead.
    """
    # New arrays, without gaps: NumPy takes the same way through all of them, and so rounds alike.
    away_x, away_y = point[..., 0] - pose[..., 0], point[..., 1] - pose[..., 1]
    heading = np.array(pose[..., 2])
    cosine, sine = np.cos(heading), np.sin(heading)
    distance = np.sqrt(away_x * away_x + away_y * away_y)
    here = distance == 0
    unit = np.where(here, 1, distance)
    bearing = np.empty((*distance.shape, 2))
    bearing[..., 0] = np.where(here, 1, away_x * cosine + away_y * sine) / unit
    bearing[..., 1] = (away_y * cosine - away_x * sine) / unit
    return distance, bearing


def distance_to(pose: Floats, point: Floats) -> Floats:
    """The first half of what seen_from() returns."""
    away_x, away_y = point[..., 0] - pose[..., 0], point[..., 1] - pose[..., 1]
    return np.sqrt(away_x * away_x + away_y * away_y)
