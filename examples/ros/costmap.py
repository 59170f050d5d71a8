#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Keeps a map of obstacles that come and go, as the obstacle layer of Nav2's costmaps does.

  python -m stagesim.ros simple.world
  python examples/ros/costmap.py --ros-args -r base_scan:=/r0/base_scan1 -p frame:=r0/odom

Each scan frees the cells that its rays pass, and marks those where they end. Nav2 has the parameters `inf_is_valid` (true:
a ray without a hit, +Inf, frees cells), `obstacle_max_range` (hits further away mark nothing; 2.5 m),
`raytrace_max_range` (rays free cells up to there; 3 m) and `resolution` (0.05 m), too. Others are `side` (20 m), `frame`
(odom), and `namespace` of the topics tf and tf_static (empty).
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
from transforms import KEPT, Placed, Transforms, nanoseconds

UNKNOWN, FREE, OCCUPIED = -1, 0, 100


class Obstacles:
    """A map of obstacles.

    Attributes:
        grid: UNKNOWN, FREE or OCCUPIED for each cell, int8.
        inf_is_valid: a ray without a hit frees cells.
        obstacle_max_range, raytrace_max_range: up to where hits mark and rays free cells, metres.
    """

    def __init__(self, side: float, resolution: float, inf_is_valid: bool, obstacle_max_range: float,
                 raytrace_max_range: float) -> None:
        self.grid = Grid.square(side, resolution, UNKNOWN, np.int8)
        self.inf_is_valid = inf_is_valid
        self.obstacle_max_range, self.raytrace_max_range = obstacle_max_range, raytrace_max_range

    def see(self, pose: np.ndarray, bearings: np.ndarray, ranges: np.ndarray, most: float) -> None:
        """Takes a scan of a sensor at `pose` whose rays reach `most` metres."""
        hit = np.isfinite(ranges)
        valid = hit | ((ranges == np.inf) & self.inf_is_valid)
        reached = np.minimum(np.where(hit, ranges, most), self.raytrace_max_range)
        self.grid.set(along(pose[:2], ends_of(pose, bearings[valid], reached[valid]), self.grid.resolution / 2), FREE)
        near = hit & (ranges <= self.obstacle_max_range)
        self.grid.set(ends_of(pose, bearings[near], ranges[near]), OCCUPIED)


class Costmap(Node):
    """The node; `obstacles` is its map, `time` the stamp of the last scan in it (ns), -1 before."""

    def __init__(self, cli_args: list[str] | None = None, **parameters: Any) -> None:
        overrides = [rclpy.Parameter(name, value=value) for name, value in parameters.items()]
        super().__init__("costmap", parameter_overrides=overrides, cli_args=cli_args)
        frame = self.declare_parameter("frame", "odom").value
        defaults = {"side": 20.0, "resolution": 0.05, "inf_is_valid": True, "obstacle_max_range": 2.5,
                    "raytrace_max_range": 3.0}
        self.obstacles = Obstacles(*(self.declare_parameter(name, value).value for name, value in defaults.items()))
        self.time = -1
        self._placed = Placed(Transforms(self, self.declare_parameter("namespace", "").value), frame, self._see)
        self.create_subscription(LaserScan, "base_scan", self._placed.add, 100)
        self._out = self.create_publisher(OccupancyGrid, "costmap", KEPT)

    def _see(self, scan: LaserScan, pose: np.ndarray) -> None:
        self.obstacles.see(pose, bearings_of(scan), np.array(scan.ranges), scan.range_max)
        self.time = nanoseconds(scan.header.stamp)
        if self._out.get_subscription_count():
            grid = self.obstacles.grid
            self._out.publish(grid.message(self._placed.target, scan.header.stamp, grid.cells))


def main() -> None:
    run(Costmap)


if __name__ == "__main__":
    main()
