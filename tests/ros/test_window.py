# SPDX-License-Identifier: GPL-2.0-or-later
"""The page as the node's window: its contents, and equal effects of the page's orders and of ROS."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Callable, Iterator

import numpy as np
import pytest
import stagesim as st

pytest.importorskip("websockets", reason="the package websockets is not installed: tools/setup --live")
sys.path.append(str(Path(__file__).resolve().parents[1] / "python"))
from geometry_msgs.msg import PoseStamped, Twist  # noqa: E402
from live_client import Client as Page  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from patience import PATIENCE, slowness  # noqa: E402
from rcl_interfaces.srv import GetParameters  # noqa: E402
from ros_testing import Client, Process  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from std_msgs.msg import Header  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402


Meet = Callable[..., tuple[Process, Page, Client]]


@pytest.fixture
def meet(ros: None, start: Callable[..., Process]) -> Iterator[Meet]:
    """A function that starts a node with a page, and connects to the page and to ROS."""
    pages: list[Page] = []
    clients: list[Client] = []

    def begin(world: str, *options: str, **parameters: Any) -> tuple[Process, Page, Client]:
        process = start(world, *options, **parameters)
        pages.append(Page(process))  # type: ignore[arg-type]
        clients.append(Client())  # after the node, because discovery takes seconds otherwise
        return process, pages[-1], clients[-1]

    yield begin
    for page in pages:
        page.socket.close()
    for client in clients:
        client.close()


def microseconds(stamp: Any) -> int:
    return int(stamp.sec * 1_000_000 + stamp.nanosec // 1000)


def place_of(odometry: Odometry) -> list[float]:
    pose = odometry.pose.pose
    return [pose.position.x, pose.position.y, 2 * np.arctan2(pose.orientation.z, pose.orientation.w)]


def test_page_shows_commands_of_ros(meet: Meet, two: str) -> None:
    _, page, client = meet(two, "--gui", base_watchdog_timeout=0.0, speed=2)
    truth = {name: client.listen(Odometry, f"/{name}/ground_truth") for name in "ab"}
    for name, turn in (("a", 0.7), ("b", -0.4)):
        twist = Twist()
        twist.linear.x, twist.angular.z = 0.3, turn
        client.talk(Twist, f"/{name}/cmd_vel").publish(twist)
    client.until(lambda: all(got and got[-1].twist.twist.linear.x for got in truth.values()))
    page.until(lambda: page.place("a")[0] > 0)  # an older frame may arrive first
    shown: dict[int, dict[str, Any]] = {}
    common: set[int] = set()

    def compare() -> bool:
        shown[round(page.frame["time"] * 1e6)] = {name: page.place(name).copy() for name in "ab"}
        client.spin()
        for name, got in truth.items():
            # The page shows the end of a step; messages belong to its beginning.
            told = {microseconds(message.header.stamp) - 100_000: place_of(message) for message in got}
            common.update(shown.keys() & told.keys())
            for moment in shown.keys() & told.keys():
                assert shown[moment][name] == pytest.approx(told[moment], abs=1e-6), (name, moment)
        return len(common) >= 8

    page.until(compare)
    places = [shown[moment]["a"][0] for moment in sorted(common)]
    assert len(set(places)) == len(places)


def test_page_and_ros_see_each_others_pauses_and_speeds(meet: Meet, two: str) -> None:
    _, page, client = meet(two, gui=True)
    clock = client.listen(Clock, "/clock")
    client.until(lambda: len(clock) > 2)
    page.until(lambda: not page.frame["paused"])
    page.send("pause", on=True)
    page.until(lambda: page.frame["paused"])
    client.spin(0.2)
    stood = microseconds(clock[-1].clock)
    client.spin(0.3)
    assert microseconds(clock[-1].clock) == stood
    page.send("step", count=7)
    page.until(lambda: page.frame["paused"] and round(page.frame["time"] * 1e6) == stood + 700_000)
    client.until(lambda: microseconds(clock[-1].clock) == stood + 700_000)
    assert client.step()[0] == pytest.approx(stood / 1e6 + 0.8)
    page.until(lambda: page.frame["steps"] == round(stood / 1e5) + 8)
    assert client.call("/stage/pause", SetBool, data=False).message == "running"
    page.until(lambda: not page.frame["paused"])
    assert client.call("/stage/pause", SetBool, data=True).message == "paused"
    page.until(lambda: page.frame["paused"])
    page.send("speed", factor=20)
    page.until(lambda: page.frame["speed"] == 20)
    assert client.call("/stage/get_parameters", GetParameters, names=["speed"]).values[0].double_value == 20
    page.send("pause", on=False)
    page.until(lambda: page.frame["rate"] > 5 and page.frame["busy"] > 0)
    client.set(speed=float("inf"))
    page.until(lambda: page.frame["speed"] == 0 and page.frame["rate"] > 30)  # 0 replaces infinity, which JSON lacks
    page.send("speed", factor=-1)
    assert "expected 0 or 0.001 to 1000000" in page.until_error()


def test_a_reset_by_the_page_resets_ros(meet: Meet) -> None:
    _, page, client = meet("simple.world", "--gui", "--seed", "3", speed=5.0)
    clock = client.listen(Clock, "/clock")
    client.until(lambda: clock)
    page.until(lambda: page.frame["steps"] > 5)
    for seed, number in (("9", 9), (None, 9), ("3", 3)):
        page.send("pause", on=True)
        page.send("drive", thing=page.thing("r0"), velocity=[0.1, 0, 0])  # the reset ends this
        page.send("reset", seed=seed)
        page.until(lambda: page.frame["steps"] == 0 and page.frame["paused"])
        assert page.frame["seed"] == str(number)
        client.until(lambda: clock and microseconds(clock[-1].clock) == 0)
        page.send("step", count=39)
        page.until(lambda: page.frame["steps"] == 39 and page.frame["paused"])
        with st.World("simple.world", seed=number) as world:
            world.step(40)
            assert client.step() == (4.0, world.state_hash())
        page.send("pause", on=False)


def test_drag_and_drive(meet: Meet, two: str, tmp_path: Path) -> None:
    world = tmp_path / "gps.world"
    world.write_text(Path(two).read_text().replace('localization "odom"', 'localization "gps"'))
    _, page, client = meet(str(world), "--gui", paused=True, base_watchdog_timeout=0.0, speed=4)
    truth, odometry = (client.listen(Odometry, f"/b/{name}") for name in ("ground_truth", "odom"))
    client.until(lambda: truth and odometry)
    page.until(lambda: True)
    page.send("move", thing=page.thing("b"), pose=[1.5, -2.5, 0.5])
    client.until(lambda: place_of(truth[-1]) == pytest.approx([1.5, -2.5, 0.5]))  # while paused
    client.step()
    client.until(lambda: place_of(odometry[-1]) == pytest.approx([1.5, -2.5, 0.5]))

    def speed(x: float) -> None:
        client.until(lambda: truth[-1].twist.twist.linear.x == x)

    twist = Twist()
    twist.linear.x = 0.25
    client.talk(Twist, "/b/cmd_vel").publish(twist)
    page.send("pause", on=False)
    speed(0.25)
    page.send("drive", thing=page.thing("b"), velocity=[-0.5, 0, 0])  # overrides commands of ROS
    speed(-0.5)
    page.send("drive", thing=page.thing("b"), velocity=[0, 0, 0])
    speed(0.25)
    page.send("drive", thing=page.thing("b"), velocity=[-0.5, 0, 0])
    speed(-0.5)  # the order of the page expires
    speed(0.25)
    message = PoseStamped()
    message.pose.position.y = 1.0
    client.call("/stage/pause", SetBool, data=True)
    page.until(lambda: page.frame["paused"])
    teleport = client.talk(PoseStamped, "/b/teleport")
    client.spin(0.2)  # waits until the pause has been shown
    teleport.publish(message)
    page.until(lambda: (page.place("b") == np.array([0, 1, 0], np.float32)).all())


def test_lockstep_waits_while_the_page_answers(meet: Meet, two: str) -> None:
    _, page, client = meet(two, "--gui", lockstep="logger", speed=0)
    clock = client.listen(Clock, "/clock")
    done = client.talk(Header, "/stage/done")
    page.until(lambda: page.frame["note"] == "waiting for logger")
    page.send("move", thing=page.thing("b"), pose=[1, -2, 0])
    page.until(lambda: (page.place("b") == np.array([1, -2, 0], np.float32)).all())
    assert page.frame["steps"] == 1
    page.send("step", count=3)
    page.until(lambda: page.frame["paused"] and page.frame["steps"] == 4)
    page.send("pause", on=False)
    page.until(lambda: not page.frame["paused"] and page.frame["note"] == "waiting for logger")
    assert page.frame["steps"] == 4
    client.until(lambda: clock and clock[-1].clock.nanosec == 400_000_000)
    done.publish(Header(frame_id="logger", stamp=clock[-1].clock))
    page.until(lambda: page.frame["steps"] == 5)


def test_a_signal_ends_the_node_with_a_browser_connected(meet: Meet, tmp_path: Path) -> None:
    """With a display, the node opens the page; here a script replaces the browser and prints its arguments."""
    opened = tmp_path / "opened"
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" > {opened}\n')
    browser.chmod(0o755)
    process, page, _ = meet("simple.world", "--gui", environment={"DISPLAY": ":77", "BROWSER": str(browser)})
    page.until(lambda: page.frame["steps"] > 0)
    assert opened.read_text() == f"{process.url}\n"
    page.send("drive", thing=page.thing("r0"), velocity=[0.1, 0, 0])
    page.until(lambda: True)
    began = time.monotonic()
    status, text = process.end(signal.SIGINT)
    assert status == 0 and "Traceback" not in text and "rror" not in text
    assert time.monotonic() - began < 3 * slowness()


CODE = """
import sys
from stagesim.ros.main import run
assert run(["node", "simple.world", "--duration", "0.2", "--ros-args", "-p", "speed:=0"]) == 0
print([name for name in sys.modules if name.startswith(("websockets", "stagesim.live"))])
sys.modules["websockets"] = None
print(run(["node", "--gui", "simple.world"]))
del sys.modules["websockets"]
print(run(["node", "--gui=PORT", "simple.world"]))
"""


def test_errors_in_one_line_and_nothing_imported_without_need() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        done = subprocess.run([sys.executable, "-c", CODE.replace("PORT", port)], capture_output=True, text=True,
                              check=False, timeout=PATIENCE)
    imported, missing, refused = done.stdout.splitlines()
    assert imported == "[]"
    assert missing.startswith("stagesim.ros: there is no package 'websockets")
    assert refused.startswith(f"stagesim.ros: can't serve at 127.0.0.1:{port}: ")
