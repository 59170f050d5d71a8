# SPDX-License-Identifier: GPL-2.0-or-later
"""Maps of square cells, and the cells that rays pass."""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from typing import Any

import numpy as np
from nav_msgs.msg import OccupancyGrid

from transforms import pose_of


@dataclass
class Grid:
    """A map whose axes are those of its frame.

    Attributes:
        cells: a value for each cell, shape (rows, columns); rows are along y, columns along x.
        resolution: side of a cell, metres.
        origin: x and y of the corner of the first cell, metres, shape (2,).
    """

    cells: np.ndarray
    resolution: float
    origin: np.ndarray

    @classmethod
    def square(cls, side: float, resolution: float, value: Any, kind: Any) -> Grid:
        """A square map with the middle (0, 0): `side` in metres, `kind` of the values."""
        count = round(side / resolution)
        return cls(np.full((count, count), value, kind), resolution, np.full(2, -count * resolution / 2))

    @classmethod
    def from_message(cls, message: OccupancyGrid) -> Grid:
        """Raises ValueError: the map is turned."""
        x, y, turn = pose_of(message.info.origin)
        if turn != 0:
            raise ValueError(f"found a map turned by {turn:g} rad, expected one along its frame")
        cells = np.array(message.data, np.int8).reshape(message.info.height, message.info.width)
        return cls(cells, message.info.resolution, np.array([x, y]))

    def indices(self, points: np.ndarray) -> np.ndarray:
        """The row and column of the cells of points (x, y), shape (..., 2); they may lie outside of the map."""
        return np.floor((points[..., ::-1] - self.origin[::-1]) / self.resolution).astype(int)

    def inside(self, indices: np.ndarray) -> np.ndarray:
        """Whether cells are in the map, shape (...)."""
        return ((indices >= 0) & (indices < self.cells.shape)).all(-1)

    def mask(self, points: np.ndarray) -> np.ndarray:
        """True for the cells of the points that lie in the map, shape (rows, columns)."""
        found = self.indices(points)
        mask = np.zeros(self.cells.shape, bool)
        mask[tuple(found[self.inside(found)].T)] = True
        return mask

    def set(self, points: np.ndarray, value: Any) -> None:
        """Sets the cells of the points that lie in the map."""
        self.cells[self.mask(points)] = value

    def message(self, frame: str, stamp: Any, occupancy: np.ndarray) -> OccupancyGrid:
        """The map as a message, with a percentage for each cell, or -1 for unknown: int8, of the shape of the cells."""
        message = OccupancyGrid()
        message.header.frame_id, message.header.stamp = frame, stamp
        info = message.info
        info.resolution, (info.height, info.width) = self.resolution, self.cells.shape
        (info.origin.position.x, info.origin.position.y), info.origin.orientation.w = map(float, self.origin), 1.0
        message.data = array("b", occupancy.astype(np.int8).tobytes())
        return message


def bearings_of(scan: Any) -> np.ndarray:
    """The angles of a scan's rays from the axis of the sensor, shape (n,)."""
    return scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))


def ends_of(pose: np.ndarray, bearings: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """The ends of rays from a pose, shape (n, 2)."""
    angles = pose[2] + bearings
    return pose[:2] + ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)


def along(start: np.ndarray, ends: np.ndarray, spacing: float) -> np.ndarray:
    """Points on the rays from `start` to `ends`, half a spacing or less before the end: shape (m, 2)."""
    ways = ends - start
    lengths = np.hypot(*ways.T)
    counts = np.ceil(lengths / spacing).astype(int)
    rays = np.repeat(np.arange(len(ends)), counts)
    steps = np.arange(len(rays)) - np.repeat(np.cumsum(counts) - counts, counts)
    return start + ways[rays] * ((steps + 0.5) / counts[rays])[:, None]
