# SPDX-License-Identifier: GPL-2.0-or-later
"""The node that decides, with inputs that are missing, late or contradictory: it stops or ignores them, and says so once."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, Callable, Iterator

import numpy as np
import pytest
from geometry_msgs.msg import Twist
from patience import PATIENCE
from rclpy.duration import Duration
from rosgraph_msgs.msg import Clock
from what_if_messages import goal, occupancy, odometry, pose

SECOND = 10**9
WORLD = ('resolution 0.05\ninterval_sim 100\n'
         'position( name "robot" size [0.4 0.4 0.4] round 1 drive "diff" localization "gps" )\n')
#: Half a second of simulated time between decisions, each of which may take as long in real time.
PARAMETERS = {"use_sim_time": True, "rate": 2.0, "odom_timeout": 0.9, "goal": [4.0, 0.0], "samples": 3, "map_topic": "",
              "localization": "odom", "budget": 0.9, "deadline": 0.95}


class Driven:
    """A node whose messages come from this test, and whose commands go there."""

    def __init__(self, world: str, **parameters: Any) -> None:
        from stagesim.ros.what_if.node import WhatIfNode

        self.node = WhatIfNode(world, parameters={**PARAMETERS, **parameters})
        self.now = SECOND
        self.commands: list[tuple[float, Twist]] = []  # when, and what
        self.acknowledged = -1  # number of commands that the node has waited for
        self.node._cmd_vel = self  # type: ignore[assignment]

    def publish(self, message: Twist) -> None:
        self.commands.append((time.monotonic(), message))

    def wait_for_all_acked(self, timeout: Duration) -> bool:
        self.acknowledged = len(self.commands)
        return True

    def send(self, topic: str, message: Any) -> None:
        takers = [each for each in self.node.subscriptions if each.topic_name == f"/{topic}"]
        assert takers, topic
        for each in takers:
            each.callback(message)

    def go(self, periods: int = 1, odom: Callable[[int], Any] | None = odometry, **messages: Callable[[int], Any]) -> str:
        """Lets time pass, with messages for each decision; returns the status."""
        for _ in range(periods):
            self.now += SECOND // 2
            clock = Clock()
            clock.clock.sec, clock.clock.nanosec = divmod(self.now, SECOND)
            self.send("clock", clock)
            for topic, make in {"odom": odom, **messages}.items():
                if make is not None:
                    self.send(topic, make(self.now))
            self.node.turn()
        return self.node.status

    @property
    def speed(self) -> float:
        return float(self.commands[-1][1].linear.x)


@pytest.fixture
def make(ros: None, tmp_path: Path) -> Iterator[Callable[..., Driven]]:
    (tmp_path / "robot.world").write_text(WORLD)
    made: list[Driven] = []

    def begin(**parameters: Any) -> Driven:
        made.append(Driven(str(tmp_path / "robot.world"), **parameters))
        return made[-1]

    yield begin
    for driven in made:
        driven.node.close()
        assert driven.speed == 0 and driven.acknowledged == len(driven.commands)  # or its last command could be lost


def test_good_inputs_drive_until_the_goal_is_reached(make: Any) -> None:
    driven = make(others="friend", tracks="people")
    friend = {"friend": lambda now: odometry(now, (0, 3, 0))}
    assert driven.go(2, people=lambda now: odometry(now, (5, 5, 0), child="someone"), **friend) == "drives"
    assert driven.speed == 0.5 and driven.node.decisions == 2
    assert driven.go(1, odom=lambda now: odometry(now, (3.95, 0, 0)), **friend) == "has arrived" and driven.speed == 0
    count = len(driven.commands)
    assert driven.go(3, **friend) == "has arrived" and len(driven.commands) == count
    driven.send("goal_pose", goal(-4, 0))
    assert driven.go(1, **friend) == "drives"


@pytest.mark.parametrize(("parameters", "messages", "status"), [
    ({}, {"odom": None}, "no odometry has been received"),
    ({"localization": "both"}, {}, "no pose of the localization has been received"),
    ({"localization": "both"}, {"pose": lambda now: pose(SECOND // 1000, (0, 0, 0))}, "older than the first odometry"),
    ({"localization": "pose"}, {"odom": None}, "no pose"), ({"map_topic": "/map"}, {}, "no map has been received on /map"),
    ({"others": "/friend"}, {}, "nothing has been received on /friend"), ({"goal": []}, {}, "has no goal"),
    ({"budget": 1e-6}, {}, "a decision is late")])
def test_missing_inputs_stop_the_robot(make: Any, capfd: Any, parameters: dict[str, Any], messages: dict[str, Any],
                                       status: str) -> None:
    driven = make(**parameters)
    assert status in driven.go(3, **messages)
    assert driven.speed == 0
    assert capfd.readouterr().err.count(status) == 1


NAN = float("nan")
OTHERS = {"tracks": "people"}


@pytest.mark.parametrize(("parameters", "topic", "make_message", "log", "status"), [
    ({}, "odom", lambda now: odometry(now, (NAN, 0, 0)), "found the pose (nan, 0, 0)", "older than 0.9 s"),
    ({}, "odom", lambda now: odometry(now, errors=(-1, 1, 1)), "positive semidefinite", "older than 0.9 s"),
    ({}, "odom", lambda now: odometry(SECOND), "older than one before", "older than 0.9 s"),
    ({}, "odom", lambda now: odometry(now + 9 * SECOND), "9 s in the future", "older than 0.9 s"),
    (OTHERS, "people", lambda now: odometry(now, (NAN, 0, 0), child="x"), "expected finite", "people contradicts itself"),
    (OTHERS, "people", lambda now: odometry(now, velocity=(0, NAN, 0), child="x"), "found the velocity", "people contradicts itself"),
    (OTHERS, "people", lambda now: odometry(now, errors=(-1, 1, 1), child="x"), "semidefinite", "people contradicts itself"),
    (OTHERS, "people", lambda now: odometry(2 * SECOND, (now * 1e-9, 9, 0), child="x"), "'x' twice", "people contradicts itself"),
    (OTHERS, "people", lambda now: odometry(now, frame="r1/odom", child="x"), "frame 'r1/odom' of others", "people contradicts itself"),
    ({"map_topic": "/map"}, "map", lambda now: occupancy(np.zeros((3, 3)), frame="other"), "frame 'other' of a map", "no map"),
    ({"map_topic": "/map"}, "map", lambda now: occupancy(np.zeros((0, 3))), "0 rows", "no map"),
    ({"map_topic": "/map"}, "map", lambda now: occupancy(np.zeros((3, 3)), resolution=NAN), "a resolution", "no map"),
    ({"map_topic": "/map"}, "map", lambda now: occupancy(np.zeros((3, 3)), origin=(NAN, 0, 0)), "the pose (nan", "no map"),
    ({}, "goal_pose", lambda now: goal(NAN, 0), "the goal (nan", "drives"),
    ({}, "goal_pose", lambda now: goal(1, 0, frame="odom"), "frame 'odom' of a goal", "drives")])
def test_contradictory_inputs_are_told_once(make: Any, capfd: Any, parameters: dict[str, Any], topic: str,
                                            make_message: Callable[[int], Any], log: str, status: str) -> None:
    driven = make(**parameters)
    driven.go(1)
    messages = {topic: make_message} if topic == "odom" else {"odom": odometry, topic: make_message}
    found = driven.go(4, **messages)
    assert status in found and (driven.speed == 0) == (found != "drives")
    text = capfd.readouterr().err
    assert text.count(f"{topic}: found") == 1 and log in text
    if topic != "map":
        assert driven.go(4) == "drives" and driven.speed > 0


def test_time_that_goes_back_makes_the_node_begin_anew(make: Any, capfd: Any) -> None:
    driven = make()
    assert driven.go(4) == "drives"
    driven.now = 0
    assert driven.go(1, odom=None).startswith("stopped: time went back by 2.5 s") and driven.speed == 0
    assert capfd.readouterr().err.count("time went back") == 1
    assert driven.go(2, odom=None) == "stopped: no odometry has been received" and driven.speed == 0
    assert driven.go(1) == "drives"


def test_a_slow_decision_stops_the_robot_while_it_lasts(make: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    driven = make(rate=5.0, deadline=0.9)
    assert driven.go(1) == "drives" and driven.speed > 0
    decide, returned = driven.node.decider.decide, []

    def slow(*given: Any) -> Any:
        found = decide(*given)
        time.sleep(0.5)
        returned.append(time.monotonic())
        return found

    monkeypatch.setattr(driven.node.decider, "decide", slow)
    assert "took longer than 180 ms" in driven.go(1)
    stopped, message = driven.commands[-1]
    assert message.linear.x == 0 and len(driven.commands) == 2 and stopped < returned[0] - 0.1
    monkeypatch.undo()
    assert driven.go(1) == "drives" and driven.speed > 0


def test_a_clock_that_stands_still_stops_the_robot(make: Any) -> None:
    driven = make()
    driven.go(1)
    end = time.monotonic() + PATIENCE
    while driven.node.status == "drives" and time.monotonic() < end:
        driven.node.turn()
    assert driven.node.status == "stopped: the clock stands still" and driven.speed == 0


def test_maps_are_obstacles_wherever_their_origin_is(make: Any) -> None:
    """A wall is a row of cells, in a map that is turned by a quarter."""
    driven = make(map_topic="/map", turns=[0.0], samples=1)
    cells = np.zeros((40, 60))
    driven.send("map", occupancy(cells, origin=(3, -3, np.pi / 2)))
    belief = driven.node.decider._belief
    assert driven.go(1) == "drives" and driven.speed > 0
    cells[20] = 100  # at x = 1
    driven.send("map", occupancy(cells, origin=(3, -3, np.pi / 2)))
    assert driven.node.decider._belief is belief
    assert driven.go(1) == "drives" and driven.speed == 0
    driven.send("map", occupancy(cells, origin=(3, -3, 0)))  # at y = -1
    assert driven.node.decider._belief is not belief
    assert driven.go(1) == "drives" and driven.speed > 0
    driven.send("map", occupancy(np.full((70, 90), 100), origin=(-3, -3, 0)))
    assert "in an obstacle" in driven.go(1) and driven.speed == 0


def test_others_go_on_until_nothing_is_heard_of_them(make: Any) -> None:
    driven = make(tracks="people", turns=[0.0], speeds=[0.0, 0.5], samples=1, behaviours="go on")
    person = odometry(driven.now + SECOND // 2, (1.0, 0, 0), child="x")
    assert driven.go(1, people=lambda _: person) == "drives" and driven.speed == 0
    assert driven.go(1) == "drives" and driven.speed == 0
    assert driven.go(3) == "drives" and driven.speed > 0
    own = odometry(driven.now + SECOND // 2, (0, 0, 0))  # a tracker that sees the robot itself
    assert driven.go(1, people=lambda _: own) == "drives" and driven.speed > 0


@pytest.mark.parametrize(("name", "value"), [
    ("rate", 0.0), ("samples", 1.5), ("speeds", []), ("turns", [NAN]), ("goal", [1.0]), ("localization", "gps"),
    ("behaviours", "fly 2"), ("behaviours", "function"), ("accelerations", [1.0, -1.0]), ("delay", -1.0)])
def test_wrong_parameters_are_one_line(make: Any, name: str, value: Any) -> None:
    with pytest.raises(ValueError, match="found") as error:
        make(**{name: value})
    assert "\n" not in str(error.value)
