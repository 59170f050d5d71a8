# SPDX-License-Identifier: GPL-2.0-or-later
"""Names of topics, frames and robots, in the scheme of stage_ros2 or stage_ros. Logs have the same names."""

from __future__ import annotations

from .. import _core
from .._core import (BASE_FRAME, FOOTPRINT_FRAME, MAP_FRAME, ODOMETRY_FRAME, ODOMETRY_TOPIC, SCAN_TOPIC,
                     NamingScheme, joined, ros_name, sensor_name)

__all__ = ["BASE_FRAME", "FOOTPRINT_FRAME", "MAP_FRAME", "ODOMETRY_FRAME", "ODOMETRY_TOPIC", "SCAN_TOPIC", "SCHEMES",
           "NamingScheme", "joined", "ros_name", "sensor_name"]

SCHEMES = {scheme.name: scheme for scheme in _core.naming_schemes()}
