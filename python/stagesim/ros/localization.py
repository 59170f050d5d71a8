# SPDX-License-Identifier: GPL-2.0-or-later
"""Where robots believe to be in the map: a stand-in for a localization such as AMCL, with its topics.

The belief follows the true pose. A client can shift it by `initialpose`; the robot itself stays where it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Sequence

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped

from .covariance import in_space
from .endpoints import Endpoints
from .feeds import Bodies, BodyFeed
from .frames import Frames
from .messages import MARK, Array, Template, heading_of, planar
from .names import joined
from .robots import Look, Robot

if TYPE_CHECKING:
    from .node import StageNode


class BeliefFeed(BodyFeed):
    """The believed pose of a robot in the map."""

    message = PoseWithCovarianceStamped

    def __init__(self, topic: str, robot: int, bodies: Bodies, frames: Frames, covariances: Array, frame: str) -> None:
        super().__init__(topic, robot, bodies)
        self._frames, self._covariances = frames, covariances
        message = PoseWithCovarianceStamped()
        message.header.frame_id = frame
        message.pose.pose.position.x = MARK
        self._template = Template(message)
        self._numbers = self._template.doubles(MARK, 7 + 36)

    def make(self, stamp: Array) -> bytes:
        self._template.stamp(stamp)
        self._numbers[:7] = planar(self._frames.beliefs())[self._robot]
        self._numbers[7:] = self._covariances[self._robot]
        return self._template.bytes()


class Localization:
    """Subscribes to `initialpose` of all robots, and gives each the topic `amcl_pose`.

    Attributes:
        covariances: those of the believed poses: shape (n, 36).
    """

    def __init__(self, node: StageNode, endpoints: Endpoints, look: Look, robots: Sequence[Robot], bodies: Bodies,
                 frames: Frames) -> None:
        self._node, self._frames = node, frames
        self.covariances = in_space(np.zeros((len(robots), 3, 3)))
        for number, robot in enumerate(robots):
            feed = BeliefFeed(joined(robot.prefix, "amcl_pose"), number, bodies, frames, self.covariances, look.map)
            feed.limit.kind = "amcl_pose"
            robot.feeds.append(feed)

            def believe(message: PoseWithCovarianceStamped, robot: int = number) -> None:
                self._believe(robot, message)

            endpoints.subscribe(PoseWithCovarianceStamped, joined(robot.prefix, "initialpose"), believe)

    def _believe(self, robot: int, message: PoseWithCovarianceStamped) -> None:
        place, covariance = message.pose.pose.position, np.asarray(message.pose.covariance)
        pose = (place.x, place.y, heading_of(message.pose.pose.orientation))
        name, log = self._node.robots[robot].model.name, self._node.get_logger()
        if not np.isfinite(pose).all() or not np.isfinite(covariance).all():
            log.warning(f"{name!a}: found an initial pose with {pose}, expected finite numbers")
            return
        try:
            self._frames.shift(robot, self._frames.in_world(pose, message.header.frame_id, robot))
        except ValueError as error:
            log.warning(f"{name!a}: initial pose not taken: {error}")
            return
        self.covariances[robot] = covariance
        if self._node.paused:
            self._node.publish(everything=True)
