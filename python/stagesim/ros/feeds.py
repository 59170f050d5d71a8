# SPDX-License-Identifier: GPL-2.0-or-later
"""The topics of robots: a feed for each topic.

A feed reads nothing from the world before its topic has a subscriber, because reading a sensor makes it work.
"""

from __future__ import annotations

import math
import sys
from array import array
from typing import Any, Callable

import numpy as np
from geometry_msgs.msg import Point
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, CameraInfo, Image, LaserScan, Range
from std_msgs.msg import (Bool, Float32MultiArray, Float64MultiArray, Int32MultiArray, MultiArrayDimension,
                          MultiArrayLayout, UInt8MultiArray)
from visualization_msgs.msg import Marker, MarkerArray

from .._core import Model, RangeSensor, View
from ..fleet import Fleet
from ..world import Contacts
from .covariance import OdometryErrors, in_space
from .messages import FLOAT_MARK, MARK, Array, Template, planar, stamp_of
from .topics import Limit

#: Max number of detections in a message of a fiducial finder or a blobfinder.
MAX_DETECTIONS = 32


class Feed:
    """The messages of one topic.

    Attributes:
        message: the type of the messages.
        topic: the name of the topic, with the robot's prefix.
        sensor: True: the data come from a sensor, so the parameter `sensor_qos` sets the reliability.
        interval: mean interval of messages, microseconds of simulated time; 0: one per step.
        model: the sensor's model; None: no single sensor.
        attached: True: the feed reads arrays of the world.
        active: True: the topic has subscribers.
        limit: the maximum rate, which depends on the kind of topic.
    """

    message: type = object
    sensor = True

    def __init__(self, topic: str, interval: int = 0) -> None:
        self.topic = topic
        self.interval = interval
        self.model: Model | None = None
        self.attached = False
        self.active = False
        self.publisher: Any = None
        self.limit = Limit("readings")

    def take_over(self, other: Feed) -> None:
        """Continues an earlier feed of the topic, with its publisher, subscribers and maximum rate."""
        self.limit, self.active = other.limit, other.active
        if other.attached:
            self.attach()

    def attach(self) -> None:
        """Starts reading the data from the world; further calls have no effect."""
        if not self.attached:
            self.attached = True
            self.connect()

    def connect(self) -> None:
        """Gets the arrays that the feed reads. Called once, by attach()."""

    def due(self, now: int, step: int) -> bool:
        """Returns whether there are new data at time `now`, after a step of duration `step` (both microseconds).

        Models update in the first step at or after each multiple of their interval.
        """
        return self.interval == 0 or now // self.interval != (now - step) // self.interval

    def when(self, now: int, step: int) -> int:
        """The time stamp of the data, microseconds."""
        if self.model is None or self.due(now, step):
            return now
        return round(self.model.last_update * 1e6) or now

    def make(self, stamp: Array) -> Any:
        """Returns a message, or its bytes, with that time stamp; None: no data yet."""
        raise NotImplementedError

    def send(self, now: int, step: int) -> None:
        """Publishes the data at time `now`, after a step of duration `step` (both microseconds)."""
        message = self.make(stamp_of(self.when(now, step)))
        if message is not None:
            self.publisher.publish(message)


class Bodies:
    """Poses, velocities and covariances of all robots in ROS's formats, computed once per step on demand.

    A step senses first and then moves. All values belong to the beginning of the last step in which the robot or
    one of its sensors updated, like the readings with the same stamp.

    Args:
        fleet: the robots.
        errors: the errors of their odometry.
    """

    def __init__(self, fleet: Fleet, errors: OdometryErrors) -> None:
        self._fleet, self._errors = fleet, errors
        self._known: dict[str, Any] = {}
        self._exact = in_space(np.zeros((len(fleet), 3, 3)))
        self._moved = False

    def forget(self, moved: bool = False) -> None:
        """Called when the world has changed. `moved`: a client has moved robots since the last step."""
        self._known.clear()
        self._moved = moved

    def estimate(self) -> Array:
        """Estimated poses as position and quaternion: shape (n, 7)."""
        return self._once("estimate", lambda: planar(self._fleet.estimate))

    def estimated_velocity(self) -> Array:
        """Estimated velocities forwards, to the left and turning: shape (n, 3)."""
        return self._fleet.estimated_velocity

    def truth(self) -> Array:
        """True poses as position and quaternion: shape (n, 7)."""
        return self._once("truth", lambda: planar(
            self._fleet.pose if self._moved else self._fleet.sensed_pose))

    def velocity(self) -> Array:
        """True velocities forwards, to the left and turning: shape (n, 3)."""
        return self._fleet.actual_velocity

    def times(self) -> Array:
        """Time stamps of poses and estimates, microseconds: shape (n,)."""
        return self._once("times", lambda: np.rint(self._fleet.sensed_time * 1e6).astype(np.int64))

    def covariance(self) -> tuple[Array, Array]:
        """Covariances of the estimated poses and velocities: shape (n, 36) each."""
        fleet = self._fleet
        return (self._once("pose", lambda: self._errors.pose(fleet.estimate_covariance)),
                self._once("twist", lambda: self._errors.twist(fleet.estimated_velocity,
                                                               fleet.estimated_velocity_covariance)))

    def contacts(self) -> Contacts:
        """The places where bodies touch now."""
        return self._once("contacts", self._fleet.world.contacts)

    def exact(self) -> tuple[Array, Array]:
        """Covariances of the true poses and velocities: shape (n, 36) each."""
        return self._exact, self._exact

    def _once(self, name: str, make: Callable[[], Any]) -> Any:
        known = self._known.get(name)
        if known is None:
            known = self._known[name] = make()
        return known


class BodyFeed(Feed):
    """A topic with the stamps of a robot's odometry."""

    sensor = False

    def __init__(self, topic: str, robot: int, bodies: Bodies) -> None:
        super().__init__(topic)
        self._robot, self._bodies = robot, bodies

    def due(self, now: int, step: int) -> bool:
        return bool(self._bodies.times()[self._robot] == now)

    def when(self, now: int, step: int) -> int:
        return int(self._bodies.times()[self._robot])


class OdometryFeed(BodyFeed):
    """The pose and the velocity of a robot.

    Args:
        poses, velocities: functions that return the values of all robots, see Bodies.
        covariances: a function that returns the covariances of poses and velocities of all robots.
        frame, child: frame of the pose, and frame of the velocity.
    """

    message = Odometry

    def __init__(self, topic: str, robot: int, bodies: Bodies, poses: Callable[[], Array],
                 velocities: Callable[[], Array], covariances: Callable[[], tuple[Array, Array]], frame: str,
                 child: str) -> None:
        super().__init__(topic, robot, bodies)
        self._poses, self._velocities, self._covariances = poses, velocities, covariances
        message = Odometry(child_frame_id=child)
        message.header.frame_id = frame
        message.pose.pose.position.x = MARK
        message.twist.twist.linear.x = 2 * MARK
        self._template = Template(message)
        pose, twist = self._template.doubles(MARK, 7 + 36), self._template.doubles(2 * MARK, 6 + 36)
        self._pose, self._pose_covariance = pose[:7], pose[7:]
        self._twist, self._twist_covariance = twist[:6], twist[6:]
        self._twist[0] = 0

    def make(self, stamp: Array) -> bytes:
        self._template.stamp(stamp)
        self._pose[:] = self._poses()[self._robot]
        x, y, turn = self._velocities()[self._robot]
        self._twist[0], self._twist[1], self._twist[5] = x, y, turn
        of_pose, of_twist = self._covariances()
        self._pose_covariance[:], self._twist_covariance[:] = of_pose[self._robot], of_twist[self._robot]
        return self._template.bytes()


class StallFeed(Feed):
    """True if an obstacle has blocked the last move of a robot."""

    message = Bool
    sensor = False

    def __init__(self, topic: str, robot: int, fleet: Fleet) -> None:
        super().__init__(topic)
        self._robot, self._fleet = robot, fleet

    def make(self, stamp: Array) -> Bool:
        return Bool(data=bool(self._fleet.stalled[self._robot]))


def rep117(readings: Array, least: float, most: float) -> Array:
    """Converts readings to REP 117: infinity from `most` on, minus infinity below `least`. NaN stays NaN."""
    return np.where(readings >= most, np.inf, np.where(readings < least, -np.inf, readings))


class Beams(Feed):
    """One sensor of a ranger: the samples [first, first + sensor.samples) of the ranger.

    `sources` returns the robot's rows of ranges and intensities. `by_rep117`: ranges follow REP 117; otherwise they
    are the maximum range where nothing is hit.
    """

    def __init__(self, topic: str, interval: int, sources: Callable[[], tuple[Array, Array]],
                 first: int, sensor: RangeSensor, by_rep117: bool) -> None:
        super().__init__(topic, interval)
        self._sources, self._by_rep117 = sources, by_rep117
        self._bounds = (sensor.min_range, sensor.range)
        self._duration = round(1e6 * sensor.time_increment * max(0, sensor.samples - 1))
        self._part = slice(first, first + sensor.samples)
        self._source = self._brightness = np.empty(0)

    def when(self, now: int, step: int) -> int:
        return max(0, super().when(now, step) - self._duration)  # of the first ray

    def connect(self) -> None:
        ranges, intensities = self._sources()
        self._source, self._brightness = ranges[self._part], intensities[self._part]

    def readings(self) -> Array:
        """The ranges to publish."""
        return rep117(self._source, *self._bounds) if self._by_rep117 else self._source

    def nothing_yet(self) -> bool:
        """True if the sensor has not measured yet."""
        return len(self._source) > 0 and np.isnan(self._source[0])


class ScanFeed(Beams):
    """A sensor of several rays as a LaserScan."""

    message = LaserScan

    def __init__(self, topic: str, interval: int, sources: Callable[[], tuple[Array, Array]],
                 first: int, sensor: RangeSensor, frame: str, by_rep117: bool) -> None:
        super().__init__(topic, interval, sources, first, sensor, by_rep117)
        count = sensor.samples
        half = sensor.fov / 2 if count > 1 else 0.0
        message = LaserScan(
            angle_min=-half, angle_max=half, angle_increment=2 * half / max(1, count - 1),
            time_increment=sensor.time_increment,
            scan_time=interval / 1e6, range_min=sensor.min_range, range_max=sensor.range,
            ranges=array("f", [FLOAT_MARK] * count), intensities=array("f", [2 * FLOAT_MARK] * count))
        message.header.frame_id = frame
        self._template = Template(message)
        self._ranges = self._template.floats(FLOAT_MARK, count)
        self._intensities = self._template.floats(2 * FLOAT_MARK, count)

    def make(self, stamp: Array) -> bytes | None:
        if self.nothing_yet():
            return None
        self._template.stamp(stamp)
        self._ranges[:] = self.readings()
        self._intensities[:] = self._brightness
        return self._template.bytes()


class RangeFeed(Beams):
    """A sensor of a single ray, such as a sonar, as a Range."""

    message = Range

    def __init__(self, topic: str, interval: int, sources: Callable[[], tuple[Array, Array]],
                 first: int, sensor: RangeSensor, frame: str, by_rep117: bool) -> None:
        super().__init__(topic, interval, sources, first, sensor, by_rep117)
        message = Range(radiation_type=Range.ULTRASOUND, field_of_view=sensor.fov,
                        min_range=sensor.min_range, max_range=sensor.range, range=FLOAT_MARK)
        message.header.frame_id = frame
        self._template = Template(message)
        self._range = self._template.floats(FLOAT_MARK, 1)

    def make(self, stamp: Array) -> bytes | None:
        if self.nothing_yet():
            return None
        self._template.stamp(stamp)
        self._range[:] = self.readings()
        return self._template.bytes()


class ImageFeed(Feed):
    """Colour or depth images of a camera, which `source` returns: shape (height, width, ...).

    `times` returns the time of its last picture, shape (1,); NaN: there is none. `by_rep117`: depths follow REP 117;
    otherwise they are the far clipping distance where nothing is seen.
    """

    message = Image

    def __init__(self, topic: str, interval: int, view: View, frame: str, encoding: str,
                 source: Callable[[], Array], times: Callable[[], Array], by_rep117: bool = False) -> None:
        super().__init__(topic, interval)
        self._get, self._get_time, self._by_rep117 = source, times, by_rep117 and encoding == "32FC1"
        self._bounds = (view.near, np.float32(view.far))
        self._source = self._time = np.empty(0)
        bytes_each = {"rgb8": 3, "32FC1": 4}[encoding]
        size = view.width * view.height * bytes_each
        message = Image(height=view.height, width=view.width, encoding=encoding,
                        is_bigendian=int(sys.byteorder == "big"), step=view.width * bytes_each,
                        data=array("B", bytes(size)))
        message.header.frame_id = frame
        self._template = Template(message)
        shape = (view.height, view.width) + ((3,) if encoding == "rgb8" else ())
        self._corner = (slice(view.height), slice(view.width))
        self._kind = np.dtype(np.uint8 if encoding == "rgb8" else np.float32)
        self._pixels = self._template.tail(self._kind, size // self._kind.itemsize).reshape(shape)

    def connect(self) -> None:
        self._source, self._time = self._get()[self._corner], self._get_time()

    def make(self, stamp: Array) -> bytes | None:
        if np.isnan(self._time).any():
            return None  # the camera has taken no picture yet
        self._template.stamp(stamp)
        self._pixels[...] = rep117(self._source, *self._bounds) if self._by_rep117 else self._source
        return self._template.bytes()


class CameraInfoFeed(Feed):
    """The intrinsic parameters of a camera, without distortion."""

    message = CameraInfo

    def __init__(self, topic: str, interval: int, view: View, frame: str) -> None:
        super().__init__(topic, interval)
        x, y = view.width / 2, view.height / 2
        fx, fy = x / np.tan(view.fov / 2), y / np.tan(view.vertical_fov / 2)
        message = CameraInfo(
            height=view.height, width=view.width, distortion_model="plumb_bob", d=[0.0] * 5,
            k=[fx, 0.0, x, 0.0, fy, y, 0.0, 0.0, 1.0], r=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p=[fx, 0.0, x, 0.0, 0.0, fy, y, 0.0, 0.0, 0.0, 1.0, 0.0])
        message.header.frame_id = frame
        self._template = Template(message)

    def make(self, stamp: Array) -> bytes:
        self._template.stamp(stamp)
        return self._template.bytes()


class DetectionsFeed(Feed):
    """The detections of a finder as markers; the first marker deletes those of the message before."""

    message = MarkerArray

    def __init__(self, topic: str, interval: int, robot: int, sights: Callable[[], Any],
                 frame: str) -> None:
        super().__init__(topic, interval)
        self._robot, self._get, self._frame = robot, sights, frame
        self._sights: Any = None

    def connect(self) -> None:
        self._sights = self._get()

    def make(self, stamp: Array) -> MarkerArray:
        count = min(int(self._sights.count[self._robot]), MAX_DETECTIONS)
        return MarkerArray(markers=[self._marker(stamp, -1, Marker.DELETEALL)] +
                           [self._seen(stamp, i) for i in range(count)])

    def _marker(self, stamp: Array, number: int, action: int = Marker.ADD) -> Marker:
        marker = Marker(ns=self.topic, id=max(0, number), action=action)
        marker.header.frame_id = self._frame
        marker.header.stamp.sec, marker.header.stamp.nanosec = int(stamp[0]), int(stamp[1])
        marker.pose.orientation.w = 1.0
        marker.color.a = 1.0
        return marker

    def _seen(self, stamp: Array, number: int) -> Marker:
        raise NotImplementedError


class FiducialsFeed(DetectionsFeed):
    """An arrow for each fiducial, from its position along its heading, with its id as text."""

    def _seen(self, stamp: Array, number: int) -> Marker:
        seen, at = self._sights, (self._robot, number)
        marker = self._marker(stamp, number)
        marker.type = Marker.ARROW
        marker.text = str(seen.id[at])
        marker.pose.position.x = float(seen.range[at] * np.cos(seen.bearing[at]))
        marker.pose.position.y = float(seen.range[at] * np.sin(seen.bearing[at]))
        marker.pose.orientation.z = float(np.sin(seen.heading[at] / 2))
        marker.pose.orientation.w = float(np.cos(seen.heading[at] / 2))
        marker.scale.x, marker.scale.y, marker.scale.z = 0.4, 0.06, 0.06
        marker.color.g = 1.0
        return marker


class BlobsFeed(DetectionsFeed):
    """A sphere for each blob, in its colour; `points` are the top left and bottom right of its box in pixels."""

    def __init__(self, topic: str, interval: int, robot: int, sights: Callable[[], Any], frame: str,
                 view: View) -> None:
        super().__init__(topic, interval, robot, sights, frame)
        self._view = view

    def _seen(self, stamp: Array, number: int) -> Marker:
        seen, at, view = self._sights, (self._robot, number), self._view
        left, top, right, bottom = (float(side) for side in seen.box[at])
        bearing = view.pan + view.fov * (0.5 - (left + right) / 2 / max(1, view.width - 1))
        distance = float(seen.range[at])
        marker = self._marker(stamp, number)
        marker.type = Marker.SPHERE
        marker.points = [Point(x=left, y=top), Point(x=right, y=bottom)]
        marker.pose.position.x = float(distance * np.cos(bearing))
        marker.pose.position.y = float(distance * np.sin(bearing))
        width = max(0.05, distance * view.fov * (right - left + 1) / max(1, view.width))
        marker.scale.x = marker.scale.y = marker.scale.z = width
        color = marker.color
        color.r, color.g, color.b, color.a = (float(share) for share in seen.color[at])
        return marker


class ReadingFeed(Feed):
    """A reading of a sensor as a plain array: the row of a robot, which `source` returns; bools are 0 or 1."""

    MESSAGES = {"bool": UInt8MultiArray, "uint8": UInt8MultiArray, "int32": Int32MultiArray,
                "float32": Float32MultiArray, "float64": Float64MultiArray}

    def __init__(self, topic: str, interval: int, dtype: str, source: Callable[[], Array]) -> None:
        super().__init__(topic, interval)
        self.message = self.MESSAGES[dtype]
        self._get = source
        self._source = np.empty(0)

    def connect(self) -> None:
        self._source = self._get()

    def make(self, stamp: Array) -> Any:
        row = self._source
        code = "B" if row.dtype == bool else row.dtype.char
        sizes = row.shape if row.ndim > 1 else ()  # one axis needs no layout
        dims = [MultiArrayDimension(label=str(axis), size=size, stride=math.prod(sizes[axis:]))
                for axis, size in enumerate(sizes)]
        return self.message(layout=MultiArrayLayout(dim=dims), data=array(code, row.tobytes()))


class BatteryFeed(Feed):
    """The state of charge of a robot's power pack. Voltages are NaN, because Stage only counts joules."""

    message = BatteryState
    sensor = False

    def __init__(self, topic: str, robot: int, fleet: Fleet, capacity: float) -> None:
        super().__init__(topic)
        self._robot, self._fleet, self._capacity = robot, fleet, capacity
        self._before = np.nan
        nan = float("nan")
        self._message = BatteryState(
            voltage=nan, temperature=nan, current=nan, charge=nan, capacity=nan, design_capacity=nan,
            present=True, power_supply_status=BatteryState.POWER_SUPPLY_STATUS_UNKNOWN)

    def take_over(self, other: Feed) -> None:
        super().take_over(other)
        self._before = getattr(other, "_before", np.nan)

    def make(self, stamp: Array) -> BatteryState:
        stored = float(self._fleet.energy[self._robot])
        message = self._message
        message.header.stamp.sec, message.header.stamp.nanosec = int(stamp[0]), int(stamp[1])
        # Stage represents an infinite supply by a negative amount; it is always full.
        infinite = stored < 0 or not np.isfinite(stored)
        message.percentage = 1.0 if infinite else stored / self._capacity if self._capacity > 0 else 0.0
        message.power_supply_status = self._status(stored, infinite)
        self._before = stored
        return message

    def _status(self, stored: float, infinite: bool) -> int:
        """The status, by the change since the message before."""
        if infinite or stored >= self._capacity:
            return BatteryState.POWER_SUPPLY_STATUS_FULL
        if stored > self._before:
            return BatteryState.POWER_SUPPLY_STATUS_CHARGING
        if stored < self._before:
            return BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
        return BatteryState.POWER_SUPPLY_STATUS_NOT_CHARGING
