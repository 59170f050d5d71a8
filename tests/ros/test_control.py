# SPDX-License-Identifier: GPL-2.0-or-later
"""Control of robots and of the world: commands, teleports, services, time."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest
import stagesim as st
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from patience import PATIENCE, slowness
from ros_testing import SENSOR, Client, Process, node_here
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty, SetBool


def command(x: float = 0.0, y: float = 0.0, turn: float = 0.0, stamped: bool = False) -> Any:
    twist = Twist()
    twist.linear.x, twist.linear.y, twist.angular.z = x, y, turn
    return TwistStamped(twist=twist) if stamped else twist


def place_of(odometry: Odometry) -> tuple[float, float]:
    return odometry.pose.pose.position.x, odometry.pose.pose.position.y


@pytest.mark.parametrize("stamped", (False, True))
@pytest.mark.parametrize("scheme", ("stage_ros2", "stage_ros"))
@pytest.mark.parametrize("robot", (0, 1))
def test_cmd_vel_moves_the_robot_that_it_names(start: Callable[..., Process], client: Client, two: str,
                                               robot: int, scheme: str, stamped: bool) -> None:
    start(two, naming=scheme, stamped_cmd_vel=stamped, speed=5.0, base_watchdog_timeout=0.0)
    old = scheme == "stage_ros"
    names = ["robot_0", "robot_1"] if old else ["a", "b"]
    truth = "base_pose_ground_truth" if old else "ground_truth"
    poses = [client.listen(Odometry, f"/{name}/{truth}") for name in names]
    client.until(lambda: all(poses))
    before = [place_of(got[-1]) for got in poses]
    talk = client.talk(TwistStamped if stamped else Twist, f"/{names[robot]}/cmd_vel")
    talk.publish(command(0.2, 0.1, 0.3, stamped))
    client.until(lambda: place_of(poses[robot][-1]) != before[robot] and poses[robot][-1].twist.twist.linear.x)
    twist = poses[robot][-1].twist.twist
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == (0.2, 0.1, 0.3)
    assert {place_of(message) for message in poses[1 - robot]} == {before[1 - robot]}


def test_commands_that_are_no_numbers_do_nothing(start: Callable[..., Process], client: Client,
                                                 one: str) -> None:
    process = start(one, speed=5.0)
    odometry = client.listen(Odometry, "/odom")
    client.talk(Twist, "/cmd_vel").publish(command(float("nan")))
    client.until(lambda: len(odometry) > 20)
    assert odometry[-1].twist.twist.linear.x == 0
    assert "found the speeds (nan, 0.0, 0.0), expected finite numbers" in process.end()[1]


def test_the_watchdog_stops_a_robot(start: Callable[..., Process], client: Client, one: str) -> None:
    start(one, paused=True, base_watchdog_timeout=0.5)
    truth = client.listen(Odometry, "/ground_truth")
    talk = client.talk(Twist, "/cmd_vel")
    talk.publish(command(0.2))
    client.spin(0.3)
    client.step(20)
    client.until(lambda: truth and truth[-1].header.stamp.sec == 2)
    # The command came at 0 s, so the watchdog stops the robot in the step that begins at 0.6 s.
    assert place_of(truth[-1])[0] == pytest.approx(0.6 * 0.2)
    talk.publish(command(0.2))
    client.spin(0.3)
    client.step(3)
    client.until(lambda: truth[-1].header.stamp.nanosec == 300_000_000)
    assert place_of(truth[-1])[0] == pytest.approx(0.8 * 0.2)  # the pose before the move of the last step


def test_own_controllers_drive_until_somebody_commands(start: Callable[..., Process],
                                                       client: Client) -> None:
    start("simple.world", paused=True)
    truth = client.listen(Odometry, "/r0/ground_truth")
    client.until(lambda: client.node.count_publishers("/r0/ground_truth"))
    world = st.World("simple.world")
    world.step(30)
    client.spin(0.3)
    client.set(steps=30)
    client.step()
    client.until(lambda: truth and truth[-1].header.stamp.sec == 3)
    assert place_of(truth[-1]) == world.model("r0").sensed_pose[:2] != (0, -6)
    client.talk(Twist, "/r0/cmd_vel").publish(command(0.0))
    client.spin(0.3)
    client.step()
    client.until(lambda: truth[-1].header.stamp.sec == 6)
    assert truth[-1].twist.twist.linear.x == 0


@pytest.mark.parametrize("paused", (True, False))
def test_teleport(start: Callable[..., Process], client: Client, two: str, paused: bool) -> None:
    start(two, paused=paused)
    truth = [client.listen(Odometry, f"/{name}/ground_truth") for name in "ab"]
    talk = client.talk(PoseStamped, "/b/teleport")
    client.until(lambda: client.node.count_publishers("/b/ground_truth"))
    client.spin(0.3)
    message = PoseStamped()
    message.pose.position.x, message.pose.position.y = 1.5, -2.5
    message.pose.orientation.z, message.pose.orientation.w = np.sin(0.4), np.cos(0.4)
    talk.publish(message)
    client.until(lambda: truth[1] and place_of(truth[1][-1]) == (1.5, -2.5))
    orientation = truth[1][-1].pose.pose.orientation
    assert 2 * np.arctan2(orientation.z, orientation.w) == pytest.approx(0.8)
    assert all(place_of(got) == (0, 0) for got in truth[0])


def test_pause_step_and_speed(start: Callable[..., Process], client: Client, two: str) -> None:
    start(two)
    clock = client.listen(Clock, "/clock")
    client.until(lambda: len(clock) > 3)
    assert client.call("/stage/pause", SetBool, data=True).message == "paused"
    client.spin(0.3)
    before = seconds(clock[-1])
    client.spin(0.5)
    assert seconds(clock[-1]) == before
    client.set(steps=7)
    assert client.step()[0] == pytest.approx(before + 0.7)
    client.until(lambda: seconds(clock[-1]) == pytest.approx(before + 0.7))
    client.set(speed=20)  # an integer is accepted, too
    client.call("/stage/pause", SetBool, data=False)
    for _ in range(100):  # repeats until the machine is not too busy
        begin, start_time = time.monotonic(), seconds(clock[-1])
        client.spin(2)
        speed = (seconds(clock[-1]) - start_time) / (time.monotonic() - begin)
        assert speed < 22 * slowness()  # a delayed machine catches up
        if 8 < speed < 22:
            break
    else:
        raise AssertionError(f"the speed is never 20, but {speed}")
    times = [seconds(message) for message in clock]
    assert times == sorted(times)


def seconds(clock: Clock) -> float:
    return clock.clock.sec + clock.clock.nanosec / 1e9


def test_time_goes_back_only_at_resets(start: Callable[..., Process], client: Client) -> None:
    start("simple.world", speed=0.0)
    clock = client.listen(Clock, "/clock")
    client.until(lambda: clock)
    resets = 5
    for _ in range(resets):
        client.spin(0.2)
        assert client.call("/stage/reset").success
    client.spin(0.2)
    times = [seconds(message) for message in clock]
    backwards = [after for before, after in itertools.pairwise(times) if after < before]
    assert len(times) > 100 and len(backwards) == resets and max(backwards) < 5


@pytest.mark.parametrize("always_on", (False, True))
def test_reset_with_a_seed(start: Callable[..., Process], client: Client, always_on: bool) -> None:
    start("simple.world", "--seed", "3", paused=True, steps=40, always_on=always_on)
    hashes = {3: {client.step()}}
    for seed in (-1, 3, 4, 3, -1, 4):
        client.set(seed=seed)
        answer = client.call("/stage/reset")
        assert answer.success and answer.message == f"began anew with the seed {3 if seed < 0 else seed}"
        hashes.setdefault(3 if seed < 0 else seed, set()).add(client.step())
    assert [len(found) for found in hashes.values()] == [1, 1] and hashes[3] != hashes[4]
    for seed, found in hashes.items() if not always_on else ():
        with st.World("simple.world", seed=seed) as world:
            world.step(40)
            assert found == {(4.0, world.state_hash())}


def test_reset_positions_works_as_in_stage_ros(start: Callable[..., Process], client: Client, two: str) -> None:
    start(two, paused=True, base_watchdog_timeout=0)
    truth = client.listen(Odometry, "/a/ground_truth")
    client.talk(Twist, "/a/cmd_vel").publish(command(0.2))
    client.spin(0.3)
    client.step(5)
    client.until(lambda: truth and place_of(truth[-1])[0] == pytest.approx(0.08))
    client.call("/reset_positions", Empty)
    assert client.step(2)[0] == pytest.approx(0.7)
    client.until(lambda: truth[-1].header.stamp.nanosec == 700_000_000)
    assert place_of(truth[-1]) == (0, 0)


@pytest.mark.parametrize("in_file", (False, True))
def test_snapshot_and_restore(start: Callable[..., Process], client: Client, tmp_path: Path,
                              in_file: bool) -> None:
    file = str(tmp_path / "state") if in_file else ""
    start("zoo.world", paused=True, steps=20, always_on=True, **({"snapshot_file": file} if file else {}))
    clock = client.listen(Clock, "/clock")
    answer = client.call("/stage/restore")
    assert not answer.success and ("No such file" if in_file else "found no snapshot") in answer.message
    client.step()
    assert client.call("/stage/snapshot").success
    later = client.step()
    answer = client.call("/stage/restore")
    assert answer.success and answer.message == "went back to 2 s"
    assert client.step() == later
    assert bool(in_file) == os.path.exists(file)
    client.until(lambda: seconds(clock[-1]) == 4)
    times = [seconds(message) for message in clock]
    assert sum(after < before for before, after in itertools.pairwise(times)) == 1


def test_a_snapshot_replaces_no_other_file(start: Callable[..., Process], client: Client, tmp_path: Path) -> None:
    file = tmp_path / "notes"
    file.write_text("precious")
    start("zoo.world", paused=True, always_on=True, snapshot_file=str(file))
    answer = client.call("/stage/snapshot")
    assert not answer.success and "found something else than a snapshot" in answer.message
    assert file.read_text() == "precious"


def test_a_killed_node_can_be_restarted(start: Callable[..., Process], client: Client, two: str) -> None:
    scans = client.listen(LaserScan, "/a/base_scan", SENSOR)
    talk = client.node.create_publisher(Twist, "/a/cmd_vel", 10)
    truth = client.listen(Odometry, "/a/ground_truth")
    for number in range(2):
        process = start(two, base_watchdog_timeout=0.0)
        scans.clear(), truth.clear()
        client.until(lambda: scans and truth and talk.get_subscription_count() > 0)
        talk.publish(command(0.1 * (number + 1)))
        client.until(lambda: truth[-1].twist.twist.linear.x == 0.1 * (number + 1))
        process.end(signal.SIGKILL)


def test_a_signal_ends_the_node_without_a_traceback(start: Callable[..., Process], client: Client) -> None:
    for sign in (signal.SIGINT, signal.SIGTERM):
        process = start("simple.world")
        client.until(lambda: client.node.count_publishers("/r0/odom"))
        client.spin(0.3)
        status, text = process.end(sign)
        assert status == 0 and "Traceback" not in text, text
        client.until(lambda: not client.node.count_publishers("/r0/odom"))


def test_duration_and_statistics(start: Callable[..., Process]) -> None:
    figures = start("simple.world", "--duration", "3", "--stats", speed=0).statistics()
    with st.World("simple.world") as world:
        world.step(30)
        assert (figures["simulated"], figures["state"]) == (3.0, world.state_hash())


@pytest.mark.parametrize("arguments, parameters, complaint", (
    ([], {"naming": "other"}, "parameter naming: found 'other', expected stage_ros2 or stage_ros"),
    ([], {"speed": -1}, "parameter speed: found -1, expected a number, 0 or more"),
    ([], {"speed": "fast"}, "parameter speed: found 'fast', expected a number, 0 or more"),
    ([], {"paused": 3}, "paused"),
    ([], {"lockstep": "r0"}, "found robots in lockstep, whose commands carry no time"),
    ([], {"gui": 8642}, "gui"),
    (["--threads", "0"], {}, "found 0 as threads, expected a whole number, 1 to 1024"),
    (["nothing.world"], {}, "nothing.world: unable to open world file"),
))
def test_errors_in_one_line(start: Callable[..., Process], arguments: list[str],
                            parameters: dict[str, Any], complaint: str) -> None:
    world = arguments if arguments and arguments[0].endswith(".world") else ["simple.world", *arguments]
    status, text = start(*world, **parameters).wait()
    assert status == 1 and "Traceback" not in text
    assert len(text.splitlines()) == 1 and complaint in text, text


def test_the_world_may_be_a_parameter(start: Callable[..., Process], client: Client, one: str) -> None:
    start("--stats", world_file=one)
    client.until(lambda: client.node.count_publishers("/odom"))


def test_keyboard(start: Callable[..., Process], client: Client, two: str) -> None:
    start(two)
    truth = client.listen(Odometry, "/b/ground_truth")
    client.until(lambda: truth)
    terminal, inner = os.openpty()
    process = subprocess.Popen([sys.executable, "-m", "stagesim.ros.keyboard", "b", "--speed", "0.3"],
                               stdin=inner, stdout=inner, stderr=inner)
    for key, speeds in (("i", (0.3, 0)), ("o", (0.3, -0.8)), ("x", (0, 0)), ("m", (-0.3, -0.8)), ("k", (0, 0))):
        client.until(lambda: client.node.count_publishers("/b/cmd_vel"))
        client.spin(0.2)
        os.write(terminal, key.encode())
        client.until(lambda: (truth[-1].twist.twist.linear.x, truth[-1].twist.twist.angular.z) == speeds)
    os.write(terminal, b"q")
    assert process.wait(PATIENCE) == 0
    os.close(terminal), os.close(inner)


def test_resets_do_not_leak(ros: None) -> None:
    """Makes STAGE_ROS_RESETS resets (1000 in the long form) and prints the memory in use."""
    resets = int(os.environ.get("STAGE_ROS_RESETS", "60"))
    with st.World("zoo.world") as world, node_here(world, always_on=True) as node:
        def some(count: int) -> None:
            for _ in range(count):
                node._reset()
                node.advance()

        some(max(20, resets // 10))
        before, publishers = memory(), len(list(node.publishers))
        some(resets)
        grown = memory() - before
        print(f"{resets} resets: {grown} bytes more")
        assert len(list(node.publishers)) == publishers
        assert grown < 2_000_000


def memory() -> int:
    """Resident memory of this process, bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_many_pauses_and_commands_do_not_slow_the_clock(start: Callable[..., Process], client: Client,
                                                        two: str) -> None:
    """At speed 1, simulated time keeps up with real time."""
    start(two)
    clock = client.listen(Clock, "/clock")
    talk = client.talk(Twist, "/a/cmd_vel")
    client.until(lambda: len(clock) > 3)
    for pauses in (False, True):
        begin, then = time.monotonic(), seconds(clock[-1])
        while time.monotonic() < begin + 3:
            for _ in range(200):
                talk.publish(command(0.1))
            if pauses:
                for on in (True, False):
                    client.call("/stage/pause", SetBool, data=on)
            client.spin(0.001)
        client.spin(0.2)
        passed, real = seconds(clock[-1]) - then, time.monotonic() - begin
        assert (0.05 if pauses else 0.6) / slowness() * real < passed < real + 0.3


@pytest.mark.parametrize("value", (0, -1, 1_000_001, 2**62, 1.5, True, "many"))
def test_invalid_numbers_of_steps_are_refused(start: Callable[..., Process], one: str, value: Any) -> None:
    status, text = start(one, steps=value).wait()
    found = {"many": "'many'", True: "True"}.get(value, str(value))
    assert status == 1 and f"parameter steps: found {found}, expected a whole number, 1 to 1000000" in text, text
