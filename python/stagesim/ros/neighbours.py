# SPDX-License-Identifier: GPL-2.0-or-later
"""Knowledge of robots about others: messages of their radios with range and bearing, and the things that they touch."""

from __future__ import annotations

import sys
from array import array
from typing import Any, Callable

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from visualization_msgs.msg import Marker, MarkerArray

from .._core import Model
from ..fleet import Fleet
from .feeds import MAX_DETECTIONS, Bodies, DetectionsFeed, Feed
from .messages import Array

#: A message that a radio has received, as a point: the position of the sender in the frame of the radio, its range and
#: bearing, the id of its radio, the time of sending, and the payload.
RECEIVED = np.dtype([("x", np.float32), ("y", np.float32), ("z", np.float32), ("range", np.float32),
                     ("bearing", np.float32), ("sender", np.int32), ("sent", np.float64), ("size", np.int32),
                     ("data", np.uint8, 64)])
FIELDS = {np.float32: PointField.FLOAT32, np.float64: PointField.FLOAT64, np.int32: PointField.INT32,
          np.uint8: PointField.UINT8}


def fields_of(kind: np.dtype[Any]) -> list[PointField]:
    """The fields of a point whose bytes are those of a NumPy structure."""
    fields = []
    for name, (part, offset, *_) in (kind.fields or {}).items():
        fields.append(PointField(name=name, offset=offset, datatype=FIELDS[part.base.type],
                                 count=int(np.prod(part.shape, dtype=int))))
    return fields


class RadioFeed(Feed):
    """The messages that a radio has received in its last update, as a point for each."""

    message = PointCloud2

    def __init__(self, topic: str, interval: int, robot: int, sights: Callable[[], Any], frame: str) -> None:
        super().__init__(topic, interval)
        self._robot, self._get, self._frame = robot, sights, frame
        self._heard: Any = None
        self._fields = fields_of(RECEIVED)

    def connect(self) -> None:
        self._heard = self._get()

    def make(self, stamp: Array) -> PointCloud2:
        heard, row = self._heard, self._robot
        points = np.zeros(min(int(heard.count[row]), MAX_DETECTIONS), RECEIVED)
        for name in ("range", "bearing", "sender", "sent", "size", "data"):
            points[name] = getattr(heard, name)[row, :len(points)]
        points["x"] = points["range"] * np.cos(points["bearing"])
        points["y"] = points["range"] * np.sin(points["bearing"])
        message = PointCloud2(height=1, width=len(points), fields=self._fields, point_step=RECEIVED.itemsize,
                              row_step=RECEIVED.itemsize * len(points), is_bigendian=sys.byteorder == "big",
                              is_dense=True, data=array("B", points.tobytes()))
        message.header.frame_id = self._frame
        message.header.stamp.sec, message.header.stamp.nanosec = int(stamp[0]), int(stamp[1])
        return message


class ContactsFeed(DetectionsFeed):
    """An arrow for each place where a robot touches something, away from the robot, with the name of the thing."""

    sensor = False

    def __init__(self, topic: str, robot: int, bodies: Bodies, fleet: Fleet, ids: set[int], frame: str) -> None:
        super().__init__(topic, 0, robot, bodies.contacts, frame)
        self._fleet, self._ids = fleet, ids

    def connect(self) -> None:
        pass

    def make(self, stamp: Array) -> MarkerArray:
        places = self._get()
        x, y, heading = self._fleet.pose[self._robot]
        c, s = np.cos(heading), np.sin(heading)
        markers = [self._marker(stamp, -1, Marker.DELETEALL)]
        for pair, point, normal in zip(places.models, places.points, places.normals):
            for own, other, sign in ((pair[0], pair[1], 1.0), (pair[1], pair[0], -1.0)):
                if int(own) in self._ids:
                    marker = self._marker(stamp, len(markers) - 1)
                    marker.text = name_of(self._fleet, int(other))
                    marker.pose.position.x = float(c * (point[0] - x) + s * (point[1] - y))
                    marker.pose.position.y = float(c * (point[1] - y) - s * (point[0] - x))
                    half = (np.arctan2(sign * normal[1], sign * normal[0]) - heading) / 2
                    marker.pose.orientation.z, marker.pose.orientation.w = float(np.sin(half)), float(np.cos(half))
                    marker.scale.x, marker.scale.y, marker.scale.z = 0.2, 0.03, 0.03
                    marker.color.r = 1.0
                    markers.append(marker)
        return MarkerArray(markers=markers)


def name_of(fleet: Fleet, number: int) -> str:
    """The name of a model; empty if it is gone."""
    model: Model | None = fleet.world._core.find_id(number)
    return "" if model is None else model.name
