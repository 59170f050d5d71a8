# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages with the same stamp belong to one instant, so a mapper finds the walls."""

from __future__ import annotations

import os
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Callable, Iterator

import numpy as np
import pytest
import stagesim as st
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from plugin import compile_plugin
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_testing import SENSOR, Client, node_here
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage
from transforms import seen_from  # from examples/ros

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])

# A square room, whose walls have inner faces at x, y = +-5 m.
WORLD = """interval_sim {step}
ray_model "exact"
model( pose [0 5.5 0 0] size [12 1 10] )
model( pose [0 -5.5 0 0] size [12 1 10] )
model( pose [5.5 0 0 0] size [1 12 10] )
model( pose [-5.5 0 0 0] size [1 12 10] )
position( name "r" size [0.4 0.4 0.4] pose [1 -2 0 30] localization "{localization}" localization_origin [0 0 0 0]
  odom_error [0 0 0 0] update_interval {robot}
  ranger( pose [0.05 0.02 0 5] update_interval {ranger}
    sensor( pose [0.05 0 0 10] range [0 20] fov 350 samples 36 ) ) )
"""


def microseconds(stamp: Any) -> int:
    return int(stamp.sec * 1_000_000 + stamp.nanosec // 1000)


def plane(transform: Any) -> np.ndarray:
    """Converts a transform to x, y and heading."""
    place = transform.translation if hasattr(transform, "translation") else transform.position
    turn = transform.rotation if hasattr(transform, "rotation") else transform.orientation
    return np.array([place.x, place.y, 2 * np.arctan2(turn.z, turn.w)])


def placed(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    c, s = np.cos(outer[2]), np.sin(outer[2])
    return np.array([outer[0] + c * inner[0] - s * inner[1], outer[1] + s * inner[0] + c * inner[1],
                     outer[2] + inner[2]])


class Listener:
    """Collects a node's messages by stamp."""

    def __init__(self, client: Client) -> None:
        self.scans = client.listen(LaserScan, "/base_scan", SENSOR)
        self.tf = client.listen(TFMessage, "/tf")
        self.fixed = client.listen(TFMessage, "/tf_static", QoSProfile(
            depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.odom = client.listen(Odometry, "/odom")
        self.truth = client.listen(Odometry, "/ground_truth")

    def count(self) -> int:
        """Number of messages so far."""
        return len(self.scans) + len(self.tf) + len(self.odom) + len(self.truth)

    def moving(self, child: str) -> dict[int, np.ndarray]:
        found: dict[int, np.ndarray] = {}
        for message in self.tf:
            for transform in message.transforms:
                if transform.child_frame_id == child:
                    found[microseconds(transform.header.stamp)] = plane(transform.transform)
        return found

    def place(self, frame: str, stamp: int) -> np.ndarray:
        """The pose of a frame at that time, in that of the odometry: through static links and moving ones."""
        fixed = {t.child_frame_id: t for message in self.fixed for t in message.transforms}
        moving = {t.child_frame_id: t for message in self.tf for t in message.transforms
                  if microseconds(t.header.stamp) == stamp}
        place = np.zeros(3)
        while frame != "odom":
            assert frame in fixed or frame in moving, (frame, stamp)
            assert not (frame in fixed and frame in moving)
            link = fixed.get(frame) or moving[frame]
            place = placed(plane(link.transform), place)
            frame = link.header.frame_id
        return place

    def errors_in_time(self) -> np.ndarray:
        """Distances of the scans' end points from the walls, if each ray has the interpolated pose of its time."""
        fixed = {t.child_frame_id: plane(t.transform) for message in self.fixed for t in message.transforms}
        moving = self.moving("base_footprint")
        times = np.array(sorted(moving), dtype=float)
        poses = np.array([moving[int(time)] for time in times])
        poses[:, 2] = np.unwrap(poses[:, 2])
        errors = []
        for scan in self.scans:
            at = microseconds(scan.header.stamp) + 1e6 * scan.time_increment * np.arange(len(scan.ranges))
            if at[0] < times[0] or at[-1] > times[-1]:
                continue
            base = np.array([np.interp(at, times, poses[:, axis]) for axis in range(3)])
            x, y, a = placed(base, placed(fixed["base_link"], fixed[scan.header.frame_id]))
            angles = a + scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
            ends = np.array([x + scan.ranges * np.cos(angles), y + scan.ranges * np.sin(angles)])
            errors.append(np.abs(np.abs(ends).max(0) - 5))
        return np.concatenate(errors)

    def errors(self) -> np.ndarray:
        """Distances of the scans' end points from the walls."""
        errors = []
        for scan in self.scans:
            x, y, a = self.place(scan.header.frame_id, microseconds(scan.header.stamp))
            angles = a + scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
            ends = np.array([x + scan.ranges * np.cos(angles), y + scan.ranges * np.sin(angles)])
            errors.append(np.abs(np.abs(ends).max(0) - 5))
        return np.concatenate(errors)


@contextmanager
def driven(client: Client, file: Path, speed: float, turn: float, late: int = 0) -> Iterator[tuple[Listener, Callable[[float], None]]]:
    """A node in this process whose robot drives, and which is listened to after `late` steps.

    Yields:
        What has been heard, and a function that makes steps for so many seconds.
    """
    with st.World(file) as world, node_here(world, publish_map_tf=True, base_watchdog_timeout=0.0) as node:
        twist = Twist()
        twist.linear.x, twist.angular.z = speed, turn
        client.talk(Twist, "/cmd_vel").publish(twist)
        client.until(lambda: node._executor.spin(0.01) or node.team.last_command[0] >= 0)
        for _ in range(late):
            node.advance()
        heard = Listener(client)
        topics = ("/base_scan", "/tf", "/odom", "/ground_truth")
        client.until(lambda: heard.fixed and all(node.count_subscribers(topic) for topic in topics))
        feeds = [feed for feed in node.team.feeds if f"/{feed.topic}" in topics]

        def all_are_served() -> bool:
            node._publish_to_new_subscribers()
            return all(feed.active for feed in (*feeds, *node.team.tf))

        client.until(all_are_served)

        def run(seconds: float) -> None:
            for _ in range(round(seconds / world.dt)):
                node.advance()
                client.spin()
            before = -1
            while heard.count() > before:  # until all that was sent has come
                before = heard.count()
                client.spin(0.1)

        yield heard, run


@pytest.mark.parametrize("localization", ("gps", "odom"))
@pytest.mark.parametrize("step, ranger, robot", ((5, 100, 100), (20, 100, 100), (100, 100, 100), (20, 30, 100),
                                                 (5, 20, 40)))
def test_a_mapper_finds_the_walls(client: Client, tmp_path: Any, step: int, ranger: int, robot: int,
                                  localization: str) -> None:
    file = tmp_path / "room.world"
    file.write_text(WORLD.format(step=step, ranger=ranger, robot=robot, localization=localization))
    # Subscribing after 7 steps must not shift the phase of the scans.
    with driven(client, file, 0.5, 1.2, late=7) as (heard, run):
        run(4)
        client.until(lambda: len(heard.scans) >= 3800 // max(step, ranger))

    errors = heard.errors() * 1e3
    print(f"node, {localization}, steps of {step} ms, updates {ranger} and {robot} ms: {errors.size} points, mm: "
          f"median {np.median(errors):.3f}, 90 % {np.quantile(errors, .9):.3f}, max {errors.max():.3f}")
    assert errors.max() < 0.01  # rounding of 32-bit floats

    # Updates happen in the first step at or after each multiple of the interval.
    stamps = [microseconds(scan.header.stamp) // 1000 for scan in heard.scans]
    first = stamps[0]
    expected = [-(-k * ranger // step) * step for k in range(1, 5000 // ranger)]
    assert stamps == [at for at in expected if at >= first][:len(stamps)]

    believed, truth = heard.moving("base_footprint"), {
        microseconds(message.header.stamp): plane(message.pose.pose) for message in heard.truth}
    assert len(truth) > 15
    for message in heard.odom:
        assert plane(message.pose.pose) == pytest.approx(believed[microseconds(message.header.stamp)], abs=1e-9)
    for stamp, pose in truth.items():
        if stamp in believed:
            assert pose == pytest.approx(believed[stamp], abs=1e-9)
    # The estimate is exact, so the transform from map to odometry is the identity.
    origins = heard.moving("odom")
    assert origins
    for origin in origins.values():
        assert origin == pytest.approx(np.zeros(3), abs=1e-9 if localization == "odom" else 0)


def test_the_twist_of_a_blocked_robot_is_zero(client: Client, tmp_path: Any) -> None:
    file = tmp_path / "room.world"
    file.write_text(WORLD.format(step=100, ranger=100, robot=100, localization="odom")
                    .replace("pose [1 -2 0 30]", "pose [4.6 0 0 0]"))
    with driven(client, file, 0.5, 0.0) as (heard, run):
        run(1)
        client.until(lambda: len(heard.truth) > 9 and len(heard.odom) > 9)
    for got in (heard.truth, heard.odom):
        assert got[-1].twist.twist.linear.x == 0
        assert got[-1].pose.pose == got[-3].pose.pose


TURNS = """
#include "stage.hh"
extern "C" int Init(Stg::Model* mod, Stg::CtrlArgs*) {
  mod->Subscribe();
  if (auto* joint = dynamic_cast<Stg::ModelActuator*>(mod)) joint->SetSpeed(1.5);
  if (auto* robot = dynamic_cast<Stg::ModelPosition*>(mod)) robot->SetSpeed(0.1, 0, -1);
  return 0;
}
"""
#: Models that carry the ranger on the robot; the ranger is inserted into their section.
CARRIERS = {
    "rotational actuator":
        'actuator( type "rotational" max_speed 2 min_position -1000 max_position 1000 ctrl "{}" ',
    "linear actuator":
        'actuator( type "linear" axis [0.6 0.8 0] max_speed 2 min_position -10 max_position 10 ctrl "{}" ',
    "actuator with a model on it":
        'actuator( pose [0.1 0 0 20] type "rotational" max_speed 2 min_position -1000 max_position 1000 ctrl "{}" '
        'model( pose [0.2 0.1 0 30] ',
    "robot": 'position( name "n" size [0.2 0.2 0.2] pose [0.1 0.05 0 40] ctrl "{}" ',
}


@pytest.fixture(scope="module")
def turns(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The compiled controller."""
    plugin = tmp_path_factory.mktemp("turns") / "turns.so"
    compile_plugin(TURNS, plugin, ROOT)
    return plugin


@pytest.mark.parametrize("step", (20, 100))
@pytest.mark.parametrize("carrier", CARRIERS)
def test_frames_of_sensors_move_with_their_carrier(client: Client, tmp_path: Path, turns: Path, carrier: str,
                                                   step: int) -> None:
    inner = CARRIERS[carrier].format(turns)
    text = WORLD.format(step=step, ranger=100, robot=100, localization="odom").replace("  ranger(", f"  {inner}ranger(")
    file = tmp_path / "room.world"
    file.write_text(text + ")" * inner.count("( "))
    with driven(client, file, 0.2, 1.2) as (heard, run):
        run(2)
        client.until(lambda: len(heard.scans) >= 15)
    errors = heard.errors() * 1e3
    print(f"{carrier}, steps of {step} ms: {errors.size} points, mm: max {errors.max():.3f}")
    assert errors.max() < 0.01  # ranges are 32-bit floats
    stamps = [microseconds(scan.header.stamp) for scan in heard.scans]
    mounts = [seen_from(heard.place("base_footprint", stamp), heard.place("base_scan_link", stamp)) for stamp in stamps]
    assert len(mounts) >= 15 and np.ptp(mounts, 0).max() > 0.5


def test_a_mapper_that_knows_the_time_of_each_ray_finds_the_walls(client: Client, tmp_path: Any) -> None:
    file = tmp_path / "room.world"
    text = WORLD.format(step=20, ranger=100, robot=20, localization="gps")
    file.write_text(text.replace("samples 36", "samples 36 time_increment 0.002"))
    with driven(client, file, 0.5, 1.2) as (heard, run):
        run(3)
        client.until(lambda: len(heard.scans) >= 25)

    scan = heard.scans[5]
    assert scan.time_increment == pytest.approx(.002) and scan.scan_time == pytest.approx(.1)
    assert microseconds(scan.header.stamp) % 100_000 == 30_000  # the first ray, 70 ms before the last one
    errors = heard.errors_in_time() * 1e3
    print(f"rays in time: {errors.size} points, mm: median {np.median(errors):.3f}, max {errors.max():.3f}")
    assert errors.size > 500
    assert errors.max() < 0.01
