# SPDX-License-Identifier: GPL-2.0-or-later
"""Topics: names, frames, and data, which equal those of the simulator."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path
from typing import Any, Callable, Iterator

import numpy as np
import pytest
import stagesim as st
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_testing import SENSOR, TWO, Client, Process, node_here
from sensor_msgs.msg import BatteryState, CameraInfo, Image, LaserScan, Range
from std_msgs.msg import Bool, Float32MultiArray, Float64MultiArray, Int32MultiArray, UInt8MultiArray
from visualization_msgs.msg import MarkerArray

TFMessage = pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not there; try tools/setup --ros").TFMessage

SCHEMES = ("stage_ros2", "stage_ros")
KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TYPES = {"base_scan": LaserScan, "image": Image, "depth": Image, "camera_info": CameraInfo,
         "fiducials": MarkerArray, "blobs": MarkerArray, "bumper": UInt8MultiArray, "stall": Bool,
         "battery": BatteryState}
#: Types of messages with readings, by types of their elements.
ELEMENTS = {"bool": UInt8MultiArray, "uint8": UInt8MultiArray, "int32": Int32MultiArray, "float32": Float32MultiArray,
            "float64": Float64MultiArray}
MOST = 32  # detections in a message

#: Topics that are compared with the simulator by other tests.
ELSEWHERE = {"contacts", "diagnostics", "imu", "robot_description", "joint_states", "wheel_ticks"}

#: Readings without a message of their own, by type of model.
ARRAYS = {"actuator": ["position", "velocity"], "wifi": ["count", "position", "power", "frequency"],
          "gripper": ["paddles", "paddle_position", "lift", "lift_position", "beams", "contacts", "gripped"],
          "groundsensor": ["value"], "lightsensor": ["intensity", "color", "direction"],
          "radio": ["count", "sender", "sent", "range", "bearing", "size", "data"]}


def reading_of(topic: str) -> tuple[str, st.fleet.Reading] | None:
    """The type of sensor and its reading that a topic such as /r0/wifi/count has, or None."""
    kind, name = topic.split("/")[-2:]
    if kind not in ARRAYS:
        return None
    return kind, next(reading for reading in st.fleet.sensor_types()[kind] if reading.name == name)


def type_of(topic: str) -> type:
    reading, name = reading_of(topic), topic.split("/")[-1]
    if reading is not None:
        return ELEMENTS[reading[1].dtype]
    return next((kind for start, kind in TYPES.items() if name.startswith(start)), Odometry)


def tree(model: st.Model) -> Iterator[st.Model]:
    yield model
    for child in model.children:
        yield from tree(child)


def expected_topics(world: st.World, scheme: str) -> list[str]:
    """The topics that docs/ros_reference.md documents, computed independently of the node."""
    old = scheme == "stage_ros"
    robots = [model for model in world.models if model.type == "position" and model.parent is None]
    topics = ["/diagnostics"]
    for i, robot in enumerate(robots):
        prefix = "/" if len(robots) == 1 else f"/robot_{i}/" if old else f"/{robot.name}/"
        kinds = Counter(model.type for model in tree(robot))
        numbers: Counter[str] = Counter()
        own = ["odom", "base_pose_ground_truth" if old else "ground_truth", "stall", "contacts", "imu", "robot_description"]
        if robot.drive_type in ("diff", "car"):
            own += ["joint_states", "wheel_ticks"]
        for model in tree(robot):
            number = "" if kinds[model.type] == 1 else f"{'_' if old else ''}{numbers[model.type]}"
            numbers[model.type] += 1
            if model.type == "ranger":
                own += [f"base_scan{number}{f'_sensor_{k}' if k else ''}" for k in range(len(model.sensors))]
            names = {"camera": ["image", "depth", "camera_info"], "fiducial": ["fiducials"],
                     "blobfinder": ["blobs"], "bumper": ["bumper"], "radio": ["range_and_bearing"]}
            own += [name + number for name in names.get(model.type, [])]
            own += [f"{model.type}{number}/{name}" for name in ARRAYS.get(model.type, [])]
        if robot.energy_capacity is not None:
            own.append("battery")
        topics += [prefix + name for name in own]
    return sorted(topics)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("world_file", st.shipped_worlds())
def test_topics_and_frames_of_every_world(ros: None, world_file: str, scheme: str) -> None:
    with st.World(world_file) as world, node_here(world, naming=scheme) as node:
        published = {name for name, _ in node.get_publisher_names_and_types_by_node("stage", "/")}
        published -= {"/clock", "/tf", "/tf_static", "/parameter_events", "/rosout"}
        published = {name for name in published if not name.startswith("/simulate_steps/")}  # of simulation_interfaces
        assert sorted(published) == expected_topics(world, scheme)
        listened = {name for name, _ in node.get_subscriber_names_and_types_by_node("stage", "/")}
        for robot in node.robots:
            for name in ("cmd_vel", "teleport"):
                assert f"/{robot.prefix}/{name}".replace("//", "/") in listened
        # A chain of existing frames leads from each sensor to the body.
        for robot in node.robots:
            parents = {child: parent for parent, child, _ in robot.mounts}
            for frame in parents:
                while frame in parents:
                    frame = parents[frame]
                assert frame == "base_footprint"


@pytest.fixture
def zoo(start: Callable[..., Process], client: Client,
        request: pytest.FixtureRequest) -> tuple[Client, str]:
    """A paused node of zoo.world, in which all sensors work, and its naming scheme."""
    start("zoo.world", paused=True, always_on=True, naming=request.param)
    return client, request.param


@pytest.mark.parametrize("zoo", SCHEMES, indirect=True)
def test_messages_of_the_zoo_equal_the_state_of_the_simulator(zoo: tuple[Client, str]) -> None:
    client, scheme = zoo
    world = st.World("zoo.world")
    topics = [topic for topic in expected_topics(world, scheme)
              if reading_of(topic) is not None or topic.split("/")[-1] not in ELSEWHERE]
    got = {topic: client.listen(type_of(topic), topic, SENSOR) for topic in topics}
    moving, fixed = client.listen(TFMessage, "/tf"), client.listen(TFMessage, "/tf_static", KEPT)
    client.until(lambda: all(client.node.count_publishers(topic) for topic in [*topics, "/tf"]))
    attach_all(world)
    for model in world.models:
        if model.type == "position" and model.subscribers == 0:
            model.subscribe()
    client.until(lambda: fixed)
    client.spin(0.3)
    for _ in range(30):
        time_, state = client.step()
        world.step()
        assert (time_, state) == (world.time, world.state_hash())
        client.until(lambda: moving and stamp_of(moving[-1].transforms[0]) == pytest.approx(world.time))
        client.until(lambda: all(is_of(world.time, messages) for messages in got.values()))
    check(world, got, scheme)
    check_frames(world, moving[-1], fixed[-1], got, scheme)


def attach_all(world: st.World) -> None:
    """Subscribes to all sensors in the order of always_on."""
    fleet = world.fleet()
    for ask in (fleet.ranger, fleet.camera, fleet.fiducials, fleet.blobs, fleet.bumper):
        for index in range(3):
            try:
                ask(index)
            except st.GoneError:
                break
    for kind in ("gripper", "wifi"):
        fleet.sensor(kind, 0, MOST)


def stamp_of(message: Any) -> float:
    header = message.markers[0].header if isinstance(message, MarkerArray) else message.header
    return header.stamp.sec + header.stamp.nanosec / 1e9


def is_of(moment: float, messages: list[Any]) -> bool:
    """True if the last message has that stamp, or no stamp."""
    return bool(messages) and (isinstance(messages[-1], (Bool, *ELEMENTS.values())) or
                               stamp_of(messages[-1]) == pytest.approx(moment, abs=1e-9))


def check(world: st.World, got: dict[str, list[Any]], scheme: str) -> None:
    """Compares the last message of each topic with the world."""
    fleet = world.fleet()
    seen: Counter[str] = Counter()
    for topic, messages in got.items():
        reading = reading_of(topic)
        *_, prefix, name = ["", *topic.strip("/").split("/")][:-1 if reading is not None else None]
        robot = int(prefix.split("_")[1]) if scheme == "stage_ros" else fleet.names.index(prefix)
        message = messages[-1]
        assert is_of(world.time, messages)
        if reading is not None:
            check_reading(fleet, robot, *reading, message)
            seen["readings of " + reading[0]] += 1
            continue
        kind = next((kind for kind in CHECKS if name.startswith(kind)), name)
        CHECKS[kind](world, fleet, robot, name, message)
        seen[kind] += 1
    assert set(seen) == {"readings of gripper", "readings of wifi"} | set(CHECKS) - {
        "ground_truth" if scheme == "stage_ros" else "base_pose_ground_truth"}


def check_reading(fleet: st.Fleet, robot: int, kind: str, reading: Any, message: Any) -> None:
    row = getattr(fleet.sensor(kind, 0, MOST), reading.name)[robot]
    assert np.array_equal(np.array(message.data, row.dtype), np.ravel(row), equal_nan=reading.dtype.startswith("float"))


def check_scan(world: st.World, fleet: st.Fleet, robot: int, name: str, scan: LaserScan) -> None:
    rest = name.removeprefix("base_scan").split("_sensor_")
    index, part = int(rest[0].strip("_") or 0), int(rest[1]) if len(rest) > 1 else 0
    ranger = [m for m in tree(world.model(fleet.names[robot])) if m.type == "ranger"][index]
    sensor = ranger.sensors[part]
    first = sum(s.samples for s in ranger.sensors[:part])
    ranges = fleet.ranger(index).ranges[robot, first:first + sensor.samples]
    assert np.array_equal(scan.ranges, np.where(ranges < sensor.range, ranges, np.inf).astype(np.float32))
    assert np.array_equal(scan.intensities,
                          fleet.ranger(index).intensities[robot, first:first + sensor.samples].astype("f4"))
    assert scan.range_max == np.float32(sensor.range)
    angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
    bearings = fleet.ranger(index).bearings[robot, first:first + sensor.samples] - sensor.pose[3]
    bearings -= ranger.pose_in_tree[3]
    assert np.allclose(np.exp(1j * angles), np.exp(1j * bearings), atol=1e-5)
    assert angles[-1] == pytest.approx(scan.angle_max, abs=1e-5)


def check_odometry(poses: str, velocities: str) -> Callable[..., None]:
    def check_pose(world: st.World, fleet: st.Fleet, robot: int, name: str, odometry: Odometry) -> None:
        pose, twist = odometry.pose.pose, odometry.twist.twist
        x, y, a = getattr(fleet, poses)[robot]
        assert (pose.position.x, pose.position.y) == (x, y)
        assert (pose.orientation.z, pose.orientation.w) == (np.sin(a / 2), np.cos(a / 2))
        assert (twist.linear.x, twist.linear.y, twist.angular.z) == tuple(getattr(fleet, velocities)[robot])
        for covariance in (odometry.pose.covariance, odometry.twist.covariance):
            matrix = np.reshape(covariance, (6, 6))
            assert (np.diag(matrix)[2:5] == 1e6).all() and (np.linalg.eigvalsh(matrix) > 0).all()

    return check_pose


def check_image(world: st.World, fleet: st.Fleet, robot: int, name: str, image: Image) -> None:
    kind = np.uint8 if image.encoding == "rgb8" else np.float32
    expected = fleet.camera().color[robot] if image.encoding == "rgb8" else fleet.camera().depth[robot]
    pixels = np.frombuffer(image.data, kind).reshape(expected.shape)
    if kind == np.float32:
        view = next(m for m in tree(world.model(fleet.names[robot])) if m.type == "camera").view
        expected = np.where(expected < np.float32(view.far), expected, np.float32(np.inf))
    assert np.array_equal(pixels, expected) and len(np.unique(pixels)) > 1
    assert (image.height, image.width, image.step) == (48, 64, 64 * (3 if kind == np.uint8 else 4))


def check_lens(world: st.World, fleet: st.Fleet, robot: int, name: str, info: CameraInfo) -> None:
    assert (info.width, info.height) == (64, 48)
    assert 2 * np.arctan(32 / info.k[0]) == pytest.approx(np.radians(70))
    assert 2 * np.arctan(24 / info.k[4]) == pytest.approx(np.radians(40))


def check_fiducials(world: st.World, fleet: st.Fleet, robot: int, name: str, array: MarkerArray) -> None:
    seen, count = fleet.fiducials(), fleet.fiducials().count[robot]
    assert len(array.markers) == 1 + count
    for i, marker in enumerate(array.markers[1:]):
        place = marker.pose.position
        assert int(marker.text) == seen.id[robot, i]
        assert np.hypot(place.x, place.y) == pytest.approx(seen.range[robot, i])
        assert np.arctan2(place.y, place.x) == pytest.approx(seen.bearing[robot, i])


def check_blobs(world: st.World, fleet: st.Fleet, robot: int, name: str, array: MarkerArray) -> None:
    seen, count = fleet.blobs(), fleet.blobs().count[robot]
    assert len(array.markers) == 1 + count and count > 0
    for i, marker in enumerate(array.markers[1:]):
        box = [side for point in marker.points for side in (point.x, point.y)]
        assert box == list(seen.box[robot, i])
        assert (marker.color.r, marker.color.g, marker.color.b) == tuple(seen.color[robot, i][:3])
        place = marker.pose.position
        assert np.hypot(place.x, place.y) == pytest.approx(seen.range[robot, i])


def check_bumper(world: st.World, fleet: st.Fleet, robot: int, name: str, message: UInt8MultiArray) -> None:
    assert list(message.data) == list(fleet.bumper()[robot]) and len(message.data) == 4


def check_stall(world: st.World, fleet: st.Fleet, robot: int, name: str, message: Bool) -> None:
    assert message.data == fleet.stalled[robot]


def check_battery(world: st.World, fleet: st.Fleet, robot: int, name: str, battery: BatteryState) -> None:
    capacity = world.model(fleet.names[robot]).energy_capacity
    assert battery.percentage == np.float32(fleet.energy[robot] / capacity)
    assert battery.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_DISCHARGING


CHECKS = {
    "base_scan": check_scan, "odom": check_odometry("estimate", "estimated_velocity"),
    "ground_truth": check_odometry("sensed_pose", "actual_velocity"),
    "base_pose_ground_truth": check_odometry("sensed_pose", "actual_velocity"), "image": check_image,
    "depth": check_image,
    "camera_info": check_lens, "fiducials": check_fiducials, "blobs": check_blobs, "bumper": check_bumper,
    "battery": check_battery, "stall": check_stall}


def check_frames(world: st.World, moving: Any, fixed: Any, got: dict[str, list[Any]], scheme: str) -> None:
    """Checks the chain of frames from each sensor to its robot's odometry, and the resulting pose."""
    links = {t.child_frame_id: t for message in (moving, fixed) for t in message.transforms}
    fleet = world.fleet()
    roots = set()
    for topic, messages in got.items():
        message = messages[-1]
        if isinstance(message, (LaserScan, Image)):
            place, frame = np.eye(4), message.header.frame_id
            while frame in links:
                place = matrix(links[frame].transform) @ place
                frame = links[frame].header.frame_id
            roots.add(frame)
            prefix = topic.split("/")[1]
            robot = int(prefix.split("_")[1]) if scheme == "stage_ros" else fleet.names.index(prefix)
            assert frame == f"{prefix}/odom"
            x, y, a = fleet.estimate[robot]
            if topic.endswith("base_scan_0") or topic.endswith("base_scan0"):
                origin = fleet.ranger(0).origins[robot, 0]
                c, s = np.cos(a), np.sin(a)
                assert np.allclose(place[:2, 3], [x + c * origin[0] - s * origin[1],
                                                  y + s * origin[0] + c * origin[1]])
            if topic.endswith("image"):  # the optical axis points ahead and slightly down
                assert np.allclose(place[:3, 2], [np.cos(a) * np.cos(np.radians(5)),
                                                  np.sin(a) * np.cos(np.radians(5)), -np.sin(np.radians(5))])
    assert len(roots) == len(fleet)
    for transform in moving.transforms:
        assert stamp_of(transform) == pytest.approx(world.time, abs=1e-9)


def matrix(transform: Any) -> Any:
    q, t = transform.rotation, transform.translation
    x, y, z, w = q.x, q.y, q.z, q.w
    assert x * x + y * y + z * z + w * w == pytest.approx(1)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), t.x],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), t.y],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), t.z],
        [0, 0, 0, 1]])


@pytest.mark.parametrize("single_beams", ("scan", "range", "none"))
def test_single_beams(start: Callable[..., Process], client: Client, one: str, single_beams: str) -> None:
    start(one, paused=True, single_beams=single_beams)
    kind = Range if single_beams == "range" else LaserScan
    fan = client.listen(LaserScan, "/base_scan", SENSOR)
    beam = client.listen(kind, "/base_scan_sensor_1", SENSOR)
    client.until(lambda: client.node.count_publishers("/base_scan"))
    client.spin(0.5)
    client.step(2)
    client.until(lambda: len(fan) >= 1)
    client.spin(0.3)
    assert bool(beam) == (single_beams != "none")
    if single_beams == "range":
        # There is no obstacle to the left.
        assert (beam[-1].range, beam[-1].max_range) == (np.inf, 4.0)
        assert beam[-1].field_of_view == pytest.approx(np.radians(15))
        assert beam[-1].header.frame_id == "base_scan_link_sensor_1"


def test_one_robot_has_no_prefix_unless_it_is_wanted(ros: None, one: str) -> None:
    for scheme, prefix in (("stage_ros2", "a"), ("stage_ros", "robot_0")):
        for enforced in (False, True):
            with st.World(one) as world, node_here(world, naming=scheme, enforce_prefixes=enforced) as node:
                assert [robot.prefix for robot in node.robots] == [prefix if enforced else ""]


def test_robots_of_the_same_name_get_different_prefixes(ros: None) -> None:
    text = "".join(f'position( name "{name}" pose [{i} 0 0 0] )\n'
                   for i, name in enumerate(("r:1", "r:1", "r 1", "2", "é")))
    with st.World.from_text(text) as world, node_here(world) as node:
        assert [robot.prefix for robot in node.robots] == ["r_1", "r_1_2", "r_1_3", "_2", "robot"]
        assert [robot.model.pose[0] for robot in node.robots] == [0, 1, 2, 3, 4]


def test_names_that_are_not_utf_8_become_names_of_ros(start: Callable[..., Process], client: Client,
                                                      tmp_path: Path) -> None:
    """Names that are not UTF-8 are allowed in world files and as file names."""
    file = os.fsencode(tmp_path) + b"/w\xff.world"
    with open(file, "wb") as out:
        out.write(b'position( name "r\xff" ) position( name "\xff" pose [1 0 0 0] ) position( name "\x80" pose [2 0 0 0] )')
    process = start(os.fsdecode(file))
    odometry = {name: client.listen(Odometry, f"/{name}/ground_truth") for name in ("r", "robot", "robot_2")}
    client.until(lambda: all(odometry.values()))
    assert [got[-1].pose.pose.position.x for got in odometry.values()] == [0, 1, 2]
    client.until(lambda: r"w\xff.world: 3 robots" in process.output())  # printed after the first messages
    status, text = process.end()
    assert status == 0, text


def test_parameters_name_the_frames(start: Callable[..., Process], client: Client, one: str) -> None:
    start(one, paused=True, odom_frame_id="o", base_link_frame_id="b", base_footprint_frame_id="f",
          map_frame_id="m", publish_map_tf=True)
    odometry, truth = client.listen(Odometry, "/odom"), client.listen(Odometry, "/ground_truth")
    moving, fixed = client.listen(TFMessage, "/tf"), client.listen(TFMessage, "/tf_static", KEPT)
    talk = client.talk(Twist, "/cmd_vel")
    client.until(lambda: fixed)
    command = Twist()
    command.linear.x, command.linear.y, command.angular.z = 0.3, 0.1, 0.5
    client.set(base_watchdog_timeout=0.0)
    talk.publish(command)
    client.spin(0.3)
    client.step(30)
    client.until(lambda: len(odometry) > 20 and len(truth) > 20 and len(moving) > 20)
    assert (odometry[-1].header.frame_id, odometry[-1].child_frame_id) == ("o", "f")
    assert truth[-1].header.frame_id == "m"
    links = {t.child_frame_id: t for message in (moving[-1], fixed[-1]) for t in message.transforms}
    assert {(t.header.frame_id, child) for child, t in links.items()} >= {("m", "o"), ("o", "f"), ("f", "b")}
    # The transforms from the map give the true pose, although the odometry has errors.
    place = matrix(links["o"].transform) @ matrix(links["f"].transform)
    true, guess = truth[-1].pose.pose.position, odometry[-1].pose.pose.position
    assert np.allclose(place[:2, 3], [true.x, true.y])
    assert np.hypot(true.x - guess.x, true.y - guess.y) > 1e-3


def test_publish_tf_turns_frames_off(start: Callable[..., Process], client: Client, one: str) -> None:
    start(one, publish_tf=False)
    odometry = client.listen(Odometry, "/odom")
    client.until(lambda: odometry)
    assert client.node.count_publishers("/tf") == client.node.count_publishers("/tf_static") == 0


def test_sensors_without_subscribers_do_not_work(start: Callable[..., Process], client: Client, two: str) -> None:
    start(two, paused=True)
    quiet = st.World(two)
    for model in quiet.models:
        if model.type == "position":
            model.subscribe()
    quiet.step(5)
    assert client.step(5)[1] == quiet.state_hash()
    scans = client.listen(LaserScan, "/a/base_scan", SENSOR)
    client.spin(0.5)
    client.step(3)
    client.until(lambda: scans)
    quiet.step(3)
    assert client.step()[1] != stepped(quiet)


def stepped(world: st.World) -> str:
    world.step()
    return world.state_hash()


def test_scans_come_when_the_sensor_has_measured(start: Callable[..., Process], client: Client,
                                                 tmp_path: Path) -> None:
    """With steps of 20 ms and updates every 100 ms, scans come with updates for any time of subscription."""
    file = tmp_path / "fine.world"
    file.write_text("interval_sim 20\n" + TWO)
    start(str(file), paused=True, base_watchdog_timeout=0.0)
    talk = client.talk(Twist, "/a/cmd_vel")
    command = Twist()
    command.linear.x = 0.5
    talk.publish(command)
    client.spin(0.3)
    client.set(steps=13)
    client.step()
    scans = client.listen(LaserScan, "/a/base_scan", SENSOR)
    client.until(lambda: client.node.count_publishers("/a/base_scan"))
    client.spin(0.5)
    client.set(steps=1)
    world = st.World(file)
    cmd = world.fleet().cmd
    cmd[:] = np.nan
    for name in "ab":
        world.model(name).subscribe()
    cmd[0] = 0.5, 0, 0
    world.step(13)
    ranges = world.fleet().ranger().ranges
    expected = []
    for _ in range(20):
        client.step()
        world.step()
        if round(world.time * 1000) % 100 == 0:
            read = np.where(ranges[0, :5] < 5, ranges[0, :5], np.inf)
            expected.append((round(world.time * 1000), read.astype(np.float32).tolist()))
    client.until(lambda: len(scans) == len(expected) == 4)
    assert [(round(stamp_of(scan) * 1000), list(scan.ranges)) for scan in scans] == expected
    assert len({tuple(row) for _, row in expected}) == 4
