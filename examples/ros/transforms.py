# SPDX-License-Identifier: GPL-2.0-or-later
"""Poses of frames at the time of a stamp, from /tf and /tf_static: a small stand-in for tf2_ros, which PyPI lacks.

Poses are x, y (metres) and heading (radians): arrays of shape (..., 3).
"""

from __future__ import annotations

from collections import deque
from typing import Any, Callable

import numpy as np
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

KEPT = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # for topics kept for late subscribers
MOST_TIMES = 1000  # transforms of a frame that are kept
MOST_WAITING = 100  # messages that wait for their transforms


def nanoseconds(stamp: Any) -> int:
    """Converts the stamp of a message."""
    return int(stamp.sec * 1_000_000_000 + stamp.nanosec)


def heading_of(turn: Any) -> float:
    """The heading of a quaternion about the vertical."""
    return float(2 * np.arctan2(turn.z, turn.w))


def pose_of(pose: Any) -> np.ndarray:
    """Converts a geometry_msgs/Pose, shape (3,)."""
    return np.array([pose.position.x, pose.position.y, heading_of(pose.orientation)])


def placed(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Poses in the frame of `outer`, if `inner` are in the frames at these poses."""
    c, s = np.cos(outer[..., 2]), np.sin(outer[..., 2])
    return np.stack([outer[..., 0] + c * inner[..., 0] - s * inner[..., 1],
                     outer[..., 1] + s * inner[..., 0] + c * inner[..., 1], outer[..., 2] + inner[..., 2]], -1)


def seen_from(frame: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Poses in the frame at `frame`, of which both are in the same frame; the inverse of placed()."""
    x, y, turn = np.moveaxis(pose - frame, -1, 0)
    c, s = np.cos(frame[..., 2]), np.sin(frame[..., 2])
    return np.stack([c * x + s * y, c * y - s * x, np.angle(np.exp(1j * turn))], -1)


class Transforms:
    """Transforms between frames, by time.

    Args:
        node: subscribes to the topics "tf" and "tf_static" of `namespace`.
        namespace: "" for /tf; "/r0" for a robot with transforms of its own.

    Attributes:
        listeners: functions that are called when transforms have arrived.
    """

    def __init__(self, node: Node, namespace: str = "") -> None:
        self.listeners: list[Callable[[], None]] = []
        self._parents: dict[str, str] = {}
        self._fixed: dict[str, np.ndarray] = {}
        self._moving: dict[str, deque[tuple[int, np.ndarray]]] = {}
        node.create_subscription(TFMessage, f"{namespace}/tf", self._move, 100)
        node.create_subscription(TFMessage, f"{namespace}/tf_static", self._fix, KEPT)

    def pose(self, target: str, frame: str, time: int) -> np.ndarray | None:
        """The pose of a frame in another one at a time in nanoseconds; None if it is not known (yet).

        Between two transforms, the pose is interpolated.
        """
        above = self._ancestors(target)
        common = next((name for name in self._ancestors(frame) if name in above), None)
        if common is None:
            return None
        here, there = self._below(common, frame, time), self._below(common, target, time)
        return None if here is None or there is None else seen_from(there, here)

    def _ancestors(self, frame: str) -> list[str]:
        """The frame itself, its parent and so on."""
        found = [frame]
        while found[-1] in self._parents:
            found.append(self._parents[found[-1]])
        return found

    def _below(self, ancestor: str, frame: str, time: int) -> np.ndarray | None:
        """The pose of a frame in one of its ancestors; None if it is not known."""
        pose = np.zeros(3)
        while frame != ancestor:
            link = self._fixed.get(frame)
            if link is None:
                link = self._at(self._moving[frame], time)
            if link is None:
                return None
            pose, frame = placed(link, pose), self._parents[frame]
        return pose

    @staticmethod
    def _at(links: deque[tuple[int, np.ndarray]], time: int) -> np.ndarray | None:
        after = None
        for moment, link in reversed(links):
            if moment == time:
                return link
            if moment < time:
                if after is None:
                    return None
                share = (time - moment) / (after[0] - moment)
                step = seen_from(link, after[1])
                return placed(link, np.array([*(share * step[:2]), share * step[2]]))
            after = moment, link
        return None

    def _move(self, message: TFMessage) -> None:
        for link in message.transforms:
            time = nanoseconds(link.header.stamp)
            links = self._moving.setdefault(link.child_frame_id, deque(maxlen=MOST_TIMES))
            while links and links[-1][0] >= time:  # sent again, or time has gone back
                links.pop()
            links.append((time, self._pose(link)))
            self._parents[link.child_frame_id] = link.header.frame_id
        self._tell()

    def _fix(self, message: TFMessage) -> None:
        for link in message.transforms:
            self._fixed[link.child_frame_id] = self._pose(link)
            self._parents[link.child_frame_id] = link.header.frame_id
        self._tell()

    @staticmethod
    def _pose(link: Any) -> np.ndarray:
        place = link.transform.translation
        return np.array([place.x, place.y, heading_of(link.transform.rotation)])

    def _tell(self) -> None:
        for listener in self.listeners:
            listener()


class Placed:
    """Hands on messages with the pose of a frame at their stamp, as soon as it is known.

    Args:
        transforms: where the poses are from.
        target: the frame in which the poses shall be.
        handle: called as handle(message, pose), in the order of the messages. Messages whose pose does not become
            known are dropped.
    """

    def __init__(self, transforms: Transforms, target: str, handle: Callable[[Any, np.ndarray], None]) -> None:
        self.target = target
        self._transforms, self._handle = transforms, handle
        self._waiting: deque[tuple[Any, str]] = deque(maxlen=MOST_WAITING)
        transforms.listeners.append(self._try)

    def add(self, message: Any, frame: str | None = None) -> None:
        """Takes a message; the frame is that of its header if none is given."""
        self._waiting.append((message, frame or message.header.frame_id))
        self._try()

    def _try(self) -> None:
        number = 0
        while number < len(self._waiting):
            message, frame = self._waiting[number]
            number += 1
            pose = self._transforms.pose(self.target, frame, nanoseconds(message.header.stamp))
            if pose is not None:
                for _ in range(number):  # earlier ones came before the first transforms
                    self._waiting.popleft()
                number = 0
                self._handle(message, pose)
