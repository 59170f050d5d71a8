# SPDX-License-Identifier: GPL-2.0-or-later
"""Parameters of topics: a maximum rate for each kind, and ROS's overrides of the quality of service."""

from __future__ import annotations

import math
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions

from .parameters import Parameter

#: Kinds of topics, as docs/ros_reference.md names them without numbers.
KINDS = ("odom", "ground_truth", "scan", "image", "depth", "camera_info", "fiducials", "blobs", "bumper", "readings",
         "range_and_bearing", "contacts", "stall", "imu", "joint_states", "wheel_ticks", "battery", "amcl_pose", "tf")

RATES = {f"topics.{kind}.rate": Parameter(
    0.0, f"most messages per simulated second on each topic of the kind {kind}; 0: all", "a number, 0 or more",
    lambda value: 0 <= value < math.inf) for kind in KINDS}


class Limit:
    """Lets the first message of each period pass, and drops the others.

    Attributes:
        kind: the kind of topic.
        rate: number of periods per simulated second; 0: all messages pass.
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.rate = 0.0
        self._period = -1

    def passes(self, now: int) -> bool:
        """Whether a message of the time `now` (microseconds) is published. Time may go back."""
        if self.rate == 0:
            return True
        period = math.floor(now * self.rate / 1e6 + 1e-9)
        passes, self._period = period != self._period, period
        return passes


def read_rates(node: Node, limits: list[Limit]) -> None:
    """Sets the rates to those of the parameters."""
    rates = {kind: float(node.get_parameter(f"topics.{kind}.rate").value) for kind in KINDS}
    for limit in limits:
        limit.rate = rates[limit.kind]


def make_publisher(node: Node, message: type, topic: str, qos: Any) -> Any:
    """Makes a publisher whose quality of service ROS's parameters qos_overrides can change.

    Raises:
        ValueError: a parameter has an invalid value.
    """
    try:
        return node.create_publisher(message, topic, qos,
                                     qos_overriding_options=QoSOverridingOptions.with_default_policies())
    except RuntimeError as error:
        if not rclpy.ok():
            raise
        reason = str(error).splitlines()[0]
        raise ValueError(f"qos_overrides.{node.resolve_topic_name(topic)}.publisher: {reason}") from None
