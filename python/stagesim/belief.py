# SPDX-License-Identifier: GPL-2.0-or-later
"""Beliefs of a robot that is not in the simulator, and decisions by samples of them."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _core, _paths
from ._batch_arguments import device_choice
from ._checks import integer, shown
from .errors import StageError

if TYPE_CHECKING:
    from .scenes import GridMap, Scene

Floats = npt.NDArray[np.float64]
KINDS = ("stand", "go on", "go to", "social force", "orca", "controller", "function")
REASONS = ("horizon", "told apart", "budget")


class Moments(NamedTuple):
    """Before a step of the samples: k others whom a function moves, each in a sample of a plan.

    Attributes:
        poses: of the robot and of all n others, in the order of their ids, in the frame of the world file: shape (k, 1 + n, 3).
        own: place among these n + 1 of the one who is moved: shape (k,).
        ids: of the one who is moved: shape (k,).
        plans: number of the plan: shape (k,).
        samples: number of the sample: shape (k,).
        times: seconds since the beginning: shape (k,).
    """

    poses: Floats
    own: npt.NDArray[np.int64]
    ids: npt.NDArray[np.uint64]
    plans: npt.NDArray[np.int64]
    samples: npt.NDArray[np.int64]
    times: Floats


class Sightings(NamedTuple):
    """All sightings of k futures, each a sample of a plan, after each of m steps.

    Attributes:
        poses: of the robot and of all n others, in the order of their ids, in the frame of the world file: shape
            (k, m, 1 + n, 3).
        velocities: of each in its own frame, m/s and rad/s: shape (k, m, 1 + n, 3).
        stalled: whether each wanted to move and was kept from it by contact: shape (k, m, 1 + n). A robot that stands isn't
            stalled if somebody runs into it, but he is.
        radii: of the n others, metres: shape (n,).
        plans: number of the plan: shape (k,).
        samples: number of the sample: shape (k,).
        interval: seconds of a step.
    """

    poses: Floats
    velocities: Floats
    stalled: npt.NDArray[np.bool_]
    radii: Floats
    plans: npt.NDArray[np.int64]
    samples: npt.NDArray[np.int64]
    interval: float


class Behaviour(NamedTuple):
    """A way in which somebody may behave.

    Args:
        kind: "stand"; "go on" with the present velocity; or to a goal: "go to" straight, "social force" like the controller
            stage/pedestrian, "orca" like stage/orca; "controller"; or "function".
        weight: of its probability, above 0; those of all behaviours need not add up to 1.
        goal: x and y, metres, in the frame of the world file; needed to go to one.
        speed: on the way to the goal, m/s; 0: that of the present velocity. Give it if somebody may start from rest.
        controller: a batch controller and its arguments, as the property ctrl of a world file: "stage/wander speed=0.3".
        function: called in each step with Moments of all samples that have it; returns velocities in the frame of the world
            file, m/s and rad/s: shape (k, 2) or (k, 3). Such samples are simulated in lockstep, which takes more time.
    """

    kind: str = "go on"
    weight: float = 1.0
    goal: tuple[float, float] | None = None
    speed: float = 0.0
    controller: str = ""
    function: Callable[[Moments], npt.ArrayLike] | None = None


class OtherKind(NamedTuple):
    """Others of a size, which are discs.

    Args:
        radius, height: metres.
        body: further properties and children in the language of world files, such as a ranger: social forces, reciprocal
            avoidance and controllers see walls by them, and nothing else.
        room: number of others that there is room for from the start; doubled when there are more.
    """

    radius: float = 0.25
    height: float = 1.7
    body: str = ""
    room: int = 8


class _Source(NamedTuple):
    """The text of a world, and pictures that it names."""

    path: str
    text: str | None = None  # that of the file if there is none
    pictures: Mapping[str, bytes] = MappingProxyType({})


def _source_of(file: str | os.PathLike[str] | Scene | _Source) -> _Source:
    if isinstance(file, _Source):
        return file
    if isinstance(file, (str, bytes, os.PathLike)):
        return _Source(_paths.resolve(file))
    from .scenes import Scene

    if not isinstance(file, Scene):
        raise TypeError(f"found {shown(file)}, expected a world file or a scene: stagesim.scenes.Scene()")
    return _Source("<scene>", file.text(), file.pictures())


class Belief:
    """The belief of a robot: a world file for what is known for sure, and measurements, which are changed in place.

    Others are discs. Lengths are in metres, poses (x, y, heading) in the frame of the world file. A covariance has shape
    (3, 3), in the units of these numbers; zeros mean that there is no error. The world must be closed, see Batch.explain().

    Args:
        file: a world file; one that ships with Stage may be named without its folder. Or a stagesim.scenes.Scene.
        robot: name of the position model that decides.
        grid: rows and columns of an occupancy grid in addition to the walls of the file; or a stagesim.scenes.GridMap, or the
            path of a map.yaml, which give its size, cells, resolution, origin and height; None: there is none.
        resolution: side of a cell of the grid.
        origin: pose of the outer corner of the grid's cell in row 0 and column 0, as in nav_msgs/OccupancyGrid.
        wall_height: height of occupied cells.
        other_radius, other_height: of others.
        room: number of others that there is room for from the start; doubled when there are more.
        kinds: kinds of others, at least one; None: one kind of the given radius, height and room.
        others_clear_cells: cells near the place of an other, up to its radius and the side of a cell, count as free. For grids
            that are made from a robot's own sensors, which show others as obstacles.

    Raises:
        StageError: the file can't be loaded, or has no such robot.
        ValueError: a number is out of range.
    """

    def __init__(self, file: str | os.PathLike[str] | Scene | _Source, robot: str, *, grid: tuple[int, int] | GridMap | str | os.PathLike[str] | None = None,
                 resolution: float = 0.05, origin: npt.ArrayLike = (0, 0, 0), wall_height: float = 1.0,
                 other_radius: float = 0.25, other_height: float = 1.7, room: int = 8,
                 kinds: Sequence[OtherKind] | None = None, others_clear_cells: bool = False) -> None:
        map_given = _map_of(grid)
        if map_given is not None:
            grid, resolution, wall_height = map_given.shape, map_given.resolution, map_given.height
            origin = np.asarray(map_given.origin, float)[[0, 1, -1]]
        self.grid = None if grid is None else _side(grid)
        all_kinds = [OtherKind(other_radius, other_height, "", room)] if kinds is None else list(kinds)
        sizes = [(kind.radius, kind.height, integer(kind.room, "room", 1, 100000)) for kind in all_kinds]
        self._kinds, self._count = len(all_kinds), 0  # of others
        source = _source_of(file)
        self._core = _core.make_belief(
            source.path, source.text, dict(source.pictures), robot, np.array([resolution, wall_height], float), _numbers(origin, "origin", (3,)),
            np.array(sizes, float).reshape(-1, 3), [kind.body for kind in all_kinds], *(self.grid or (0, 0)),
            bool(others_clear_cells))
        if map_given is not None:
            self.set_grid(map_given.occupied)

    @classmethod
    def from_text(cls, text: str, robot: str, folder: str | os.PathLike[str] = "", **options: Any) -> Belief:
        """Makes a belief from the contents of a world file.

        Args:
            text: the contents of a world file.
            robot: name of the position model that decides.
            folder: the folder that file names in `text` are relative to; by default that of the shipped worlds.

        All other arguments are those of Belief().
        """
        return cls(_Source(os.path.join(os.fspath(folder) or _paths.WORLDS[0], "<text>"), text), robot, **options)

    def set_robot(self, pose: npt.ArrayLike, velocity: npt.ArrayLike = (0, 0, 0),
                  pose_covariance: npt.ArrayLike | None = None, velocity_covariance: npt.ArrayLike | None = None) -> None:
        """Says where the robot is, and its velocity in its own frame: (x, y, turn rate), m/s and rad/s.

        Before the first call, it is where the world file has it, and stands. A covariance has variances, not deviations:
        np.diag([0.05, 0.05, 0.02]) ** 2 is that of errors of 5 cm and 0.02 rad.

        Raises:
            StageError: a number is not finite, or a covariance is not symmetric and positive semidefinite.
            ValueError: a shape is wrong.
        """
        self._core.set_robot(_rows(1, pose, velocity, pose_covariance, velocity_covariance)[0])

    def set_others(self, ids: npt.ArrayLike, poses: npt.ArrayLike, velocities: npt.ArrayLike | None = None,
                   pose_covariances: npt.ArrayLike | None = None, velocity_covariances: npt.ArrayLike | None = None,
                   behaviours: Sequence[Sequence[Behaviour]] | None = None, kinds: npt.ArrayLike | None = None) -> None:
        """Replaces all tracked others by n others.

        Args:
            ids: their numbers, each once: shape (n,). Random numbers of samples belong to them.
            poses: shape (n, 3).
            velocities: in the frame of the world file, m/s and rad/s: shape (n, 3); None: all stand.
            pose_covariances, velocity_covariances: shape (n, 3, 3), or (3, 3) for all; None: there are no errors.
            behaviours: hypotheses for each of them; None or an empty sequence: they go on. A controller that is named for the
                first time makes the world of the belief anew.
            kinds: their kinds, as numbers of Belief's argument: shape (n,); None: all are of the first kind.

        Raises:
            StageError: a number makes no sense; nobody is tracked then.
            ValueError: a shape or a kind is wrong.
        """
        numbers = np.asarray(ids)
        if numbers.ndim != 1 or (numbers.size and numbers.dtype.kind not in "iu") or (numbers < 0).any():
            raise ValueError(f"found {shown(ids)} as ids, expected whole numbers from 0 on: shape (n,)")
        if len(np.unique(numbers)) != len(numbers):
            raise ValueError("found an id twice, expected different ones")
        n = len(numbers)
        rows = _rows(n, poses, np.zeros((n, 3)) if velocities is None else velocities, pose_covariances,
                     velocity_covariances)
        of_kinds = np.zeros(n, int) if kinds is None else np.asarray(kinds)
        if of_kinds.shape != (n,) or of_kinds.dtype.kind not in "iu" or not ((0 <= of_kinds) & (of_kinds < self._kinds)).all():
            raise ValueError(f"found {shown(kinds)} as kinds, expected whole numbers below {self._kinds}: shape ({n},)")
        if behaviours is not None and len(behaviours) != n:
            raise ValueError(f"found behaviours of {len(behaviours)} others, expected {n}")
        lists = [] if behaviours is None else behaviours
        if any(isinstance(each, Behaviour) for each in lists):
            raise ValueError("found a Behaviour for an other, expected a sequence of them for each other")
        pairs = [(i, each) for i, all_of in enumerate(lists) for each in all_of]
        table = np.array([_row(i, each) for i, each in pairs], float).reshape(-1, 6)
        makers = _makers([each for _, each in pairs])
        try:
            self._core.set_others(numbers.astype(np.uint64), rows, of_kinds.astype(np.uint64), table, makers)
            self._count = n
        except StageError:
            self._count = 0
            raise
        finally:
            self._makers = makers  # the compiled belief doesn't keep functions

    def set_grid(self, cells: npt.ArrayLike, threshold: int = 65) -> None:
        """Replaces the cells of the grid.

        Args:
            cells: shape as given to Belief; row 0 is the lowest. Truth values: True is occupied; or whole numbers: -1 is
                unknown and counts as free, 0 to 100 the probability in percent, as in nav_msgs/OccupancyGrid.
            threshold: cells with at least this percentage are occupied.

        Raises:
            ValueError: the shape or the type is wrong, or the belief has no grid.
        """
        array = np.asarray(cells)
        if self.grid is None:
            raise ValueError("found cells for a belief without a grid, expected Belief(..., grid=(rows, columns))")
        if array.shape != self.grid or array.dtype.kind not in "biu":
            raise ValueError(f"found cells of shape {array.shape} and type {array.dtype}, expected {self.grid} and bool or int")
        occupied = array if array.dtype == bool else array >= threshold
        self._core.set_grid(np.ascontiguousarray(occupied, np.uint8))

    def set_delay(self, seconds: float) -> None:
        """Says how many seconds, 0 to 10, pass until the robot obeys a command; it goes on as now before.

        Raises:
            StageError: the number is out of range.
        """
        self._core.set_delay(float(seconds))


class Decision:
    """A decision of ConsequenceEngine about p plans.

    Attributes:
        best: number of the best plan; the first if several are equal.
        reason: "horizon": all samples were simulated; "told apart": enough of them; or "budget".
        complete: whether the first samples reached the horizon.
        samples: number of samples of the best plan.
        steps: of all samples together.
        seconds: spent.
        joules: spent, if the budget has watts.
        scores: by plan and sample, NaN where none was simulated: shape (p, most samples of a plan).
        collided: by plan and sample, like the scores.
    """

    def __init__(self, core: _core.Decision, asked: tuple[Any, ...], watched: int, others: int) -> None:
        self._core, self._asked, self._watched, self._others = core, asked, watched, others
        self.best: int = core.best
        self.reason = REASONS[core.reason]
        self.complete: bool = core.complete
        self.samples: int = core.samples
        self.steps: int = core.scenario_steps
        self.seconds: float = core.seconds
        self.joules: float = core.joules
        scores, collided = core.scores, core.collided
        most = max(map(len, scores), default=0)
        self.scores = np.full((len(scores), most), np.nan)
        self.collided = np.zeros((len(scores), most), bool)
        for i, values in enumerate(scores):
            self.scores[i, :len(values)] = values
            self.collided[i, :len(values)] = collided[i]

    @property
    def mean(self) -> Floats:
        """Mean score of each plan: shape (p,)."""
        return np.nanmean(self.scores, 1)

    @property
    def worst(self) -> Floats:
        """Least score of each plan: shape (p,)."""
        return np.nanmin(self.scores, 1)

    def quantile(self, q: float) -> Floats:
        """Score that a share `q`, 0 to 1, of the samples of each plan doesn't exceed: shape (p,)."""
        return np.nanquantile(self.scores, q, axis=1)

    @property
    def risk(self) -> Floats:
        """Share of the samples of each plan that collided: shape (p,)."""
        return self.collided.sum(1) / np.maximum(1, np.isfinite(self.scores).sum(1))

    @property
    def risk_interval(self) -> Floats:
        """Wilson's interval of the probability of a collision with a confidence of 95 %: shape (p, 2)."""
        return np.array(self._core.intervals, float).reshape(-1, 2)

    def future(self, plan: int, others: int = 0) -> Floats:
        """Poses in the first sample of a plan after each step: shape (steps, 1 + others, 3).

        Args:
            plan: its number.
            others: how many of the others that were tracked follow the robot, in the order of their ids.

        Raises:
            ValueError: a number is out of range.
        """
        found = np.array(self._core.future(integer(plan, "plan", 0, len(self.scores) - 1)), float)
        count = integer(others, "others", 0, self._others)
        return found.reshape(-1, self._watched, 3)[:, :1 + count]

    def __repr__(self) -> str:
        return (f"<Decision for plan {self.best} by {self.samples} samples ({self.reason}): score {self.mean[self.best]:.3g}, "
                f"risk {self.risk[self.best]:.3g}>")


class ConsequenceEngine:
    """Chooses among plans by their consequences in samples of a belief. Results equal those of C++, bit for bit.

    Args:
        belief: may be changed between decisions.
        samples: number of samples of each plan; all plans have the same random numbers.
        most_samples: if greater, the number is doubled until the best plan can be told apart from the others.
        prefer: "mean", "worst", or a quantile from 0 to 1 of the scores, which decides.
        max_risk: plans that collide in a greater share of the samples are chosen only if all do.
        indifference: a difference of scores that doesn't matter, for `most_samples`.
        threads: None: all processors.
        device: an OpenCL device such as "opencl:gpu"; None: the host. Results are equal.

    Raises:
        StageError: the world isn't closed, or there is no such device.
        ValueError: an argument is out of range.
    """

    def __init__(self, belief: Belief, *, samples: int = 10, most_samples: int | None = None,
                 prefer: str | float = "mean", max_risk: float = 1.0, indifference: float = 0.0,
                 threads: int | None = None, device: str | None = None) -> None:
        kinds = {"mean": 0, "worst": 1}
        if not (prefer in kinds if isinstance(prefer, str) else 0 <= prefer <= 1):
            raise ValueError(f'found {shown(prefer)} as prefer, expected "mean", "worst" or a number from 0 to 1')
        kind, quantile = (kinds[prefer], 0.0) if isinstance(prefer, str) else (2, float(prefer))
        self.belief = belief
        samples = integer(samples, "samples", 1, 100000)
        most = samples if most_samples is None else integer(most_samples, "most_samples", samples, 100000)
        choice = device_choice(device)
        self._core = _core.make_engine(
            belief._core, samples, most, kind, np.array([quantile, max_risk, indifference, 2.0], float),
            _core.count_processors() if threads is None else integer(threads, "threads", 1, 1024), choice or "",
            choice is not None)

    @property
    def device(self) -> str | None:
        """Name of the device that makes the steps, or None."""
        return self._core.device or None

    def choose(self, plans: npt.ArrayLike, goal: npt.ArrayLike | None = None, *, radius: float | None = None,
               horizon: float = 5.0, hold: float = 1.0, seed: int = 1, seconds: float = 0.0, steps: int = 0,
               joules: float = 0.0, watts: float = 0.0, penalty: float = 100.0, tolerance: float = 0.2,
               judge: Callable[[Sightings], Any] | None = None) -> Decision:
        """Returns the best plan: the one with the least mean distance to the goal during the horizon, or with the best score.

        Args:
            plans: velocities of the robot in its own frame, (x, y, turn rate): shape (p, 3), or (p, m, 3) for m velocities
                after each other, the last one for good. The first plan is chosen if nothing is known.
            goal: x and y, metres; None if there is a judge.
            radius: of the robot, metres, for contacts with others who run into it; needed with a goal.
            horizon: simulated seconds to look ahead, with the delay.
            hold: duration of each velocity, seconds.
            seed: of the samples: equal seeds and beliefs have equal samples. It may be the same in all decisions of a trip.
            seconds, steps, joules: budgets of time, of steps of all samples, and of `watts` times the seconds; 0: no limit.
            penalty: of a collision, which ends a sample, in metres of the mean distance.
            tolerance: the goal is reached within this distance, metres.
            judge: called with the Sightings of all samples that have been simulated, and again if more are added; returns scores,
                higher is better: shape (k,), or a pair of scores and truth values that say which futures have collided, without
                which `max_risk` has no effect.

        Raises:
            StageError: there can be no decision: the robot would be in an obstacle, or can't obey a plan.
            ValueError: a shape is wrong, or a number is out of range.
        """
        if (goal is None) == (judge is None):
            raise ValueError("found a goal and a judge, or none of them, expected one")
        if goal is not None and radius is None:
            raise ValueError("found no radius of the robot, expected metres")
        return self._decide(None, *_asked(plans, (0, 0) if goal is None else goal, judge, radius or 0.0, penalty, tolerance,
                                          horizon, hold, seconds, joules, watts, steps, seed))

    def replay(self, decision: Decision) -> Decision:
        """Repeats a decision of this engine about the same belief, without its budgets: exactly."""
        return self._decide(decision, *decision._asked)

    def _decide(self, earlier: Decision | None, *asked: Any) -> Decision:
        core = self._core.choose(*asked) if earlier is None else self._core.replay(*asked, earlier._core)
        return Decision(core, asked, self._core.watched, self.belief._count)


def _asked(plans: npt.ArrayLike, goal: npt.ArrayLike, judge: Callable[[Sightings], Any] | None,
           *numbers: Any) -> tuple[Any, ...]:
    """The arguments of the compiled functions: plans, numbers, judge, steps, seed."""
    array = np.asarray(plans, np.float64)
    array = array[:, None] if array.ndim == 2 else array
    if array.ndim != 3 or array.shape[2] != 3 or array.shape[1] == 0:
        raise ValueError(f"found plans of shape {np.shape(plans)}, expected (p, 3) or (p, m, 3)")
    given = [float(number) for number in numbers[:-2]]
    if not all(math.isfinite(number) and number >= 0 for number in given):
        raise ValueError("found a number that is negative or not finite, expected metres, seconds, joules and watts")
    return (np.ascontiguousarray(array), np.concatenate([_numbers(goal, "goal", (2,)), given]), judge and _Judge(judge),
            integer(numbers[-2], "steps", 0), integer(numbers[-1], "seed", 0, 2**64 - 1))


class _Judge:
    """A judge as the compiled function calls it: returns scores and collisions, shape (k, 2)."""

    def __init__(self, function: Callable[[Sightings], Any]) -> None:
        self._function = function

    def __call__(self, poses: Floats, velocities: Floats, stalled: npt.NDArray[np.uint8], *rest: Any) -> Floats:
        found = self._function(Sightings(poses, velocities, stalled.view(bool), *rest))
        scores, collided = found if isinstance(found, tuple) and len(found) == 2 else (found, False)
        table = np.zeros((len(poses), 2))
        array = np.asarray(scores, float)
        if array.shape != (len(poses),) or not np.isfinite(array).all():
            raise ValueError(f"found scores of shape {array.shape} from the judge, expected {len(poses)} finite numbers")
        table[:, 0] = array
        table[:, 1] = np.broadcast_to(np.asarray(collided, bool), (len(poses),))
        return table


class _Rule:
    """A function that moves others as the compiled function calls it: returns velocities, shape (k, 3)."""

    def __init__(self, function: Callable[[Moments], npt.ArrayLike]) -> None:
        self._function = function

    def __call__(self, *given: Any) -> Floats:
        moments = Moments(*given)
        found = np.asarray(self._function(moments), float)
        k = len(moments.ids)
        if found.shape not in ((k, 2), (k, 3)):
            raise ValueError(f"found velocities of shape {found.shape} from a function that moves others, expected {(k, 3)}")
        velocities = np.zeros((k, 3))
        velocities[:, :found.shape[1]] = found
        return velocities


def _map_of(grid: Any) -> GridMap | None:
    """The map that a grid is given by, if it isn't given by its size."""
    if isinstance(grid, (str, os.PathLike)):
        from .scenes import GridMap, Scene
        return GridMap.from_file(grid)
    return None if grid is None or isinstance(grid, (tuple, list)) else grid


def _side(grid: Any) -> tuple[int, int]:
    return integer(grid[0], "grid", 1, 10000), integer(grid[1], "grid", 1, 10000)


def _makers(behaviours: Sequence[Behaviour]) -> list[str | _Rule | None]:
    """Controllers and functions of behaviours. Those with the same function are moved by one call."""
    rules: dict[int, _Rule] = {}
    makers: list[str | _Rule | None] = []
    for behaviour in behaviours:
        function = behaviour.function if behaviour.kind == "function" else None
        if behaviour.kind == "function" and not callable(function):
            raise ValueError(f"found {shown(function)} as the function of a behaviour, expected a function")
        rule = None if function is None else rules.setdefault(id(function), _Rule(function))
        makers.append(behaviour.controller if behaviour.kind == "controller" else rule)
    return makers


def _numbers(given: npt.ArrayLike, name: str, shape: tuple[int, ...]) -> Floats:
    array = np.asarray(given, np.float64)
    if array.shape != shape:
        raise ValueError(f"found {name} of shape {array.shape}, expected {shape}")
    return np.ascontiguousarray(array)


def _rows(n: int, poses: npt.ArrayLike, velocities: npt.ArrayLike, *covariances: npt.ArrayLike | None) -> Floats:
    """Poses, velocities and their covariances: shape (n, 24)."""
    columns = []
    for given, name in ((poses, "poses"), (velocities, "velocities")):
        array = np.asarray(given, np.float64)
        if array.shape != (n, 3) and not (n == 1 and array.shape == (3,)):
            raise ValueError(f"found {name} of shape {array.shape}, expected {(n, 3)}")
        columns.append(array.reshape(n, 3))
    for covariance in covariances:
        array = np.asarray(np.zeros((3, 3)) if covariance is None else covariance, np.float64)
        if array.shape not in ((3, 3), (n, 3, 3)):
            raise ValueError(f"found covariances of shape {array.shape}, expected (3, 3) or {(n, 3, 3)}")
        columns.append(np.broadcast_to(array, (n, 3, 3)).reshape(n, 9))
    return np.concatenate(columns, 1)


def _row(i: int, behaviour: Behaviour) -> list[float]:
    """A behaviour of the other in this place as numbers."""
    if not isinstance(behaviour, Behaviour):
        raise ValueError(f"found {shown(behaviour)} for other {i}, expected a sequence of Behaviour for each of them")
    kind, weight, goal, speed = behaviour[:4]
    if kind not in KINDS:
        raise ValueError(f"found a behaviour {shown(kind)}, expected one of {', '.join(KINDS)}")
    numbers = [weight, *((0, 0) if goal is None else goal), speed]
    if len(numbers) != 4 or not all(isinstance(number, (int, float, np.number)) for number in numbers):
        raise ValueError(f"found {shown(behaviour[:4])}, expected a kind, a weight, goal=(x, y) and a speed")
    if goal is None and kind in ("go to", "social force", "orca"):
        raise ValueError(f"found {shown(kind)} without a goal, expected x and y")
    return [i, KINDS.index(kind), *map(float, numbers)]
