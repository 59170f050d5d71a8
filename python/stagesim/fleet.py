# SPDX-License-Identifier: GPL-2.0-or-later
"""Arrays of all robots at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _checks, _core
from .device_array import DeviceArray, wrapped

if TYPE_CHECKING:
    from .world import World

MAX_BYTES = 64  #: of a message
MOST = 2**31 - 1  #: sensors of a robot, and things that a sensor reports
Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int32]
Bools = npt.NDArray[np.bool_]


class _Views:
    """Creates arrays on first use and returns the same objects afterwards."""

    def __init__(self) -> None:
        self._views: dict[str, npt.NDArray[Any]] = {}

    def _view(self, name: str, make: Callable[[], Any]) -> npt.NDArray[Any]:
        view = self._views.get(name)
        if view is None:
            view = self._views[name] = wrapped(make())
        return view


class Reading(NamedTuple):
    """One reading of a type of sensor; see sensor_types()."""

    name: str
    dtype: str
    unit: str
    description: str
    is_list: bool  #: one row per detection, of which an array holds a maximum number


class Messages(NamedTuple):
    """Messages that robots have received, as arrays with an element per message: see Fleet.messages()."""

    receiver: Integers  #: index of the robot in the fleet; ascending
    sender: Integers  #: index of the robot that sent it; -1: it is gone or not in the fleet
    range: Floats  #: measured distance of the sender's radio, metres
    bearing: Floats  #: its measured direction relative to the receiving radio's heading, radians
    sent: Floats  #: world time when it was sent, seconds
    size: Integers  #: number of bytes
    payload: npt.NDArray[np.uint8]  #: the bytes and zeros behind them: shape (k, 64)


def sensor_types() -> dict[str, tuple[Reading, ...]]:
    """Returns what the types of sensors measure, including types from plug-ins that have been loaded."""
    return {name: tuple(Reading(*reading) for reading in readings) for name, readings in _core.readings().items()}


class Sensor:
    """One sensor of each robot. Each reading of its type is an attribute: an array, such as `ranges` of a ranger.

    Arrays are live, like those of the fleet: shape (n, ...) for the n robots of a fleet, (worlds, n, ...) for a
    batch. Axes are as long as those of the largest sensor; a list of detections has `most` rows per robot. Unused
    elements, and those of robots that are gone, have no such sensor or have no readings yet, are NaN, 0 or False.
    Getting a sensor subscribes to it, which makes it measure.

    `time` is the world time of each sensor's last update, seconds: shape (n,). NaN: no update yet. The readings
    were taken at the beginning of the step that ended at that time; see Fleet.sensed_pose.
    """

    def __init__(self, readings: tuple[Reading, ...], view: Callable[[str], npt.NDArray[Any]]) -> None:
        self.readings = readings  #: names, types and units of the arrays
        self._view = view
        self.time: Floats = wrapped(view("time"))  # raises GoneError if there is no such sensor

    def __getattr__(self, name: str) -> npt.NDArray[Any]:
        if name.startswith("_") or all(name != reading.name for reading in self.readings):
            raise AttributeError(f"found {name!r}, expected a reading of the sensor", name=name, obj=self)
        view = self.__dict__[name] = wrapped(self._view(name))
        return view

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *(reading.name for reading in self.readings)})


class Crowd(_Views):
    """The arrays of fleets and batches. Shapes are those of a fleet; a batch has an axis for worlds in front."""

    def __init__(self, crowd: _core.Crowd) -> None:
        super().__init__()
        self._crowd = crowd
        self._sensors: dict[tuple[str, int, int], Sensor] = {}

    def __len__(self) -> int:
        return self._crowd.size

    def _body(self, name: str) -> Floats:
        view = self._views.get(name)
        return self._view(name, lambda: self._crowd.body(name)) if view is None else view

    def _matrices(self, name: str) -> Floats:
        """A view of 3 x 3 matrices, whose elements are in the last axis of the array."""
        def make() -> Floats:
            body = self._crowd.body(name)
            return body.reshape(*body.shape[:-1], 3, 3)

        return self._view(name, make)

    @property
    def pose(self) -> Floats:
        """x, y (metres) and heading (radians) in the world frame: shape (n, 3). NaN: the robot is gone.

        This is the current pose, after the moves of the last step. Readings of sensors are taken at the
        beginning of a step and belong to `sensed_pose`.
        """
        return self._body("pose")

    @property
    def sensed_pose(self) -> Floats:
        """Poses of the robots when their newest readings were taken: x, y, heading; shape (n, 3).

        They are in the world frame. A step senses first and then moves: this is the pose at the beginning of
        the last step in which the robot or one of its sensors updated. `estimate` and the newest readings
        belong to the same instant. Reading this array subscribes to the robots. NaN: the robot is gone.
        """
        return self._body("sensed_pose")

    @property
    def sensed_time(self) -> Floats:
        """World time that belongs to `sensed_pose` and `estimate`, seconds: shape (n,).

        A sensor with the same `time` has taken its readings at that instant. 0: no update yet. NaN: the robot
        is gone.
        """
        return self._body("sensed_time")

    @property
    def velocity(self) -> Floats:
        """Current set speeds: forwards, to the left (m/s) and turning (rad/s), shape (n, 3).

        A stall does not change them. NaN: the robot is gone.
        """
        return self._body("velocity")

    @property
    def actual_velocity(self) -> Floats:
        """Speeds of the last step's moves: forwards, to the left (m/s) and turning (rad/s), shape (n, 3).

        0: the robot was blocked. NaN: the robot is gone.
        """
        return self._body("actual_velocity")

    @property
    def estimate(self) -> Floats:
        """Estimated poses: x, y (metres) and heading (radians), shape (n, 3).

        They are in the frame of each robot's odometry, or in the world frame with the localization "gps". An
        estimate is updated whenever the robot or one of its sensors updates, and belongs to the same instant
        as `sensed_pose`, which it equals with "gps". Reading this array subscribes to the robots. NaN: the
        robot is gone.
        """
        return self._body("estimate")

    @property
    def estimated_velocity(self) -> Floats:
        """Velocities of the wheels with the errors of the odometry; `actual_velocity` with "gps". Shape (n, 3)."""
        return self._body("estimated_velocity")

    @property
    def estimate_covariance(self) -> Floats:
        """Covariances of `estimate` over x, y (metres) and heading (radians): shape (n, 3, 3).

        They are those of the random errors that `odom_noise` causes, in the frame of the estimate; 0 without that
        property and with "gps". The constant factors `odom_error` are not part of it. Reading this array subscribes
        to the robots. NaN: the robot is gone.
        """
        return self._matrices("estimate_covariance")

    @property
    def estimated_velocity_covariance(self) -> Floats:
        """Covariances of `estimated_velocity`, in (m/s, m/s, rad/s)², like `estimate_covariance`: shape (n, 3, 3)."""
        return self._matrices("estimated_velocity_covariance")

    @property
    def cmd(self) -> Floats:
        """Writable array of commanded speeds: forwards, to the left (m/s), turning (rad/s); shape (n, 3).

        For robots with car steering, the third number is the steering angle (rad), or the turn rate with
        `car_command "turn"`. From the first access to this array on, the commands are applied before each step;
        initially all are 0. A command overrides the one that a controller gave in the step before. A row with a NaN
        is skipped: that robot obeys its controller or keeps its last command.
        """
        return self._view("cmd", self._crowd.commands)

    @property
    def stalled(self) -> Bools:
        """True if the robot was blocked at its last attempt to move: shape (n,)."""
        return self._view("stalled", self._crowd.stalled)

    @property
    def energy(self) -> Floats:
        """Energy stored in the power pack, joules: shape (n,). NaN: the robot has none."""
        return self._body("energy")

    def sensor(self, type: str, index: int = 0, most: int = 8) -> Sensor:
        """Returns sensor number `index` (from 0, in the order of creation) of a type of each robot.

        Args:
            type: the type of the sensor: see sensor_types(). Types derived from it count as well.
            index: the number of the sensor on its robot.
            most: max number of detections per robot, for sensors that report lists.

        Raises:
            GoneError: no robot has such a sensor.
            ValueError: there is no such type, or a number is out of range.
        """
        key = type, _checks.integer(index, "index", 0, MOST), _checks.integer(most, "most", 0, MOST)
        found = self._sensors.get(key)
        if found is None:
            found = self._sensors[key] = self._find_sensor(*key)
        return found

    def _find_sensor(self, type: str, index: int, most: int) -> Sensor:
        types = sensor_types()
        if type not in types:
            raise ValueError(f"found {type!r}, expected a type of sensor: {', '.join(types)}")
        if most > 0 and not any(reading.is_list for reading in types[type]):
            return self.sensor(type, index, 0)
        crowd = self._crowd  # the sensor must not refer to this object, which refers to it
        return Sensor(types[type], lambda name: crowd.sensor(type, index, most, name))

    def ranger(self, index: int = 0) -> Sensor:
        """Returns `sensor("ranger", index)`."""
        return self.sensor("ranger", index)

    def fiducials(self, index: int = 0, most: int = 8) -> Sensor:
        """Returns `sensor("fiducial", index, most)`."""
        return self.sensor("fiducial", index, most)

    def blobs(self, index: int = 0, most: int = 8) -> Sensor:
        """Returns `sensor("blobfinder", index, most)`."""
        return self.sensor("blobfinder", index, most)

    def camera(self, index: int = 0) -> Sensor:
        """Returns `sensor("camera", index)`."""
        return self.sensor("camera", index)

    def bumper(self, index: int = 0) -> Bools:
        """Returns `sensor("bumper", index).hit`."""
        return self.sensor("bumper", index).hit

    def array(self, name: str) -> npt.NDArray[Any]:
        """Returns an array by its name.

        Args:
            name: "pose" and the like, or "TYPE.READING" of sensor 0, or "TYPE:INDEX.READING", such as
                "ranger:1.ranges".

        Raises:
            ValueError, GoneError: there is no such array.
        """
        sensor, dot, reading = name.partition(".")
        if not dot and isinstance(getattr(type(self), name, None), property):
            view: Any = getattr(self, name)
        else:
            kind, _, index = sensor.partition(":")
            view = getattr(self.sensor(kind, int(index or 0)), reading, None)
        if not isinstance(view, (np.ndarray, DeviceArray)):
            raise ValueError(f"found {name!r}, expected the name of an array")
        return view


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

    def send(self, payload: bytes | npt.ArrayLike, which: npt.ArrayLike | None = None, index: int = 0) -> None:
        """Sends a message by a radio of each robot, which radios of other robots receive in the next step.

        Args:
            payload: up to 64 bytes: uint8 of shape (m, bytes) for m selected robots, or (bytes,) or bytes for
                all of them. Arrays of other types are sent by `numbers.view(numpy.uint8)`.
            which: a mask of shape (n,), or indices of the robots that send; None: all.
            index: the number of the radio on its robot.

        Robots that are gone or have no such radio send nothing. See messages().

        Raises:
            GoneError: no robot has such a radio.
            TypeError: the payload is not of bytes.
            ValueError: there are more than 64 bytes, or a shape is wrong.
        """
        index = _checks.integer(index, "index", 0, MOST)
        data = np.frombuffer(payload, np.uint8) if isinstance(payload, bytes) else np.asarray(payload)
        if data.dtype != np.uint8:
            raise TypeError(f"found a payload of {data.dtype}, expected bytes: use numbers.view(numpy.uint8)")
        if data.ndim not in (1, 2):
            raise ValueError(f"found a payload of shape {data.shape}, expected (robots, bytes)")
        if data.shape[-1] > MAX_BYTES:
            raise ValueError(f"found a message of {data.shape[-1]} bytes, expected at most {MAX_BYTES}; "
                             "send it in several parts")
        chosen = np.arange(len(self)) if which is None else np.arange(len(self))[np.asarray(which)]
        if data.ndim == 2 and len(data) != len(chosen):
            raise ValueError(f"found {len(data)} messages, expected one for each of {len(chosen)} robots")
        payloads = np.zeros((len(self), data.shape[-1]), np.uint8)
        payloads[chosen] = data
        mask = np.zeros(len(self), bool)
        mask[chosen] = True
        self.world._core.send(self._crowd, index, payloads, mask)

    def messages(self, index: int = 0) -> Messages:
        """Returns what a radio of each robot has received until its last update, as new arrays.

        Args:
            index: the number of the radio on its robot.

        A message is reported once: those of a robot are replaced in each update of its radio. They are ordered by
        robot, then by step, then by distance. Ranges and bearings belong to the poses at the beginning of the
        step of reception, usually `sensed_pose`. Calling this subscribes to the radios, so that they receive from
        then on. `sensor("radio")` has the same as live arrays.

        Raises:
            GoneError: no robot has such a radio.
        """
        return Messages(*self.world._core.messages(self._crowd, _checks.integer(index, "index", 0, MOST)))

    def switch_lights(self, on: npt.ArrayLike, which: npt.ArrayLike | None = None, index: int = 0) -> None:
        """Switches a light of each robot. Light sensors sense the change from the next step on.

        Args:
            on: truth values of shape (m,) for m selected robots, or one for all of them.
            which: a mask of shape (n,), or indices of the robots whose lights are switched; None: all.
            index: the number of the light on its robot, among its models of the types light and lightindicator.

        Robots that are gone or have no such light are skipped.

        Raises:
            GoneError: no robot has such a light.
            ValueError: a shape is wrong.
        """
        index = _checks.integer(index, "index", 0, MOST)
        values, mask = self._for_robots(np.asarray(on, bool), which, ())
        self.world._core.switch_lights(self._crowd, index, values, mask)

    def set_light_intensity(self, intensity: npt.ArrayLike, which: npt.ArrayLike | None = None, index: int = 0) -> None:
        """Sets the intensity of a light of each robot, at once like Model.intensity.

        Args:
            intensity: W/m2 at 1 m, 0 or more: shape (m,) for m selected robots, or one for all of them.
            which: a mask of shape (n,), or indices of the robots; None: all.
            index: the number of the light on its robot, as in switch_lights().

        Robots that are gone or have no such light are skipped.

        Raises:
            GoneError: no robot has such a light.
            TypeError: such a light is a lightindicator, whose intensity is that of the world file.
            ValueError: a shape or an intensity is wrong.
        """
        given = np.asarray(intensity, np.float64)
        if not (np.isfinite(given) & (given >= 0)).all():
            raise ValueError("found an intensity that is negative or not finite, expected 0 or more")
        values, mask = self._for_robots(given, which, ())
        self.world._core.set_lights(self._crowd, _checks.integer(index, "index", 0, MOST), values[:, None], mask)

    def set_light_color(self, color: npt.ArrayLike, which: npt.ArrayLike | None = None, index: int = 0) -> None:
        """Sets the colour of a light of each robot, like Model.color.

        Args:
            color: red, green, blue and opacity, each from 0 to 1: shape (m, 4) for m selected robots, or (4,) for all of
                them.
            which, index: as in set_light_intensity().

        Robots that are gone or have no such light are skipped.

        Raises:
            GoneError: no robot has such a light.
            ValueError: a shape or a number is wrong.
        """
        given = np.asarray(color, np.float64)
        if not ((given >= 0) & (given <= 1)).all():
            raise ValueError("found a part of a color outside of 0 to 1")
        values, mask = self._for_robots(given, which, (4,))
        self.world._core.set_lights(self._crowd, _checks.integer(index, "index", 0, MOST), values, mask)

    def _for_robots(self, given: npt.NDArray[Any], which: npt.ArrayLike | None,
                    each: tuple[int, ...]) -> tuple[npt.NDArray[Any], Bools]:
        """Values of all robots, each of this shape, from those of the selected ones, and a mask of these."""
        chosen = np.arange(len(self)) if which is None else np.arange(len(self))[np.asarray(which)]
        if given.shape not in (each, chosen.shape + each):
            raise ValueError(f"found values of shape {given.shape}, expected one for each of {len(chosen)} robots")
        values, mask = np.zeros((len(self), *each), given.dtype), np.zeros(len(self), bool)
        values[chosen], mask[chosen] = given, True
        return values, mask

    def light_intensity(self, index: int = 0) -> Floats:
        """Returns the intensity of light number `index` of each robot in W/m2 at 1 m, as a new array of shape (n,).

        Lights are counted as in switch_lights(). NaN: the robot is gone or has no such light.

        Raises:
            GoneError: no robot has such a light.
        """
        values = np.empty((len(self), 1))
        self.world._core.read_light_numbers(self._crowd, _checks.integer(index, "index", 0, MOST), values)
        return values[:, 0]

    def light_color(self, index: int = 0) -> Floats:
        """Returns red, green, blue and opacity of light number `index` of each robot, as a new array of shape (n, 4).

        It is the colour of a light that is on. NaN and errors are as in light_intensity().
        """
        values = np.empty((len(self), 4))
        self.world._core.read_light_numbers(self._crowd, _checks.integer(index, "index", 0, MOST), values)
        return values

    def lights(self, index: int = 0) -> Bools:
        """Returns which robots have a light number `index` that is on, as a new array of shape (n,).

        Lights are counted as in switch_lights().

        Raises:
            GoneError: no robot has such a light.
        """
        values = np.empty(len(self), bool)
        self.world._core.read_lights(self._crowd, _checks.integer(index, "index", 0, MOST), values)
        return values

    def __repr__(self) -> str:
        return f"<Fleet of {len(self)} robots>"
