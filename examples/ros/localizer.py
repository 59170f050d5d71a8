#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Localizes a robot on /map by its scans and its odometry, with particles, as AMCL does.

  python -m stagesim.ros simple.world --ros-args -p publish_map:=true
  python examples/ros/localizer.py --ros-args -r base_scan:=/r0/base_scan1 -r initialpose:=/r0/initialpose -p odom_frame:=r0/odom -p base_frame:=r0/base_footprint -p start:='[0.3, -6.2, 1.4]'

It publishes the transform from the map to the odometry's frame on /tf, and the pose on amcl_pose. It starts around `start`
(x, y, heading), and again around each pose on initialpose. Parameters: `particles` (800), `beams` of a scan that it uses
(60), `deviations` of the start ([0.3, 0.3, 0.2]), `odometry_errors` (see Filter), `map_frame`, `odom_frame` and
`base_frame`, `namespace` of the topics tf and tf_static (empty), `seed` (1).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from grids import Grid, bearings_of, ends_of
from programs import run
from transforms import KEPT, Placed, Transforms, nanoseconds, placed, pose_of, seen_from

OCCUPIED = 65  # per cent, from which a cell of the map is occupied
SIGMA, FURTHEST = 0.05, 0.4  # standard deviation of a beam's end from the nearest obstacle, and its limit, metres
CHANCE = 0.05  # share of beams that end anywhere
TRUST = 0.3  # beams are not independent: each counts as so many


def distances(occupied: np.ndarray, resolution: float) -> np.ndarray:
    """The distance of each cell from the nearest occupied one, metres, at most FURTHEST."""
    reach = round(FURTHEST / resolution)
    squares = np.where(occupied, 0.0, (reach + 1.0)**2)
    for axis in (0, 1):
        wide = np.pad(squares, [(reach, reach) if a == axis else (0, 0) for a in (0, 1)], constant_values=np.inf)
        count = squares.shape[axis]
        squares = np.min([np.take(wide, range(reach + k, reach + k + count), axis) + k * k
                          for k in range(-reach, reach + 1)], 0)
    return np.minimum(np.sqrt(squares) * resolution, FURTHEST)


class Filter:
    """A particle filter with a likelihood field: Thrun, Burgard and Fox, Probabilistic Robotics (2005), 5.4 and 6.4.

    Args:
        grid: the map.
        particles: their number.
        odometry_errors: standard deviations: of a turn per radian turned and per metre driven, and of a way per metre
            driven and per radian turned.
    """

    def __init__(self, grid: Grid, particles: int, odometry_errors: Any, seed: int) -> None:
        self._grid = grid
        near = distances(grid.cells >= OCCUPIED, grid.resolution)
        chances = (1 - CHANCE) * np.exp(-0.5 * (near / SIGMA)**2) + CHANCE
        self._field = np.pad(TRUST * np.log(chances), 1, constant_values=TRUST * np.log(CHANCE))
        self._errors = odometry_errors
        self._random = np.random.default_rng(seed)
        self.poses = np.zeros((particles, 3))
        self.weights = np.full(particles, 1 / particles)

    def start(self, pose: np.ndarray, deviations: np.ndarray) -> None:
        """Puts the particles around a pose."""
        self.poses = pose + self._random.normal(size=self.poses.shape) * deviations
        self.weights[:] = 1 / len(self.weights)

    def move(self, step: np.ndarray) -> None:
        """Moves the particles: `step` is the pose now in the frame of the pose before."""
        way = np.hypot(step[0], step[1])
        per_turn, turn_per_way, per_way, way_per_turn = self._errors
        turns = per_turn * abs(step[2]) + turn_per_way * way
        ways = per_way * way + way_per_turn * abs(step[2])
        noise = self._random.normal(size=self.poses.shape) * [ways, ways, turns]
        self.poses = placed(self.poses, step + noise)

    def see(self, mount: np.ndarray, bearings: np.ndarray, ranges: np.ndarray) -> None:
        """Weighs the particles by a scan of a sensor at `mount` on the robot, and resamples them if few matter."""
        ends = ends_of(mount, bearings, ranges) @ [1, 1j]
        x, y, turn = self.poses.T[:, :, None]
        ends = ends * np.exp(1j * turn) + (x + 1j * y)
        found = self._grid.indices(np.stack([ends.real, ends.imag], -1)) + 1
        found = np.clip(found, 0, np.array(self._field.shape) - 1)
        likelihood = self._field[found[..., 0], found[..., 1]].sum(1)
        self.weights *= np.exp(likelihood - likelihood.max())
        self.weights /= self.weights.sum()
        if 1 / (self.weights**2).sum() < len(self.weights) / 2:
            self._resample()

    def _resample(self) -> None:
        count = len(self.weights)
        marks = (self._random.random() + np.arange(count)) / count
        chosen = np.searchsorted(np.cumsum(self.weights), marks)
        self.poses = self.poses[np.minimum(chosen, count - 1)]
        self.weights[:] = 1 / count

    def estimate(self) -> np.ndarray:
        """The mean of the particles, shape (3,)."""
        turn = np.angle(self.weights @ np.exp(1j * self.poses[:, 2]))
        return np.array([*(self.weights @ self.poses[:, :2]), turn])

    def variances(self) -> np.ndarray:
        """The variances of the particles, shape (3,)."""
        return self.weights @ seen_from(self.estimate(), self.poses)**2


class Localizer(Node):
    """The node; `pose` is the believed pose of the robot at the stamp of the last scan, `time` (ns)."""

    def __init__(self, cli_args: list[str] | None = None, **parameters: Any) -> None:
        overrides = [rclpy.Parameter(name, value=value) for name, value in parameters.items()]
        super().__init__("localizer", parameter_overrides=overrides, cli_args=cli_args)
        defaults = {"particles": 800, "beams": 60, "start": [0.0, 0.0, 0.0], "deviations": [0.3, 0.3, 0.2], "seed": 1,
                    "odometry_errors": [0.03, 0.02, 0.05, 0.01], "map_frame": "map", "odom_frame": "odom",
                    "base_frame": "base_footprint", "namespace": ""}
        self._get = {name: self.declare_parameter(name, value).value for name, value in defaults.items()}
        self.pose, self.time = np.zeros(3), -1
        self._filter: Filter | None = None
        self._odom: np.ndarray | None = None  # pose of the robot at the last scan, in the frame of the odometry
        self._begin = np.array(self._get["start"]), np.array(self._get["deviations"])
        self._transforms = Transforms(self, self._get["namespace"])
        self._placed = Placed(self._transforms, self._get["odom_frame"], self._see)
        self.create_subscription(OccupancyGrid, "/map", self._take_map, KEPT)
        self.create_subscription(LaserScan, "base_scan", self.take_scan, 100)
        self.create_subscription(PoseWithCovarianceStamped, "initialpose", self._start, 10)
        self._tf = self.create_publisher(TFMessage, f"{self._get['namespace']}/tf", 100)
        self._out = self.create_publisher(PoseWithCovarianceStamped, "amcl_pose", 10)

    def take_scan(self, scan: LaserScan) -> None:
        """Takes a scan, which waits for the transforms of its time."""
        self._placed.add(scan)

    def _take_map(self, message: OccupancyGrid) -> None:
        self._filter = Filter(Grid.from_message(message), self._get["particles"], self._get["odometry_errors"],
                              self._get["seed"])
        self._filter.start(*self._begin)

    def _start(self, message: PoseWithCovarianceStamped) -> None:
        variances = np.array(message.pose.covariance)[[0, 7, 35]]
        self._begin = pose_of(message.pose.pose), np.sqrt(np.where(variances > 0, variances, self._begin[1]**2))
        if self._filter is not None:
            self._filter.start(*self._begin)

    def _see(self, scan: LaserScan, eye: np.ndarray) -> None:
        time = nanoseconds(scan.header.stamp)
        mount = self._transforms.pose(self._get["base_frame"], scan.header.frame_id, time)
        if self._filter is None or mount is None:
            return
        odom = placed(eye, seen_from(mount, np.zeros(3)))
        if self._odom is not None:
            self._filter.move(seen_from(self._odom, odom))
        self._odom = odom
        ranges, bearings = np.array(scan.ranges), bearings_of(scan)
        hits = np.flatnonzero(np.isfinite(ranges) & (ranges < scan.range_max))
        used = hits[np.linspace(0, len(hits) - 1, min(len(hits), self._get["beams"])).astype(int)] if len(hits) else hits
        self._filter.see(mount, bearings[used], ranges[used])
        self.pose, self.time = self._filter.estimate(), time
        self._publish(scan.header.stamp, odom)

    def _publish(self, stamp: Any, odom: np.ndarray) -> None:
        link = TransformStamped()
        link.header.stamp, link.header.frame_id = stamp, self._get["map_frame"]
        link.child_frame_id = self._get["odom_frame"]
        frame = placed(self.pose, seen_from(odom, np.zeros(3)))
        link.transform.translation.x, link.transform.translation.y = map(float, frame[:2])
        link.transform.rotation.z, link.transform.rotation.w = np.sin(frame[2] / 2), np.cos(frame[2] / 2)
        self._tf.publish(TFMessage(transforms=[link]))
        pose = PoseWithCovarianceStamped(header=link.header)
        pose.pose.pose.position.x, pose.pose.pose.position.y = map(float, self.pose[:2])
        pose.pose.pose.orientation.z, pose.pose.pose.orientation.w = np.sin(self.pose[2] / 2), np.cos(self.pose[2] / 2)
        pose.pose.covariance[[0, 7, 35]] = self._filter.variances()
        self._out.publish(pose)


def main() -> None:
    run(Localizer)


if __name__ == "__main__":
    main()
