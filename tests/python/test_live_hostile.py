# SPDX-License-Identifier: GPL-2.0-or-later
"""stagesim.live: each invalid request gets one clean answer, and clients that flood the server don't stop the
clock."""

from __future__ import annotations

import itertools
import json
import re
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import urlsplit

import pytest
import stagesim as st

pytest.importorskip("websockets", reason="the package websockets is not installed: tools/setup --live")
from live_client import Client, do  # noqa: E402
from patience import PATIENCE  # noqa: E402
from stagesim.live import Server  # noqa: E402
from stagesim.pace import Pace  # noqa: E402
from websockets.exceptions import ConnectionClosed  # noqa: E402


@pytest.fixture
def server(room: str) -> Iterator[Server]:
    with Server(st.World.from_text(room), paused=True) as made:
        yield made


# ---- requests ----

def answer_to(server: Server, request: bytes) -> bytes:
    """The server's whole response until it closes the connection."""
    with socket.create_connection(("127.0.0.1", urlsplit(server.url).port), timeout=PATIENCE) as connection:
        connection.sendall(request)
        answer = b""
        while part := connection.recv(65536):
            answer += part
        return answer


HOST = b"Host: 127.0.0.1\r\n"
DIGITS = b"9" * 400
TARGETS = {
    b"/": 200, b"/?a=" + DIGITS: 200, b"/#part": 200, b"http://127.0.0.1/": 200, b"http://localhost": 200,
    b"HTTP://LOCALHOST:1/main.js?x": 200, b"https://[::1]/style.css": 200, b"http://127.0.0.1?x": 200,
    b"http://evil.example/": 403, b"http://127.0.0.1@evil.example/": 403, b"http://[": 400, b"http://[::1": 400,
    b"http://": 400, b"http:///": 400, b"http://127.0.0.1:" + DIGITS + b"/": 400, b"ftp://127.0.0.1/": 400,
    b"file:///etc/passwd": 400, b"javascript:alert(1)": 400, b"*": 400, b"page": 400, b"//[": 404, b"//": 404,
    b"/%zz": 404, b"/" + DIGITS: 404, b"/..": 404, b"/" + b"a" * 9000: 414, b"/\xc3\xa9": 400, b"/\0": 400,
    b"/a b": 400,
    b"/live": 426, b"/live?token=" + DIGITS: 426, b"/live?" + b"&".join([b"a=1"] * 100): 426,
}
METHODS = {b"GET": None, b"HEAD": None, b"POST": 405, b"PUT": 405, b"DELETE": 405, b"OPTIONS": 405, b"CONNECT": 405,
           b"TRACE": 405, b"get": 405, b"9" * 400: 405, b"G\xcbT": 400, b"": 400}
VERSIONS = {b"HTTP/1.1": None, b"HTTP/1.0": None, b"HTTP/2.0": 505, b"HTTP/9.9": 505, b"HTTP/" + DIGITS: 400, b"": 400,
            b"http/1.1": 400, b"HTTP/1.1 x": 400}
FIELDS = {
    b"": None, b"X: \xff\xfe\r\n": None, b"X:\r\n": None, b"Content-Length: 0\r\n": None,
    b"X: " + DIGITS + b"\r\n": None,
    b"Content-Length: " + DIGITS + b"\r\n": 400, b"Content-Length: 5\r\n": 400, b"Content-Length: x\r\n": 400,
    b"Content-Length: -1\r\n": 400, b"Transfer-Encoding: chunked\r\n": 400, b"no field\r\n": 400, b": x\r\n": 400,
    b" folded: x\r\n": 400, b"X: \0\r\n": 400, b"X: " + b"a" * 9000 + b"\r\n": 431, b"X: a\r\n" * 120: 431,
    b"X: " + b"a" * 60000 + b"\r\n": 431, b"Host: 127.0.0.1\r\n": 403, b"Origin: http://evil.example\r\n": 403,
    b"Origin: \xff\r\n": 403,
}
NO_REQUESTS = {
    b"\x16\x03\x01\x00\xc8\x01\x00\x00\xc4\x03\x03" + bytes(range(256)): 400, b"\xff\xfe\xfd": 400, b"\0": 400,
    b"SSH-2.0-OpenSSH_9.2\r\n": 400, b"{}\n": 400, b"GET / HTTP/1.1\n" + HOST + b"\n": 400, b"GET\r\n\r\n": 400,
    b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n": 505, b"a" * 20000: 414, b"GET / HTTP/1.1\r\nHost: \xff\r\n\r\n": 403,
    b"GET / HTTP/1.1\r\n\r\n": 403, b"GET / HTTP/1.1\r\n" + HOST + HOST + b"\r\n": 403,
    b"GET / HTTP/1.1\r\n" + HOST + b"Content-Length: 5\r\n\r\nhello": 400,
    b"\r\n\r\nGET / HTTP/1.1\r\n" + HOST + b"\r\n": 200,
    b"POST / HTTP/1.1\r\n" + HOST + b"Content-Length: 5000000\r\n\r\n" + b"x" * 300_000: 405,
}


def requests() -> Iterator[tuple[bytes, int]]:
    """Yields requests with one or two unusual parts, and the expected status of each."""
    for (target, good), (method, bad) in itertools.product(TARGETS.items(), METHODS.items()):
        refused = 414 if good == 414 else bad or good
        refused = 400 if target in (b"/\xc3\xa9", b"/\0", b"/a b") or bad == 400 and good != 414 else refused
        yield method + b" " + target + b" HTTP/1.1\r\n" + HOST + b"\r\n", refused
    for (version, bad), (fields, wrong) in itertools.product(VERSIONS.items(), FIELDS.items()):
        yield b"GET / " + version + b"\r\n" + HOST + fields + b"\r\n", bad or wrong or 200
    yield from NO_REQUESTS.items()


def test_every_request_gets_one_clean_answer(server: Server) -> None:
    count = 0
    for request, status in requests():
        answer = answer_to(server, request)
        head, _, body = answer.partition(b"\r\n\r\n")
        found = re.match(rb"HTTP/1\.1 (\d{3}) [A-Za-z -]+\r\n", head)
        assert found and int(found[1]) == status, (request[:100], status, answer[:200])
        length = re.search(rb"(?i)\r\ncontent-length: (\d+)", head)
        assert length, (request[:100], head)
        if request.lstrip().startswith(b"HEAD") and status != 400 and status != 414:
            assert body == b"", (request[:100], answer[:300])
        else:
            assert len(body) == int(length[1]), (request[:100], answer[:300])
            assert status == 200 or (body.count(b"\n") == 1 and body.isascii() and len(body) < 300), body
        assert b"Traceback" not in answer and b"HTTP/1.1" not in body or status in (400, 505), answer
        count += 1
    assert count > 500
    assert answer_to(server, b"GET / HTTP/1.1\r\n" + HOST + b"\r\n").startswith(b"HTTP/1.1 200 ")


def test_a_request_that_never_ends_is_answered_after_a_while(server: Server) -> None:
    assert answer_to(server, b"GET / HTTP/1.1\r\nHost:").startswith(b"HTTP/1.1 408 ")


def test_a_request_in_pieces_is_one(server: Server) -> None:
    with socket.create_connection(("127.0.0.1", urlsplit(server.url).port), timeout=PATIENCE) as connection:
        for piece in (b"G", b"ET /main.js HT", b"TP/1.1\r", b"\nHost: 127.0.0", b".1\r\n\r", b"\n"):
            connection.sendall(piece)
            time.sleep(0.02)
        assert connection.recv(100).startswith(b"HTTP/1.1 200 OK")


# ---- orders ----

#: A valid value for each field of orders.
GOOD = {"on": True, "factor": 2, "count": 1, "seed": None, "thing": 1, "pose": [0, 0, 0], "velocity": [0, 0, 0],
        "chosen": None, "scans": [], "all": True}
ORDERS = {"pause": ["on"], "speed": ["factor"], "step": ["count"], "reset": ["seed"], "move": ["thing", "pose"],
          "drive": ["thing", "velocity"], "sense": ["thing"], "watch": ["chosen", "scans", "all"]}
#: JSON values that are invalid for all fields or for most.
VALUES = ["9" * 400, "-" + "9" * 400, "9" * 5000, "1e999", "-1e999", "NaN", "Infinity", "1e308", "1.5", "-1",
          "18446744073709551616",
          "4294967296", '"x"', '"' + "9" * 400 + '"', '"\\u0663"', '"\\ud800"', '""', "{}", '{"a": [1]}', "[]",
          "[[]]", "[1, 2]",
          "[1, 2, 3, 4]", '["a", "b", "c"]', "[" + "9" * 400 + ", 0, 0]", "[NaN, 0, 0]", "[null, null, null]",
          "true", "null",
          "[" * 900 + "]" * 900, '"' + "x" * 9000 + '"', "[" + "1," * 300 + "1]"]
FRAMES = ["", " ", "null", "7", '"pause"', "[]", "{}", '{"do": null}', '{"do": 7}', '{"do": ["pause"]}',
'{"do": {"do": 1}}',
          '{"do": "nothing"}', '{"do": "' + "x" * 9000 + '"}', '{"do": "\\ud800"}', '{"do": "pause"', "[" * 9000,
          '{"a":' * 3000,
          "9" * 5000, b"", b"\xff\x00", b'{"do": "pause", "on": true}', bytes(9000)]


def orders() -> Iterator[str | bytes]:
    yield from FRAMES
    for name, fields in ORDERS.items():
        for field in fields:
            others = {other: GOOD[other] for other in fields if other != field}
            start = json.dumps({"do": name, **others})[:-1]
            yield start + "}"
            for value in VALUES:
                yield f'{start}, "{field}": {value}}}'


def may_be_carried_out(order: str | bytes) -> bool:
    """True if the order may be valid, because some of the values are valid for some fields."""
    try:
        fields = json.loads(order)
    except (ValueError, RecursionError):
        return False
    if not isinstance(fields, dict):
        return False
    fits: dict[str, Callable[[Any], bool]] = {
        "on": lambda v: isinstance(v, bool), "all": lambda v: isinstance(v, bool), "chosen": lambda v: v is None,
        "factor": lambda v: v == 1.5, "seed": lambda v: v is None or v == 2**32, "scans": lambda v: v in ([], [1,
        2], [1, 2, 3, 4]),
        "thing": lambda v: v == 1, "count": lambda v: v == 1, "pose": lambda v: v == [0, 0, 0],
        "velocity": lambda v: v == [0, 0, 0]}
    wanted = ORDERS.get(fields["do"], []) if isinstance(fields.get("do"), str) else []
    return bool(wanted) and all((name in fields or name == "seed" or name == "chosen")
                                and (fields.get(name) is not True or name in ("on", "all"))
                                and fits[name](fields.get(name)) for name in wanted)


def test_every_invalid_order_is_answered_in_one_line(server: Server) -> None:
    """The connection stays open, and the world is unchanged."""
    state = do(server, lambda run: run.world.state_hash())
    count = 0
    with Client(server) as client:
        for order in orders():
            if may_be_carried_out(order):
                continue
            client.socket.send(order)
            line = client.until_error()
            assert line and "\n" not in line and len(line) < 200 and "Error" not in line, (order[:100], line)
            count += 1
        client.send("step", count=1)
        client.until(lambda: client.frame["steps"] == 1)
    assert count > 300
    do(server, lambda run: run.reset(1))
    assert do(server, lambda run: run.world.state_hash()) == state


def frame(first: int, length: int, payload: bytes, masked: bool = True) -> bytes:
    """Makes a possibly invalid frame of the WebSocket protocol."""
    if length < 126:
        head = struct.pack(">BB", first, (128 if masked else 0) | length)
    else:
        head = struct.pack(">BBQ", first, (128 if masked else 0) | 127, length)
    return head + (b"\0\0\0\0" if masked else b"") + payload


@pytest.mark.parametrize(("data", "code"), [
    (frame(0x81, 2, b"\xff\xfe"), 1007), (frame(0x81, 2, b"{}", masked=False), 1002), (frame(0x83, 0, b""), 1002),
    (frame(0xF1, 0, b""), 1002), (frame(0x80, 0, b""), 1002), (frame(0x09, 0, b""), 1002), (frame(0x81, 2**63,
    b""), 1002),
    (frame(0x81, 2**62, b""), 1009), (frame(0x81, 20000, b" " * 20000), 1009), (frame(0x88, 1, b"\0"), 1002),
    (frame(0x88, 2, b"\0\0"), 1002)])
def test_frames_that_violate_the_protocol_end_only_their_connection(server: Server, data: bytes, code: int) -> None:
    with Client(server) as bad, Client(server) as good:
        bad.until(lambda: True)
        bad.socket.socket.sendall(data)
        with pytest.raises(ConnectionClosed) as caught:
            while True:
                bad.next()
        received = caught.value.rcvd
        assert received is not None and received.code in (code, 1009 if code == 1002 else code)
        good.send("step", count=1)
        good.until(lambda: good.frame["steps"] == 1)


# ---- the clock ----

class Flood:
    """Clients that send without pause, each in its own thread."""

    def __init__(self, server: Server, clients: int, send: Callable[[Client, int], None]) -> None:
        self._over = threading.Event()
        self.sent = 0
        self._threads = [threading.Thread(target=self._work, args=(server, send)) for _ in range(clients)]

    def _work(self, server: Server, send: Callable[[Client, int], None]) -> None:
        with Client(server) as client:
            reader = threading.Thread(target=self._read, args=(client,))
            reader.start()
            for number in itertools.count():
                if self._over.is_set():
                    break
                try:
                    send(client, number)
                except (ConnectionClosed, TimeoutError):
                    break
                self.sent += 1
            client.socket.close()
            reader.join()

    @staticmethod
    def _read(client: Client) -> None:
        try:
            while True:
                client.next()
        except (ConnectionClosed, TimeoutError):
            pass

    def __enter__(self) -> Flood:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        for thread in self._threads:
            thread.join()


def often(period: float, what: str, **parts: Any) -> Callable[[Client, int], None]:
    """Sends an order once per period."""
    def send(client: Client, number: int) -> None:
        client.send(what, **parts)
        time.sleep(period)

    return send


def both_speeds(client: Client, number: int) -> None:
    client.send("speed", factor=(1, 1.001)[number % 2])
    time.sleep(0.03)


def pause_and_go(client: Client, number: int) -> None:
    """Pauses the world for a third of the time."""
    client.send("pause", on=number % 2 == 1)
    time.sleep((0.01, 0.02)[number % 2])


def move(client: Client, number: int) -> None:
    client.send("move", thing=1, pose=[100 + number % 7, 50, 0])


def nonsense(client: Client, number: int) -> None:
    client.socket.send((b"\xff", "x", "[" * 3000, '{"do": "speed", "factor": ' + "9" * 400 + "}")[number % 4])


@pytest.mark.parametrize(("clients", "send", "share"), [
    (1, often(0.03, "speed", factor=1), 1), (1, both_speeds, 1), (8, often(0.0, "speed", factor=1), 1),
    (3, pause_and_go, None), (1, often(0.03, "pause", on=False), 1), (8, move, 1), (8, nonsense, 1),
    (8, often(0.0, "watch", chosen=1, scans=[], all=True), 1)],
    ids=["33 speeds a second", "two speeds", "speeds", "pauses", "goes", "moves", "nonsense", "wishes"])
@pytest.mark.parametrize("dt", [100, 20])
def test_clients_that_flood_do_not_stop_the_clock(room: str, dt: int, clients: int, send: Callable[[Client, int], None],
                                                  share: float | None) -> None:
    """At speed 1, simulated time keeps up with real time, apart from delays of a busy machine."""
    world = st.World.from_text(f"interval_sim {dt}\n" + room)
    with Server(world, speed=1.0) as server, Flood(server, clients, send) as flood:
        deadline = time.monotonic() + PATIENCE
        while flood.sent < 20:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        time_then, began = do(server, lambda run: run.world.time), time.monotonic()
        time.sleep(3)
        passed, real = do(server, lambda run: run.world.time) - time_then, time.monotonic() - began
    if share is None:
        assert 0.05 * real < passed < real + dt / 1000
    else:
        assert 0.6 * real < passed < real + 2 * dt / 1000 + 0.3


def test_other_clients_are_answered_in_a_flood(server: Server) -> None:
    with Flood(server, 8, move), Client(server) as client:
        for number in range(1, 6):
            client.send("speed", factor=number)
            client.until(lambda: client.frame["speed"] == number)  # noqa: B023


def test_steps_that_are_asked_for_one_by_one_are_all_made(server: Server) -> None:
    with Client(server) as client:
        for _ in range(40):
            client.send("step", count=1)
        client.until(lambda: client.frame["steps"] == 40)


def test_orders_beyond_the_limit_of_the_queue_are_refused(room: str) -> None:
    """The queue of orders is limited while the run is busy with a step."""
    from stagesim.live.show import MAX_ORDERS

    busy, over = threading.Event(), threading.Event()

    def control(world: st.World) -> None:
        busy.set()
        over.wait()

    with Server(st.World.from_text(room), port=None, control=control) as server:
        busy.wait()
        futures = [server.run.order(lambda run: run.world.time) for _ in range(MAX_ORDERS + 10)]
        over.set()
        assert all(future.result(PATIENCE) >= 0 for future in futures[:1000])
        with pytest.raises(st.StageError, match="orders that wait already"):
            futures[-1].result(PATIENCE)


def test_pace_keeps_time_over_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Frequent changes of speed and pause alter the number of due steps by at most one."""
    now = 100.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    pace, made = Pace(1.0, True, 0.25), 0
    for tick in range(3000):
        now += 0.001
        pace.change(speed=(1.0, 2.0)[tick % 2], running=tick % 5 != 0)
        for _ in range(pace.steps_due(0.1)):
            pace.made(0.1)
            made += 1
    # Four of five milliseconds count, at 1.5 times the real speed.
    assert made == pytest.approx(3 * 0.8 * 1.5 / 0.1, abs=1)


def test_pace_makes_up_for_a_short_delay_and_not_for_a_long_one(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    pace = Pace(2.0, True, 0.25)
    now = 0.2
    assert pace.steps_due(0.1) == 4 and pace.wait(0.1) == 0
    pace.made(0.4)
    assert pace.steps_due(0.1) == 0 and pace.wait(0.1) == pytest.approx(0.05)
    now = 60.0
    assert pace.steps_due(0.1) == 6  # the lag of 0.25 s at that speed, and one due step
