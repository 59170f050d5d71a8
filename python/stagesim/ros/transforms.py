# SPDX-License-Identifier: GPL-2.0-or-later
"""/tf and /tf_static: from the odometry of each robot to its body, and from there to its sensors."""

from __future__ import annotations

from typing import Sequence

import numpy as np
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from .endpoints import Endpoints
from .feeds import Bodies
from .frames import Frames
from .messages import Array, Transforms, planar, stamp_of, stamps_of
from .names import joined
from .robots import Look, Robot
from .topics import Limit

try:
    from tf2_msgs.msg import TFMessage
except ModuleNotFoundError:  # not among PyPI's wheels
    TFMessage = None

#: number of cached messages, each for another set of robots
_MOST_MESSAGES = 64


def transform_feeds(node: Node, endpoints: Endpoints, look: Look, robots: Sequence[Robot], bodies: Bodies, frames: Frames,
                    with_map: bool, namespaced: str) -> list[TransformFeed]:
    """The feeds of all frames; none, after a warning, if there is no module tf2_msgs.

    Args:
        namespaced: "never": one feed on /tf; "only": one for each robot with a prefix, on /PREFIX/tf, with frames without
            the prefix; "also": both.
    """
    if TFMessage is None:
        node.get_logger().warning("no /tf: there is no Python module tf2_msgs; docs/ros.md says how to "
                                  "make it (python -m stagesim.ros.make_messages)")
        return []
    own = [i for i, robot in enumerate(robots) if robot.prefix and namespaced != "never"]
    shared = [i for i in range(len(robots)) if namespaced == "also" or i not in own]
    feeds = [TransformFeed(endpoints, look, robots, bodies, frames, with_map, [i], robots[i].prefix) for i in own]
    if shared:
        feeds.append(TransformFeed(endpoints, look, robots, bodies, frames, with_map, shared))
    return feeds


class TransformFeed:
    """Publishes the frames of robots.

    Frames that do not move on their robot are published once, on /tf_static. The others have the stamps of the
    robot's odometry and the poses of that instant: the robot's body, and sensors that stand on an actuator.

    Args:
        endpoints: makes the publishers.
        look: the names of frames.
        robots: all robots of the world.
        bodies: their poses.
        frames: the origins of their odometry.
        with_map: also publish the transforms from the map to the odometry, for which each robot is where it
            believes to be.
        chosen: indices of the robots whose frames are published.
        namespace: prefix of the topics; the names of frames then lack the robots' prefixes.

    Attributes:
        publisher: that of /tf.
        active: somebody listens to /tf.
        limit: its maximum rate.
    """

    def __init__(self, endpoints: Endpoints, look: Look, robots: Sequence[Robot], bodies: Bodies, frames: Frames,
                 with_map: bool, chosen: Sequence[int], namespace: str = "") -> None:
        topic = joined(namespace, "tf") if namespace else "/tf"
        self.publisher = endpoints.publisher(TFMessage, topic, 100)
        self.active = False
        self.limit = Limit("tf")
        self._look, self._bodies, self._frames, self._with_map = look, bodies, frames, with_map
        self._chosen, self._robots = np.asarray(chosen), [robots[i] for i in chosen]
        self._prefixes = ["" if namespace else robot.prefix for robot in self._robots]
        self._messages: dict[bytes, Transforms] = {}  # by the set of robots in them
        self._joints = [(i, joint) for i, robot in enumerate(self._robots) for joint in robot.joints]
        self._joint_owners = np.array([i for i, _ in self._joints], np.intp)
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._static = endpoints.publisher(TFMessage, f"{topic}_static", kept, fixed=True)
        names = [(joined(prefix, parent), joined(prefix, child))
                 for prefix, robot in zip(self._prefixes, self._robots) for parent, child, _ in robot.mounts]
        poses = [pose for robot in self._robots for _, _, pose in robot.mounts]
        message = Transforms((TFMessage, TransformStamped), names)
        self._static.publish(message.bytes(stamp_of(0), np.array(poses)))

    def look_for_listeners(self) -> None:
        """Updates `active`."""
        self.active = self.publisher.get_subscription_count() > 0

    def send(self, now: int, everything: bool) -> None:
        """Publishes the frames of the robots that sensed at the time `now` (microseconds), or of all."""
        times = self._bodies.times()[self._chosen]
        which = np.full(len(times), True) if everything else times == now
        if not which.any() or not (self.limit.passes(now) or everything):
            return
        owners = [np.flatnonzero(which)]
        poses = [self._bodies.estimate()[self._chosen[which]]]
        if self._with_map:
            owners.append(owners[0])
            poses.append(planar(self._frames.believed_origins(self._chosen[which])))
        if self._joints:
            owners.append(self._joint_owners[which[self._joint_owners]])
            poses.append(np.reshape([joint.pose() for i, joint in self._joints if which[i]], (-1, 7)))
        self.publisher.publish(self._message(which).bytes(
            stamps_of(times[np.concatenate(owners)]), np.concatenate(poses)))

    def _message(self, which: Array) -> Transforms:
        """The message for the robots marked True; most of the time, these are all moving robots."""
        key = which.tobytes()
        if key not in self._messages:
            if len(self._messages) > _MOST_MESSAGES:
                self._messages.clear()
            look = self._look
            prefixes = [prefix for prefix, wanted in zip(self._prefixes, which) if wanted]
            names = [(joined(prefix, look.odom), joined(prefix, look.footprint)) for prefix in prefixes]
            if self._with_map:
                names += [(look.map, joined(prefix, look.odom)) for prefix in prefixes]
            names += [(joined(self._prefixes[i], joint.parent), joined(self._prefixes[i], joint.child))
                      for i, joint in self._joints if which[i]]
            self._messages[key] = Transforms((TFMessage, TransformStamped), names)
        return self._messages[key]
