# SPDX-License-Identifier: GPL-2.0-or-later
"""The topics and frames of each robot of a world."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Callable, Iterator, Sequence

import numpy as np

from .._core import Model, RangeSensor
from ..fleet import Fleet, Reading, sensor_types
from ..world import World
from .feeds import (MAX_DETECTIONS, BatteryFeed, BlobsFeed, Bodies, CameraInfoFeed, Feed, FiducialsFeed, ImageFeed,
                    OdometryFeed, RangeFeed, ReadingFeed, ScanFeed, StallFeed)
from .imu import ImuErrors, ImuFeed, ImuNoise
from .motion import JointsFeed, Motion, TicksFeed
from .neighbours import ContactsFeed, RadioFeed
from .names import (BASE_FRAME, FOOTPRINT_FRAME, MAP_FRAME, ODOMETRY_FRAME, ODOMETRY_TOPIC, SCAN_TOPIC, SCHEMES,
                    NamingScheme, joined, ros_name, sensor_name)


@dataclass(frozen=True)
class Look:
    """The parameters of the node that determine topics and frames.

    Attributes:
        scheme: the naming scheme.
        enforce_prefixes: True: a single robot has a prefix, too.
        odom, base, footprint, map: names of frames.
        single_beams: sensors of one ray are published as "scan", as "range" or not ("none").
        by_rep117: True: ranges and depths follow REP 117; False: they are published as Stage has them.
        plain_frames: True: messages name a robot's frames without its prefix, as its own /NAME/tf does.
        ticks: number of ticks that encoders count in a turn of a wheel.
        imu: errors of inertial measurement units.
    """

    scheme: NamingScheme = SCHEMES["stage_ros2"]
    enforce_prefixes: bool = False
    odom: str = ODOMETRY_FRAME
    base: str = BASE_FRAME
    footprint: str = FOOTPRINT_FRAME
    map: str = MAP_FRAME
    single_beams: str = "scan"
    by_rep117: bool = True
    plain_frames: bool = False
    ticks: int = 1000
    imu: ImuErrors = ImuErrors()

    def frame(self, prefix: str, name: str) -> str:
        """The name in messages of a frame of the robot with that prefix."""
        return joined("" if self.plain_frames else prefix, name)


Place = tuple[float, float, float, float]  #: x, y, z (metres) and heading (radians)


@dataclass(frozen=True)
class Joint:
    """A frame that moves on its robot: an actuator, or a sensor that another robot carries.

    Attributes:
        parent, child: names of frames, without the robot's prefix.
        robot, sensor: models; the actuator or sensor stands on the robot or an actuator, with others between them.
        inner: the pose of the frame on the sensor.
        pan, tilt: how it is turned there, radians; positive tilts look down.
    """

    parent: str
    child: str
    robot: Model
    sensor: Model
    inner: Place
    pan: float
    tilt: float

    def pose(self) -> np.ndarray:
        """Position and quaternion in the parent frame at the instant of the newest readings: shape (7,)."""
        place = relative(self.sensor.sensed_pose_in_tree, self.robot.sensed_pose_in_tree)
        return spatial(composed(place, self.inner), self.pan, self.tilt)


@dataclass
class Robot:
    """A robot in ROS.

    Attributes:
        model: its model in the world.
        prefix: prefix of its topics and frames; may be empty.
        feeds: its topics.
        mounts: its static frames: parent and child without the prefix, and position and quaternion, shape (7,).
        joints: its frames that move on it.
        actuators: those of them that are actuators, each after the one that carries it.
    """

    model: Model
    prefix: str
    feeds: list[Feed] = field(default_factory=list)
    mounts: list[tuple[str, str, np.ndarray]] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    actuators: list[Joint] = field(default_factory=list)


def make_robots(world: World, fleet: Fleet, bodies: Bodies, motion: Motion, look: Look,
                names: Sequence[str]) -> list[Robot]:
    """Makes all robots of the fleet, with their feeds and frames; `names` are their prefixes."""
    models = {model.id: model for model in world.models}  # by id, because names may be ambiguous
    return [_Maker(world, fleet, bodies, motion, look, i, Robot(models[fleet.ids[i]], names[i])).robot
            for i in range(len(fleet))]


def tree(model: Model) -> Iterator[Model]:
    """Yields the model and all its descendants, in the order in which fleets number sensors."""
    yield model
    for child in model.children:
        yield from tree(child)


def sensors_of(model: Model) -> list[RangeSensor] | None:
    """The sensors of a ranger, including types from plug-ins; None if the model is no ranger."""
    try:
        return model.sensors
    except TypeError:
        return None


class _Maker:
    """Makes the feeds and frames of one robot."""

    def __init__(self, world: World, fleet: Fleet, bodies: Bodies, motion: Motion, look: Look, number: int,
                 robot: Robot) -> None:
        self._fleet, self._look, self._number = fleet, look, number
        self._step = round(world.dt * 1e6)
        self.robot = robot
        self._links = {robot.model.id: look.base}  # frames that do not move on their model
        self._add_odometry(bodies)
        self._add_actuators()
        self._add_motion(bodies, motion)
        kinds: dict[str, list[Model]] = {}
        for model in tree(self.robot.model):
            kind = "ranger" if sensors_of(model) is not None else model.sensor_type or model.type
            kinds.setdefault(kind, []).append(model)
        add: dict[str, Callable[[Model, int, int], None]] = {
            "ranger": self._add_ranger, "camera": self._add_camera, "fiducial": self._add_fiducials,
            "blobfinder": self._add_blobs, "bumper": self._add_bumper, "radio": self._add_radio}
        types = sensor_types()
        for kind, models in kinds.items():
            for i, model in enumerate(models):
                if kind in add:
                    add[kind](model, i, len(models))
                if kind in types and (kind not in add or kind == "radio"):
                    self._add_readings(model, kind, types[kind], i, len(models))
        capacity = self.robot.model.energy_capacity
        if capacity is not None:
            self._feed("battery", BatteryFeed(self._topic("battery"), number, fleet, capacity))

    # ---- names and times ----

    def _topic(self, name: str) -> str:
        return joined(self.robot.prefix, name)

    def _frame(self, name: str) -> str:
        return self._look.frame(self.robot.prefix, name)

    def _interval(self, model: Model) -> int:
        """Mean interval between updates, microseconds; at least a step, because updates happen in steps."""
        return max(round(model.interval * 1e6), self._step)

    def _feed(self, kind: str, feed: Feed, model: Model | None = None) -> None:
        feed.limit.kind, feed.model = kind, model
        self.robot.feeds.append(feed)

    def _mount(self, frame: str, sensor: Model, inner: Place = (0.0, 0.0, 0.0, 0.0), pan: float = 0.0,
               tilt: float = 0.0) -> str:
        """A frame at the pose `inner` on a sensor of the robot; returns its name in messages."""
        carrier = self._carrier_of(sensor)
        if carrier is None:
            self.robot.joints.append(Joint(self._look.base, frame, self.robot.model, sensor, inner, pan, tilt))
        else:
            place = composed(relative(sensor.pose_in_tree, carrier.pose_in_tree), inner)
            self.robot.mounts.append((self._links[carrier.id], frame, spatial(place, pan, tilt)))
        return self._frame(frame)

    def _carrier_of(self, model: Model) -> Model | None:
        """The robot, or the actuator on it, on which a model does not move; None: it is on another robot."""
        carrier = model.parent
        while carrier is not None and carrier.id not in self._links:
            if carrier.type == "position":
                return None
            carrier = carrier.parent
        return carrier

    def _add_actuators(self) -> None:
        """The frames of actuators, which carry the frames of sensors."""
        found = [model for model in tree(self.robot.model) if model.type == "actuator"]
        for i, model in enumerate(found):
            carrier = self._carrier_of(model)
            if carrier is not None:
                self._links[model.id] = f"{self._look.scheme.numbered('actuator', i, len(found))}_link"
                joint = Joint(self._links[carrier.id], self._links[model.id], carrier, model, (0.0,) * 4, 0.0, 0.0)
                self.robot.joints.append(joint)
                self.robot.actuators.append(joint)

    # ---- feeds ----

    def _add_odometry(self, bodies: Bodies) -> None:
        look = self._look
        footprint = self._frame(look.footprint)
        self.robot.mounts.append((look.footprint, look.base, np.array([0, 0, 0, 0, 0, 0, 1.0])))
        self._feed("odom", OdometryFeed(
            self._topic(ODOMETRY_TOPIC), self._number, bodies, bodies.estimate, bodies.estimated_velocity,
            bodies.covariance, self._frame(look.odom), footprint))
        self._feed("ground_truth", OdometryFeed(
            self._topic(look.scheme.ground_truth), self._number, bodies, bodies.truth, bodies.velocity, bodies.exact,
            look.map, footprint))
        self._feed("stall", StallFeed(self._topic("stall"), self._number, self._fleet))
        ids = {model.id for model in tree(self.robot.model)}
        self._feed("contacts", ContactsFeed(self._topic("contacts"), self._number, bodies, self._fleet, ids, footprint))

    def _add_motion(self, bodies: Bodies, motion: Motion) -> None:
        row, model = self._number, self.robot.model
        errors = self._look.imu
        noise = None if errors == ImuErrors() else ImuNoise(errors, self._fleet.world, model.id)
        self._feed("imu", ImuFeed(self._topic("imu"), row, bodies, motion, self._frame(self._look.base), noise))
        if motion.wheels[row].names or self.robot.actuators:
            moved = {joint.child.removesuffix("_link"): joint.sensor for joint in self.robot.actuators}
            self._feed("joint_states", JointsFeed(self._topic("joint_states"), row, bodies, motion, model, moved))
        if motion.wheels[row].names:
            self._feed("wheel_ticks", TicksFeed(self._topic("wheel_ticks"), row, bodies, motion, self._look.ticks))

    def _add_ranger(self, model: Model, index: int, count: int) -> None:
        look, row, fleet = self._look, self._number, self._fleet
        topic = look.scheme.numbered(SCAN_TOPIC, index, count)
        frame = look.scheme.numbered(look.scheme.scan_frame, index, count)
        first = 0
        for i, sensor in enumerate(model.sensors):
            single = sensor.samples == 1
            if not (single and look.single_beams == "none"):
                make = RangeFeed if single and look.single_beams == "range" else ScanFeed
                mount = self._mount(sensor_name(frame, i), model, sensor.pose)
                self._feed("scan", make(
                    self._topic(sensor_name(topic, i)), self._interval(model),
                    lambda: (fleet.ranger(index).ranges[row], fleet.ranger(index).intensities[row]),
                    first, sensor, mount, look.by_rep117), model)
            first += sensor.samples

    def _add_camera(self, model: Model, index: int, count: int) -> None:
        scheme, row, fleet, view = self._look.scheme, self._number, self._fleet, model.view
        name = scheme.numbered(scheme.camera_frame, index, count)
        eye = f"{self._mount(name, model, pan=view.pan, tilt=view.tilt)}_optical"
        # Optical frames have z forwards, x to the right and y down (REP 103).
        self.robot.mounts.append((name, f"{name}_optical", np.array([0, 0, 0, -0.5, 0.5, -0.5, 0.5])))
        interval = self._interval(model)

        def topic(name: str) -> str:
            return self._topic(scheme.numbered(name, index, count))

        def times() -> Any:
            return fleet.camera(index).time[row:row + 1]

        self._feed("image", ImageFeed(topic("image"), interval, view, eye, "rgb8",
                                      lambda: fleet.camera(index).color[row], times), model)
        self._feed("depth", ImageFeed(topic("depth"), interval, view, eye, "32FC1",
                                      lambda: fleet.camera(index).depth[row], times, self._look.by_rep117), model)
        self._feed("camera_info", CameraInfoFeed(topic("camera_info"), interval, view, eye), model)

    def _add_fiducials(self, model: Model, index: int, count: int) -> None:
        name = self._look.scheme.numbered("fiducials", index, count)
        frame = self._mount(f"{name}_link", model)
        self._feed("fiducials", FiducialsFeed(
            self._topic(name), self._interval(model), self._number,
            lambda: self._fleet.fiducials(index, MAX_DETECTIONS), frame), model)

    def _add_blobs(self, model: Model, index: int, count: int) -> None:
        name = self._look.scheme.numbered("blobs", index, count)
        frame = self._mount(f"{name}_link", model)
        self._feed("blobs", BlobsFeed(
            self._topic(name), self._interval(model), self._number, lambda: self._fleet.blobs(index, MAX_DETECTIONS),
            frame, model.view), model)

    def _add_bumper(self, model: Model, index: int, count: int) -> None:
        topic = self._topic(self._look.scheme.numbered("bumper", index, count))
        self._feed("bumper", ReadingFeed(topic, self._interval(model), "bool",
                                         lambda: self._fleet.bumper(index)[self._number, :model.lines]), model)

    def _add_radio(self, model: Model, index: int, count: int) -> None:
        """The topic with all readings of a radio; each of them also has a topic of its own."""
        scheme = self._look.scheme
        frame = self._mount(scheme.numbered("radio_link", index, count), model)
        topic = self._topic(scheme.numbered("range_and_bearing", index, count))
        self._feed("range_and_bearing", RadioFeed(
            topic, self._interval(model), self._number, lambda: self._fleet.sensor("radio", index, MAX_DETECTIONS),
            frame), model)

    def _add_readings(self, model: Model, kind: str, readings: tuple[Reading, ...], index: int, count: int) -> None:
        """A topic for each reading of a sensor for which ROS has no message, such as one from a plug-in."""
        name = self._look.scheme.numbered(ros_name(kind), index, count)
        for reading in readings:
            def source(reading: Reading = reading) -> Any:
                sensor = self._fleet.sensor(kind, index, MAX_DETECTIONS)
                return getattr(sensor, reading.name)[self._number, ...]

            topic = self._topic(f"{name}/{reading.name}")
            self._feed("readings", ReadingFeed(topic, self._interval(model), reading.dtype, source), model)


def composed(place: Place, inner: Place) -> Place:
    """Transforms the pose `inner` from the frame `place` to the parent frame of `place`."""
    x, y, z, a = place
    c, s = float(np.cos(a)), float(np.sin(a))
    return (x + inner[0] * c - inner[1] * s, y + inner[0] * s + inner[1] * c, z + inner[2], a + inner[3])


def relative(pose: Place, frame: Place) -> Place:
    """A pose in the frame of another one; both are in the same frame."""
    x, y = pose[0] - frame[0], pose[1] - frame[1]
    c, s = float(np.cos(frame[3])), float(np.sin(frame[3]))
    return (c * x + s * y, c * y - s * x, pose[2] - frame[2], pose[3] - frame[3])


def spatial(pose: Place, pan: float = 0.0, tilt: float = 0.0) -> np.ndarray:
    """Position and quaternion (x, y, z, w) of a pose that is turned by `pan`, then tilted down: shape (7,)."""
    x, y, z, heading = pose
    half, down = (heading + pan) / 2, tilt / 2
    return np.array([x, y, z, -np.sin(half) * np.sin(down), np.cos(half) * np.sin(down),
                     np.sin(half) * np.cos(down), np.cos(half) * np.cos(down)])
