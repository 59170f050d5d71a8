# SPDX-License-Identifier: GPL-2.0-or-later
"""What the node says on /clock."""

from __future__ import annotations

import time

from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from .messages import stamp_of


class ClockFeed:
    """Publishes simulated time, with each step or at a rate of its own.

    Args:
        node: that publishes.
        rate: messages in a second of real time; 0: one for each step.
    """

    def __init__(self, node: Node, rate: float) -> None:
        self._publisher = node.create_publisher(Clock, "/clock", 10)
        self._rate = rate
        self.begin()

    def begin(self) -> None:
        """Time may go back."""
        self._told = -1  # microseconds
        self._due = 0.0  # when the next message is due, in real time

    def tell(self, now: int, always: bool = False) -> None:
        """It is that time (microseconds). It goes back to no earlier one, and is published if it is due or `always`."""
        real = time.monotonic()
        if self._rate > 0:
            if real < self._due and not always:
                return
            due = self._due + 1 / self._rate
            self._due = due if due > real else real + 1 / self._rate
        self._told = max(now, self._told)
        message = Clock()
        message.clock.sec, message.clock.nanosec = (int(part) for part in stamp_of(self._told))
        self._publisher.publish(message)

    def wait(self) -> float:
        """Seconds of real time until the next message is due, whether a step comes or not; infinity: with a step."""
        return max(0.0, self._due - time.monotonic()) if self._rate > 0 else float("inf")
