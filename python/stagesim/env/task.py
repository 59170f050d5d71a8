# SPDX-License-Identifier: GPL-2.0-or-later
"""The base class of tasks, and the view of the worlds that tasks get."""

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
    """The worlds of an environment as a task sees them.

    Attributes:
        batch: the worlds. Tasks only read it; the environment steps and resets it.
        world: another world of the same file, in the state after loading: for the map and for cast().
        n: number of worlds; 1 in a single environment.
        robots: number of robots per world.
        actions: number of actions since the episode began: int64, shape (n,).
        live: True for robots that still take part in the episode: shape (n, robots).
        notes: the task's own arrays by name; their first axis is the world.
    """

    def __init__(self, batch: Batch, world: World, ranges: str = "ranger.ranges") -> None:
        self.batch = batch
        self._ranges = ranges
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
        """Poses: x, y (metres) and heading (radians), shape (n, robots, 3), live."""
        return self.batch.pose

    @property
    def velocity(self) -> Floats:
        """Set speeds: forwards, to the left (m/s) and turning (rad/s), shape (n, robots, 3), live."""
        return self.batch.velocity

    @property
    def stalled(self) -> Bools:
        """True if blocked at the last attempt to move: shape (n, robots), live."""
        return self.batch.stalled

    @property
    def ranges(self) -> Floats:
        """The array that Task.ranges names, metres: shape (n, robots, samples), live."""
        return self.batch.array(self._ranges)

    @property
    def metrics(self) -> dict[str, Floats]:
        """The world file's metrics since the episode began, by name: new arrays of shape (n,); NaN: no value."""
        return self.batch.metrics

    @property
    def places(self) -> Floats:
        """Places that the first robot can reach from its pose in the file: x, y, metres, shape (m, 2).

        They form a grid of 0.25 m, have a clearance of 0.3 m and are sorted by the length of the path.
        """
        if self._places is None:
            self._places = reachable_places(self.world, self._start)
        return self._places

    def scatter(self, random: np.random.Generator, count: int, gap: float = 0.7,
                choice: Floats | None = None) -> Floats:
        """Draws random places with a minimum distance from each other.

        Args:
            random: the random generator of the world.
            count: number of places.
            gap: min distance between two of them, metres.
            choice: places to draw from, shape (m, 2); None: all of `places`.

        Returns:
            x, y, metres: shape (count, 2).

        Raises:
            StageError: there is not enough space.
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
    """The result of an action.

    Attributes:
        reward: reward of each robot: shape (n, robots).
        terminated: True for robots whose episode is terminated: shape (n, robots).
        info: further values of each robot by name: numbers or bools, shape (n, robots).
    """

    reward: Floats
    terminated: Bools
    info: dict[str, npt.NDArray[Any]] = field(default_factory=dict)


class Task:
    """Base class of tasks. Override `size`, `begin`, `observe` and `judge`.

    The methods process arrays of all worlds at once; the results of a world must not depend on the number of
    worlds. A task keeps the state of an episode in `scene.notes`, so that one object can serve several
    environments. It draws random numbers only from the generator that begin() gets.

    Attributes:
        world: the default world file.
        steps: steps of the world per action.
        limit: max number of actions of an episode, after which it is truncated.
        top_speed: speeds forwards, to the left (m/s) and turning (rad/s) for an action of 1. An action has a
            number from -1 to 1 for each of them that is not 0.
        ranges: the array that Scene.ranges returns, as in Batch.array(): that of the first ranger, or of another
            sensor, such as "sonar_ring.ranges" of a plug-in.
        bounds: min and max of observations. Values outside are clipped; the first one causes a
            RuntimeWarning.
    """

    world: str = "arena.world"
    steps: int = 2
    limit: int = 300
    top_speed: tuple[float, float, float] = (0.5, 0.0, 1.5)
    ranges: str = "ranger.ranges"
    bounds: tuple[float, float] = (-1.0, 1.0)

    def prepare(self, scene: Scene) -> None:
        """Called once per environment: creates arrays in `scene.notes` and reads constant data."""

    def size(self, scene: Scene) -> int:
        """Returns the number of elements of a robot's observation."""
        raise NotImplementedError

    def begin(self, scene: Scene, index: int, random: np.random.Generator) -> npt.ArrayLike | None:
        """Begins an episode in world `index`, which has just been reset.

        Returns:
            Start poses x, y (metres) and heading (radians): shape (robots, 3); None: the poses in the file. The
            robots then stand still for one step, in which their sensors measure.
        """
        return None

    def observe(self, scene: Scene) -> npt.NDArray[Any]:
        """Returns the observations as a new array of shape (n, robots, size). NaN becomes 0."""
        raise NotImplementedError

    def judge(self, scene: Scene) -> Outcome:
        """Returns the result of the last action; called once after each. A reward of NaN becomes 0.

        Rows of robots that are not live and of worlds whose episode is over are ignored.
        """
        raise NotImplementedError

    def command(self, scene: Scene, actions: Floats) -> Floats:
        """Converts actions of -1 to 1, shape (n, robots, numbers), to speeds, shape (n, robots, 3)."""
        speeds = np.zeros((scene.n, scene.robots, 3))
        driven = np.flatnonzero(self.top_speed)
        speeds[..., driven] = actions * np.asarray(self.top_speed)[driven]
        return speeds


def seen_from(pose: Floats, point: Floats) -> tuple[Floats, Floats]:
    """Computes distances and bearings of points, seen from robots.

    Args:
        pose: x, y (metres) and heading (radians) of the robots: shape (..., 3).
        point: x, y of the points, metres: shape (..., 2).

    Returns:
        The distances (metres, shape (...)), and cosine and sine of the bearings relative to the headings:
        shape (..., 2). A point at the robot's position counts as straight ahead.
    """
    # Contiguous copies make NumPy use the same loops, and thus the same rounding, for any number of worlds.
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
    """Computes only the distances of seen_from()."""
    away_x, away_y = point[..., 0] - pose[..., 0], point[..., 1] - pose[..., 1]
    return np.sqrt(away_x * away_x + away_y * away_y)
