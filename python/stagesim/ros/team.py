# SPDX-License-Identifier: GPL-2.0-or-later
"""All robots of a node: their topics, frames, commands and odometry."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Sequence

import numpy as np
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Header

from ..errors import GoneError
from ..fleet import Fleet
from ..text import printable
from ..world import World
from . import cars
from .covariance import OdometryErrors
from .description import publish_descriptions
from .endpoints import Endpoints
from .feeds import Bodies, Feed
from .frames import Frames
from .imu import ImuErrors
from .localization import Localization
from .messages import Array, heading_of
from .motion import Motion, Wheels
from .names import SCHEMES, joined, ros_name
from .robots import Look, make_robots
from .topics import read_rates
from .transforms import TransformFeed, transform_feeds

if TYPE_CHECKING:
    from .node import StageNode

#: Number of topics whose subscribers are counted at once.
MAX_LOOK = 500


class Kept(NamedTuple):
    """State of robots that belongs to a snapshot.

    Attributes:
        rows: the rows of the robots in the arrays, by their ids.
        jacobian, turned, shifts: see OdometryErrors.jacobian, Motion.count() and Frames.shifts.
    """

    rows: dict[int, int]
    jacobian: Array
    turned: Array
    shifts: Array


def look_of(node: StageNode) -> Look:
    """The parameters of the node that determine topics and frames of robots."""
    value = node.value
    return Look(SCHEMES[value("naming")], value("enforce_prefixes"), value("odom_frame_id"),
                value("base_link_frame_id"), value("base_footprint_frame_id"), value("map_frame_id"),
                value("single_beams"), value("ranges") == "rep117", value("namespaced_tf") != "never",
                value("ticks_per_turn"), ImuErrors(**{name: value(f"imu_{name}") for name in (
                    "gyro_noise", "gyro_walk", "accelerometer_noise", "accelerometer_walk")}))


def free_name(name: str, taken: Sequence[str]) -> str:
    """The name, with a number if it is taken."""
    number, free = 2, name
    while free in taken:
        number, free = number + 1, f"{name}_{number}"
    return free


def fleet_of(world: World) -> Fleet:
    """All robots of a world; there may be none."""
    try:
        return world.fleet()
    except GoneError:
        return Fleet(world, world._core.crowd([]), (), ())


class Team:
    """The robots of a node.

    A team is made anew when robots have come or gone. It takes over the state, the publishers and the subscriptions of
    the robots that are still there.

    Args:
        node: the node, whose parameters are declared.
        before: the team so far, which can't be used any more; None: this is the first one of the world.

    Attributes:
        endpoints: makes publishers and subscriptions.
        prefixes: prefixes of all robots that there have been, by id and name. A robot that comes back has its prefix.
        robots: the robots, in the order of the fleet.
        names: their names in lock-step.
        fleet: their state in the world.
        feeds: their topics.
        tf: the topics of their frames.
        frames: the origins of their odometry, and where they believe to be.
        motion: measurements of their inertial sensors and wheels.
        cmd: their commands, see Fleet.cmd.
        last_command: time of each robot's last command, microseconds; -1: none. Shape (n,).
    """

    def __init__(self, node: StageNode, before: Team | None = None) -> None:
        self._node = node
        self._looked_at = 0
        value, world = node.value, node.world
        self.endpoints = Endpoints(node) if before is None else before.endpoints
        self.fleet = fleet_of(world) if before is not None else world.fleet()
        self._home = self.fleet.pose.copy()
        models = {model.id: model for model in world.models}
        self._errors = OdometryErrors(np.reshape([models[number].odom_error for number in self.fleet.ids], (-1, 3)))
        self._bodies = Bodies(self.fleet, self._errors)
        look = look_of(node)
        sizes = value("wheel_radius"), value("wheel_separation")
        self.motion = Motion(self.fleet, [Wheels(models[number], *sizes) for number in self.fleet.ids], world.dt)
        self.prefixes: dict[tuple[int, str], str] = {} if before is None else before.prefixes
        self.robots = make_robots(world, self.fleet, self._bodies, self.motion, look, self._find_prefixes(look, before))
        self.names = [robot.prefix or printable(robot.model.name) for robot in self.robots]
        self.frames = Frames(look, [robot.prefix for robot in self.robots], self.fleet)
        self.localization = None if not value("publish_map_tf") else Localization(
            node, self.endpoints, look, self.robots, self._bodies, self.frames)
        self.feeds = [feed for robot in self.robots for feed in robot.feeds]
        self._make_publishers()
        self.tf: list[TransformFeed] = [] if not value("publish_tf") else transform_feeds(
            node, self.endpoints, look, self.robots, self._bodies, self.frames, value("publish_map_tf"),
            value("namespaced_tf"))
        self.limits = [feed.limit for feed in (*self.feeds, *self.tf)]
        publish_descriptions(node, self.endpoints, look, self.robots, self.motion.wheels,
                             [] if before is None else before.robots)
        self._make_commands()
        if before is not None:
            self._take_over(before)
        self.endpoints.remove_unused()

    def _find_prefixes(self, look: Look, before: Team | None) -> list[str]:
        """The prefix of each robot. Those that nobody has chosen are the names of the robots."""
        stay = {} if before is None else {robot.model.id: robot.prefix for robot in before.robots}
        keys = list(zip(self.fleet.ids, self.fleet.names))
        if not self.prefixes:
            self.prefixes.update(zip(keys, look.scheme.prefixes(list(self.fleet.names), look.enforce_prefixes)))
        for key in keys:
            if key not in self.prefixes and key[0] in stay:
                self.prefixes[key] = stay[key[0]]  # it has got another name
            if key not in self.prefixes:
                self.prefixes[key] = free_name(ros_name(key[1]), [self.prefixes[other] for other in keys
                                                                  if other in self.prefixes])
        return [self.prefixes[key] for key in keys]

    # ---- robots that stay ----

    def is_outdated(self) -> bool:
        """True if the world has other robots now."""
        now = [(id, name) for id, name, _, on_ground in self._node.world._core.robots() if on_ground]
        return now != list(zip(self.fleet.ids, self.fleet.names))

    def _take_over(self, before: Team) -> None:
        """Continues the robots that the team before had, too, and ends that team."""
        places = {id: row for row, id in enumerate(before.fleet.ids)}
        rows = np.array([row for row, id in enumerate(self.fleet.ids) if id in places], np.intp)
        others = np.array([places[id] for id in self.fleet.ids if id in places], np.intp)
        self.last_command[rows] = before.last_command[others]
        self.cmd[:] = np.nan
        self.cmd[rows] = before.cmd[others]
        before.cmd[:] = np.nan
        self._home[rows] = before._home[others]
        feeds = {(feed.topic, feed.message): feed for feed in before.feeds}
        for feed in self.feeds:
            earlier = feeds.get((feed.topic, feed.message))
            if earlier is not None:
                feed.take_over(earlier)
        self._subscribe()
        self._errors.begin(self.fleet.estimate)
        self._errors.take_over(before._errors, rows, others)
        self.motion.take_over(before.motion, rows, others)
        self.frames.shifts[rows] = before.frames.shifts[others]
        if self.localization is not None and before.localization is not None:
            self.localization.covariances[rows] = before.localization.covariances[others]
        before._end()

    def _end(self) -> None:
        """Drops what refers to the arrays of the fleet, so that they are freed at once."""
        for robot in self.robots:
            robot.feeds.clear()
        self.feeds, self.tf = [], []

    # ---- publishing ----

    def _make_publishers(self) -> None:
        effort = (ReliabilityPolicy.RELIABLE if self._node.value("sensor_qos") == "reliable"
                  else ReliabilityPolicy.BEST_EFFORT)
        sensor = QoSProfile(depth=5, reliability=effort)
        for feed in self.feeds:
            feed.publisher = self.endpoints.publisher(feed.message, feed.topic, sensor if feed.sensor else 10)

    def due(self, now: int, step: int, everything: bool) -> list[Feed]:
        """The topics with subscribers that have new data after a step of duration `step`, or all with subscribers."""
        return [feed for feed in self.feeds
                if feed.active and (everything or feed.due(now, step) and feed.limit.passes(now))]

    def send_transforms(self, now: int, everything: bool) -> None:
        """Publishes the frames of the robots that sensed at the time `now` (microseconds), or of all."""
        for transforms in self.tf:
            if transforms.active:
                transforms.send(now, everything)

    def look_for_subscribers(self) -> list[Feed]:
        """Checks for subscribers and new rates; returns the topics that have got their first subscriber."""
        read_rates(self._node, self.limits)
        for transforms in self.tf:
            transforms.look_for_listeners()
        found = []
        for feed in self._next_topics():
            listened = feed.publisher.get_subscription_count() > 0
            if listened and not feed.active:
                feed.attach()
                found.append(feed)
            feed.active = listened
        return found

    def _next_topics(self) -> list[Feed]:
        """The topics whose subscribers are counted now: MAX_LOOK in turn, so that thousands delay no step."""
        first, end = self._looked_at, self._looked_at + MAX_LOOK
        self._looked_at = end if end < len(self.feeds) else 0
        return self.feeds[first:end]

    # ---- commands ----

    def _make_commands(self) -> None:
        self.cmd = self.fleet.cmd
        self.last_command = np.full(len(self.fleet), -1, np.int64)
        node, self._cars_turn = self._node, self._node.value("cars_turn")
        kind = TwistStamped if node.value("stamped_cmd_vel") else Twist
        for i, robot in enumerate(self.robots):
            def command(message: Any, robot: int = i) -> None:
                self.command(robot, message)

            def teleport(message: PoseStamped, robot: int = i) -> None:
                self.teleport(robot, message)

            self.endpoints.subscribe(kind, joined(robot.prefix, "cmd_vel"), command)
            self.endpoints.subscribe(PoseStamped, joined(robot.prefix, "teleport"), teleport)
        cars.subscribe(node, self)

    def command(self, robot: int, message: Twist | TwistStamped) -> None:
        """Handles a message on `cmd_vel`."""
        stamped = isinstance(message, TwistStamped)
        twist = message.twist if stamped else message
        speeds, model = (twist.linear.x, twist.linear.y, twist.angular.z), self.robots[robot].model
        if self._cars_turn and cars.is_car(model) and np.isfinite(speeds).all():
            speeds = cars.turning(model, speeds[0], speeds[2])
        self.obey(robot, speeds, message.header if stamped else None)

    def obey(self, robot: int, speeds: tuple[float, float, float], header: Header | None) -> None:
        """Commands a robot, and takes the header as its answer in lock-step. Speeds that are not finite are refused."""
        self._node.note_call()
        if not np.isfinite(speeds).all():
            self._node.get_logger().warning(f"{self.robots[robot].model.name!a}: found the speeds {speeds}, expected "
                                            "finite numbers", throttle_duration_sec=5)
            return
        if not self._node.accepts(self.names[robot], header):
            return
        self.cmd[robot] = speeds
        self.last_command[robot] = self._node.now

    def run_watchdog(self, patience: float) -> None:
        """Stops robots whose last command is older than `patience` seconds; 0: none."""
        if patience > 0:
            silent = (self.last_command >= 0) & (self._node.now - self.last_command > patience * 1e6)
            if silent.any():
                self.cmd[silent] = 0.0

    def teleport(self, robot: int, message: PoseStamped) -> None:
        """Handles a message on `teleport`."""
        place = message.pose.position
        pose = (place.x, place.y, heading_of(message.pose.orientation))
        name, frame, log = self.robots[robot].model.name, message.header.frame_id, self._node.get_logger()
        if not np.isfinite(pose).all():
            log.warning(f"{name!a}: found the pose {pose}, expected finite numbers")
            return
        try:
            pose = self.frames.in_world(pose, frame, robot)
        except ValueError as error:
            log.warning(f"{name!a}: not put elsewhere: {error}")
            return
        self.fleet.teleport(pose, [robot])
        self._node.moved()

    def go_home(self) -> None:
        """Moves robots back to their start poses and stops them."""
        self.fleet.teleport(self._home)
        self.cmd[self.last_command >= 0] = 0.0

    # ---- state ----

    def on_moved(self) -> None:
        """Called when a client has moved robots."""
        self._bodies.forget(moved=True)

    def step(self) -> None:
        """Follows a step that has just been made."""
        self._bodies.forget()
        self._errors.move(self.fleet.estimate)
        self.motion.step()

    def kept(self) -> Kept:
        """The state that belongs to a snapshot, for begin()."""
        return Kept({id: row for row, id in enumerate(self.fleet.ids)}, self._errors.jacobian.copy(),
                    self.motion.count(), self.frames.shifts.copy())

    def begin(self, kept: Kept | None = None, all_sensors: bool = False) -> None:
        """Starts after loading, a reset or a restore.

        Args:
            kept: the value of kept() at the restored time; None, and for robots that it lacks: as before any motion.
            all_sensors: True: sensors work from now on, even without subscribers.
        """
        self.cmd[self.last_command < 0] = np.nan  # robots without a command obey their own controllers
        # Attach sensors before robots, as after a reset: the order of subscriptions is part of the state.
        if all_sensors:
            self.attach_sensors()
        self._subscribe()
        self._bodies.forget()
        self._errors.begin(self.fleet.estimate, None if kept is None else self._rows_of(kept.jacobian, kept.rows))
        self.motion.begin(None if kept is None else self._rows_of(kept.turned, kept.rows))
        self.frames.shifts[:] = 0.0 if kept is None else self._rows_of(kept.shifts, kept.rows)

    def attach_sensors(self) -> None:
        """Lets all sensors work, even without subscribers."""
        for feed in sorted(self.feeds, key=lambda feed: not feed.sensor):  # velocities of robots subscribe to them
            feed.attach()

    def _subscribe(self) -> None:
        """Makes the odometry of all robots work from the beginning."""
        for robot in self.robots:
            if robot.model.subscribers == 0:
                robot.model.subscribe()

    def _rows_of(self, values: Array, rows: dict[int, int]) -> Array:
        """The values of the robots by the rows that their ids have there; zeros for those that have none."""
        found = np.zeros((len(self.fleet), *values.shape[1:]))
        for row, id in enumerate(self.fleet.ids):
            if id in rows:
                found[row] = values[rows[id]]
        return found
