# SPDX-License-Identifier: GPL-2.0-or-later
"""The topics /map and /map_metadata: what stands still in the world."""

from __future__ import annotations

import math
import time
from array import array
from typing import TYPE_CHECKING

import numpy as np
from nav_msgs.msg import MapMetaData, OccupancyGrid
from rclpy.qos import DurabilityPolicy, QoSProfile

from ..maps import map_of
from ..scenes import GridMap

if TYPE_CHECKING:
    from .node import StageNode

#: Seconds of real time between two looks for changes of the world.
PERIOD = 1.0
KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class MapFeed:
    """Publishes the map of a world, and again when the scenery has changed. Late subscribers get the last one.

    A world that was made of a map has a map like that, with its unknown cells.
    """

    def __init__(self, node: StageNode) -> None:
        self._node, self._world = node, node.world
        height = float(node.get_parameter("map_height").value)
        self._height = height if height >= 0 else None
        self._resolution = float(node.get_parameter("map_resolution").value)
        self._frame = str(node.get_parameter("map_frame_id").value)
        scene = self._world._recipe.scene
        self._given: GridMap | None = None if scene is None else scene.map
        self._last_look, self._fingerprint = -math.inf, -1
        self._map = node.create_publisher(OccupancyGrid, "/map", KEPT)
        self._metadata = node.create_publisher(MapMetaData, "/map_metadata", KEPT)

    def look(self, now: int, at_once: bool = False) -> None:
        """Publishes the map if it is new; looks once per period.

        Args:
            now: simulated time, microseconds.
            at_once: True: looks now.
        """
        if not at_once and time.monotonic() - self._last_look < PERIOD:
            return
        self._last_look = time.monotonic()
        fingerprint = self._world._core.scenery_fingerprint(self._height)
        if fingerprint != self._fingerprint:
            self._fingerprint = fingerprint
            self._publish(now)

    def _publish(self, now: int) -> None:
        try:
            made = map_of(self._world, self._resolution, height=self._height, like=self._given)
        except ValueError as error:
            self._node.get_logger().warning(f"there is no /map: {error}")
            return
        message = OccupancyGrid()
        message.header.frame_id = self._frame
        message.header.stamp.sec, message.header.stamp.nanosec = now // 1_000_000, now % 1_000_000 * 1000
        message.info = self._information(made)
        message.info.map_load_time = message.header.stamp
        message.data = array("b", self._cells(made).tobytes())
        self._metadata.publish(message.info)
        self._map.publish(message)

    def _cells(self, made: GridMap) -> np.ndarray:  # type: ignore[type-arg]
        cells = np.asarray(made.array)
        given = None if self._given is None else np.asarray(self._given.array)
        if given is None or given.dtype == bool:
            return cells
        return np.where((given < 0) & (cells == 0), np.int8(-1), cells)

    @staticmethod
    def _information(made: GridMap) -> MapMetaData:
        rows, columns = made.shape
        information = MapMetaData(resolution=made.resolution, width=columns, height=rows)
        pose = information.origin
        pose.position.x, pose.position.y = made.origin[0], made.origin[1]
        pose.orientation.z, pose.orientation.w = math.sin(made.origin[3] / 2), math.cos(made.origin[3] / 2)
        return information
