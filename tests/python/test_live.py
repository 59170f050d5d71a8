# SPDX-License-Identifier: GPL-2.0-or-later
"""stagesim.live: what a program that looks at a running world gets, and what its orders do."""

from __future__ import annotations

import http.client
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
import stagesim as st

pytest.importorskip("websockets", reason="the package websockets is not installed: tools/setup --live")
from stagesim.live import Run, Server  # noqa: E402
from stagesim.live.__main__ import arguments  # noqa: E402
from stagesim.live.messages import order_of  # noqa: E402
from stagesim.live.scene import Shapes  # noqa: E402
from websockets.exceptions import InvalidStatus  # noqa: E402
from live_client import Client  # noqa: E402

WORLDS = st.shipped_worlds()


@pytest.fixture
def server(room: str) -> Iterator[Server]:
    """Three robots without controllers, paused."""
    with Server(st.World.from_text(room), paused=True) as made:
        yield made


def do(server: Server, what: object) -> object:
    return server.run.order(what).result(20)  # type: ignore[arg-type]


def fleet_pose(server: Server) -> np.ndarray:
    return do(server, lambda run: run.world.fleet().pose.copy())  # type: ignore[return-value]


# ---- frames ----

@pytest.mark.parametrize("file", WORLDS)
def test_every_shipped_world(file: str) -> None:
    """Places are those of the fleet, and it is the run that there would be without anybody looking."""
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
        assert client.scans == []  # nobody has asked the rangers for anything
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


def test_details(server: Server) -> None:
    with Client(server) as client:
        client.until(lambda: True)
        client.send("watch", chosen=client.thing("b"), scans=[], all=False)
        client.until(lambda: client.frame["details"])
        facts = client.frame["details"]
        assert facts["name"] == "b" and facts["pose"] == pytest.approx([0, 2, np.pi / 2])
        assert (facts["rangers"], facts["sensing"], facts["velocity"]) == (1, 0, [0, 0, 0])


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
        assert (client.scene["first"], len(client.scene["lengths"])) == (known, 1)  # only what is new
        do(server, lambda run: setattr(run.world.model("b"), "color", (1, 0, 0, 1)))
        client.until(lambda: client.scene["scene"] > number + 1)
        assert client.scene["lengths"] == []


def test_shapes_without_end(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that are not there any more are forgotten some time."""
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
    """Simulated time keeps to real time, times the speed."""
    with Server(st.World.from_text(room), speed=speed) as server:
        first, began = do(server, lambda run: run.world.time), time.monotonic()
        time.sleep(1.5)
        passed = do(server, lambda run: run.world.time) - first
        assert passed == pytest.approx(speed * (time.monotonic() - began), abs=0.2 * speed + 0.1)


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
        client.send("drive", thing=client.thing("b"), velocity=[0.5, 0, 0])
        client.until(lambda: client.place("b")[1] > 2.2)
        time.sleep(0.8)  # nobody repeats the order
        first = fleet_pose(server)
        time.sleep(0.4)
        after = fleet_pose(server)
        assert (after == first).all()
        assert (after[[0, 2]] == before[[0, 2]]).all()
        assert after[1, 1] < 3 and after[1, 0] == pytest.approx(0, abs=1e-9)


def test_who_goes_lets_go(server: Server) -> None:
    with Client(server) as client:
        client.until(lambda: True)
        client.send("pause", on=False)
        client.send("drive", thing=client.thing("b"), velocity=[0, 0, 1])
        client.until(lambda: client.place("b")[2] > 1.7)
    deadline = time.monotonic() + 5
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


# ---- clients ----

def test_two_clients(server: Server) -> None:
    with Client(server) as one, Client(server) as other:
        one.send("step", count=2)
        for client in (one, other):
            client.until(lambda: client.frame["steps"] == 2)  # noqa: B023
        assert one.words == other.words


def test_a_client_that_is_killed(server: Server) -> None:
    client = Client(server)
    client.until(lambda: True)
    client.socket.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
    client.socket.socket.close()
    client.socket.close()
    with Client(server) as other:
        other.send("step", count=2)
        other.until(lambda: other.frame["steps"] == 2)


def test_a_client_that_does_not_read(room: str) -> None:
    """Frames are left out for it; nobody waits."""
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


def test_garbage_is_answered(server: Server) -> None:
    """Each with one line, and nothing changes."""
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


def test_long_messages_end_the_connection_alone(server: Server) -> None:
    with Client(server) as client, Client(server) as other:
        client.until(lambda: True)
        client.socket.send("x" * 20_000)
        with pytest.raises(Exception, match="1009"):
            client.until(lambda: False)
        other.send("step", count=1)
        other.until(lambda: other.frame["steps"] == 1)


def test_raw_bytes_harm_nobody(server: Server) -> None:
    address = ("127.0.0.1", urlsplit(server.url).port)
    random = np.random.default_rng(1)
    for length in (0, 1, 100, 30_000):
        with socket.create_connection(address) as raw:
            raw.sendall(random.bytes(length))
    with Client(server) as client:
        client.until(lambda: True)


# ---- who may come ----

def get(server: Server, path: str, **headers: str) -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection("127.0.0.1", urlsplit(server.url).port, timeout=20)
    connection.putrequest("GET", path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    return connection.getresponse()


def test_page(server: Server) -> None:
    """All of it comes from here."""
    answer = get(server, "/")
    text = answer.read().decode()
    assert answer.status == 200 and answer.getheader("Content-Type") == "text/html; charset=utf-8"
    assert "default-src 'self'" in str(answer.getheader("Content-Security-Policy"))
    assert "http://" not in text and "https://" not in text
    names = {file.name for file in (Path(st.__file__).parent / "live" / "page").iterdir()}
    assert {"index.html", "style.css", "main.js"} <= names
    for name in names:
        assert get(server, f"/{name}").status == 200


@pytest.mark.parametrize("path", ["/nothing", "/../scene.py", "/..%2fscene.py", "//etc/passwd", "/page/../web.py",
                                  "/%2e%2e/web.py", "/index.html/", "/./index.html", "/\\..\\web.py"])
def test_nothing_else_is_served(server: Server, path: str) -> None:
    assert get(server, path).status == 404


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "localhost.evil.example", "", "[::1", "127.0.0.1.nip.io"])
def test_foreign_names_are_refused(server: Server, host: str) -> None:
    """Those are what DNS rebinding would bring."""
    assert get(server, "/", Host=host).status == 403
    assert get(server, "/live", Host=host).status == 403


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost:1234", "[::1]:80", "LOCALHOST"])
def test_own_names_are_not(server: Server, host: str) -> None:
    assert get(server, "/", Host=host).status == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", "http://localhost", "file://"])
def test_foreign_origins_are_refused(server: Server, origin: str) -> None:
    with pytest.raises(InvalidStatus, match="403"):
        Client(server, origin=origin)


def test_own_origin_is_not(server: Server) -> None:
    with Client(server, origin=server.url.rstrip("/")) as client:
        client.until(lambda: True)


def test_others_need_the_token(room: str) -> None:
    """Where other machines can come."""
    with Server(st.World.from_text(room), host="0.0.0.0", paused=True) as server:  # noqa: S104
        assert f"//{socket.gethostname()}:" in server.url and "?token=" in server.url
        server.url = server.url.replace(socket.gethostname(), "127.0.0.1")
        with Client(server) as client:
            client.until(lambda: True)
        for query in ("", "?token=", "?token=guessed", "?token=%ff"):
            assert get(server, f"/live{query}").status == 403
        assert get(server, "/").status == 200


def test_loopback_only(server: Server) -> None:
    assert server.url.startswith("http://127.0.0.1:") and "token" not in server.url


# ---- beginning and end ----

def test_port_in_use(server: Server, room: str) -> None:
    with pytest.raises(st.StageError, match="can't serve at 127.0.0.1"):
        Server(st.World.from_text(room), port=urlsplit(server.url).port).start()


def test_the_world_is_free_again(room: str) -> None:
    world = st.World.from_text(room)
    for _ in range(3):
        with Server(world, speed=0):
            time.sleep(0.05)
        steps = world.steps
        assert world.step(2) == 2 and world.steps == steps + 2


def test_a_world_that_is_closed(server: Server) -> None:
    with Client(server) as client:
        client.until(lambda: True)
        do(server, lambda run: run.world.close())
        client.send("step", count=1)
        assert client.until_error()
    assert get(server, "/").status == 200


def test_orders_after_the_end(room: str) -> None:
    run = Run(st.World.from_text(room))
    run.start()
    run.stop()
    with pytest.raises(st.GoneError):
        run.order(lambda run: None).result(5)


def test_orders_are_what_the_docstring_says() -> None:
    for order in ('{"do": "pause", "on": true}', '{"do": "speed", "factor": 2}', '{"do": "step", "count": 1}',
                  '{"do": "reset", "seed": null}', '{"do": "move", "thing": 1, "pose": [1, 2, 3]}',
                  '{"do": "drive", "thing": 1, "velocity": [1, 2, 3]}', '{"do": "sense", "thing": 1}',
                  '{"do": "watch", "chosen": null, "scans": [], "all": true}'):
        assert callable(order_of(order, None))
        name = json.loads(order)["do"]
        assert f'"{name}"' in str(order_of.__doc__)


def test_page_of_the_documentation(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """docs/live.md does what it says, and names all options."""
    page = root / "docs" / "live.md"
    if not page.exists():
        pytest.skip("there is no docs/live.md")
    for code in re.findall(r"```python\n(.*?)```", page.read_text(), re.S):
        exec(compile(code, str(page), "exec"), {})  # noqa: S102
    printed = capsys.readouterr().out
    assert printed.startswith("http://127.0.0.1:") and printed.count("\n") == 2
    for option in arguments()._option_string_actions:
        assert option in ("-h", "--help", "--opencl-always") or f"`{option}" in page.read_text(), option


def command(*words: str) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, "-m", "stagesim.live", *words], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True, env=dict(os.environ, DISPLAY="", WAYLAND_DISPLAY=""))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_command(number: int) -> None:
    """One line with the address; a signal ends it at once."""
    process = command("cave.world", "--port", "0", "--seed", "7")
    assert process.stdout is not None
    line = process.stdout.readline()
    port = urlsplit(line.strip()).port
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.request("GET", "/")
    assert connection.getresponse().status == 200
    began = time.monotonic()
    process.send_signal(number)
    rest, errors = process.communicate(timeout=20)
    assert (process.returncode, rest, errors) == (0, "", "")
    assert time.monotonic() - began < 3


@pytest.mark.parametrize(("words", "status", "text"), [
    (["nothing.world"], 1, "stage: nothing.world: "),
    (["cave.world", "--port", "70000"], 2, "found '70000', expected a port"),
    (["cave.world", "--speed", "-1"], 1, "stage: found the speed -1.0"),
    (["cave.world", "--threads", "0"], 1, "stage: found 0 threads"),
    (["cave.world", "--host", "203.0.113.7"], 1, "stage: can't serve at 203.0.113.7"),
    ([], 2, "WORLD")])
def test_command_that_fails(words: list[str], status: int, text: str) -> None:
    process = command(*words)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == status and text in errors and "Traceback" not in errors


# ---- the program ----

PROGRAM = Path(st.__file__).parent / "bin" / "stage"


def stage(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(PROGRAM), *words], capture_output=True, text=True, check=False, timeout=60,
                          env={**os.environ, "DISPLAY": "", "WAYLAND_DISPLAY": "", **environment})


def test_program(tmp_path: Path) -> None:
    """`stage --live` is the module, with its options; what lies in the working folder is not imported."""
    (tmp_path / "stagesim.py").write_text("raise SystemExit('a file of the working folder was imported')")
    (tmp_path / "w.world").write_text('position( name "r" )')
    process = subprocess.Popen(
        [str(PROGRAM), "--live=0", "w.world", "--seed", "7", "--no-controllers", "--ray-model", "exact"], cwd=tmp_path,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "DISPLAY": "", "WAYLAND_DISPLAY": "", "STAGE_PYTHON": sys.executable})
    assert process.stdout is not None
    address = process.stdout.readline().strip()
    assert address.startswith("http://127.0.0.1:")

    class Served:
        url = address

    with Client(Served()) as client:  # type: ignore[arg-type]
        client.until(lambda: client.frame["time"] > 0.2)
        assert (client.frame["seed"], client.frame["speed"], client.scene["world"]) == ("7", 1, "w.world")
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=20) == ("", "") and process.returncode == 0


@pytest.mark.parametrize(("words", "status", "text"), [
    (["--live"], 2, "found no world file"),
    (["--live", "a.world", "b.world"], 2, "--live: found 2 world files, expected one"),
    (["--live=x", "a.world"], 2, "--live: found 'x', expected nothing, or a port"),
    (["--foxglove=65536", "a.world"], 2, "--foxglove: found '65536'"),
    (["--live", "--stats", "s.json", "a.world"], 2, "--stats does not go with --live"),
    (["--live", "--screenshot", "s.png", "a.world"], 2, "--screenshot does not go with --live"),
    (["--live=0", "nothing.world"], 1, "stage: nothing.world: ")])
def test_program_that_fails(words: list[str], status: int, text: str, tmp_path: Path,
                            monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = stage(*words, STAGE_PYTHON=sys.executable)
    assert done.returncode == status and text in done.stderr and done.stderr.count("\n") == 1, done


def test_program_without_python(tmp_path: Path) -> None:
    """One line says what is missing: the interpreter, or the package."""
    (tmp_path / "w.world").touch()
    done = stage("--live", str(tmp_path / "w.world"), STAGE_PYTHON="/nowhere/python3")
    assert (done.returncode, done.stderr.count("\n")) == (1, 1) and "'/nowhere/python3' (STAGE_PYTHON)" in done.stderr
    (tmp_path / "bin").mkdir()
    alone = shutil.copy(os.path.realpath(PROGRAM), tmp_path / "bin" / "stage")
    libraries = os.path.dirname(os.path.realpath(PROGRAM.parent.parent / "lib" / f"libstage.so.{st.__version__}"))
    done = subprocess.run([alone, "--live", str(tmp_path / "w.world")], capture_output=True, text=True, check=False,
                          env={"PATH": os.environ["PATH"], "LD_LIBRARY_PATH": libraries,
                               "STAGE_PYTHON": sys.executable, "PYTHONNOUSERSITE": "1"})
    if done.returncode == 1:  # it is not installed for this interpreter
        assert done.stderr.startswith("stage: can't load the Python package stagesim: ")
        assert done.stderr.count("\n") == 1
