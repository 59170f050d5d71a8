# SPDX-License-Identifier: GPL-2.0-or-later
"""The colcon package, tested without colcon, and the documentation."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from launch_stubs import commands, loaded
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from patience import PATIENCE
from rcl_interfaces.srv import GetParameters
from rclpy.parameter import parameter_value_to_python
from ros_testing import Client, Process
from stagesim.ros.names import SCHEMES
from stagesim.ros.parameters import PARAMETERS, Parameter
from stagesim.ros.what_if.parameters import PARAMETERS as WHAT_IF

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
PACKAGE = ROOT / "ros2" / "stage_ros2"


RUN = "import sys, stage_ros2; sys.argv[0] = 'stage_ros2'; stage_ros2.main()"


def run(*arguments: str, path: str = "", code: str = RUN) -> subprocess.CompletedProcess[str]:
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join([str(PACKAGE), path]))
    return subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True,
                          check=False, env=environment, timeout=PATIENCE)


def test_the_executable_runs_the_node() -> None:
    done = run("simple.world", "--duration", "0.5", "--stats", path=os.environ.get("PYTHONPATH", ""))
    assert done.returncode == 0 and '"simulated": 0.5' in done.stdout, done.stderr


def test_the_error_without_stagesim_names_it() -> None:
    done = run()
    if "PYTHONPATH" not in os.environ:
        pytest.skip("stagesim is installed")
    assert done.returncode == 1
    assert done.stderr.startswith("stage_ros2: there is no Python module stagesim")


def test_the_second_executable_runs_the_node_that_decides() -> None:
    code = "import sys, stage_ros2; sys.argv[0] = 'what_if'; stage_ros2.what_if()"
    done = run("missing.world", code=code, path=os.environ.get("PYTHONPATH", ""))
    assert done.returncode == 1 and "stagesim.ros.what_if: " in done.stderr and "missing.world" in done.stderr


@pytest.mark.parametrize(("file", "parameters"), [("stage", PARAMETERS), ("what_if", WHAT_IF)])
def test_launch_files_offer_only_known_parameters(file: str, parameters: dict[str, Parameter]) -> None:
    with loaded(PACKAGE / "launch" / f"{file}.launch.py") as names:
        if file == "stage":
            assert set(names["ARGUMENTS"]) == set(parameters) - {"world_file"}  # which is the argument "world"
    for name, (default, kind, _) in names["ARGUMENTS"].items():
        known = parameters[name]
        assert kind is type(known.default)
        assert default == (str(known.default).lower() if kind is bool else str(known.default)), name


def start_launched(words: list[str], module: str) -> Process:
    """Starts a node as a launch file would, by the words behind its executable."""
    at = words.index("--ros-args")
    return Process(words[0], *words[1:at], module=module, more=words[at + 1:])


def parameters_of(client: Client, node: str, names: list[str]) -> dict[str, Any]:
    """The parameters of a node in another process."""
    values = client.call(f"{node}/get_parameters", GetParameters, names=names).values
    return {name: parameter_value_to_python(value) for name, value in zip(names, values)}


#: Values of parameters, which are given to stage.launch.py as arguments.
GIVEN = {
    "naming": "stage_ros", "odom_frame_id": "o", "base_link_frame_id": "b", "base_footprint_frame_id": "f",
    "map_frame_id": "m", "enforce_prefixes": True, "publish_tf": False, "publish_map_tf": True, "publish_map": True,
    "map_resolution": 0.5, "map_height": 0.3, "namespaced_tf": "also", "wheel_radius": 0.1, "wheel_separation": 0.4,
    "ticks_per_turn": 77, "single_beams": "none", "sensor_qos": "best_effort", "ranges": "stage", "clock_rate": 20.0,
    "stamped_cmd_vel": True, "cars_turn": True, "always_on": True, "base_watchdog_timeout": 1.5, "steps": 3, "seed": 9,
    "imu_gyro_noise": 0.01, "imu_gyro_walk": 0.02, "imu_accelerometer_noise": 0.03, "imu_accelerometer_walk": 0.04,
    "snapshot_file": "my snapshot", "speed": 2.0, "paused": True, "gui": False, "lockstep": "", "lockstep_interval": 0.2}


def test_each_argument_of_the_launch_file_arrives(client: Client, tmp_path: Path, one: str) -> None:
    given = {**GIVEN, "log_file": str(tmp_path / "my log.mcap")}
    assert set(given) == set(PARAMETERS) - {"world_file"}
    file = tmp_path / "more.yaml"
    file.write_text("stage: {ros__parameters: {topics.scan.rate: 4.0, ticks_per_turn: 78}}")
    texts = {name: str(value).lower() if isinstance(value, bool) else str(value) for name, value in given.items()}
    found = commands(PACKAGE / "launch" / "stage.launch.py", tmp_path, world=one, rviz="true", params_file=str(file), **texts)
    assert set(found) == {"stage_ros2", "rviz2"} and "use_sim_time: true" in (tmp_path / "rviz20.yaml").read_text()
    process = start_launched(found["stage_ros2"], "stagesim.ros")
    try:
        expected = {**given, "topics.scan.rate": 4.0, "ticks_per_turn": 78}
        assert parameters_of(client, "/stage", list(expected)) == expected
    finally:
        status, text = process.end()
        assert status == 0, text


def test_launched_without_arguments_parameters_have_their_defaults(client: Client, tmp_path: Path) -> None:
    found = commands(PACKAGE / "launch" / "stage.launch.py", tmp_path)
    assert found.keys() == {"stage_ros2"} and found["stage_ros2"][0] == "simple.world"
    process = start_launched(found["stage_ros2"], "stagesim.ros")
    try:
        expected = {name: parameter.default for name, parameter in PARAMETERS.items() if name != "world_file"}
        assert parameters_of(client, "/stage", list(expected)) == expected
        client.until(lambda: client.node.count_publishers("/r0/odom"))
    finally:
        status, text = process.end()
        assert status == 0, text


def test_a_launched_lifecycle_node_loads_a_map_with_robots(client: Client, tmp_path: Path) -> None:
    (tmp_path / "m.pgm").write_bytes(b"P5 40 40 255\n" + b"\xfe" * 1600)
    (tmp_path / "m.yaml").write_text("image: m.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n"
                                     "occupied_thresh: 0.65\nfree_thresh: 0.196\n")
    found = commands(PACKAGE / "launch" / "stage.launch.py", tmp_path, lifecycle="true", map=str(tmp_path / "m.yaml"),
                     robots="turtlebot3_burger:1,1,0 turtlebot3_burger:2,2,90")["stage_ros2"]
    assert found[:2] == ["--lifecycle", "--map"]
    process = Process(*found[:found.index("--ros-args")], more=found[found.index("--ros-args") + 1:])
    try:
        assert client.call("/stage/change_state", ChangeState,
                           transition=Transition(id=Transition.TRANSITION_CONFIGURE)).success
        client.until(lambda: client.node.count_publishers("/r1/odom"))
    finally:
        status, text = process.end()
        assert status == 0, text


def test_arguments_of_the_node_that_decides_arrive(client: Client, tmp_path: Path) -> None:
    world = str(ROOT / "examples" / "what_if" / "belief.world")
    file = PACKAGE / "launch" / "what_if.launch.py"
    for goal in ("[]", "[5.0, 0.5]"):
        found = commands(file, tmp_path, world=world, namespace="robot", goal=goal, map_topic="", samples="7",
                         odom_topic="ground_truth")
        process = start_launched(found["what_if"], "stagesim.ros.what_if")
        try:
            got = parameters_of(client, "/robot/what_if", ["samples", "map_topic", "robot", "use_sim_time", "goal"])
            assert got == {"samples": 7, "map_topic": "", "robot": "robot", "use_sim_time": False, "goal": got["goal"]}
            assert list(got["goal"]) == ([] if goal == "[]" else [5.0, 0.5])
            client.until(lambda: client.node.count_subscribers("/robot/ground_truth"))
        finally:
            status, text = process.end()
        assert status == 0, text
    with pytest.raises(RuntimeError, match="world"):
        commands(file, tmp_path)


@pytest.mark.parametrize(("page", "parameters"), [("ros_reference.md", PARAMETERS), ("ros_what_if.md", WHAT_IF)])
def test_all_parameters_are_documented(page: str, parameters: dict[str, Parameter]) -> None:
    text = (ROOT / "docs" / page).read_text()
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|]*?) \|", text, re.MULTILINE))
    for name, parameter in parameters.items():
        default = parameter.default
        shown = str(default).lower() if isinstance(default, bool) else str(default)
        assert rows.get(name) == (f"`{shown}`" if default not in ("", []) else "empty"), name


def test_names_of_both_schemes_are_documented() -> None:
    text = "".join((ROOT / "docs" / page).read_text() for page in ("ros.md", "ros_reference.md"))
    for scheme in SCHEMES.values():
        assert f"`{scheme.ground_truth}`" in text


def test_packages_of_the_extra_are_pinned() -> None:
    tomllib = pytest.importorskip("tomllib")  # since Python 3.11
    project = tomllib.loads((ROOT / "python" / "pyproject.toml").read_text())["project"]
    pinned = (ROOT / "python" / "ros_requirements.txt").read_text()
    for name in project["optional-dependencies"]["ros"]:
        assert f"\n{name.split('>')[0]}==" in pinned, name
