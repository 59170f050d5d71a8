#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Makes a map from scans and the poses of the sensor on /tf, and publishes it.

  python -m stagesim.ros simple.world
  python examples/ros/mapper.py --ros-args -r base_scan:=/r0/base_scan1 -p frame:=r0/odom

It trusts the transforms: with poses by GPS or odometry without errors the map is exact, otherwise it drifts as odometry
does. Parameters: `frame` (odom) of the map, `side` (40 m), `resolution` (0.05 m), `namespace` of the topics tf and
tf_static (empty).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import rclpy
from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

from grids import Grid, along, bearings_of, ends_of
from programs import run
from transforms import KEPT, Placed, Transforms

HIT, PASSED, MOST = 0.9, -0.4, 4.0  # changes of the logarithm of the odds that a cell is occupied, and their limit


class Map:
    """The logarithms of the odds that cells are occupied, as in Moravec and Elfes (1985); 0 is unknown."""

    def __init__(self, side: float, resolution: float) -> None:
        self.grid = Grid.square(side, resolution, 0.0, np.float32)

    def see(self, pose: np.ndarray, bearings: np.ndarray, ranges: np.ndarray, most: float) -> None:
        """Adds the scan of a sensor at `pose`; rays without a hit are free up to `most` metres."""
        hit = np.isfinite(ranges)
        seen = hit | (ranges == np.inf)
        ends = ends_of(pose, bearings[seen], np.where(hit, ranges, most)[seen])
        occupied = self.grid.mask(ends[hit[seen]])
        free = self.grid.mask(along(pose[:2], ends, self.grid.resolution / 2))
        change = np.where(occupied, HIT, np.where(free, PASSED, 0.0))
        np.clip(self.grid.cells + change, -MOST, MOST, out=self.grid.cells)

    def occupancy(self) -> np.ndarray:
        """Percentages, as in nav_msgs/OccupancyGrid: -1 for cells that no ray has reached; int8."""
        odds = self.grid.cells
        return np.where(odds == 0, -1, np.round(100 / (1 + np.exp(-odds)))).astype(np.int8)


class Mapper(Node):
    """The node; `map` is its map, `scans` the number of scans in it."""

    def __init__(self, cli_args: list[str] | None = None, **parameters: Any) -> None:
        overrides = [rclpy.Parameter(name, value=value) for name, value in parameters.items()]
        super().__init__("mapper", parameter_overrides=overrides, cli_args=cli_args)
        frame = self.declare_parameter("frame", "odom").value
        self.map = Map(self.declare_parameter("side", 40.0).value, self.declare_parameter("resolution", 0.05).value)
        self.scans = 0
        self._stamp: Any = None
        self._placed = Placed(Transforms(self, self.declare_parameter("namespace", "").value), frame, self._see)
        self.create_subscription(LaserScan, "base_scan", self._placed.add, 100)
        self._out = self.create_publisher(OccupancyGrid, "map", KEPT)
        self.create_timer(1.0, self._publish)

    def _see(self, scan: LaserScan, pose: np.ndarray) -> None:
        self.map.see(pose, bearings_of(scan), np.array(scan.ranges), scan.range_max)
        self.scans += 1
        self._stamp = scan.header.stamp

    def _publish(self) -> None:
        if self._stamp is not None:
            self._out.publish(self.map.grid.message(self._placed.target, self._stamp, self.map.occupancy()))
            self._stamp = None


def main() -> None:
    run(Mapper)


if __name__ == "__main__":
    main()
