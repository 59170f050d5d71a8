# SPDX-License-Identifier: GPL-2.0-or-later
"""The data that a viewer gets by Foxglove's protocol, and the effects of its commands.

The test itself is the viewer; Foxglove is not run.
"""

from __future__ import annotations

import base64
import itertools
import json
import math
import struct
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import stagesim as st

pytest.importorskip("websockets", reason="the package websockets is not installed: tools/setup --live")
pytest.importorskip("foxglove", reason="the package foxglove-sdk is not installed: tools/setup --live")
pytest.importorskip("google.protobuf", reason="the package protobuf is not installed: tools/setup --live")
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory  # noqa: E402
from live_client import Client, do  # noqa: E402
from patience import PATIENCE  # noqa: E402
from stagesim.live import Server  # noqa: E402
from websockets.sync.client import connect  # noqa: E402


class Viewer:
    """A client of the protocol foxglove.sdk.v1."""

    def __init__(self, server: Server) -> None:
        self.socket = connect(server.foxglove_url, subprotocols=["foxglove.sdk.v1"],  # type: ignore[list-item]
                              max_size=None, close_timeout=1).__enter__()
        self.channels: dict[str, dict[str, Any]] = {}
        self.topics: dict[int, str] = {}
        self.classes: dict[str, Any] = {}
        self.heard: dict[str, dict[str, Any]] = {}  # JSON messages by operation
        self.last: dict[str, Any] = {}  # the last message by topic
        self.time = -1.0

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def until(self, holds: Callable[[], Any], seconds: float = PATIENCE) -> None:
        end = time.monotonic() + seconds
        while not holds():
            assert time.monotonic() < end, "it never came to that"
            self.take(self.socket.recv(timeout=PATIENCE))

    def take(self, message: str | bytes) -> None:
        if isinstance(message, str):
            said = json.loads(message)
            self.heard[said["op"]] = said
            for channel in said.get("channels", []) if said["op"] == "advertise" else []:
                self.channels[channel["topic"]] = channel
        elif message[0] == 1:  # opcode of message data
            number, _ = struct.unpack_from("<IQ", message, 1)
            topic = self.topics[number]
            self.last[topic] = self.decoded(topic, message[13:])
        elif message[0] == 2:
            self.time = struct.unpack_from("<Q", message, 1)[0] / 1e9
        elif message[0] == 3:
            self.heard["serviceCallResponse"] = {"bytes": message}

    def decoded(self, topic: str, data: bytes) -> Any:
        channel = self.channels[topic]
        if channel["encoding"] == "json":
            return json.loads(data)
        if topic not in self.classes:
            files = descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
            pool = descriptor_pool.DescriptorPool()
            for file in files.file:
                pool.Add(file)
            self.classes[topic] = message_factory.GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))
        return self.classes[topic].FromString(data)

    def subscribe(self, *topics: str) -> None:
        self.until(lambda: set(topics) <= set(self.channels))
        wanted = []
        for topic in topics:
            number = len(self.topics) + 1
            self.topics[number] = topic
            wanted.append({"id": number, "channelId": self.channels[topic]["id"]})
        self.send(op="subscribe", subscriptions=wanted)

    def send(self, **said: Any) -> None:
        self.socket.send(json.dumps(said))

    def publish(self, topic: str, message: Any) -> None:
        self.send(op="advertise", channels=[{"id": 7, "topic": topic, "encoding": "json",
                                             "schemaName": "geometry_msgs/Twist"}])
        self.socket.send(struct.pack("<BI", 1, 7) + json.dumps(message).encode())
        self.send(op="unadvertise", channelIds=[7])

    def call(self, name: str, request: str) -> str:
        """Calls a service; returns its response or its error."""
        service = next(s["id"] for s in self.heard["advertiseServices"]["services"] if s["name"] == name)
        for kind in ("serviceCallResponse", "serviceCallFailure"):
            self.heard.pop(kind, None)
        self.socket.send(struct.pack("<BIII", 2, service, 1, 4) + b"json" + request.encode())
        self.until(lambda: "serviceCallResponse" in self.heard or "serviceCallFailure" in self.heard)
        return "done" if "serviceCallResponse" in self.heard else str(self.heard["serviceCallFailure"]["message"])


def twist(forwards: float, turning: float) -> dict[str, dict[str, float]]:
    return {"linear": {"x": forwards, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": turning}}


@pytest.fixture
def server(room: str) -> Iterator[Server]:
    with Server(st.World.from_text(room), port=None, foxglove=0, paused=True) as made:
        yield made


def test_server_announces_its_channels_and_services(server: Server) -> None:
    with Viewer(server) as viewer:
        viewer.until(lambda: {"/scene", "/tf", "/state"} <= set(viewer.channels)
                     and "advertiseServices" in viewer.heard)
        greeting = viewer.heard["serverInfo"]
        assert greeting["name"] == "Stage"
        assert {"clientPublish", "parameters", "services", "time"} <= set(greeting["capabilities"])
        schemas = {topic: channel["schemaName"] for topic, channel in viewer.channels.items()}
        assert schemas == {"/scene": "foxglove.SceneUpdate", "/tf": "foxglove.FrameTransforms", "/state": "stage.State"}
        services = {service["name"] for service in viewer.heard["advertiseServices"]["services"]}
        assert services == {"/step", "/reset", "/pause"}
    assert server.foxglove_url.startswith("ws://127.0.0.1:") and server.url == ""


def test_scene_and_transforms(server: Server) -> None:
    """A viewer that connects while the run is paused also gets everything."""
    with Viewer(server) as viewer:
        viewer.subscribe("/scene", "/tf", "/state")
        viewer.until(lambda: {"/scene", "/tf", "/state"} <= set(viewer.last))
        entities = {entity.frame_id: entity for entity in viewer.last["/scene"].entities}
        assert set(entities) == {"wall", "a", "b", "c"}
        wall = entities["wall"]
        points = np.array([[p.x, p.y, p.z] for p in wall.triangles[0].points])
        assert np.ptp(points, axis=0) == pytest.approx([0.1, 8, 1])
        assert max(wall.triangles[0].indices) < len(points)
        assert {pair.key: pair.value for pair in entities["b"].metadata} == {"name": "b", "type": "position"}
        poses = {t.child_frame_id: t for t in viewer.last["/tf"].transforms}
        assert set(poses) == {"wall", "a", "b", "c"}
        assert (poses["b"].translation.x, poses["b"].translation.y) == (0, 2)
        assert 2 * math.atan2(poses["b"].rotation.z, poses["b"].rotation.w) == pytest.approx(math.pi / 2)
        assert viewer.last["/state"]["paused"] is True and viewer.last["/state"]["steps"] == 0


def test_scene_has_only_entities_that_changed(server: Server) -> None:
    with Viewer(server) as viewer:
        viewer.subscribe("/scene", "/tf")
        viewer.until(lambda: "/scene" in viewer.last and len(viewer.last["/scene"].entities) == 4)
        assert [deletion.type for deletion in viewer.last["/scene"].deletions] == [1]  # deletes all
        do(server, lambda run: setattr(run.world.model("b"), "color", (0, 0, 1, 1)))
        viewer.until(lambda: len(viewer.last["/scene"].entities) == 1)
        entity = viewer.last["/scene"].entities[0]
        assert entity.frame_id == "b" and (entity.triangles[0].color.r, entity.triangles[0].color.b) == (0, 1)
        number = do(server, lambda run: run.world.model("a").id)
        do(server, lambda run: run.world.model("a").delete())
        viewer.until(lambda: len(viewer.last["/scene"].entities) == 0)
        assert [(d.type, d.id) for d in viewer.last["/scene"].deletions] == [(0, str(number))]
        with Viewer(server) as other:
            other.subscribe("/scene")
            other.until(lambda: "/scene" in other.last)
            assert {entity.frame_id for entity in other.last["/scene"].entities} == {"wall", "b", "c"}


def test_scans_are_the_readings(server: Server) -> None:
    with Viewer(server) as viewer:
        viewer.subscribe("/tf")
        do(server, lambda run: (run.world.fleet().ranger(0).ranges, run.make_steps(2)))
        viewer.subscribe("/a/scan", "/b/scan")
        do(server, lambda run: run.make_steps(1))
        viewer.until(lambda: all(topic in viewer.last and viewer.last[topic].timestamp.nanos == 200_000_000
                                 for topic in ("/a/scan", "/b/scan")))
        ranges = do(server, lambda run: run.world.fleet().ranger(0).ranges.copy())
        for row, name in enumerate("ab"):
            scan = viewer.last[f"/{name}/scan"]
            assert (np.array(scan.ranges, np.float32) == ranges[row].astype(np.float32)).all()
            assert (scan.start_angle, scan.end_angle) == pytest.approx((-math.pi / 4, math.pi / 4))


def test_scans_and_transforms_of_one_stamp_are_of_one_instant() -> None:
    """While a robot turns: scans lie on the walls, and the transform of their stamp is where the robot sensed."""
    text = """ray_model "exact"
model( pose [0 5.5 0 0] size [12 1 10] ) model( pose [0 -5.5 0 0] size [12 1 10] )
model( pose [5.5 0 0 0] size [1 12 10] ) model( pose [-5.5 0 0 0] size [1 12 10] )
position( name "r" localization "gps" ranger( sensor( range [0 20] fov 350 samples 36 ) ) )"""

    def plane(place: Any, turn: Any) -> tuple[float, float, float]:
        return place.x, place.y, 2 * math.atan2(turn.z, turn.w)

    with Server(st.World.from_text(text), port=None, foxglove=0, paused=True) as made, Viewer(made) as viewer:
        viewer.subscribe("/tf")

        def begin(run: Any) -> Any:
            fleet = run.world.fleet()
            fleet.cmd[:] = [0.5, 0, 1.2]
            return fleet, fleet.ranger(0).ranges

        fleet, _ = do(made, begin)
        do(made, lambda run: run.make_steps(1))
        viewer.subscribe("/r/scan")
        for step in range(2, 12):
            before = tuple(do(made, lambda run: fleet.pose[0].copy()))
            do(made, lambda run: run.make_steps(1))
            stamp = (step - 1) * 100_000_000
            viewer.until(lambda: "/r/scan" in viewer.last
                         and viewer.last["/r/scan"].timestamp.ToNanoseconds() == stamp)
            scan, transforms = viewer.last["/r/scan"], viewer.last["/tf"].transforms
            x, y, a = plane(scan.pose.position, scan.pose.orientation)
            angles = a + np.linspace(scan.start_angle, scan.end_angle, len(scan.ranges))
            ends = np.array([x + scan.ranges * np.cos(angles), y + scan.ranges * np.sin(angles)])
            assert np.abs(np.abs(ends).max(0) - 5).max() < 1e-4  # 32-bit floats
            (then,) = (t for t in transforms if t.child_frame_id == "r" and t.timestamp.ToNanoseconds() == stamp)
            assert plane(then.translation, then.rotation) == pytest.approx(before, abs=1e-6)
            (now,) = (t for t in transforms if t.child_frame_id == "r" and t.timestamp.ToNanoseconds() > stamp)
            assert plane(now.translation, now.rotation) != pytest.approx(before, abs=0.03)


def test_services(server: Server) -> None:
    with Viewer(server) as viewer:
        viewer.subscribe("/state")
        viewer.until(lambda: "/state" in viewer.last and "advertiseServices" in viewer.heard)
        assert viewer.call("/step", '{"count": 4}') == "done"
        viewer.until(lambda: viewer.last["/state"]["steps"] == 4 and viewer.time == pytest.approx(0.4))
        assert viewer.call("/reset", '{"seed": 77}') == "done"
        viewer.until(lambda: viewer.last["/state"]["steps"] == 0 and viewer.last["/state"]["seed"] == "77")
        assert viewer.call("/pause", '{"on": false}') == "done"
        viewer.until(lambda: viewer.last["/state"]["steps"] > 3)
        assert viewer.call("/pause", "") == "done"
        steps = do(server, lambda run: run.world.steps)
        digits = "9" * 400
        for service, field, values in (
                ("/step", "count", ("0", '"x"', "null", "[]", "{}", "true", "1.5", "NaN", "1e999", digits, f'"{digits}"')),
                ("/reset", "seed", ("-1", '"x"', "[]", "{}", "true", "1.5", "NaN", digits, f'"{digits}"')),
                ("/pause", "on", ("0", '"x"', "null", "[]", digits))):
            for request in ("{", "[]", "7", '"x"', digits, "[" * 9000, *(f'{{"{field}": {value}}}' for value in values)):
                answer = viewer.call(service, request)
                assert "found" in answer and "\n" not in answer and len(answer) < 200, (service, request[:50], answer)
                assert "Error" not in answer.replace("ValueError: ", ""), answer
        assert do(server, lambda run: run.world.steps) == steps


def test_parameters(server: Server) -> None:
    with Viewer(server) as viewer:
        def value(name: str) -> Any:
            return next((p["value"] for p in viewer.heard.get("parameterValues", {}).get("parameters", [])
                         if p["name"] == name), None)

        viewer.send(op="getParameters", parameterNames=[], id="1")
        viewer.until(lambda: (value("speed"), value("paused"), value("seed")) == (1.0, True, "1"))
        for name, wanted in (("speed", 3.5), ("paused", False), ("seed", "12")):
            viewer.send(op="setParameters", parameters=[{"name": name, "value": wanted}], id=name)
            viewer.until(lambda: value(name) == wanted)  # noqa: B023
        assert do(server, lambda run: (run._speed, run._paused, run.world.seed)) == (3.5, False, 12)
        for number, (name, wrong) in enumerate(itertools.product(
                ("speed", "paused", "seed"), (-1, "x", [1, 2], {"a": 1}, 10**400, 1e308, "9" * 400, ""))):
            viewer.heard.pop("status", None)
            viewer.send(op="setParameters", parameters=[{"name": name, "value": wrong}], id=f"wrong {number}")
            viewer.until(lambda: viewer.heard["parameterValues"].get("id") == f"wrong {number}"  # noqa: B023
                         or "status" in viewer.heard)  # status messages of the server about unreadable input
            assert do(server, lambda run: (run._speed, run._paused, run.world.seed)) == (3.5, False, 12), (name, wrong)


def test_cmd_vel(server: Server) -> None:
    """A cmd_vel drives the named robot for a short time."""
    with Viewer(server) as viewer:
        viewer.subscribe("/state")
        do(server, lambda run: run.pause(False))
        viewer.publish("/b/cmd_vel", twist(0.4, 0.2))
        def velocities() -> list[tuple[float, ...]]:
            return do(server, lambda run: [run.world.model(name).velocity for name in "ab"])

        deadline = time.monotonic() + PATIENCE
        while (now := velocities()) == [(0, 0, 0), (0, 0, 0)]:
            assert time.monotonic() < deadline
            time.sleep(0.02)
        assert now == [(0, 0, 0), (0.4, 0, 0.2)]
        while velocities() != [(0, 0, 0), (0, 0, 0)]:
            assert time.monotonic() < deadline
            time.sleep(0.02)


def test_invalid_messages_are_ignored(server: Server) -> None:
    with Viewer(server) as viewer:
        viewer.subscribe("/state")
        for message in ({}, [], 7, "x", {"linear": 3}, {"linear": {"x": "a"}, "angular": {}}, {"twist": 4},
                        twist(math.nan, 0), twist(math.inf, 0), twist(10**400, 0), {"twist": [1]},
                        {"linear": {"x": [1]}, "angular": {"z": True}}, {"linear": {}, "angular": 10**400}):
            viewer.publish("/b/cmd_vel", message)
            viewer.publish("/nobody/cmd_vel", message)
        viewer.socket.send(b"\0\1\2")
        viewer.send(op="nonsense")
        do(server, lambda run: run.make_steps(2))
        viewer.until(lambda: viewer.last.get("/state", {}).get("steps") == 2)
        assert do(server, lambda run: run.world.model("b").velocity) == (0, 0, 0)


def test_a_viewer_that_is_killed_does_not_disturb_another(server: Server) -> None:
    first = Viewer(server)
    first.subscribe("/tf")
    with Viewer(server) as second:
        second.subscribe("/state")
        first.socket.socket.close()
        do(server, lambda run: run.make_steps(3))
        second.until(lambda: second.last.get("/state", {}).get("steps") == 3)


def test_viewer_and_page_share_a_run(room: str) -> None:
    with Server(st.World.from_text(room), foxglove=0, paused=True) as server:
        with Viewer(server) as viewer, Client(server) as client:
            viewer.subscribe("/state")
            client.send("step", count=2)
            viewer.until(lambda: viewer.last.get("/state", {}).get("steps") == 2)
            client.until(lambda: client.frame["steps"] == 2)


def test_port_in_use(server: Server, room: str) -> None:
    port = int(server.foxglove_url.rsplit(":", 1)[1])
    with pytest.raises(st.StageError, match="can't serve Foxglove at 127.0.0.1"):
        Server(st.World.from_text(room), port=None, foxglove=port).start()


@pytest.mark.parametrize("file", st.shipped_worlds())
def test_every_shipped_world(file: str) -> None:
    with Server(st.World(file), port=None, foxglove=0, speed=0) as server, Viewer(server) as viewer:
        viewer.subscribe("/scene", "/tf")
        viewer.until(lambda: {"/scene", "/tf"} <= set(viewer.last))
        robots = do(server, lambda run: run.world.fleet().names)
        assert set(robots) <= {transform.child_frame_id for transform in viewer.last["/tf"].transforms}
        assert set(robots) <= {entity.frame_id for entity in viewer.last["/scene"].entities}


def test_the_nose_is_the_last_area_of_a_robot() -> None:
    world = st.World.from_text(
        'position( name "a" size [0.4 0.4 0.2] color "red" ) position( name "b" pose [2 0 0 0] gui_nose 0 )'
        'model( name "c" pose [4 0 0 0] )')
    shapes = {thing.name: thing.shape for thing in world._core.things()}
    from stagesim.shapes import areas_of

    areas = {name: list(areas_of(shape)) for name, shape in shapes.items()}
    assert [len(areas[name]) for name in "abc"] == [2, 1, 1]
    (tip, left, right), = areas["a"][1].outlines
    assert tip == pytest.approx((0.18, 0)) and left[0] == right[0] < 0 and left[1] == -right[1] > 0
    assert areas["a"][1].low == pytest.approx(0.2)
