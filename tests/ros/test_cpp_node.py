# SPDX-License-Identifier: GPL-2.0-or-later
"""The C++ node of ros2/stage_ros2_cpp does the same as the Python node, message by message.

rclcpp is not on PyPI, so the package is compiled against a stand-in with ROS's own messages: see cpp_node.py.
"""

from __future__ import annotations

import array
import math
import re
import struct
import sys
from pathlib import Path
from typing import Any, Iterator
from unittest import mock

import numpy as np
import pytest
from cpp_node import PACKAGE, ROOT, Command, Run, build_cpp_node, run_cpp, run_python
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from std_srvs.srv import Empty, SetBool, Trigger

RESPONSES = {"/reset_positions": Empty.Response, "/stage/pause": SetBool.Response, "/stage/reset": Trigger.Response,
             "/stage/step": Trigger.Response}
#: Topics that only the Python node has, as docs/ros_reference.md says, without prefixes and numbers.
ONLY_PYTHON = {"contacts", "robot_description", "amcl_pose", "fiducials", "blobs", "bumper", "bumper/", "range_and_bearing",
               "diagnostics", "actuator"}
#: Sines, cosines and tangents of NumPy and of the C library may differ in the last digits, and sums are not in the same
#: order. All else must be equal to the last bit: ranges, intensities, pixels, estimates, velocities and stamps.
TRIGONOMETRIC = re.compile(
    r"orientation\.|rotation\.|transform\.translation\.|covariance|\.[kp]$|position\[|linear_acceleration\.")
PRECISION = 1e-12

WALLS = """
resolution 0.02
interval_sim {step}
model( pose [0 3 0 0] size [12 0.1 1] color "red" ) model( pose [0 -3 0 0] size [12 0.1 1] color "blue" )
model( pose [5 0 0 0] size [0.1 6 1] ranger_return 7.5 ) model( pose [-5 0 0 0] size [0.1 6 1] )
"""
EYES = """
define eyes ranger( update_interval 100 size [0.1 0.1 0.1] pose [0.05 0.02 0 10]
  sensor( range [0.3 4] fov 180 samples 19 pose [0.1 0 0 0] )
  sensor( range [0 2.5] fov 15 samples 1 pose [0 0.1 0 90] noise [0.01 0 0.02] )
  sensor( range [0 20] fov 360 samples 12 time_increment 0.004 ) )
define watch camera( update_interval 200 size [0.05 0.05 0.05] pose [0 0 0.3 0] resolution [16 9] range [0.2 4] fov [70 40]
  pantilt [10 5] )
"""
ONE = WALLS + EYES + """
position( name "robot one" pose [-1 0.5 0 20] size [0.4 0.36 0.3] drive "diff" localization "odom" odom_error [0.02 0 0 0.05]
  odom_noise [0.05 0 0.02 0.03] joules 20 watts 1 update_interval 100 eyes() watch() fiducial( range_max 4 ) )
model( pose [1.5 1 0 0] size [0.3 0.3 0.5] fiducial_return 3 )
"""
MANY = WALLS + EYES + """
position( name "a" pose [-2 1 0 0] size [0.4 0.4 0.3] drive "omni" localization "gps" joules 500 eyes() eyes() )
position( name "b c" pose [2 1 0 90] size [0.4 0.4 0.3] drive "diff" localization "odom" localization_origin [0 0 0 0]
  odom_error [0.01 0 0 0.02] update_interval 40
  actuator( type "rotational" size [0.1 0.1 0.1] max_speed 1 min_position -9 max_position 9 eyes() ) )
position( name "b-c" pose [0 -2 0 0] size [0.6 0.3 0.3] drive "car" wheelbase 0.4 localization "odom" eyes( update_interval 250 )
  watch() watch() bumper( bcount 2 ) )
position( name "4" pose [3 -1.5 0 120] size [0.4 0.4 0.3] drive "diff" ctrl "wander" joules -1 eyes() )
"""


@pytest.fixture(scope="module")
def driver() -> Path:
    return build_cpp_node()


@pytest.fixture(autouse=True)
def rclpy_runs(ros: None) -> Iterator[None]:
    """The Python node needs rclpy."""
    yield


def twist(ahead: float, left: float, turn: float, stamped: bool = False) -> Any:
    message = TwistStamped() if stamped else Twist()
    inner = message.twist if stamped else message
    inner.linear.x, inner.linear.y, inner.angular.z = float(ahead), float(left), float(turn)
    return message


def pose(x: float, y: float, degrees: float, frame: str = "") -> PoseStamped:
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y = float(x), float(y)  # rclpy does not convert integers
    message.pose.orientation.z = math.sin(math.radians(degrees) / 2)
    message.pose.orientation.w = math.cos(math.radians(degrees) / 2)
    return message


def steps(count: int) -> list[Command]:
    return [("set", "steps", count), ("call", "/stage/step", Trigger.Request())]


def listen(*topics: str) -> list[Command]:
    """Subscribes, and waits until the node has looked for subscribers."""
    return [*(("listen", topic) for topic in topics), ("wait", 0.12)]


def flat(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """The parts of a message by their paths. Arrays of numbers are one part."""
    if hasattr(value, "get_fields_and_field_types"):
        for name in value.get_fields_and_field_types():
            yield from flat(getattr(value, name), f"{path}.{name}")
    elif isinstance(value, (list, tuple)):
        yield f"{path} length", len(value)
        for i, part in enumerate(value):
            yield from flat(part, f"{path}[{i}]")
    else:
        yield path, value


def bits(value: Any) -> Any:
    """Something that is equal only for equal bits: NaN equals NaN, and 0 is not -0."""
    if isinstance(value, float):
        return struct.pack("=d", value)
    return value.tobytes() if isinstance(value, (np.ndarray, array.array)) else value


def differences(found: Any, expected: Any) -> list[str]:
    """Returns a line for each part in which two messages differ."""
    lines = []
    for (path, a), (other, b) in zip(flat(found), flat(expected), strict=True):
        if path == other and bits(a) == bits(b):
            continue
        close = TRIGONOMETRIC.search(path) and isinstance(a, (float, np.ndarray, array.array)) and np.allclose(
            a, b, rtol=PRECISION, atol=PRECISION)
        if not close:
            lines.append(f"{path}: found {a!r}, expected {b!r}")
    return lines


def both(driver: Path, folder: Path, world: str, parameters: dict[str, Any], commands: list[Command]) -> tuple[Run, Run]:
    file = folder / "test.world"
    file.write_text(world)
    parameters = {"paused": True, **parameters}
    cpp = run_cpp(driver, {"world_file": str(file), **parameters}, commands, RESPONSES)
    assert not cpp.refused or cpp.publishers, cpp.refused
    return cpp, run_python(str(file), parameters, commands, cpp.publishers)


def kind_of(topic: str, prefixes: set[str]) -> str:
    """The name of a topic without the robot's prefix and numbers."""
    first, _, rest = topic.removeprefix("/").partition("/")
    name = rest if first in prefixes else topic.removeprefix("/")
    return re.sub(r"_?\d+(?=/|$)", "", name).partition("/")[0]


def leave_out_joints(joints: Any) -> None:
    """Removes the joints of actuators, which only the Python node has, and which follow the wheels."""
    count = sum("actuator" not in name for name in joints.name)
    joints.name, joints.position, joints.velocity = joints.name[:count], joints.position[:count], joints.velocity[:count]


def leave_out_actuators(cpp: Run, python: Run) -> None:
    """Removes frames of actuators and on them: only the Python node has the former, so the latter have other parents."""
    def links(run: Run) -> list[Any]:
        return [message for _, message in run.events if hasattr(message, "transforms")]

    moved = {link.child_frame_id for message in links(python) for link in message.transforms
             if "actuator" in link.header.frame_id + link.child_frame_id}
    for message in links(python) + links(cpp):
        message.transforms = [link for link in message.transforms if link.child_frame_id not in moved]


def compare(cpp: Run, python: Run) -> dict[str, int]:
    """Compares two runs; returns the number of messages by topic."""
    for topic, made in cpp.publishers.items():
        assert python.publishers[topic] == made, topic
    prefixes = {topic.split("/")[1] for topic in python.publishers if topic.endswith("/odom") and topic.count("/") == 2}
    missing = {kind_of(topic, prefixes) for topic in set(python.publishers) - set(cpp.publishers)}
    assert missing <= ONLY_PYTHON
    for topic, made_of in cpp.subscriptions.items():
        assert python.subscriptions[topic] == made_of, topic
    assert {kind_of(topic, prefixes) for topic in set(python.subscriptions) - set(cpp.subscriptions)} <= {
        "ackermann_cmd", "initialpose", "stage"}

    for topic, message in python.events:
        if topic.endswith("joint_states"):
            leave_out_joints(message)
    leave_out_actuators(cpp, python)
    expected = [(topic, message) for topic, message in python.events if topic in cpp.publishers or topic in RESPONSES]
    counts: dict[str, int] = {}
    for number, ((topic, found), (other, wanted)) in enumerate(zip(cpp.events, expected)):
        assert topic == other, (number, topic, other)
        lines = differences(found, wanted)
        assert not lines, f"message {number}, number {counts.get(topic, 0)} on {topic}:\n" + "\n".join(lines[:12])
        counts[topic] = counts.get(topic, 0) + 1
    assert [topic for topic, _ in cpp.events] == [topic for topic, _ in expected]
    print(f"{len(expected)} messages")
    return counts


def test_one_robot(driver: Path, tmp_path: Path) -> None:
    """Subscribers from the beginning; commands, an obstacle, the watchdog, a battery that becomes empty."""
    commands: list[Command] = [("early", "listen", "*"), ("publish", "/cmd_vel", twist(0.6, 0, 0.7)), *steps(12),
                               ("publish", "/cmd_vel", twist(math.nan, 0, 0)), *steps(5),
                               ("publish", "/cmd_vel", twist(0.8, 0, 0)), ("set", "base_watchdog_timeout", 0.0), *steps(60)]
    cpp, python = both(driver, tmp_path, ONE.format(step=100), {}, commands)
    counts = compare(cpp, python)
    assert counts["/base_scan"] == counts["/base_scan_sensor_2"] == counts["/odom"] - 1 == 77
    assert counts["/image"] == counts["/camera_info"] - 1 == 38 and counts["/imu"] == 77
    scans = [message for topic, message in cpp.events if topic == "/base_scan"]
    assert any(math.isinf(r) and r > 0 for scan in scans for r in scan.ranges)
    assert any(math.isinf(r) and r < 0 for scan in scans for r in scan.ranges)
    stalls = [message.data for topic, message in cpp.events if topic == "/stall"]
    assert True in stalls and False in stalls
    charge = [message.percentage for topic, message in cpp.events if topic == "/battery"]
    assert charge[0] == 1 and charge[-1] < 0.7
    # In each step, the time comes first, then transforms.
    topics = [topic for topic, _ in cpp.events]
    assert all(topics[i + 1] == "/tf" for i, topic in enumerate(topics) if topic == "/clock")


def test_one_robot_with_other_names(driver: Path, tmp_path: Path) -> None:
    """Late subscribers one by one, other names and frames, Range, Stage's own ranges, stamped commands."""
    parameters = {"naming": "stage_ros", "enforce_prefixes": True, "odom_frame_id": "o", "base_link_frame_id": "b",
                  "base_footprint_frame_id": "f", "map_frame_id": "world", "ranges": "stage", "single_beams": "range",
                  "sensor_qos": "best_effort", "publish_map_tf": True, "stamped_cmd_vel": True, "base_watchdog_timeout": 0,
                  "wheel_radius": 0.07, "wheel_separation": 0.3, "ticks_per_turn": 360}
    r = "/robot_0"
    commands = [("publish", f"{r}/cmd_vel", twist(0.4, 0, -0.5, True)), *steps(7), *listen(f"{r}/joint_states"), *steps(3),
                *listen(f"{r}/base_scan", "/tf", f"{r}/imu"), ("turn",), *steps(9), *listen(f"{r}/depth"), ("turn",),
                *steps(11), *listen("*"), ("turn",), ("leave", f"{r}/odom"), *steps(7), ("wait", 0.12), *steps(8)]
    cpp, python = both(driver, tmp_path, ONE.format(step=40), parameters, commands)
    counts = compare(cpp, python)
    assert cpp.publishers[f"{r}/base_scan_sensor_1"][0] == "sensor_msgs/msg/Range"
    assert cpp.publishers[f"{r}/base_scan"] == ("sensor_msgs/msg/LaserScan", "5", "best_effort", "volatile")
    assert counts[f"{r}/base_pose_ground_truth"] > 3 and counts[f"{r}/base_scan_sensor_1"] > 3
    assert counts[f"{r}/odom"] < counts[f"{r}/base_pose_ground_truth"]
    parents = {t.header.frame_id for topic, message in cpp.events if topic == "/tf" for t in message.transforms}
    assert parents == {"robot_0/o", "world"}


MOVES = [("publish", "/a/cmd_vel", twist(0.5, 0.2, 0.4)), ("publish", "/b_c_2/cmd_vel", twist(0.6, 0, 0.3)),
         ("publish", "/b_c/cmd_vel", twist(0.2, 0, 1.0))]


def test_many_robots(driver: Path, tmp_path: Path) -> None:
    """Robots of all drives, one with a controller; moved, reset twice, paused and running."""
    commands: list[Command] = [
        ("early", "listen", "*"), *steps(10), *MOVES, *steps(30),
        ("publish", "/a/teleport", pose(1, -1, 30)), ("publish", "/b_c/teleport", pose(0.3, 0.1, -20, "/b_c/base_link")),
        ("publish", "/_4/teleport", pose(0.5, 0, 45, "a/odom")), ("publish", "/a/teleport", pose(0, 0, 0, "nowhere")), *steps(5),
        ("call", "/reset_positions", Empty.Request()), *steps(5), ("call", "/stage/pause", SetBool.Request(data=False)),
        ("set", "speed", 0), *[("turn",)] * 8, ("publish", "/a/teleport", pose(-1, 1, 70)), *[("turn",)] * 4,
        ("call", "/stage/pause", SetBool.Request(data=True)), ("set", "seed", 7), ("call", "/stage/reset", Trigger.Request()),
        *MOVES, *steps(20), ("set", "seed", -1), ("call", "/stage/reset", Trigger.Request()), *steps(12)]
    cpp, python = both(driver, tmp_path, MANY.format(step=50), {"always_on": True}, commands)
    counts = compare(cpp, python)
    assert {"/a/odom", "/b_c/odom", "/b_c_2/odom", "/_4/odom", "/b_c_2/image1", "/a/base_scan1_sensor_2"} <= set(counts)
    assert len(cpp.publishers) == 48
    answers = [message.message for topic, message in cpp.events if topic == "/stage/reset"]
    assert answers == ["began anew with the seed 7"] * 2


def test_many_robots_with_other_names(driver: Path, tmp_path: Path) -> None:
    """Late subscribers, sensors in frames that move, no topics for single rays."""
    parameters = {"naming": "stage_ros", "single_beams": "none", "publish_map_tf": True, "speed": 0, "seed": 5}
    moves = [("publish", topic.replace("/a/", "/robot_0/").replace("/b_c_2/", "/robot_2/").replace("/b_c/", "/robot_1/"), message)
             for _, topic, message in MOVES]
    commands = [*moves, *steps(11), *listen("*"), ("turn",), *steps(40), ("call", "/stage/reset", Trigger.Request()), *moves,
                *steps(15)]
    cpp, python = both(driver, tmp_path, MANY.format(step=20), parameters, commands)
    frames = {t.child_frame_id for topic, message in cpp.events if topic == "/tf" for t in message.transforms}
    counts = compare(cpp, python)
    assert "/robot_2/image_1" in counts and "/robot_0/base_scan_0_sensor_1" not in cpp.publishers
    assert {"robot_1/base_laser_link", "robot_1/base_laser_link_sensor_2", "robot_3/odom"} <= frames


def test_bad_input_is_refused_like_by_the_python_node(driver: Path, tmp_path: Path) -> None:
    file = tmp_path / "one.world"
    file.write_text(ONE.format(step=100))
    for parameters, reason in (
            ({}, "found no world, expected one in the parameter world_file"),
            ({"world_file": str(tmp_path / "no.world")}, "no.world"),
            ({"world_file": str(file), "naming": "ros"}, "parameter naming: found ros, expected stage_ros2 or stage_ros"),
            ({"world_file": str(file), "speed": -1}, "parameter speed: found -1, expected a number, 0 or more"),
            ({"world_file": str(file), "publish_tf": "yes"}, "parameter publish_tf: found yes, expected true or false")):
        run = run_cpp(driver, parameters, [], RESPONSES)
        assert len(run.refused) == 1 and reason in run.refused[0]
    empty = tmp_path / "empty.world"
    empty.write_text("model( size [1 1 1] )\n")
    assert "found no robot" in run_cpp(driver, {"world_file": str(empty)}, [], RESPONSES).refused[0]
    changes: list[Command] = [("set", "steps", 0), ("set", "steps", 1.5), ("set", "base_watchdog_timeout", -0.1)]
    cpp, python = both(driver, tmp_path, ONE.format(step=100), {}, changes)
    assert len(cpp.refused) == len(python.refused) == 3


def test_the_launch_file_loads_the_component() -> None:
    names: dict[str, Any] = {}
    modules = ("launch", "launch.actions", "launch.substitutions", "launch_ros", "launch_ros.actions", "launch_ros.descriptions")
    with mock.patch.dict(sys.modules, {name: mock.MagicMock() for name in modules}):
        exec(compile((PACKAGE / "launch" / "stage.launch.py").read_text(), "stage.launch.py", "exec"), names)
        names["generate_launch_description"]()
        names["LaunchConfiguration"] = lambda name: mock.MagicMock(perform=lambda _: "p.yaml" if name == "parameters" else "")
        names["start_container"](mock.MagicMock())
    given = names["ComposableNode"].call_args.kwargs
    assert (given["package"], given["plugin"]) == ("stage_ros2_cpp", "stage_ros2_cpp::StageNode")
    assert given["parameters"][0] == "p.yaml" and list(given["parameters"][1]) == ["world_file"]
    build = (PACKAGE / "CMakeLists.txt").read_text()
    assert f'PLUGIN "{given["plugin"]}"' in build


def test_the_package_depends_on_what_it_includes() -> None:
    depends = set(re.findall(r"<depend>(\w+)</depend>", (PACKAGE / "package.xml").read_text()))
    sources = "".join(file.read_text() for file in sorted((PACKAGE / "src").iterdir()))
    included = set(re.findall(r"#include <(\w+)/", sources)) | {"Stage"}
    assert included ^ depends == {"builtin_interfaces"}  # which comes with all messages


def test_parameters_have_the_defaults_of_the_python_node() -> None:
    from stagesim.ros.parameters import PARAMETERS

    text = re.sub(r"\s+", " ", (PACKAGE / "src" / "parameters.cc").read_text())
    found = dict(re.findall(r'\{ ?"(\w+)", ParameterValue\(([^)]*)\)', text))
    assert len(found) > 20
    for name, given in found.items():
        default = PARAMETERS[name].default
        assert given == (f'"{default}"' if isinstance(default, str) else str(default).lower()), name
    page = (ROOT / "docs" / "ros_reference.md").read_text().split("\n## The node in C++\n")[1].split("\n## ")[0]
    for name in set(PARAMETERS) - set(found):
        assert f"`{name}`" in page, f"{name} is only in the Python node, and the page does not say so"
