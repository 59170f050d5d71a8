# SPDX-License-Identifier: GPL-2.0-or-later
"""Simulated robots, as real ones would be, are driven by the node that decides by futures."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Callable, Sequence

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from patience import PATIENCE
from ros_testing import Client, Process
from std_msgs.msg import Float64MultiArray, Header, String
from visualization_msgs.msg import MarkerArray
from what_if_messages import KEPT, goal, occupancy, odometry, pose

Start = Callable[..., Process]
ROBOT = 'size [0.4 0.4 0.4] round 1 drive "diff" localization "gps" )\n'
WALL = "resolution 0.05\ninterval_sim 100\nmodel( size [0.2 1.2 1] pose [2 0 0 0] )\n"
EMPTY = "resolution 0.05\ninterval_sim 100\n"
#: A small question, which a machine answers in a few milliseconds even if it is busy.
SMALL = {"samples": 5, "map_topic": '""',
         "localization": "odom", "robot_radius": 0.2, "other_radius": 0.25}


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str, str], str]:
    def to_file(name: str, text: str) -> str:
        (tmp_path / name).write_text(text)
        return str(tmp_path / name)

    return to_file


def decide(start: Start, world: str, robot: str, namespace: str, **parameters: Any) -> Process:
    """Starts a node that drives a robot of a simulation, with its true pose as odometry in the map."""
    return start(world, robot, module="stagesim.ros.what_if", names={"__ns": namespace, "odom": "ground_truth"},
                 **{**SMALL, **parameters})


def lockstep(start: Start, client: Client, world: str, places: dict[str, list[Odometry]], seconds: float,
             driven: Sequence[str]) -> dict[str, Any]:
    """Runs a simulation until its end while nodes drive; returns its figures. The client misses none of the places."""
    done = client.node.create_publisher(Header, "/stage/done", 10)
    for name in driven:
        client.until(lambda name=name: client.node.count_publishers(f"/{name}/cmd_vel"))
    simulation = start(world, "--duration", str(seconds), "--stats", enforce_prefixes=True, stamped_cmd_vel=True,
                       lockstep=",".join([*driven, "client"]), speed=0)

    def has_ended() -> bool:
        if all(places.values()):
            stamps = [messages[-1].header.stamp for messages in places.values()]
            if all(stamp == stamps[0] for stamp in stamps):
                done.publish(Header(stamp=stamps[0], frame_id="client"))
        return simulation.process.poll() is not None

    client.until(has_ended)
    return simulation.statistics()


def by_time(messages: Sequence[Any]) -> dict[int, Any]:
    """Messages by tenths of a second."""
    return {message.header.stamp.sec * 10 + message.header.stamp.nanosec // 10**8: message for message in messages}


def place(message: Odometry) -> np.ndarray:
    return np.array([message.pose.pose.position.x, message.pose.pose.position.y])


def test_a_robot_drives_round_a_wall_and_another_robot_twice_alike(start: Start, client: Client, write: Any) -> None:
    both = write("both.world", WALL + 'position( name "a" ' + ROBOT + 'position( name "b" pose [3 0.8 0 0] ' + ROBOT)
    alone = write("alone.world", WALL + 'position( name "a" ' + ROBOT)
    commands = client.listen(TwistStamped, "/a/cmd_vel")
    places = client.listen(Odometry, "/a/ground_truth")
    scores = client.listen(Float64MultiArray, "/a/what_if/scores")
    found = []
    for _ in range(2):
        for messages in (commands, places, scores):
            messages.clear()
        node = decide(start, alone, "a", "/a", lockstep=True, goal="[4.0, 0.0]", others="/b/ground_truth")
        figures = lockstep(start, client, both, {"a": places}, 12, ["a"])
        node.end()
        answers = {now: (message.twist.linear.x, message.twist.angular.z) for now, message in by_time(commands).items()
                   if now > 0}  # at its end, the node stops the robot with a stamp of 0
        found.append((figures["state"], answers))
        distances = [np.hypot(*(place(message) - (3, 0.8))) for message in places]
        assert np.hypot(*(place(places[-1]) - (4, 0))) < 0.3 and min(distances) > 0.45
        assert len(answers) >= 119 and len(scores) > 50 and scores[-1].layout.dim[0].size == 34
    (state, answers), (state_again, answers_again) = found
    heard_twice = answers.keys() & answers_again.keys()  # the last answers may come after the end
    assert state == state_again and len(heard_twice) >= 119
    assert all(answers[now] == answers_again[now] for now in heard_twice)


def test_two_robots_that_decide_cross_without_contact(start: Start, client: Client, write: Any) -> None:
    """Each takes the believed place of the other one."""
    both = write("both.world", EMPTY + 'position( name "a" pose [0 0 0 0] ' + ROBOT +
                 'position( name "b" pose [2 -2 0 90] ' + ROBOT)
    alone = write("alone.world", EMPTY + 'position( name "robot" ' + ROBOT)
    goals = {"a": (4, 0), "b": (2, 2)}
    places = {name: client.listen(Odometry, f"/{name}/ground_truth") for name in goals}
    for name, other in (("a", "b"), ("b", "a")):
        decide(start, alone, "robot", f"/{name}", lockstep=True, others=f"/{other}/what_if/robot",
               goal=str([float(number) for number in goals[name]]))
    lockstep(start, client, both, places, 14, "ab")
    for name, goal_of_robot in goals.items():
        assert np.hypot(*(place(places[name][-1]) - goal_of_robot)) < 0.3, name
    a, b = by_time(places["a"]), by_time(places["b"])
    assert len(a) == len(b) >= 140
    assert min(np.hypot(*(place(a[now]) - place(b[now]))) for now in a) > 0.4


def test_a_killed_node_is_started_anew_and_the_robot_stands_meanwhile(start: Start, client: Client, write: Any) -> None:
    world = write("a.world", EMPTY + 'position( name "robot" ' + ROBOT)
    places = client.listen(Odometry, "/a/ground_truth")
    futures = client.listen(MarkerArray, "/a/what_if/futures")
    status = client.listen(String, "/a/what_if/status")
    # A goal that is kept reaches the node that starts later.
    goals = client.node.create_publisher(PoseStamped, "/a/goal_pose", KEPT)
    goals.publish(goal(3, 0.5))
    simulation = write("simulation.world", EMPTY + 'position( name "a" ' + ROBOT)
    start(simulation, enforce_prefixes=True)
    parameters = {"rate": 5.0, "deadline": 1.0, "use_sim_time": True}
    first = decide(start, world, "robot", "/a", **parameters)
    client.until(lambda: places and places[-1].pose.pose.position.x > 0.8)
    first.process.kill()
    first.process.wait()
    client.spin(1.0)
    stopped = place(places[-1])
    client.spin(0.5)
    assert (place(places[-1]) == stopped).all() and 0.8 < stopped[0] < 2
    decide(start, world, "robot", "/a", **parameters)
    client.until(lambda: np.hypot(*(place(places[-1]) - (3, 0.5))) < 0.3)
    client.until(lambda: status and status[-1].data == "has arrived")
    chosen = [marker for message in futures for marker in message.markers if marker.scale.x == 0.05]
    assert chosen and all(marker.color.g > 0 for marker in chosen)


@pytest.mark.parametrize("sign", [signal.SIGINT, signal.SIGTERM])
def test_a_node_that_ends_stops_its_robot(start: Start, client: Client, write: Any, sign: int) -> None:
    """Its inputs come from publishers that keep their last message, and from those that do not."""
    node = decide(start, write("a.world", EMPTY + 'position( name "robot" ' + ROBOT), "robot", "/a", localization="both",
                  map_topic="/map", rate=5.0, deadline=1.0, pose_gap=300.0)
    commands = client.listen(Twist, "/a/cmd_vel")
    for topic, message in (("/map", occupancy(np.zeros((80, 80)), origin=(-4, -4, 0))),
                           ("/a/pose", pose(time.time_ns(), (0, 0, 0)))):
        client.node.create_publisher(type(message), topic, KEPT).publish(message)
    talk = {"/a/goal_pose": goal(3, 0), "/a/ground_truth": None}
    publishers = {topic: client.node.create_publisher(PoseStamped if message else Odometry, topic, 10)
                  for topic, message in talk.items()}

    def drives() -> bool:
        publishers["/a/goal_pose"].publish(talk["/a/goal_pose"])
        publishers["/a/ground_truth"].publish(odometry(time.time_ns(), (1, 1, 1), frame="odom"))
        return bool(commands and commands[-1].linear.x > 0)

    client.until(drives)
    status, text = node.end(sign)
    assert status == 0 and "Traceback" not in text
    client.until(lambda: commands[-1].linear.x == 0)


def test_the_commands_of_the_page_drive_the_robot_to_its_goal(ros: None, client: Client) -> None:
    root = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
    page = (root / "docs" / "ros_what_if.md").read_text()
    commands = [shlex.split(line) for line in page.splitlines() if line.startswith("python -m stagesim.ros")]
    assert len(commands) == 2
    places = client.listen(Odometry, "/robot/ground_truth")
    status = client.listen(String, "/robot/what_if/status", KEPT)
    # Twice as fast, and with fewer futures, as the machine may be busy.
    more = [["--ros-args", "-p", "speed:=2.0"], ["-p", "samples:=3", "-p", "rate:=5.0", "-p", "deadline:=1.0"]]
    running = [subprocess.Popen([sys.executable, *words[1:], *extra], cwd=root)
               for words, extra in zip(commands, more, strict=True)]
    try:
        client.until(lambda: status and status[-1].data == "has arrived")
        assert places and np.hypot(*(place(places[-1]) - (5, 0))) < 0.4
    finally:
        for process in running:
            process.send_signal(signal.SIGINT)
        for process in running:
            assert process.wait(PATIENCE) in (0, -signal.SIGINT)
