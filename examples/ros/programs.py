# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs the nodes of the programs in this folder."""

from __future__ import annotations

import sys
from typing import Callable

import rclpy
from rclpy.node import Node


def run(make: Callable[[], Node]) -> None:
    """Runs the node that `make` returns until it is interrupted, or ROS is shut down."""
    rclpy.init(args=sys.argv)
    try:
        rclpy.spin(make())
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
