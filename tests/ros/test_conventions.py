# SPDX-License-Identifier: GPL-2.0-or-later
"""Conventions of ROS: reliability, REP 117, covariances, order of messages, /clock, frames of poses."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest
import stagesim as st
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from patience import PATIENCE, slowness
from ros_testing import TWO, Client, Process, node_here
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image, LaserScan, Range
from std_msgs.msg import Bool
from std_srvs.srv import SetBool
from stagesim.ros.covariance import EXACT, UNKNOWN, OdometryErrors

RELIABLE = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
#: Common QoS of subscribers: a queue length, a reliable profile, and the profile for sensor data.
SUBSCRIBERS = {"default": 10, "reliable": RELIABLE, "sensor data": qos_profile_sensor_data}


@pytest.mark.parametrize("sensor_qos", (None, "reliable", "best_effort"))
def test_subscribers_of_every_sort_get_scans(start: Callable[..., Process], client: Client, one: str,
                                             sensor_qos: str | None) -> None:
    start(one, **({} if sensor_qos is None else {"sensor_qos": sensor_qos}))
    got = {name: client.listen(LaserScan, "/base_scan", qos) for name, qos in SUBSCRIBERS.items()}
    odometry = {name: client.listen(Odometry, "/odom", qos) for name, qos in SUBSCRIBERS.items()}
    expected = {"sensor data"} if sensor_qos == "best_effort" else set(SUBSCRIBERS)
    client.until(lambda: all(len(got[name]) > 3 for name in expected) and all(odometry.values()))
    client.spin(0.5)
    assert {name for name, scans in got.items() if scans} == expected


# ---- REP 117 ----

NEAR_AND_FAR = """
resolution 0.02
model( name "wall" pose [{x} 0 0 0] size [0.1 8 1] )
define eye ranger( size [0.1 0.1 0.1]
  sensor( range [{near} {far}] fov 90 samples 5 ray_model "exact" )
  sensor( range [{near} {far}] fov 10 samples 1 ray_model "exact" ) )
position( name "r" size [0.2 0.2 0.2] eye()
  camera( resolution [8 6] range [0.2 {far}] fov [40 30] ) )
"""


@pytest.mark.parametrize("ranges", (None, "rep117", "stage"))
@pytest.mark.parametrize("beams", ("scan", "range"))
@pytest.mark.parametrize(("x", "reads"), ((2.05, 2.0), (9.0, np.inf), (0.85, -np.inf)))
def test_ranges_follow_rep_117(start: Callable[..., Process], client: Client, tmp_path: Path, ranges: str | None,
                               beams: str, x: float, reads: float) -> None:
    """By default, +Inf means no return and -Inf too near; with the parameter, the maximum and the distance."""
    file = tmp_path / "r.world"
    file.write_text(NEAR_AND_FAR.format(x=x, near=1.0, far=4.0))
    start(str(file), single_beams=beams, **({} if ranges is None else {"ranges": ranges}))
    scans = client.listen(LaserScan, "/base_scan")
    single = client.listen(Range if beams == "range" else LaserScan, "/base_scan_sensor_1")
    depths = client.listen(Image, "/depth")
    client.until(lambda: scans and single and depths)
    if ranges == "stage":
        reads = {np.inf: 4.0, -np.inf: x - 0.05}.get(reads, reads)
    assert scans[-1].ranges[2] == pytest.approx(reads, abs=1e-3)
    read = single[-1].range if beams == "range" else single[-1].ranges[0]
    assert read == pytest.approx(reads, abs=1e-3)
    assert (scans[-1].range_min, scans[-1].range_max) == (1.0, 4.0)
    depth = np.frombuffer(depths[-1].data, np.float32).reshape(6, 8)
    if x > 4:
        assert (depth[:3] == (4.0 if ranges == "stage" else np.inf)).all()  # lower rows see the floor
    else:
        assert depth[3, 4] == pytest.approx(x - 0.05, abs=0.1)


# ---- covariances ----

def test_covariances_are_known_or_said_to_be_unknown(start: Callable[..., Process], client: Client,
                                                     tmp_path: Path) -> None:
    """No covariance is all 0. With GPS the pose is exact; with odometry, errors grow with the path."""
    file = tmp_path / "two.world"
    file.write_text(TWO + 'bot( name "c" pose [0 -2 0 0] localization "gps" )\n')
    start(str(file), paused=True, base_watchdog_timeout=0)
    odometry = {name: client.listen(Odometry, f"/{name}/odom") for name in "abc"}
    truth = client.listen(Odometry, "/a/ground_truth")
    for name in "abc":
        message = Twist()
        message.linear.x, message.linear.y, message.angular.z = 0.2, 0.1, 0.3
        client.talk(Twist, f"/{name}/cmd_vel").publish(message)
    client.until(lambda: all(odometry.values()) and truth)
    client.spin(0.3)
    client.set(steps=60)
    client.step()
    client.until(lambda: all(got[-1].header.stamp.sec == 6 for got in [*odometry.values(), truth]))
    for message in (odometry["c"][-1], truth[-1]):
        for covariance in (message.pose.covariance, message.twist.covariance):
            assert np.array_equal(covariance, np.diag([EXACT, EXACT, UNKNOWN, UNKNOWN, UNKNOWN, EXACT]).ravel())
    first, last = (np.reshape(odometry["a"][i].pose.covariance, (6, 6)) for i in (0, -1))
    assert (np.diag(first)[[0, 1, 5]] == EXACT).all()
    assert (np.diag(last)[[0, 1, 5]] > 1e-6).all() and np.array_equal(last, last.T)
    with st.World(file) as world:
        share = world.model("a").odom_error[2]
    assert last[5, 5] == pytest.approx((share * 0.3 * 6)**2 + EXACT, rel=0.05) and share != 0
    before = np.array(odometry["a"][-1].pose.covariance)
    # Restoring a state restores its covariance.
    assert client.call("/stage/snapshot").success
    client.step()
    client.until(lambda: odometry["a"][-1].header.stamp.sec == 12)
    assert not np.array_equal(odometry["a"][-1].pose.covariance, before)
    assert client.call("/stage/restore").success
    client.until(lambda: odometry["a"][-1].header.stamp.sec == 6)
    assert np.array_equal(odometry["a"][-1].pose.covariance, before)


@pytest.mark.parametrize("seed", range(4))
def test_errors_of_estimates_match_the_covariance(seed: int) -> None:
    """The difference between a path with and without odometry errors is J e, to first order."""
    random = np.random.default_rng(seed)
    shares = random.uniform(-0.002, 0.002, (20, 3))
    errors = OdometryErrors(shares)
    true, guess = np.zeros((20, 3)), np.zeros((20, 3))
    errors.begin(guess)
    for _ in range(400):
        motion = random.uniform([-0.02, -0.02, -0.1], [0.08, 0.02, 0.1], (20, 3))
        for pose, step in ((true, motion), (guess, motion * (1 + shares))):
            c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
            pose[:, 0] += c * step[:, 0] - s * step[:, 1]
            pose[:, 1] += s * step[:, 0] + c * step[:, 1]
            pose[:, 2] += step[:, 2]
        errors.move(guess)
    off = guess - true
    assert np.allclose(np.einsum("nij,nj->ni", errors.jacobian, shares), off, rtol=0.05, atol=1e-3)
    covariance = errors.pose().reshape(-1, 6, 6)
    # Each of three independent errors is one standard deviation, so their sum is within the square root of 3.
    sigma = np.sqrt(covariance[:, [0, 1, 5], [0, 1, 5]])
    assert (np.abs(off) <= np.sqrt(3) * sigma * 1.05 + 1e-3).all() and (sigma > 3e-5).all()


def test_random_errors_are_in_the_messages(start: Callable[..., Process], client: Client, tmp_path: Path) -> None:
    """The covariance of odom_noise, which the simulation computes, is that of the messages."""
    file = tmp_path / "noise.world"
    file.write_text('position( name "a" localization "odom" odom_error [0 0 0 0] odom_noise [0.02 0.01 2 1] )\n')
    start(str(file), paused=True, base_watchdog_timeout=0)
    odometry = client.listen(Odometry, "/odom")
    message = Twist()
    message.linear.x, message.angular.z = 0.2, 0.3
    client.talk(Twist, "/cmd_vel").publish(message)
    client.until(lambda: bool(odometry))
    client.spin(0.3)
    client.set(steps=60)
    client.step()
    client.until(lambda: odometry[-1].header.stamp.sec == 6)
    pose = np.reshape(odometry[-1].pose.covariance, (6, 6))
    twist = np.reshape(odometry[-1].twist.covariance, (6, 6))
    way, turn = 0.2 * 5.9, 0.3 * 5.9
    expected = np.radians(2)**2 * turn + np.radians(1)**2 * way
    assert pose[5, 5] == pytest.approx(expected, rel=0.1) and np.array_equal(pose, pose.T)
    # The variance of the velocity is that of a step's error, divided by the square of 0.1 s.
    assert twist[5, 5] == pytest.approx((np.radians(2)**2 * 0.03 + np.radians(1)**2 * 0.02) / 0.01, rel=0.1)
    assert twist[0, 0] > EXACT and pose[0, 0] > EXACT


# ---- order and time ----

def test_time_comes_before_transforms_and_these_before_data(ros: None, one: str) -> None:
    """In each step, the time is sent before transforms, and these before data."""
    with st.World(one) as world, node_here(world, always_on=True) as node:
        sent: list[str] = []

        class Noting:
            def __init__(self, topic: str) -> None:
                self.topic = topic

            def publish(self, message: Any) -> None:
                sent.append(self.topic)

            def get_subscription_count(self) -> int:
                return 1

        for feed in node.team.feeds:
            feed.publisher = Noting(feed.topic)
        node._time_feed._publisher = Noting("clock")
        if not node.team.tf:
            pytest.skip("tf2_msgs is not there; try tools/setup --ros")
        node.team.tf[0].publisher = Noting("tf")
        for _ in range(3):
            node._last_look = 0.0
            sent.clear()
            node.advance()
            assert sent[:2] == ["clock", "tf"] and len(sent) == 2 + node.topics


def test_transforms_of_a_stamp_are_there_when_its_scan_comes(start: Callable[..., Process], client: Client,
                                                             one: str) -> None:
    """A listener in another process, such as a mapper, finds the transform at the stamp of each scan."""
    tf = pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not there; try tools/setup --ros").TFMessage
    events = pytest.importorskip("rclpy.experimental.events_executor", reason="it takes messages as they arrive")
    start(one)
    arrived: list[tuple[str, float]] = []
    listener = Node("listener")
    executor = events.EventsExecutor()
    executor.add_node(listener)

    def note(kind: str) -> Callable[[Any], None]:
        def take(message: Any) -> None:
            stamp = (message.clock if kind == "clock" else message.transforms[0].header.stamp if kind == "tf"
                     else message.header.stamp)
            arrived.append((kind, stamp.sec + stamp.nanosec / 1e9))

        return take

    for kind, message, topic in (("scan", LaserScan, "/base_scan"), ("tf", tf, "/tf"), ("clock", Clock, "/clock")):
        listener.create_subscription(message, topic, note(kind), 100)
    deadline = time.monotonic() + PATIENCE
    while sum(kind == "scan" for kind, _ in arrived) < 30:
        assert time.monotonic() < deadline
        executor.spin_once(timeout_sec=0.05)
    executor.shutdown()
    listener.destroy_node()
    first = next(stamp for kind, stamp in arrived if kind == "tf")
    early = late = 0
    for at, (kind, stamp) in enumerate(arrived):
        if kind == "scan" and stamp > first:
            there = {(kind, stamp) for kind, stamp in arrived[:at]}
            early += ("tf", stamp) in there
            late += ("tf", stamp) not in there
    # The order of different topics is not guaranteed: a busy machine sometimes changes it.
    assert early > 20 and late <= 3, (early, late)


@pytest.mark.parametrize("rate", (0, 5, 50))
def test_clock_has_a_rate_of_its_own(start: Callable[..., Process], client: Client, one: str, rate: float) -> None:
    """/clock never goes back and keeps up with real time; rate 0: once per step, ten times per second."""
    start(one, clock_rate=rate)
    clock = client.listen(Clock, "/clock")
    client.until(lambda: len(clock) > 3)
    clock.clear()
    began = time.monotonic()
    client.spin(4)
    real = time.monotonic() - began
    times = np.array([message.clock.sec + message.clock.nanosec / 1e9 for message in clock])
    span = times[-1] - times[0]
    assert (np.diff(times) >= 0).all() and 0.6 * real < span < real + 0.3 * slowness()
    # The rate is that of the time stamps, because messages may wait in the queue of a busy client.
    assert 0.6 * (rate or 10) * span < len(times) - 1 <= (rate or 10) * span + 3
    on_steps = np.isclose(times % 0.1, 0) | np.isclose(times % 0.1, 0.1)
    assert on_steps.all() if rate == 0 else rate < 50 or not on_steps.all()


def test_clock_does_not_go_back_in_a_pause(start: Callable[..., Process], client: Client, one: str) -> None:
    start(one, clock_rate=200)
    clock = client.listen(Clock, "/clock", 10_000)
    client.until(lambda: len(clock) > 100)
    for _ in range(5):
        client.call("/stage/pause", SetBool, data=True)
        client.step()
        client.spin(0.1)
        client.call("/stage/pause", SetBool, data=False)
        client.spin(0.17)
    times = [message.clock.sec + message.clock.nanosec / 1e9 for message in clock]
    assert times == sorted(times)
    assert client.call("/stage/reset").success
    client.until(lambda: clock[-1].clock.sec == 0 and clock[-1].clock.nanosec < 500_000_000)


# ---- obstacles and placement -----------------------------

def test_stall_tells_that_a_robot_is_blocked(start: Callable[..., Process], client: Client, one: str) -> None:
    start(one, paused=True, base_watchdog_timeout=0)
    stall = client.listen(Bool, "/stall")
    client.until(lambda: stall)
    assert not stall[-1].data
    message = Twist()
    message.linear.x = 1.0
    client.talk(Twist, "/cmd_vel").publish(message)
    client.spin(0.3)
    client.set(steps=40)
    client.step()
    client.until(lambda: stall[-1].data)


@pytest.mark.parametrize(("frame", "place"), [
    ("", (1.5, -2.5)), ("map", (1.5, -2.5)), ("/map", (1.5, -2.5)),
    ("a/base_link", (4.5, -0.5)), ("/a/base_footprint", (4.5, -0.5)), ("b/base_link", (3.5, 2.5)),
    ("a/odom", (4.5, -0.5)), ("b/odom", (3.5, 2.5))])
def test_teleport_obeys_the_frame(start: Callable[..., Process], client: Client, tmp_path: Path, frame: str,
                                  place: tuple[float, float]) -> None:
    """Robots and their odometry start at (3, 2) with heading 0 and at (1, 1) with heading 90 degrees."""
    file = tmp_path / "two.world"
    file.write_text("""
define bot position( size [0.2 0.2 0.2] localization "odom" odom_error [0 0 0 0] )
bot( name "a" pose [3 2 0 0] )
bot( name "b" pose [1 1 0 90] )
""")
    start(str(file), paused=True)
    truth, odometry = (client.listen(Odometry, f"/a/{name}") for name in ("ground_truth", "odom"))
    talk = client.talk(PoseStamped, "/a/teleport")
    client.until(lambda: truth and odometry)
    # The origin of the odometry frame follows from estimate and true pose.
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y = 1.5, -2.5
    message.pose.orientation.w = 1.0
    if frame.endswith("odom"):
        with st.World(file) as world, node_here(world) as node:
            place = node.team.frames.in_world((1.5, -2.5, 0.0), frame, 0)[:2]
            x, y, a = node.team.frames.origins()[0 if frame.startswith("a") else 1]
            expected = (x + 1.5 * np.cos(a) + 2.5 * np.sin(a), y + 1.5 * np.sin(a) - 2.5 * np.cos(a))
            assert place == pytest.approx(expected)
    talk.publish(message)

    def is_there() -> bool:
        position = truth[-1].pose.pose.position
        return (position.x, position.y) == pytest.approx(place)

    client.until(is_there)


@pytest.mark.parametrize("frame", ("mars", "c/base_link", "a/base_scan_link", "a", "odom", "map\n", "x" * 5000, "é"))
def test_teleport_refuses_an_unknown_frame(start: Callable[..., Process], client: Client, two: str, frame: str) -> None:
    process = start(two, paused=True)
    truth = client.listen(Odometry, "/a/ground_truth")
    talk = client.talk(PoseStamped, "/a/teleport")
    client.until(lambda: truth)
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x = 1.5
    talk.publish(message)
    client.spin(0.5)
    client.step()
    client.until(lambda: truth[-1].header.stamp.nanosec == 100_000_000)
    assert truth[-1].pose.pose.position.x == 0
    lines = [line for line in process.end()[1].splitlines() if "not put elsewhere" in line]
    assert len(lines) == 1 and re.search(
        r"'a': not put elsewhere: found the frame '.{1,90}', expected map, a/odom, a/base_footprint or", lines[0]), lines


@pytest.mark.parametrize(("parameters", "complaint"), [
    ({"ranges": "rep118"}, "parameter ranges: found 'rep118', expected rep117 or stage"),
    ({"sensor_qos": "best"}, "parameter sensor_qos: found 'best', expected reliable or best_effort"),
    ({"clock_rate": -1}, "parameter clock_rate: found -1, expected a number, 0 to 1000"),
    ({"clock_rate": 1e9}, "parameter clock_rate: found 1000000000.0, expected a number, 0 to 1000"),
    ({"clock_rate": "fast"}, "parameter clock_rate: found 'fast', expected a number, 0 to 1000")])
def test_values_that_do_not_fit_are_refused_in_one_line(start: Callable[..., Process], one: str,
                                                        parameters: dict[str, Any], complaint: str) -> None:
    status, text = start(one, **parameters).wait()
    assert status == 1 and len(text.splitlines()) == 1 and complaint in text, text
