# SPDX-License-Identifier: GPL-2.0-or-later
"""The shares of time of the node on /diagnostics."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from .messages import stamp_of

if TYPE_CHECKING:
    from .node import StageNode

PERIOD = 1.0  #: seconds of real time between messages
ENOUGH = 0.95  #: share of the parameter `speed` below which the world counts as too slow


@dataclass(frozen=True)
class Moment:
    """Readings of clocks and counters at one time.

    Attributes:
        real, simulated: seconds of time.
        processor: seconds of all threads of this process.
        parts: StageNode.times.
    """

    real: float
    simulated: float
    processor: float
    parts: dict[str, float]

    @classmethod
    def now(cls, node: StageNode) -> Moment:
        """The present moment."""
        return cls(time.monotonic(), node.world.time, time.process_time(), dict(node.times))


class LoadFeed:
    """Publishes once per second what the last second was spent on. Without a subscriber, it computes nothing."""

    def __init__(self, node: StageNode) -> None:
        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._last_look = 0.0
        self._before: Moment | None = None

    def look(self) -> None:
        """Publishes a message if one is due and there is a subscriber."""
        if time.monotonic() - self._last_look < PERIOD:
            return
        self._last_look = time.monotonic()
        if self._publisher.get_subscription_count() == 0:
            self._before = None
            return
        before, now = self._before, Moment.now(self._node)
        self._before = now
        if before is not None and now.simulated >= before.simulated:  # a reset brings time back
            self._publisher.publish(self._message(before, now))

    def _message(self, before: Moment, now: Moment) -> DiagnosticArray:
        node, real = self._node, now.real - before.real
        speed = (now.simulated - before.simulated) / real
        shares = {name: 100 * (now.parts[part] - before.parts[part]) / real
                  for name, part in (("step", "step"), ("publish", "publish"), ("serve", "answer"))}
        shares["idle"] = max(0.0, 100 - sum(shares.values()))
        slow = node.is_paced and speed < ENOUGH * node.speed
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if slow else DiagnosticStatus.OK, name=f"{node.get_name()}: load",
            message="slower than the parameter speed" if slow else "paused" if node.paused else "in time")
        status.values = [
            KeyValue(key="speed", value=f"{speed:.3f}"),
            *(KeyValue(key=f"{name}, % of time", value=f"{share:.1f}") for name, share in shares.items()),
            KeyValue(key="process, % of a core", value=f"{100 * (now.processor - before.processor) / real:.1f}")]
        message = DiagnosticArray(status=[status])
        stamp = message.header.stamp
        stamp.sec, stamp.nanosec = (int(part) for part in stamp_of(node.now))
        return message
