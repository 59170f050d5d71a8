# SPDX-License-Identifier: GPL-2.0-or-later
"""stagesim.live: the data that clients get from a running world, and the effects of their orders."""

from __future__ import annotations

import json
import os
import socket
import time
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
import stagesim as st

pytest.importorskip("websockets", reason="the package websockets is not installed: tools/setup --live")
from live_client import Client, do  # noqa: E402
from patience import PATIENCE  # noqa: E402
from stagesim.live import Server  # noqa: E402
from stagesim.live.floor import picture_of  # noqa: E402
from stagesim.live.scene import Shapes  # noqa: E402

WORLDS = st.shipped_worlds()


def fleet_pose(server: Server) -> np.ndarray:
    return do(server, lambda run: run.world.fleet().pose.copy())  # type: ignore[return-value]


# ---- frames ----

@pytest.mark.parametrize("file", WORLDS)
def test_every_shipped_world(file: str) -> None:
    """Places equal those of the fleet, and clients do not change the run."""
    other = st.World(file, seed=3)
    other.step(5)
    with Server(st.World(file, seed=3), paused=True) as server, Client(server) as client:
        client.send("step", count=5)
        client.until(lambda: client.frame["steps"] == 5)
        assert client.frame["time"] == other.time and client.frame["paused"]
        assert do(server, lambda run: run.world.state_hash()) == other.state_hash()
        robots = {thing["name"]: at for at, thing in enumerate(client.scene["things"]) if thing["robot"]}
        fleet = other.fleet()
        places = client.places[[robots[name] for name in fleet.names]]
        assert (places == fleet.pose.astype(np.float32)).all()
        assert (client.stalled[[robots[name] for name in fleet.names]] == fleet.stalled).all()
        shapes = do(server, lambda run: {thing.name: thing.shape for thing in run.world._core.things()})
        assert {thing["name"]: client.shapes[thing["shape"]] for thing in client.scene["things"]} == shapes


def test_scans_are_the_readings(server: Server) -> None:
    with Client(server) as client:
        client.until(lambda: True)
        assert client.scans == []  # the rangers have no subscribers
        for name in "ab":
            client.send("sense", thing=client.thing(name))
        client.send("step", count=3)
        client.until(lambda: client.frame["steps"] == 3)
        ranges = do(server, lambda run: run.world.fleet().ranger(0).ranges.copy())
        by_thing = {scan["thing"]: scan for scan in client.scans}
        assert set(by_thing) == {client.thing("a"), client.thing("b")}
        for row, name in enumerate("ab"):
            scan = by_thing[client.thing(name)]
            assert (scan["ranges"] == ranges[row].astype(np.float32)).all()
            assert scan["reach"] == 5 and scan["fov"] == np.float32(np.pi / 2)
            assert (scan["pose"] == client.place(name)).all()
            assert scan["bearings"] == pytest.approx(np.linspace(-np.pi / 4, np.pi / 4, 5))


def test_scans_of_a_crowd_only_when_asked_for() -> None:
    with Server(st.World("cave.world"), paused=True) as server, Client(server) as client:
        client.send("step", count=2)
        client.until(lambda: client.frame["steps"] == 2)
        assert client.scans == []
        robots = [thing["id"] for thing in client.scene["things"] if thing["robot"]][:2]
        client.send("watch", chosen=robots[0], scans=robots, all=True)
        client.until(lambda: client.scans)
        assert {scan["thing"] for scan in client.scans} == set(robots)
        assert client.frame["details"]["id"] == robots[0]


FLOOR = """resolution 0.05
field( name "trail" size [4 2 0] field_resolution 1 pose [10 0 0 90] color "green" )
light( name "lamp" pose [1 2 0 0] size [0.2 0.2 0.2] intensity 1 color "red" )
position( name "r" pose [0 -1 0 0] size [0.4 0.4 0.4] lightindicator( name "led" intensity 0.04 color "blue" ) )
"""


def test_a_changed_field_is_sent_and_no_other() -> None:
    with Server(st.World.from_text(FLOOR), paused=True) as server, Client(server) as client:
        client.until(lambda: client.fields)
        (number,) = client.fields
        header, shades = client.fields[number]
        assert client.frame["fields"] == [number] and not shades.any() and shades.shape == (2, 4)
        assert header["pose"] == pytest.approx([10, 0, np.pi / 2]) and header["size"] == [4, 2]
        assert header["patch"] == [1, 1] and header["rgb"] == [0, 255, 0]
        client.send("step", count=3)
        client.until(lambda: client.frame["steps"] == 3)
        assert client.fields_received == 1
        values = np.array([[0, 1, 2, 4], [0, 0, 0, 3]])
        do(server, lambda run: setattr(run.world.fields["trail"], "values", values))
        client.until(lambda: client.fields_received > 1)
        assert np.array_equal(client.fields[number][1], np.rint(values / 4 * 255))
        do(server, lambda run: run.world.model("trail").delete())
        client.until(lambda: client.frame["fields"] == [])
        assert client.fields_received == 2


def test_fields_of_many_cells_are_sent_as_means() -> None:
    world = st.World.from_text('field( name "f" size [16.5 0.2 0] field_resolution 0.05 )')
    values = np.zeros((4, 330))
    values[0, 327:] = 9
    values[3, 0] = 3
    world.fields["f"].values = values
    picture = picture_of(world.fields["f"])
    assert picture.shape == (2, 110) and picture.patch == pytest.approx((0.15, 0.15))
    shades = np.frombuffer(picture.shades, np.uint8).reshape(picture.shape)
    assert shades[0, 109] == 255 and shades[1, 0] == round(255 / 3) and np.count_nonzero(shades) == 2
    world.fields["f"].values = 7
    assert set(picture_of(world.fields["f"]).shades) == {255}


def test_lights_that_are_on_are_sent_as_glows() -> None:
    with Server(st.World.from_text(FLOOR), paused=True) as server, Client(server) as client:
        client.until(lambda: True)
        assert client.glows == [([1, 2, 0.5], [255, 0, 0, 255])]
        do(server, lambda run: setattr(run.world.model("r.led"), "on", True))
        client.until(lambda: client.frame["glows"] == 2)
        assert client.glows[1] == ([0, -1, pytest.approx(0.4)], [0, 0, 255, 255])
        do(server, lambda run: setattr(run.world.model("lamp"), "on", False))
        client.until(lambda: client.frame["glows"] == 1)
        do(server, lambda run: setattr(run.world.model("r"), "pose", (3, 0, 0)))
        client.until(lambda: client.glows[0][0][0] == 3)
        client.send("sense", thing=client.thing("r"))
        client.send("step", count=1)
        client.until(lambda: client.frame["steps"] == 1)
        assert client.scans == []


def test_details(server: Server) -> None:
    with Client(server) as client:
        client.until(lambda: True)
        client.send("watch", chosen=client.thing("b"), scans=[], all=False)
        client.until(lambda: client.frame["details"])
        facts = client.frame["details"]
        assert facts["name"] == "b" and facts["pose"] == pytest.approx([0, 2, np.pi / 2])
        assert (facts["sensors"], facts["sensing"], facts["velocity"]) == (1, 0, [0, 0, 0])


def test_scene_follows_what_is_made_and_deleted(server: Server) -> None:
    with Client(server) as client:
        client.until(lambda: True)
        assert [thing["name"] for thing in client.scene["things"]] == ["wall", "a", "b", "c"]
        do(server, lambda run: run.world.create(name="box", pose=(1, 1, 0), size=(1, 1, 3)))
        client.until(lambda: client.frame["things"] == 5)
        assert [thing["name"] for thing in client.scene["things"]] == ["wall", "box", "a", "b", "c"]
        do(server, lambda run: run.world.model("a").delete())
        client.until(lambda: client.frame["things"] == 4)
        assert "a" not in [thing["name"] for thing in client.scene["things"]]
        number, known = client.scene["scene"], len(client.shapes)
        do(server, lambda run: setattr(run.world.model("b"), "color", (0, 1, 0, 1)))
        client.until(lambda: client.scene["scene"] > number)
        assert (client.scene["first"], len(client.scene["lengths"])) == (known, 1)  # only the new shapes
        do(server, lambda run: setattr(run.world.model("b"), "color", (1, 0, 0, 1)))
        client.until(lambda: client.scene["scene"] > number + 1)
        assert client.scene["lengths"] == []


def test_shapes_that_are_not_used_are_dropped(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    """Shapes that no longer exist are dropped eventually."""
    monkeypatch.setattr(Shapes, "MOST", 10)
    with Client(server) as client:
        client.until(lambda: True)
        for i in range(30):
            number = client.scene["scene"]
            do(server, lambda run: setattr(run.world.model("b"), "color", (i / 255, 0, 0, 1)))  # noqa: B023
            client.until(lambda: client.scene["scene"] > number)  # noqa: B023
            assert client.shapes[client.scene["things"][2]["shape"]][:4] == bytes([i, 0, 0, 255])
            assert len(client.shapes) <= 12


def test_alike_robots_share_a_shape() -> None:
    with Server(st.World("cave.world"), paused=True) as server, Client(server) as client:
        client.until(lambda: True)
        assert (len(client.scene["things"]), len(client.scene["lengths"])) == (101, 2)


# ---- orders ----

def test_pause_step_and_go(server: Server) -> None:
    with Client(server) as client:
        client.until(lambda: client.frame["paused"])
        client.send("step", count=7)
        client.until(lambda: client.frame["steps"] == 7 and client.frame["paused"])
        client.send("pause", on=False)
        client.until(lambda: client.frame["steps"] > 9)
        client.send("pause", on=True)
        client.until(lambda: client.frame["paused"])
        steps = client.frame["steps"]
        time.sleep(0.3)
        assert do(server, lambda run: run.world.steps) == steps


@pytest.mark.parametrize("speed", [0.5, 4.0])
def test_pace(room: str, speed: float) -> None:
    """Simulated time passes at real time multiplied by the speed."""
    with Server(st.World.from_text(room), speed=speed) as server:
        end = time.monotonic() + PATIENCE
        while True:  # repeats until the machine is not too busy
            first, began = do(server, lambda run: run.world.time), time.monotonic()
            time.sleep(1.5)
            passed = do(server, lambda run: run.world.time) - first
            if passed == pytest.approx(speed * (time.monotonic() - began), abs=0.2 * speed + 0.1):
                break
            assert time.monotonic() < end, "the pace is never kept"


def test_speed_changes(server: Server) -> None:
    with Client(server) as client:
        client.send("pause", on=False)
        client.send("speed", factor=0)
        client.until(lambda: client.frame["rate"] > 100)
        assert client.frame["r_acc"] == pytest.approx(3 * client.frame["rate"])
        assert 0.2 < client.frame["busy"] <= 1.01
        client.send("speed", factor=2)
        client.until(lambda: client.frame["rate"] == pytest.approx(2, rel=0.2))


def test_drive_moves_the_right_robot_and_holds_for_a_while(server: Server) -> None:
    with Client(server) as client:
        client.until(lambda: True)
        before = fleet_pose(server)
        client.send("pause", on=False)

        def has_driven() -> bool:
            """Repeats the order until the robot has moved."""
            client.send("drive", thing=client.thing("b"), velocity=[0.5, 0, 0])
            return bool(client.place("b")[1] > 2.2)

        client.until(has_driven)
        deadline = time.monotonic() + PATIENCE
        while do(server, lambda run: run.world.model("b").velocity) != (0, 0, 0):  # waits until the order expires
            assert time.monotonic() < deadline
            time.sleep(0.02)
        first = fleet_pose(server)
        time.sleep(0.4)
        after = fleet_pose(server)
        assert (after == first).all()
        assert (after[[0, 2]] == before[[0, 2]]).all()
        assert after[1, 1] < 3 and after[1, 0] == pytest.approx(0, abs=1e-9)


def test_a_client_that_disconnects_stops_driving(server: Server) -> None:
    with Client(server) as client:
        client.until(lambda: True)
        client.send("pause", on=False)
        client.send("drive", thing=client.thing("b"), velocity=[0, 0, 1])
        client.until(lambda: client.place("b")[2] > 1.7)
    deadline = time.monotonic() + PATIENCE
    while do(server, lambda run: run.world.model("b").velocity) != (0, 0, 0):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_driving_overrides_a_controller_which_then_goes_on() -> None:
    with Server(st.World("simple.world"), speed=10) as server, Client(server) as client:
        client.until(lambda: True)
        robot = next(thing["id"] for thing in client.scene["things"] if thing["robot"])
        client.send("watch", chosen=robot, scans=[], all=False)
        client.send("drive", thing=robot, velocity=[-0.1, 0, 0])
        client.until(lambda: client.frame["details"] and client.frame["details"]["velocity"] == [-0.1, 0, 0])
        client.send("drive", thing=robot, velocity=[0, 0, 0])
        client.until(lambda: client.frame["details"]["velocity"][0] > 0.05)


def test_move(server: Server) -> None:
    with Client(server) as client:
        client.until(lambda: True)
        client.send("move", thing=client.thing("c"), pose=[1.5, -1.25, 0.5])
        client.until(lambda: (client.place("c") == np.array([1.5, -1.25, 0.5], np.float32)).all())
        assert client.frame["steps"] == 0
        assert fleet_pose(server)[2] == pytest.approx([1.5, -1.25, 0.5])


def test_reset_with_seed() -> None:
    with Server(st.World("cave.world", seed=5), paused=True) as server, Client(server) as client:
        client.send("step", count=10)
        client.until(lambda: client.frame["steps"] == 10)
        client.send("reset", seed=str(2**64 - 1))
        client.until(lambda: client.frame["steps"] == 0)
        assert client.frame["seed"] == str(2**64 - 1)
        client.send("reset", seed="5")
        client.send("step", count=20)
        client.until(lambda: client.frame["steps"] == 20)
        other = st.World("cave.world", seed=5)
        other.step(20)
        assert do(server, lambda run: run.world.state_hash()) == other.state_hash()


def test_quit_time_pauses_once(room: str) -> None:
    with Server(st.World.from_text("quit_time 1\n" + room), speed=0) as server, Client(server) as client:
        client.until(lambda: client.frame["paused"])
        assert client.frame["time"] == 1 and "quit time" in client.frame["note"]
        client.send("pause", on=False)
        client.until(lambda: client.frame["time"] > 2)


# ---- a controller in Python ----

def test_control(room: str) -> None:
    """control() is called before each step, including single steps; the page may override it."""
    world = st.World.from_text(room)
    fleet, times = world.fleet(), []

    def control(given: st.World) -> None:
        times.append(given.time)
        fleet.cmd[:] = (0.1, 0, 0)

    with Server(world, paused=True, control=control) as server, Client(server) as client:
        client.send("step", count=4)
        client.until(lambda: client.frame["steps"] == 4)
        assert times == pytest.approx([0, 0.1, 0.2, 0.3])
    other = st.World.from_text(room)
    driven = other.fleet()
    driven.cmd[:] = (0.1, 0, 0)
    other.step(4)
    assert world.state_hash() == other.state_hash()


def test_an_exception_of_control_pauses_the_run(room: str) -> None:
    """An exception of control() pauses the run with a reason; the run can go on."""
    calls = []

    def control(world: st.World) -> None:
        calls.append(world.steps)
        if len(calls) == 3:
            raise KeyError("what is missing")

    with Server(st.World.from_text(room), speed=0, control=control) as server, Client(server) as client:
        client.until(lambda: client.frame["paused"])
        assert client.frame["note"] == "KeyError: 'what is missing'" and client.frame["steps"] == 2
        client.send("pause", on=False)
        client.until(lambda: client.frame["steps"] > 5)


# ---- clients ----

def test_two_clients_see_each_others_actions(server: Server) -> None:
    with Client(server) as one, Client(server) as other:
        one.send("step", count=2)
        for client in (one, other):
            client.until(lambda: client.frame["steps"] == 2)  # noqa: B023
        assert one.words == other.words


def test_a_client_that_is_killed_does_not_stop_the_run(server: Server) -> None:
    client = Client(server)
    client.until(lambda: True)
    client.socket.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
    client.socket.socket.close()
    client.socket.close()
    with Client(server) as other:
        other.send("step", count=2)
        other.until(lambda: other.frame["steps"] == 2)


def test_a_client_that_does_not_read_misses_frames(room: str) -> None:
    """A slow client misses frames, and the run does not wait for it."""
    with Server(st.World("cave.world"), speed=0) as server, Client(server) as other:
        with socket.create_connection(("127.0.0.1", urlsplit(server.url).port)) as lazy:
            lazy.sendall(b"GET /live HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                         b"Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\nSec-WebSocket-Version: 13\r\n\r\n")
            other.until(lambda: other.frame["steps"] > 5)
            steps = other.frame["steps"]
            other.until(lambda: other.frame["steps"] > steps + 5)


GARBAGE = ["", "{", "[]", "7", "null", "[" * 4000, '{"do": 3}', '{"do": "fly"}', '{"do": "pause"}',
           '{"do": "pause", "on": 1}', '{"do": "speed", "factor": -1}', '{"do": "speed", "factor": NaN}',
           '{"do": "speed", "factor": 1e999}', '{"do": "step", "count": 0}', '{"do": "step", "count": 1.5}',
           '{"do": "step", "count": 1e12}', '{"do": "reset", "seed": "-1"}', '{"do": "reset", "seed": 1.5}',
           '{"do": "reset", "seed": "18446744073709551616"}', '{"do": "reset", "seed": []}',
           '{"do": "move", "thing": 1}', '{"do": "move", "thing": 1, "pose": [1, 2]}',
           '{"do": "move", "thing": 2, "pose": [1, NaN, 0]}', '{"do": "move", "thing": 2, "pose": [1, null, 0]}',
           '{"do": "move", "thing": 99999, "pose": [1, 2, 0]}', '{"do": "move", "thing": -1, "pose": [1, 2, 0]}',
           '{"do": "drive", "thing": 1, "velocity": [1, 0, 0]}', '{"do": "drive", "thing": "a", "velocity": [1, 0, 0]}',
           '{"do": "drive", "thing": 2, "velocity": [1, 0, Infinity]}', '{"do": "sense", "thing": 77}',
           '{"do": "watch", "scans": 3, "all": true}', '{"do": "watch", "scans": [1], "all": 3}',
           json.dumps({"do": "watch", "scans": list(range(300)), "all": True}), b"\0\1\2", b"{}", b""]


def test_each_invalid_order_is_answered_with_an_error(server: Server) -> None:
    """Each invalid order gets an error in one line and changes nothing."""
    with Client(server) as client:
        client.until(lambda: True)
        before = do(server, lambda run: run.world.state_hash())
        for message in GARBAGE:
            client.socket.send(message)
            text = client.until_error()
            assert text and "\n" not in text, message
        assert do(server, lambda run: run.world.state_hash()) == before
        client.send("step", count=1)
        client.until(lambda: client.frame["steps"] == 1)


def test_a_message_that_is_too_long_ends_only_its_connection(server: Server) -> None:
    with Client(server) as client, Client(server) as other:
        client.until(lambda: True)
        client.socket.send("x" * 20_000)
        with pytest.raises(Exception, match="1009"):
            client.until(lambda: False)
        other.send("step", count=1)
        other.until(lambda: other.frame["steps"] == 1)


def test_random_bytes_do_not_disturb_other_clients(server: Server) -> None:
    address = ("127.0.0.1", urlsplit(server.url).port)
    random = np.random.default_rng(1)
    for length in (0, 1, 100, 30_000):
        with socket.create_connection(address) as raw:
            raw.sendall(random.bytes(length))
    with Client(server) as client:
        client.until(lambda: True)


def test_names_that_are_not_utf_8_are_made_printable(tmp_path: Path) -> None:
    """World files and file names may contain such names, but JSON and Foxglove only support Unicode."""
    import foxglove  # noqa: F401

    file = os.fsencode(tmp_path) + b"/w\xff.world"
    with open(file, "wb") as out:
        out.write(b'position( name "r\xff\xc3" pose [1 2 0 0] ) position( name "\xc3\xa9" ) model( name "w\x80" gui_move 0 )')
    with Server(st.World(os.fsdecode(file)), paused=True, foxglove=0) as server, Client(server) as client:
        client.until(lambda: client.scene)
        assert {thing["name"] for thing in client.scene["things"]} == {"r\\xff\\xc3", "\u00e9", "w\\x80"}
        assert client.scene["world"] == "w\\xff.world"
        robot, wall = client.thing("r\\xff\\xc3"), client.thing("w\\x80")
        client.send("watch", chosen=robot, scans=[], all=True)
        client.until(lambda: client.frame["details"] and client.frame["details"]["name"] == "r\\xff\\xc3")
        client.send("drive", thing=wall, velocity=[1, 0, 0])
        assert client.until_error() == r"'w\\x80' can't drive"
