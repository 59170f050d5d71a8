# SPDX-License-Identifier: GPL-2.0-or-later
"""All robots of a node: their topics, frames, commands and odometry."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Header

from ..text import printable
from . import cars
from .covariance import OdometryErrors
from .description import publish_descriptions
from .feeds import Bodies, Feed
from .frames import Frames
from .localization import Localization
from .messages import Array, heading_of
from .motion import Motion, Wheels
from .names import SCHEMES, joined
from .robots import Look, make_robots
from .topics import make_publisher, read_rates
from .transforms import TransformFeed, transform_feeds

if TYPE_CHECKING:
    from .node import StageNode

#: Number of topics whose subscribers are counted at once.
MAX_LOOK = 500
#: State of the robots that belongs to a snapshot: OdometryErrors.jacobian, Motion.count() and Frames.shifts.
Kept = tuple[Array | None, Array | None, Array | None]


def look_of(node: StageNode) -> Look:
    """The parameters of the node that determine topics and frames of robots."""
    value = node.value
    return Look(SCHEMES[value("naming")], value("enforce_prefixes"), value("odom_frame_id"),
                value("base_link_frame_id"), value("base_footprint_frame_id"), value("map_frame_id"),
                value("single_beams"), value("ranges") == "rep117", value("namespaced_tf") != "no",
                value("ticks_per_turn"))


class Team:
    """The robots of a node.

    Args:
        node: the node, whose parameters are declared.

    Attributes:
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

    def __init__(self, node: StageNode) -> None:
        self._node = node
        self._looked_at = 0
        value, world = node.value, node.world
        self.fleet = world.fleet()
        self._home = self.fleet.pose.copy()
        models = {model.id: model for model in world.models}
        self._errors = OdometryErrors(np.array([models[number].odom_error for number in self.fleet.ids]))
        self._bodies = Bodies(self.fleet, self._errors)
        look = look_of(node)
        sizes = value("wheel_radius"), value("wheel_separation")
        self.motion = Motion(self.fleet, [Wheels(models[number], *sizes) for number in self.fleet.ids], world.dt)
        self.robots = make_robots(world, self.fleet, self._bodies, self.motion, look)
        self.names = [robot.prefix or printable(robot.model.name) for robot in self.robots]
        self.frames = Frames(look, [robot.prefix for robot in self.robots], self.fleet)
        self.localization = None if not value("publish_map_tf") else Localization(
            node, look, self.robots, self._bodies, self.frames)
        self.feeds = [feed for robot in self.robots for feed in robot.feeds]
        self._make_publishers()
        self.tf: list[TransformFeed] = [] if not value("publish_tf") else transform_feeds(
            node, look, self.robots, self._bodies, self.frames, value("publish_map_tf"), value("namespaced_tf"))
        self.limits = [feed.limit for feed in (*self.feeds, *self.tf)]
        publish_descriptions(node, look, self.robots, self.motion.wheels)
        self._make_commands()

    # ---- publishing ----

    def _make_publishers(self) -> None:
        effort = (ReliabilityPolicy.RELIABLE if self._node.value("sensor_qos") == "reliable"
                  else ReliabilityPolicy.BEST_EFFORT)
        sensor = QoSProfile(depth=5, reliability=effort)
        for feed in self.feeds:
            feed.publisher = make_publisher(self._node, feed.message, feed.topic, sensor if feed.sensor else 10)

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
            listened = feed.publisher.handle.get_subscription_count() > 0
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

            node.create_subscription(kind, joined(robot.prefix, "cmd_vel"), command, 10)
            node.create_subscription(PoseStamped, joined(robot.prefix, "teleport"), teleport, 10)
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
        return self._errors.jacobian.copy(), self.motion.count(), self.frames.shifts.copy()

    def begin(self, kept: Kept = (None, None, None), all_sensors: bool = False) -> None:
        """Starts after loading, a reset or a restore.

        Args:
            kept: the value of kept() at the restored time; None: as before any motion.
            all_sensors: True: sensors work from now on, even without subscribers.
        """
        jacobian, turned, shifts = kept
        self.cmd[self.last_command < 0] = np.nan  # robots without a command obey their own controllers
        # Attach sensors before robots, as after a reset: the order of subscriptions is part of the state.
        if all_sensors:
            for feed in sorted(self.feeds, key=lambda feed: not feed.sensor):  # velocities of robots subscribe to them
                feed.attach()
        for robot in self.robots:
            if robot.model.subscribers == 0:
                robot.model.subscribe()  # so that its odometry works from the beginning
        self._bodies.forget()
        self._errors.begin(self.fleet.estimate, jacobian)
        self.motion.begin(turned)
        self.frames.shifts[:] = 0.0 if shifts is None else shifts
