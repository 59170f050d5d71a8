# SPDX-License-Identifier: GPL-2.0-or-later
"""Arrays of all robots at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, TypeVar

import numpy as np
import numpy.typing as npt

from . import _checks

if TYPE_CHECKING:
    from . import _core
    from .world import World

MOST = 2**31 - 1  #: sensors of a robot, and things that a sensor reports
Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int32]
Bools = npt.NDArray[np.bool_]
Sensor = TypeVar("Sensor")


class _Views:
    """Creates arrays on first use and returns the same objects afterwards."""

    def __init__(self) -> None:
        self._views: dict[str, npt.NDArray[Any]] = {}

    def _view(self, name: str, make: Callable[[], Any]) -> npt.NDArray[Any]:
        view = self._views.get(name)
        if view is None:
            view = self._views[name] = make()
        return view


class Ranger(_Views):
    """One ranger of each robot: all samples of all its sensors, sensor after sensor.

    Arrays are live, like those of the fleet: shape (n, samples) for the n robots of a fleet,
    (worlds, n, samples) for a batch. `samples` is the maximum over all robots; shorter rows are padded with
    NaN. Reading an array subscribes to the rangers, which makes them measure. NaN: not measured yet, or the
    robot is gone or has no such ranger.
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
        """Ranges, metres; the sensor's maximum range where nothing was hit. Sample 0 is the rightmost."""
        return self._array("ranges")

    @property
    def intensities(self) -> Floats:
        """The ranger_return of the model that was hit; 0: nothing was hit."""
        return self._array("intensities")

    @property
    def time(self) -> Floats:
        """World time of each ranger's last update, seconds: shape (n,). NaN: no update yet.

        The readings were taken at the beginning of the step that ended at that time; see Fleet.sensed_pose.
        """
        return self._array("time")

    @property
    def bearings(self) -> Floats:
        """Direction of each ray relative to the robot's heading: radians, -pi to pi, counter-clockwise."""
        return self._array("bearings")

    @property
    def origins(self) -> Floats:
        """Origin of each ray, x and y in the robot's frame: metres, shape (..., samples, 2)."""
        return self._array("origins")


class _Detections(_Views):
    """Common arrays of Fiducials and Blobs: the number of detections and the first few of them."""

    def __init__(self, make: Callable[[str], object]) -> None:
        super().__init__()
        self._make = make
        self._array("count")  # raises GoneError if there is no such sensor

    def _array(self, what: str) -> npt.NDArray[Any]:
        return self._view(what, lambda: self._make(what))

    @property
    def count(self) -> Integers:
        """Number of detections of each robot, shape (n,); it can be larger than `most`."""
        return self._array("count")

    @property
    def range(self) -> Floats:
        """Metres: from the origin of the finder to that of the fiducial, or the mean range of a blob."""
        return self._array("range")

    @property
    def time(self) -> Floats:
        """World time of each sensor's last update, seconds: shape (n,). NaN: no update yet."""
        return self._array("time")


class Fiducials(_Detections):
    """One fiducial finder of each robot: the first `most` fiducials that it sees, in the order of creation.

    Arrays are live: shape (n, most), or (worlds, n, most) for a batch. Unused entries are NaN, and 0 in `id`.
    """

    @property
    def id(self) -> Integers:
        """The fiducial_return of each fiducial; 0 if it is too far away to be read."""
        return self._array("id")

    @property
    def bearing(self) -> Floats:
        """Direction of each fiducial relative to the finder's heading, radians."""
        return self._array("bearing")

    @property
    def heading(self) -> Floats:
        """Heading of each fiducial relative to the finder's heading, radians."""
        return self._array("heading")


class Blobs(_Detections):
    """One blobfinder of each robot: the first `most` blobs that it sees, from right to left in the image.

    Arrays are live: shape (n, most, ...), or (worlds, n, most, ...) for a batch. Unused entries are NaN, and 0
    in `box`.
    """

    @property
    def color(self) -> Floats:
        """Red, green, blue and opacity, each 0 to 1: shape (n, most, 4)."""
        return self._array("color")

    @property
    def box(self) -> Integers:
        """Bounding box: left, top, right and bottom in pixels from the top left corner; shape (n, most, 4)."""
        return self._array("box")


class Camera(_Views):
    """One camera of each robot.

    Arrays are live: shape (n, height, width, ...), or (worlds, n, height, width, ...) for a batch, the top row
    first. Width and height are the maxima over all robots; a smaller image is in the top left corner. Reading
    an array subscribes to the cameras, which makes them take images.
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
        """Red, green and blue, 0 to 255: shape (n, height, width, 3). All 0: no image yet."""
        return self._array("color")

    @property
    def depth(self) -> npt.NDArray[np.float32]:
        """Depth along the viewing direction, metres: shape (n, height, width).

        The far clipping distance where nothing is seen. NaN: no image yet.
        """
        return self._array("depth")

    @property
    def time(self) -> Floats:
        """World time of each camera's last update, seconds: shape (n,). NaN: no update yet."""
        return self._array("time")


class Crowd(_Views):
    """The arrays of fleets and batches. Shapes are those of a fleet; a batch has an axis for worlds in front."""

    def __init__(self, crowd: _core.Crowd) -> None:
        super().__init__()
        self._crowd = crowd
        self._sensors: dict[tuple[str, int, int], Any] = {}

    def __len__(self) -> int:
        return self._crowd.size

    @property
    def pose(self) -> Floats:
        """x, y (metres) and heading (radians) in the world frame: shape (n, 3). NaN: the robot is gone.

        This is the current pose, after the moves of the last step. Readings of sensors are taken at the
        beginning of a step and belong to `sensed_pose`.
        """
        return self._view("pose", self._crowd.pose)

    @property
    def sensed_pose(self) -> Floats:
        """Poses of the robots when their newest readings were taken: x, y, heading; shape (n, 3).

        They are in the world frame. A step senses first and then moves: this is the pose at the beginning of
        the last step in which the robot or one of its sensors updated. `estimate` and the newest readings
        belong to the same instant. Reading this array subscribes to the robots. NaN: the robot is gone.
        """
        return self._view("sensed_pose", self._crowd.sensed_pose)

    @property
    def sensed_time(self) -> Floats:
        """World time that belongs to `sensed_pose` and `estimate`, seconds: shape (n,).

        A sensor with the same `time` has taken its readings at that instant. 0: no update yet. NaN: the robot
        is gone.
        """
        return self._view("sensed_time", self._crowd.sensed_time)

    @property
    def velocity(self) -> Floats:
        """Current set speeds: forwards, to the left (m/s) and turning (rad/s), shape (n, 3).

        A stall does not change them. NaN: the robot is gone.
        """
        return self._view("velocity", self._crowd.velocity)

    @property
    def actual_velocity(self) -> Floats:
        """Speeds of the last step's moves: forwards, to the left (m/s) and turning (rad/s), shape (n, 3).

        0: the robot was blocked. NaN: the robot is gone.
        """
        return self._view("actual_velocity", self._crowd.actual_velocity)

    @property
    def estimate(self) -> Floats:
        """Estimated poses: x, y (metres) and heading (radians), shape (n, 3).

        They are in the frame of each robot's odometry, or in the world frame with the localization "gps". An
        estimate is updated whenever the robot or one of its sensors updates, and belongs to the same instant
        as `sensed_pose`, which it equals with "gps". Reading this array subscribes to the robots. NaN: the
        robot is gone.
        """
        return self._view("estimate", self._crowd.estimate)

    @property
    def estimated_velocity(self) -> Floats:
        """`actual_velocity` with the errors of the odometry; exact with "gps". Shape (n, 3)."""
        return self._view("estimated_velocity", self._crowd.estimated_velocity)

    @property
    def cmd(self) -> Floats:
        """Writable array of commanded speeds: forwards, to the left (m/s), turning (rad/s); shape (n, 3).

        For robots with car steering, the third number is the steering angle (rad). From the first access to
        this array on, the commands are applied before each step; initially all are 0. A command overrides the
        one that a controller gave in the step before. A row with a NaN is skipped: that robot obeys its
        controller or keeps its last command.
        """
        return self._view("cmd", self._crowd.commands)

    @property
    def stalled(self) -> Bools:
        """True if the robot was blocked at its last attempt to move: shape (n,)."""
        return self._view("stalled", self._crowd.stalled)

    @property
    def energy(self) -> Floats:
        """Energy stored in the power pack, joules: shape (n,). NaN: the robot has none."""
        return self._view("energy", self._crowd.energy)

    def ranger(self, index: int = 0) -> Ranger:
        """Returns ranger number `index` (from 0, in the order of creation) of each robot.

        Raises:
            GoneError: no robot has such a ranger.
        """
        return self._sensor("ranger", index, 0, lambda: Ranger(self._crowd, index))

    def fiducials(self, index: int = 0, most: int = 8) -> Fiducials:
        """Returns fiducial finder number `index` of each robot, with at most `most` fiducials per robot.

        Raises:
            GoneError: no robot has such a finder.
        """
        return self._sensor("fiducials", index, most, lambda: Fiducials(
            lambda what: self._crowd.fiducials(index, most, what)))

    def blobs(self, index: int = 0, most: int = 8) -> Blobs:
        """Returns blobfinder number `index` of each robot, with at most `most` blobs per robot.

        Raises:
            GoneError: no robot has such a blobfinder.
        """
        return self._sensor("blobs", index, most, lambda: Blobs(
            lambda what: self._crowd.blobs(index, most, what)))

    def camera(self, index: int = 0) -> Camera:
        """Returns camera number `index` of each robot. Raises GoneError if no robot has such a camera."""
        return self._sensor("camera", index, 0, lambda: Camera(self._crowd, index))

    def bumper(self, index: int = 0) -> Bools:
        """Returns the contacts of bumper number `index`: True for each line that touches something.

        The array is live: shape (n, lines).

        Raises:
            GoneError: no robot has such a bumper.
        """
        number = _checks.integer(index, "index", 0, MOST)
        return self._view(f"bumper {number}", lambda: self._crowd.bumper(number))

    def _sensor(self, kind: str, index: int, most: int, make: Callable[[], Sensor]) -> Sensor:
        key = kind, _checks.integer(index, "index", 0, MOST), _checks.integer(most, "most", 0, MOST)
        known: Sensor | None = self._sensors.get(key)
        if known is None:
            known = self._sensors[key] = make()
        return known


class Fleet(Crowd):
    """Robots of a world, in a fixed order, with live arrays of their state and readings.

    Each array has a row per robot. An array is created on first use, and is then updated after each call that
    changes the world. All arrays except for `cmd` are read-only. They stay valid when models are created or
    deleted and when the world is reset or restored: the row of a deleted robot is NaN, and has values again
    if the robot comes back. When the world is closed, arrays keep their last values.
    """

    def __init__(self, world: World, crowd: _core.Crowd, ids: tuple[int, ...],
                 names: tuple[str, ...]) -> None:
        super().__init__(crowd)
        self.world = world  #: the world of the robots
        self.ids = ids  #: ids of the robots' models
        self.names = names  #: names of the robots when the fleet was made

    def teleport(self, pose: npt.ArrayLike, which: npt.ArrayLike | None = None) -> None:
        """Moves robots to other poses, without collision tests.

        Args:
            pose: x, y (metres) and heading (radians): shape (m, 3) for m selected robots, or (3,) for all.
            which: a mask of shape (n,), or indices of the robots to move; None: all.

        Raises:
            ValueError: a pose is not finite, or a shape is wrong.
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
