# SPDX-License-Identifier: GPL-2.0-or-later
"""Publishes /clock."""

from __future__ import annotations

import time

from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from .messages import stamp_of


class ClockFeed:
    """Publishes simulated time, once per step or at a fixed rate.

    Args:
        node: the node.
        rate: messages per second of real time; 0: one per step.
    """

    def __init__(self, node: Node, rate: float) -> None:
        self._publisher = node.create_publisher(Clock, "/clock", 10)
        self._rate = rate
        self.begin()

    def begin(self) -> None:
        """Starts anew after a reset or a restore: time may go back."""
        self._published = -1  # the last published time, microseconds
        self._due = 0.0  # real time at which the next message is due, seconds

    def tell(self, now: int, always: bool = False) -> None:
        """Publishes the time `now` (microseconds) if a message is due or `always`. It never goes back."""
        real = time.monotonic()
        if self._rate > 0:
            if real < self._due and not always:
                return
            due = self._due + 1 / self._rate
            self._due = due if due > real else real + 1 / self._rate
        self._published = max(now, self._published)
        message = Clock()
        message.clock.sec, message.clock.nanosec = (int(part) for part in stamp_of(self._published))
        self._publisher.publish(message)

    def wait(self) -> float:
        """Seconds of real time until the next message is due; infinity if messages come only with steps."""
        return max(0.0, self._due - time.monotonic()) if self._rate > 0 else float("inf")
