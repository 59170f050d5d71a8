# SPDX-License-Identifier: GPL-2.0-or-later
"""The node: takes what the robot measures, decides, and tells what it has decided.

One thread does all work, but that another one stops the robot while a decision is late. Decisions follow odometry, so
that a command is as new as can be.
"""

from __future__ import annotations

import math
import time
from typing import Any, Callable, Mapping

import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64MultiArray, Header, String
from visualization_msgs.msg import MarkerArray

from ...belief import Decision
from ...errors import StageError
from ..covariance import Array
from ..executor import Executor
from ..lockstep import split
from ..parameters import declare
from . import outputs
from .deadline import Deadline
from .decider import Decider, goal_of
from .localization import SECOND, Command, Localization
from .others import Others, moving_of
from .parameters import PARAMETERS
from .plane import Moving, covariance_of, pose_of, stamp_of
from .plans import behaviours_of

#: Messages are taken that are so much ahead of the clock, seconds: clocks of machines differ, and /clock may come late.
_AHEAD = 0.5
#: Decisions follow odometry that comes by this share of a period before its time, or after it.
_EARLY, _PATIENT = 0.25, 0.5
#: Seconds of real time without a decision after which the robot is stopped, because the clock stands still.
_SILENT = 1.0
#: Seconds for which a node that ends waits until its last command, which stops the robot, has been received.
_ACKNOWLEDGED = 1.0
_KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class WhatIfNode(Node):
    """The ROS 2 node of a robot that decides.

    Args:
        world: the world file with the robot; None: the parameter `world_file`.
        robot: its name there; None: the parameter `robot`.
        parameters: values of parameters by name; those of the command line take precedence.

    Attributes:
        status: what the robot does, and why it stands if it should drive.
        decisions: number of decisions that were made in time.

    Raises:
        ValueError: a parameter has an invalid value.
        StageError: the world file can't be used.
    """

    def __init__(self, world: str | None = None, robot: str | None = None,
                 parameters: Mapping[str, Any] | None = None) -> None:
        super().__init__("what_if", parameter_overrides=[Parameter(key, value=value)
                                                         for key, value in (parameters or {}).items()])
        self.status, self.decisions, self._ends = "", 0, False
        self._executor = Executor(self)
        self._deadline = Deadline(self._tell_late)
        try:
            declare(self, PARAMETERS)
            self._values = {name: self.get_parameter(name).value for name in PARAMETERS}
            self._values.update({"world_file": world} if world else {}, **({"robot": robot} if robot else {}))
            self._begin()
        except BaseException:
            self.close()
            raise

    def _begin(self) -> None:
        values = self._values
        self.decider = Decider(values)
        self._period = round(SECOND / values["rate"])
        self._uses_clock = bool(self.get_parameter("use_sim_time").value) or values["lockstep"]
        self._localization = Localization(values["localization"], values["pose_gap"])
        self._others = Others(behaviours_of(values["behaviours"]))
        self._must_hear, self._trackers = split(values["others"]), split(values["tracks"])
        goal = values["goal"]
        self._goal: Array | None = np.array(goal, float) if len(goal) else None
        self._goal_stamp = -1
        self._arrived = self._is_idle = False
        self._child = ""  # the robot's frame
        self._told_time: int | None = None
        self._complained: dict[str, str] = {}
        self._contradictions: dict[str, int] = {}  # by topics of others: when
        self._forget()
        self._make_publishers()
        self._subscribe_to_all()

    def _forget(self) -> None:
        """Starts anew, because time has gone back."""
        self._localization.forget()
        self._others.forget()
        self._contradictions.clear()
        self._commands: list[Command] = []
        self._due: int | None = None  # time of the next decision
        self._answered = self._told = -1  # times in lockstep
        self._asked_again = False
        self._last_time = -1
        self._has_news = False
        self._heard: dict[str, int] = {}  # newest stamp by topic
        self._active = time.monotonic()  # when the last decision was made, or refused

    # ---- messages ----

    def _make_publishers(self) -> None:
        stamped = self._values["stamped_cmd_vel"] or self._values["lockstep"]
        self._cmd_vel = self.create_publisher(TwistStamped if stamped else Twist, "cmd_vel", 10)
        self._stamped = stamped
        self._status = self.create_publisher(String, "~/status", _KEPT)
        self._scores = self.create_publisher(Float64MultiArray, "~/scores", 10)
        self._futures = self.create_publisher(MarkerArray, "~/futures", 10)
        self._robot = self.create_publisher(Odometry, "~/robot", 10)

    def _subscribe_to_all(self) -> None:
        values = self._values
        sensor = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE if values["lockstep"]
                            else ReliabilityPolicy.BEST_EFFORT)
        if self._uses_clock:
            self._subscribe(Clock, "/clock", self._take_clock, sensor)
        if values["localization"] != "pose":
            self._subscribe(Odometry, "odom", self._take_odometry, sensor)
        # Publishers that keep their last message give it only to subscribers who ask for it, and others to nobody who does.
        if values["localization"] != "odom":
            for qos in (sensor, _KEPT):
                self._subscribe(PoseWithCovarianceStamped, "pose", self._take_pose, qos)
        for qos in (QoSProfile(depth=10), _KEPT):
            self._subscribe(PoseStamped, "goal_pose", self._take_goal, qos)
        if values["map_topic"]:
            self._subscribe(OccupancyGrid, values["map_topic"], self._take_map,
                            QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        for topic in dict.fromkeys(self._must_hear + self._trackers):
            def take(message: Odometry, topic: str = topic) -> None:
                self._take_other(topic, message)

            self._subscribe(Odometry, topic, take, sensor, of_others=True)

    def _subscribe(self, kind: type, topic: str, take: Callable[[Any], None], qos: QoSProfile, of_others: bool = False) -> None:
        """Calls a function for messages. It raises an error about one that is ignored, of which the log tells once."""
        def handle(message: Any) -> None:
            self._executor.calls += 1
            try:
                take(message)
            except (ValueError, StageError) as error:
                if of_others:
                    self._contradictions[topic] = self.now or 0
                if self._complained.get(topic) is None:
                    self.get_logger().warning(f"{topic}: {error}; ignored")
                self._complained[topic] = str(error)
            else:
                self._complained.pop(topic, None)

        # Half of the subscriptions to poses and goals fit no publisher, which is no reason for a warning.
        self.create_subscription(kind, topic, handle, qos,
                                 event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=qos is not _KEPT))

    def _take_clock(self, message: Clock) -> None:
        now = message.clock.sec * SECOND + message.clock.nanosec
        self._asked_again |= now == self._told
        self._told_time = now

    def _take_odometry(self, message: Odometry) -> None:
        values = self._values
        measured = moving_of(message, values["pose_errors"], values["twist_errors"])
        self._check_time(measured.stamp)
        if self._localization.take_odometry(measured):
            self._child, self._has_news = message.child_frame_id, True

    def _take_pose(self, message: PoseWithCovarianceStamped) -> None:
        self._check_frame(message.header.frame_id, "of a pose")
        pose, zeros = pose_of(message.pose.pose), np.zeros(3)
        covariance = covariance_of(message.pose.covariance, self._values["pose_errors"])
        stamp = stamp_of(message.header)
        self._check_time(stamp)
        taken = self._localization.take_pose(Moving(stamp, pose, covariance, zeros, np.zeros((3, 3))))
        if taken and self._values["localization"] == "pose":
            self._has_news = True

    def _take_other(self, topic: str, message: Odometry) -> None:
        values = self._values
        if message.child_frame_id == self._child and self._child and topic in self._trackers:
            return  # the robot itself
        self._check_frame(message.header.frame_id, "of others")
        measured = moving_of(message, values["pose_errors"], values["twist_errors"])
        self._check_time(measured.stamp)
        self._others.take(topic, message.child_frame_id if topic in self._trackers else "", measured)
        self._heard[topic] = measured.stamp

    def _take_map(self, message: OccupancyGrid) -> None:
        self._check_frame(message.header.frame_id, "of a map")
        self.decider.take_map(message)

    def _take_goal(self, message: PoseStamped) -> None:
        self._check_frame(message.header.frame_id, "of a goal")
        goal, stamp = goal_of(message), stamp_of(message.header)
        if self._goal is None or stamp != self._goal_stamp or not np.array_equal(goal, self._goal):
            self._goal, self._goal_stamp, self._arrived = goal, stamp, False

    def _check_frame(self, frame: str, whose: str) -> None:
        if frame.removeprefix("/") not in ("", self._values["map_frame_id"]):
            raise ValueError(f"found the frame {frame[:60]!a} {whose}, expected {self._values['map_frame_id']!a}")

    def _check_time(self, stamp: int) -> None:
        now = self.now
        if now is not None and stamp - now > _AHEAD * SECOND:
            raise ValueError(f"found a stamp that is {(stamp - now) / SECOND:.3g} s in the future, expected the clock of this "
                             "machine, or use_sim_time with a simulation")

    # ---- time ----

    @property
    def now(self) -> int | None:
        """The time, nanoseconds; None: nobody has told it yet."""
        return self._told_time if self._uses_clock else self.get_clock().now().nanoseconds

    def run(self, duration: float = math.inf) -> None:
        """Runs until end() is called or ROS is shut down, or for `duration` seconds of real time."""
        end = time.monotonic() + duration
        while not self._ends and rclpy.ok() and time.monotonic() < end:
            self.turn()

    def end(self) -> None:
        """Makes run() return soon."""
        self._ends = True

    def turn(self) -> None:
        """Serves ROS for a moment, and decides if it is time."""
        self._executor.spin(self._wait())
        now = self.now
        if now is not None and now < self._last_time:
            self._go_back(self._last_time - now)
        if now is not None:
            self._last_time = now
        if self._values["lockstep"]:
            self._answer_step(now)
        elif now is not None and self._is_due(now):
            self._active = time.monotonic()
            self._cycle(now)
        elif time.monotonic() - self._active > _SILENT:
            self._active = time.monotonic()
            self._stop("stopped: the clock stands still" if self._told_time is not None or not self._uses_clock
                       else "stopped: no /clock has been received")

    def _go_back(self, by: int) -> None:
        self._forget()
        reason = f"stopped: time went back by {by / SECOND:.3g} s, and all measurements are forgotten"
        if self._values["lockstep"]:
            self._say(reason)  # a command would be the answer
        else:
            self._stop(reason)

    def _wait(self) -> float:
        """Seconds for which messages may be waited for."""
        if self._uses_clock or self._due is None:
            return 0.02
        late = self._due + _PATIENT * self._period - (self.now or 0)
        return min(max(late / SECOND, 0.001), 0.05)

    def _is_due(self, now: int) -> bool:
        """Whether to decide now: on new odometry at about the right time, or else somewhat later."""
        if self._due is None:
            self._due = now
        if now < self._due + (-_EARLY if self._has_news else _PATIENT) * self._period:
            return False
        self._due += self._period
        if self._due <= now:
            self._due = now + self._period
        return True

    def _answer_step(self, now: int | None) -> None:
        """Decides for a step of a simulation that waits, once all measurements of its time are there."""
        if not now:
            return
        if self._asked_again and now == self._answered:  # the answer was lost
            self._publish_command(now, self._commands[-1].velocity)
        if self._asked_again or (self._told != now and self._localization.newest == now):
            self._asked_again, self._told = False, now
            self._tell_place(now)
        if now == self._answered or self._localization.newest != now:
            return
        if all(self._heard.get(topic) == now for topic in self._must_hear):
            self._cycle(now)
            self._answered = now

    # ---- decisions ----

    def _cycle(self, now: int) -> None:
        """Makes a decision, or stops the robot."""
        self._has_news = False
        self._drop_old(now)
        why_not = self._why_not(now)
        if self._goal is None or self._arrived:
            self._idle(now)
        elif why_not:
            self._stop(f"stopped: {why_not}", now)
        else:
            self._decide(now)
        if not self._values["lockstep"]:
            self._tell_place(now)

    def _drop_old(self, now: int) -> None:
        oldest = now - round(self._values["others_timeout"] * SECOND)
        self._others.drop(oldest)
        self._contradictions = {topic: since for topic, since in self._contradictions.items() if since >= oldest}
        while len(self._commands) > 1 and self._commands[1].since < now - 10 * SECOND:
            self._commands.pop(0)

    def _why_not(self, now: int) -> str:
        """Why there can be no decision; empty if there can be one."""
        values, newest = self._values, self._localization.newest
        if reason := self._localization.why_not():
            return reason
        assert newest is not None
        age = (now - newest) / SECOND
        if age > values["odom_timeout"]:
            name = "pose" if values["localization"] == "pose" else "odometry"
            return f"the last {name} is older than {values['odom_timeout']:g} s"
        if values["map_topic"] and not self.decider.has_map:
            return f"no map has been received on {values['map_topic']}"
        for topic in self._must_hear:
            if topic not in self._heard:
                return f"nothing has been received on {topic}"
            if self._others.newest(topic) is None:
                return f"the last message on {topic} is older than {values['others_timeout']:g} s"
        for topic in self._contradictions:
            return f"{topic} contradicts itself: {self._complained.get(topic) or 'see the log'}"
        return ""

    def _decide(self, now: int) -> None:
        values = self._values
        effect = now + round(values["delay"] * SECOND)
        assert self._goal is not None
        if not values["lockstep"]:
            self._deadline.begin(values["deadline"] / values["rate"])
        try:
            robot = self._localization.at(effect, self._commands)
            if math.dist(robot.pose[:2], self._goal) <= values["tolerance"]:
                self._arrived = True
            plans, decision = self.decider.decide(
                robot, self._others.at(effect), self._goal, (values["seed"] + now // 1000) % 2**63,
                0.0 if values["lockstep"] else values["budget"] / values["rate"])
        except StageError as error:
            self._deadline.finish()
            self._stop(f"stopped: {error}", now)
            return
        if not self._deadline.finish():
            self._say(f"stopped: a decision took longer than {1000 * values['deadline'] / values['rate']:.3g} ms")
            self._note_command(now, np.zeros(3))
        elif not decision.complete:
            self._stop(f"stopped: a decision is late: {1000 * values['budget'] / values['rate']:.3g} ms do not suffice for "
                       f"{values['samples']} futures of {len(plans)} plans", now)
        elif self._arrived:
            self._idle(now)
        else:
            self._drive(now, plans, decision)

    def _drive(self, now: int, plans: Array, decision: Decision) -> None:
        self._is_idle = False
        self._publish_command(now, plans[decision.best, 0])
        self.decisions += 1
        risky = decision.risk[decision.best] > self._values["max_risk"]
        self._say("drives" + (", although all plans are risky" if risky else ""))
        if self._scores.get_subscription_count():
            self._scores.publish(outputs.scores(plans, decision))
        if self._futures.get_subscription_count():
            self._futures.publish(outputs.futures(self._header(now), decision))

    def _idle(self, now: int) -> None:
        """Stops once, and leaves the robot to others then."""
        if not self._is_idle or self._values["lockstep"]:
            self._publish_command(now, np.zeros(3))
        self._is_idle = True
        self._say("has arrived" if self._arrived else "has no goal")

    def _stop(self, reason: str, now: int | None = None) -> None:
        self._is_idle = False
        self._publish_command(now or self.now or 0, np.zeros(3))
        self._say(reason)

    def _say(self, status: str) -> None:
        """Tells a new status: in the log and on a topic."""
        if status == self.status:
            return
        self.status = status
        if status.startswith("stopped"):
            self.get_logger().warning(status)
        else:
            self.get_logger().info(status)
        self._status.publish(String(data=status))

    # ---- publishing ----

    def _header(self, now: int) -> Header:
        header = Header(frame_id=self._values["map_frame_id"])
        header.stamp.sec, header.stamp.nanosec = divmod(now, SECOND)
        return header

    def _publish_command(self, now: int, velocity: Array) -> None:
        self._note_command(now, velocity)
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.angular.z = velocity.tolist()
        self._cmd_vel.publish(TwistStamped(header=Header(stamp=self._header(now).stamp, frame_id=self._child), twist=twist)
                              if self._stamped else twist)

    def _note_command(self, now: int, velocity: Array) -> None:
        since = now + round(self._values["delay"] * SECOND)
        if self._commands and self._commands[-1].since >= since:
            self._commands.pop()
        self._commands.append(Command(since, velocity))

    def _tell_late(self) -> None:
        """Called in another thread, while a decision is late."""
        self._cmd_vel.publish(TwistStamped(header=Header(stamp=self.get_clock().now().to_msg())) if self._stamped else Twist())

    def _tell_place(self, now: int) -> None:
        """Publishes the believed place of the robot, for other robots too."""
        if not self._localization.why_not():
            self._robot.publish(outputs.odometry(self._header(now), self._child, self._localization.at(now, self._commands)))

    def close(self) -> None:
        """Stops the robot, and destroys the node."""
        self._deadline.close()
        if rclpy.ok() and hasattr(self, "_cmd_vel"):
            # With a stamp of 0, it is no answer to a simulation that waits.
            self._publish_command(0 if self._values["lockstep"] else self.now or 0, np.zeros(3))
            # A command that nobody has received yet is lost when its publisher is destroyed.
            self._cmd_vel.wait_for_all_acked(Duration(seconds=_ACKNOWLEDGED))
        self._executor.close()
        self.destroy_node()
