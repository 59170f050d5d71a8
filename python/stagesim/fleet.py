# SPDX-License-Identifier: GPL-2.0-or-later
"""Arrays of all robots at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, TypeVar

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from . import _core
    from .world import World

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int32]
Bools = npt.NDArray[np.bool_]
Sensor = TypeVar("Sensor")


class _Views:
    """Arrays that are made when they are asked for first, and are the same objects ever after."""

    def __init__(self) -> None:
        self._views: dict[str, npt.NDArray[Any]] = {}

    def _view(self, name: str, make: Callable[[], Any]) -> npt.NDArray[Any]:
        view = self._views.get(name)
        if view is None:
            view = self._views[name] = make()
        return view


class Ranger(_Views):
    """The same ranger of each robot: all rays of all its sensors, one sensor after the other.

    Arrays are live, like those of the fleet: shape (n, samples) for the n robots of a fleet, and
    (worlds, n, samples) for a batch. `samples` is that of the ranger that has most; others' rows end in
    NaN. Reading them subscribes to the rangers, so they work from then on; NaN stands where nothing has
    been measured yet, and in the rows of robots that are gone or have no such ranger.
    """

    def __init__(self, crowd: _core.Crowd, index: int) -> None:
        super().__init__()
        self._crowd = crowd
        self._index = index
        self._array("ranges")  # raises GoneError if there is none

    def _array(self, what: str) -> Floats:
        return self._view(what, lambda: self._crowd.ranger(self._index, what))

    @property
    def ranges(self) -> Floats:
        """Metres; the sensor's maximum where nothing was hit. Sample 0 is the right-hand one."""
        return self._array("ranges")

    @property
    def intensities(self) -> Floats:
        """The ranger_return of what was hit; 0 for nothing."""
        return self._array("intensities")

    @property
    def time(self) -> Floats:
        """Seconds: the time of the world at which each ranger updated last, shape (n,). NaN: not yet.

        The readings are of the beginning of the step that ended then; see Fleet.sensed_pose.
        """
        return self._array("time")

    @property
    def bearings(self) -> Floats:
        """Radians, -pi to pi, counter-clockwise: where each ray points, relative to the robot's heading."""
        return self._array("bearings")

    @property
    def origins(self) -> Floats:
        """Metres, shape (..., samples, 2): where each ray begins, x and y in the robot's frame."""
        return self._array("origins")


class _Sights(_Views):
    """What a sensor of each robot has found: a few of them, and how many there are."""

    def __init__(self, make: Callable[[str], object]) -> None:
        super().__init__()
        self._make = make
        self._array("count")  # raises GoneError if there is no such sensor

    def _array(self, what: str) -> npt.NDArray[Any]:
        return self._view(what, lambda: self._make(what))

    @property
    def count(self) -> Integers:
        """How many each robot sees, shape (n,): perhaps more than `most`."""
        return self._array("count")

    @property
    def range(self) -> Floats:
        """Metres: between the origins of finder and target, or the mean over a blob."""
        return self._array("range")

    @property
    def time(self) -> Floats:
        """Seconds: the time of the world at which each sensor updated last, shape (n,). NaN: not yet."""
        return self._array("time")


class Fiducials(_Sights):
    """What the same fiducial finder of each robot sees, the first `most` in the order of creation.

    Arrays are live, of shape (n, most), or (worlds, n, most) for a batch; NaN, and the id 0, beyond what
    was seen.
    """

    @property
    def id(self) -> Integers:
        """Their fiducial_return; 0 where it is too far away to be read."""
        return self._array("id")

    @property
    def bearing(self) -> Floats:
        """Radians, relative to the finder."""
        return self._array("bearing")

    @property
    def heading(self) -> Floats:
        """Radians: the target's heading relative to the finder's."""
        return self._array("heading")


class Blobs(_Sights):
    """What the same blobfinder of each robot sees, the first `most` from the right of the image.

    Arrays are live, of shape (n, most, ...), or (worlds, n, most, ...) for a batch; NaN and 0 beyond what
    was seen.
    """

    @property
    def color(self) -> Floats:
        """Red, green, blue, opacity, 0 to 1: shape (n, most, 4)."""
        return self._array("color")

    @property
    def box(self) -> Integers:
        """Left, top, right, bottom, pixels from the top left corner: shape (n, most, 4)."""
        return self._array("box")


class Camera(_Views):
    """The same camera of each robot.

    Arrays are live: the top row first, of shape (n, height, width, ...), or (worlds, n, height, width, ...)
    for a batch. Width and height are those of the largest pictures; smaller ones lie in the top left
    corner. Reading them subscribes to the cameras, so they work from then on.
    """

    def __init__(self, crowd: _core.Crowd, index: int) -> None:
        super().__init__()
        self._crowd = crowd
        self._index = index
        self._array("depth")  # raises GoneError if there is none

    def _array(self, what: str) -> npt.NDArray[Any]:
        return self._view(what, lambda: self._crowd.camera(self._index, what))

    @property
    def color(self) -> npt.NDArray[np.uint8]:
        """Red, green and blue, 0 to 255: shape (n, height, width, 3). 0: no picture has been taken yet."""
        return self._array("color")

    @property
    def depth(self) -> npt.NDArray[np.float32]:
        """Metres along the direction of view; the far clipping distance where there is nothing.

        Shape (n, height, width). NaN: no picture has been taken yet.
        """
        return self._array("depth")

    @property
    def time(self) -> Floats:
        """Seconds: the time of the world at which each camera updated last, shape (n,). NaN: not yet."""
        return self._array("time")


class Crowd(_Views):
    """What fleets and batches have in common."""

    def __init__(self, crowd: _core.Crowd) -> None:
        super().__init__()
        self._crowd = crowd
        self._sensors: dict[tuple[str, int, int], Any] = {}

    def __len__(self) -> int:
        return self._crowd.size

    @property
    def pose(self) -> Floats:
        """x, y (metres) and heading (radians) in the frame of the world: shape (n, 3). NaN: gone.

        It is where the robots are now, after the moves of the last step. What their sensors report is of
        that step's beginning: it belongs to `sensed_pose`.
        """
        return self._view("pose", self._crowd.pose)

    @property
    def sensed_pose(self) -> Floats:
        """Where the robots were when their newest readings were taken: x, y, heading; shape (n, 3).

        In the frame of the world. A step senses first, then moves: this is the pose at the beginning of the
        last step in which the robot, or a sensor of it, updated. `estimate` and the newest readings
        belong to the same instant. Reading it makes the robots run, as reading a sensor does. NaN: gone.
        """
        return self._view("sensed_pose", self._crowd.sensed_pose)

    @property
    def sensed_time(self) -> Floats:
        """Seconds: the time of the world that `sensed_pose` and `estimate` are stamped with; shape (n,).

        A sensor whose own `time` is the same has taken its readings at that instant. 0: nothing has
        updated yet. NaN: gone.
        """
        return self._view("sensed_time", self._crowd.sensed_time)

    @property
    def velocity(self) -> Floats:
        """Forwards, to the left (m/s) and turning (rad/s), in force now: shape (n, 3).

        A stall does not reset it. NaN: gone.
        """
        return self._view("velocity", self._crowd.velocity)

    @property
    def actual_velocity(self) -> Floats:
        """Forwards, to the left (m/s) and turning (rad/s), as the last step moved the robots: shape (n, 3).

        0 for robots that were blocked. NaN: gone.
        """
        return self._view("actual_velocity", self._crowd.actual_velocity)

    @property
    def estimate(self) -> Floats:
        """x, y (metres) and heading (radians) where the robots believe that they are: shape (n, 3).

        In the frame of their odometry, or that of the world with "gps". It is refreshed when the robot, or
        a sensor of it, updates, and belongs to the same instant as those readings and as
        `sensed_pose`, which it equals with "gps". Reading it makes the robots run. NaN: gone.
        """
        return self._view("estimate", self._crowd.estimate)

    @property
    def estimated_velocity(self) -> Floats:
        """`actual_velocity` as the odometry has it, with its errors; exact with "gps". Shape (n, 3)."""
        return self._view("estimated_velocity", self._crowd.estimated_velocity)

    @property
    def cmd(self) -> Floats:
        """Speeds that the robots are told before each step: forwards, to the left, turning; shape (n, 3).

        To be written. Metres and radians per second; the third number is the steering angle of a car.
        They are told from the first time on that somebody asks for this array; all are 0 at first. A row
        with a NaN in it is not told: such a robot is left to its own controller, or to the last command.
        A command overrides what a controller said in the step before.
        """
        return self._view("cmd", self._crowd.commands)

    @property
    def stalled(self) -> Bools:
        """Blocked at the last attempt to move: shape (n,)."""
        return self._view("stalled", self._crowd.stalled)

    @property
    def energy(self) -> Floats:
        """Joules in the power pack: shape (n,). NaN: there is none."""
        return self._view("energy", self._crowd.energy)

    def ranger(self, index: int = 0) -> Ranger:
        """The ranger that is number `index` of each robot, in the order of creation.

        Raises:
            GoneError: no robot has so many.
        """
        return self._sensor("ranger", index, 0, lambda: Ranger(self._crowd, index))

    def fiducials(self, index: int = 0, most: int = 8) -> Fiducials:
        """The fiducial finder that is number `index` of each robot; raises GoneError if none has one."""
        return self._sensor("fiducials", index, most, lambda: Fiducials(
            lambda what: self._crowd.fiducials(index, most, what)))

    def blobs(self, index: int = 0, most: int = 8) -> Blobs:
        """The blobfinder that is number `index` of each robot; raises GoneError if none has one."""
        return self._sensor("blobs", index, most, lambda: Blobs(
            lambda what: self._crowd.blobs(index, most, what)))

    def camera(self, index: int = 0) -> Camera:
        """The camera that is number `index` of each robot; raises GoneError if none has one."""
        return self._sensor("camera", index, 0, lambda: Camera(self._crowd, index))

    def bumper(self, index: int = 0) -> Bools:
        """Whether anything touches each line of bumper number `index`: shape (n, lines), live.

        Raises:
            GoneError: no robot has so many.
        """
        return self._view(f"bumper {index}", lambda: self._crowd.bumper(index))

    def _sensor(self, kind: str, index: int, most: int, make: Callable[[], Sensor]) -> Sensor:
        if index < 0 or most < 0:
            raise ValueError(f"found {kind} number {index}, at most {most} of them; expected 0 or more")
        known: Sensor | None = self._sensors.get((kind, index, most))
        if known is None:
            known = self._sensors[kind, index, most] = make()
        return known


class Fleet(Crowd):
    """Robots of a world, in a fixed order, and live arrays of what they do and sense.

    Arrays have a row for each of the n robots. They are filled in once after each call that changes the
    world, without a copy for each robot, and only those that have been asked for. All but `cmd` are
    read-only. They stay what they are when models are made or deleted, and when the world is reset or
    restored: rows of robots that are gone read NaN, and those of robots that come back go on. When the
    world is closed, they keep what they had.
    """

    def __init__(self, world: World, crowd: _core.Crowd, ids: tuple[int, ...],
                 names: tuple[str, ...]) -> None:
        super().__init__(crowd)
        self.world = world  #: whose robots these are
        self.ids = ids  #: their numbers: those of their models
        self.names = names  #: of the robots, when the fleet was made

    def teleport(self, pose: npt.ArrayLike, which: npt.ArrayLike | None = None) -> None:
        """Puts robots somewhere else, without a test for collisions.

        Args:
            pose: x, y, heading: shape (n, 3), or (3,) for all.
            which: a mask of shape (n,), or indices: these robots alone; then one row for each.
        """
        chosen = np.arange(len(self)) if which is None else np.arange(len(self))[np.asarray(which)]
        poses = np.full((len(self), 3), np.nan)
        poses[chosen] = pose
        mask = np.zeros(len(self), bool)
        mask[chosen] = True
        if not np.isfinite(poses[chosen]).all():
            raise ValueError("found a pose that is not finite")
        self.world._core.teleport(self._crowd, poses, mask)

    def __repr__(self) -> str:
        return f"<Fleet of {len(self)} robots>"
