# SPDX-License-Identifier: GPL-2.0-or-later
"""Lock-step: simulated time waits for controllers, so that runs with ROS are reproducible."""

from __future__ import annotations

import time
from typing import Any, Callable

import numpy as np
import pytest
import stagesim as st
from geometry_msgs.msg import TwistStamped
from ros_testing import SENSOR, Client, Process
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

WORLD, ROBOTS, SECONDS = "arena.world", ("r0", "r1", "r2", "r3", "r4"), 10


def speeds(ranges: Any) -> tuple[float, float]:
    """A controller that drives ahead, or turns if an obstacle is near."""
    near = float(min(ranges))
    return (0.4, 0.2 * near) if near > 0.5 else (0.1, 0.9)


def drive(client: Client, delay: Callable[[], float] = lambda: 0.0) -> None:
    """Answers each scan of each robot with a command."""
    for robot in ROBOTS:
        publisher = client.node.create_publisher(TwistStamped, f"/{robot}/cmd_vel", 10)

        def answer(scan: LaserScan, publisher: Any = publisher) -> None:
            time.sleep(delay())
            message = TwistStamped(header=scan.header)
            message.twist.linear.x, message.twist.angular.z = speeds(scan.ranges)
            publisher.publish(message)

        client.node.create_subscription(LaserScan, f"/{robot}/base_scan", answer, SENSOR)


def run(start: Callable[..., Process], client: Client, **parameters: Any) -> dict[str, Any]:
    process = start(WORLD, "--duration", str(SECONDS), "--stats", stamped_cmd_vel=True, lockstep="all",
                    **parameters)
    client.until(lambda: process.process.poll() is not None)
    return process.statistics()


def test_runs_repeat_and_are_those_without_ros(start: Callable[..., Process], client: Client) -> None:
    random = np.random.default_rng(1)
    drive(client, lambda: random.choice([0, 0, 0, 0.01]))
    first = run(start, client, speed=0)
    second = run(start, client, speed=2 * SECONDS)
    assert first["state"] == second["state"] and first["simulated"] == SECONDS
    assert first["state"] == without_ros()


def without_ros() -> str:
    """Runs the same controller without ROS, from the first step on; returns the state hash."""
    with st.World(WORLD) as world:
        fleet = world.fleet()
        cmd, ranges = fleet.cmd, fleet.ranger().ranges
        cmd[:] = np.nan
        for model in world.models:  # subscribes after the sensors, because the order is part of the state
            if model.type == "position" and model.subscribers == 0:
                model.subscribe()
        while world.time < SECONDS:
            if world.steps > 0:
                for robot, row in enumerate(ranges.astype(np.float32)):
                    ahead, turn = speeds(row)
                    cmd[robot] = ahead, 0, turn
            world.step()
        return world.state_hash()


def test_only_clients_in_the_list_are_waited_for(start: Callable[..., Process], client: Client, two: str) -> None:
    start(two, lockstep="logger", speed=0)
    clock = client.listen(Clock, "/clock")
    done = client.talk(Header, "/stage/done")
    client.until(lambda: clock)
    client.spin(1.2)
    assert {c.clock.nanosec for c in clock} <= {0, 100_000_000} and clock[-1].clock.nanosec > 0
    late = Header(frame_id="logger")
    late.stamp.sec = 5
    done.publish(late)
    done.publish(Header(frame_id="somebody else"))
    client.spin(0.3)
    assert clock[-1].clock.nanosec == 100_000_000
    for step in range(2, 6):
        done.publish(Header(frame_id="logger", stamp=clock[-1].clock))
        client.until(lambda: clock[-1].clock.nanosec == step * 100_000_000)
    client.spin(0.2)
    assert clock[-1].clock.nanosec == 500_000_000
    client.set(lockstep="")
    client.until(lambda: clock[-1].clock.sec > 2)


def test_a_late_client_gets_the_messages_of_the_last_step(start: Callable[..., Process], client: Client,
                                                          two: str) -> None:
    process = start(two, lockstep="a,b", stamped_cmd_vel=True, speed=0)
    clock = client.listen(Clock, "/clock")
    client.until(lambda: clock)
    time.sleep(1)
    again = client.listen(Clock, "/clock")
    client.until(lambda: again)
    talks = [client.talk(TwistStamped, f"/{name}/cmd_vel") for name in "ab"]
    for talk in talks:
        talk.publish(TwistStamped(header=Header(stamp=clock[-1].clock)))
    client.until(lambda: clock[-1].clock.nanosec == 200_000_000)
    client.spin(0.6)
    status, text = process.end()
    assert status == 0 and "waiting for a, b" in text


@pytest.mark.parametrize("names", ("a", "b", "a b"))
def test_robots_that_are_not_waited_for_may_be_silent(start: Callable[..., Process], client: Client,
                                                      two: str, names: str) -> None:
    start(two, lockstep=names, stamped_cmd_vel=True, speed=0)
    clock = client.listen(Clock, "/clock")
    talk = client.talk(TwistStamped, f"/{names[0]}/cmd_vel")
    client.until(lambda: clock)
    client.until(lambda: clock[-1].clock.nanosec == 100_000_000)
    talk.publish(TwistStamped(header=Header(stamp=clock[-1].clock)))
    if " " in names:
        client.spin(0.5)
        assert clock[-1].clock.nanosec == 100_000_000
    else:
        client.until(lambda: clock[-1].clock.nanosec == 200_000_000)


def test_answers_can_be_expected_at_a_longer_interval(start: Callable[..., Process], client: Client, two: str) -> None:
    start(two, lockstep="me", lockstep_interval=0.25, speed=0)
    clock = client.listen(Clock, "/clock")
    done = client.talk(Header, "/stage/done")
    for moment in (300, 500, 800):  # the first step at or after each quarter of a second
        client.until(lambda: clock and clock[-1].clock.nanosec == moment * 1_000_000)
        client.spin(0.2)
        assert clock[-1].clock.nanosec == moment * 1_000_000
        done.publish(Header(frame_id="me", stamp=clock[-1].clock))
