#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Saves a map from the topic `map` as files for map_server and `stage import`, as map_saver of Nav2 does.

  python examples/ros/save_map.py NAME.yaml

It waits for a message on `map`, writes NAME.yaml and NAME.pgm, and ends. To save another topic: --ros-args -r map:=/r0/map.
Cells from 65 % on become walls, the others free; unknown ones stay unknown.
"""

from __future__ import annotations

import sys

import numpy as np
import rclpy
from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node
from rclpy.utilities import remove_ros_args

from stagesim.maps import write_map
from stagesim.scenes import GridMap
from transforms import KEPT, pose_of


def grid_map_of(message: OccupancyGrid) -> GridMap:
    """Converts a map. Raises ValueError if the message has another number of cells than its size says."""
    info = message.info
    cells = np.array(message.data, np.int8).reshape(info.height, info.width)
    return GridMap(cells, info.resolution, pose_of(info.origin).tolist())


class Saver(Node):
    """The node; `saved` is done when the map has been saved."""

    def __init__(self, file: str) -> None:
        super().__init__("save_map")
        self.saved = rclpy.Future()
        self._file = file
        self.create_subscription(OccupancyGrid, "map", self._save, KEPT)

    def _save(self, message: OccupancyGrid) -> None:
        if not self.saved.done():
            map = grid_map_of(message)
            write_map(map, self._file)
            self.saved.set_result(True)
            self.get_logger().info(f"{self._file}: {map.shape[1]} x {map.shape[0]} cells, "
                                   f"{int(map.occupied.sum())} of them occupied")


def main() -> None:
    rclpy.init(args=sys.argv)
    names = remove_ros_args(sys.argv)[1:]
    if len(names) != 1:
        sys.exit(f"save_map.py: found {len(names)} arguments, expected the name of a file such as map.yaml")
    try:
        saver = Saver(names[0])
        rclpy.spin_until_future_complete(saver, saver.saved)
    except (OSError, ValueError) as error:
        sys.exit(f"save_map.py: {error}")
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
