# SPDX-License-Identifier: GPL-2.0-or-later
"""Shows a run in Foxglove: a WebSocket server with the subprotocol foxglove.sdk.v1."""

from __future__ import annotations

import json
import logging
import math
import threading
import time
from collections.abc import Callable
from typing import Any

import foxglove
from foxglove import Channel, Context, Parameter, Schema, Service, ServiceRequest, ServiceSchema
from foxglove.channels import FrameTransformsChannel, LaserScanChannel, SceneUpdateChannel
from foxglove.messages import (
    FrameTransform, FrameTransforms, LaserScan, Pose, Quaternion, SceneEntityDeletion,
    SceneEntityDeletionType, SceneUpdate, Timestamp, Vector3)
from foxglove.websocket import (
    Capability, ChannelView, Client, ClientChannel, MessageSchema, ServerListener, StatusLevel, WebSocketServer)

from ..errors import StageError
from .fields import flag, found, integer, number, seed
from .scene import Frame, Scan, Scene, State, Wish, unpacked_scans
from .show import Show
from .solids import entity_of

WORLD = "world"  # name of the root frame
HOLD = 1.5  # seconds for which a cmd_vel is valid; Foxglove's panel sends one per second
WAIT = 10.0  # max seconds to wait for an order
_STATE = {"type": "object", "properties": {
    name: {"type": kind} for name, kind in (
        ("time", "number"), ("steps", "integer"), ("seed", "string"), ("paused", "boolean"),
        ("speed", "number"), ("rate", "number"), ("busy", "number"), ("r_acc", "number"), ("note", "string"))}}


class Bridge:
    """The server for Foxglove.

    Topics: /scene, /tf, /state, and ROBOT/scan, ROBOT/scan_1, ... for each sensor of up to MAX_SCANNED_ROBOTS robots.
    Viewers publish geometry_msgs/Twist as JSON on ROBOT/cmd_vel, or on /cmd_vel for the first robot.
    Parameters: speed, paused, seed; setting the seed resets the world. Services: /step, /reset, /pause.

    Args:
        run: the run to show.
        host: the address to serve at.
        port: the port; 0: any free port.

    Raises:
        StageError: the port can't be opened.
    """

    def __init__(self, run: Show, host: str, port: int) -> None:
        self._run = run
        self._context = Context()
        self._scene = SceneUpdateChannel("/scene", context=self._context)
        self._transforms = FrameTransformsChannel("/tf", context=self._context)
        self._state = Channel("/state", schema=_schema("stage.State", _STATE), message_encoding="json",
                              context=self._context)
        self._scans: dict[tuple[int, int], LaserScanChannel] = {}
        self._shown_scene: Scene | None = None  # the scene that viewers have
        self._shown: dict[int, tuple[str, int]] = {}  # name and shape of each thing in that scene, by id
        self._last_time = 0.0
        self._told: tuple[Any, ...] = ()
        self._listener = _Listener(run)
        logging.getLogger("foxglove").setLevel(logging.CRITICAL)
        try:
            self._server = foxglove.start_server(
                name="Stage", host=host, port=port, context=self._context, server_listener=self._listener,
                capabilities=[Capability.ClientPublish, Capability.Parameters, Capability.Services, Capability.Time],
                supported_encodings=["json"], services=self._services(), message_backlog_size=64)
        except Exception as error:
            raise StageError(f"can't serve Foxglove at {host}:{port}: {error}") from None
        self._listener.server = self._server
        run.order(lambda run: run.listen(self.show, lambda: bool(self._listener.topics)))
        run.order(lambda run: run.wish(self, Wish(all_scans=True)))

    @property
    def port(self) -> int:
        """The port that is served."""
        return self._server.port

    def close(self) -> None:
        """Stops the server."""
        self._server.stop()

    # ---- frames ----

    def show(self, frame: Frame) -> None:
        """Sends a frame to viewers. Called by the run."""
        now = round(frame.state.time * 1e9)
        if frame.state.time < self._last_time:
            self._server.clear_session()
        self._last_time = frame.state.time
        self._server.broadcast_time(now)
        if self._listener.wants_scene.is_set():  # a new viewer needs the whole scene
            self._listener.wants_scene.clear()
            self._shown = {}
        if self._shown_scene is not frame.scene or not self._shown:
            self._show_scene(frame.scene, now)
        scans = {thing: unpacked_scans(words) for thing, words in frame.scans.items()}
        if "/tf" in self._listener.topics:
            self._transforms.log(_transforms(frame, now, scans), log_time=now)
        for thing, of_thing in scans.items():
            self._show_scans(frame, thing, of_thing, now)
        self._tell(frame, now)

    def _show_scene(self, scene: Scene, now: int) -> None:
        """Sends the changes of the scene, or the whole scene if `_shown` is empty."""
        looks = {thing.id: (name, shape)
                 for thing, name, shape in zip(scene.things, scene.names, scene.shape_of)}
        if scene.shapes is not (self._shown_scene and self._shown_scene.shapes):
            self._shown = {}  # a new table of shapes: the old shape numbers are invalid
        if self._shown:
            deletions = [SceneEntityDeletion(id=str(thing), type=SceneEntityDeletionType.MatchingId)
                         for thing in self._shown if thing not in looks]
        else:
            deletions = [SceneEntityDeletion(type=SceneEntityDeletionType.All)]
        entities = [entity_of(thing, name) for thing, name in zip(scene.things, scene.names)
                    if self._shown.get(thing.id) != looks[thing.id]]
        self._shown, self._shown_scene = looks, scene
        self._scene.log(SceneUpdate(deletions=deletions, entities=entities), log_time=now)

    def _show_scans(self, frame: Frame, thing: int, scans: list[Scan], now: int) -> None:
        name = frame.scene.names[frame.scene.index[thing]]
        for number, scan in enumerate(scans):
            channel = self._scans.get((thing, number))
            if channel is None:
                topic = f"/{name}/scan" + (f"_{number}" if number else "")
                channel = self._scans[thing, number] = LaserScanChannel(topic, context=self._context)
            channel.log(_message_of(scan), log_time=now)

    def _tell(self, frame: Frame, now: int) -> None:
        state = {**vars(frame.state), "seed": str(frame.state.seed), "r_acc": frame.r_acc}
        self._state.log(state, log_time=now)
        values = (frame.state.speed, frame.state.paused, frame.state.seed)
        if values != self._told:
            self._told = values
            self._server.publish_parameter_values(_parameters(frame.state))

    # ---- services ----

    def _services(self) -> list[Service]:
        return [self._service("/step", {"count": {"type": "integer", "default": 1}},
                              lambda run, request: run.make_steps(integer(request, "count", 1))),
                self._service("/reset", {"seed": {"type": "integer"}},
                              lambda run, request: run.reset(seed(request))),
                self._service("/pause", {"on": {"type": "boolean", "default": True}},
                              lambda run, request: run.pause(flag(request, "on", True)))]

    def _service(self, name: str, properties: dict[str, Any], do: Callable[[Show, dict[str, Any]], None]) -> Service:
        def handle(request: ServiceRequest) -> bytes:
            given = _object(request.payload or b"{}")
            self._run.order(lambda run: do(run, given)).result(WAIT)
            return b"{}"

        asked = MessageSchema(encoding="json", schema=_schema(f"stage{name}", {"type": "object",
                                                                              "properties": properties}))
        answer = MessageSchema(encoding="json", schema=_schema("stage/Empty", {"type": "object"}))
        return Service(name, schema=ServiceSchema(f"stage{name}", request=asked, response=answer), handler=handle)


class _Listener(ServerListener):
    """Handles the events of viewers; called by threads of the server."""

    def __init__(self, run: Show) -> None:
        self._run = run
        self._lock = threading.Lock()
        self._subscribers: dict[str, set[int]] = {}
        self._published: dict[tuple[int, int], str] = {}
        self._velocities: dict[tuple[int, str], tuple[float, float, float]] = {}  # not yet taken by an order
        self._complained = -math.inf  # time of the last complaint
        self.server: WebSocketServer | None = None  #: the server that sends complaints
        self.topics: frozenset[str] = frozenset()  #: topics with subscribers
        self.wants_scene = threading.Event()

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        with self._lock:
            self._subscribers.setdefault(channel.topic, set()).add(client.id)
            self.topics = frozenset(self._subscribers)
        if channel.topic == "/scene":
            self.wants_scene.set()
        self._run.order(lambda run: None)  # causes a frame, even if the world is paused

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        with self._lock:
            readers = self._subscribers.get(channel.topic, set())
            readers.discard(client.id)
            if not readers:
                self._subscribers.pop(channel.topic, None)
            self.topics = frozenset(self._subscribers)

    def on_client_advertise(self, client: Client, channel: ClientChannel) -> None:
        if channel.encoding == "json":
            self._published[client.id, channel.id] = channel.topic

    def on_client_unadvertise(self, client: Client, client_channel_id: int) -> None:
        self._published.pop((client.id, client_channel_id), None)

    def on_message_data(self, client: Client, client_channel_id: int, data: bytes) -> None:
        topic = self._published.get((client.id, client_channel_id), "")
        if not topic.endswith("/cmd_vel"):
            return
        try:
            velocity = _velocity(_object(data))
        except ValueError as error:
            self._complain(f"{found(topic)}: {error}")
            return
        robot = topic.removesuffix("/cmd_vel").removeprefix("/")
        key = (client.id, robot)
        with self._lock:
            is_waiting = key in self._velocities
            self._velocities[key] = velocity
        if not is_waiting:  # if velocities arrive faster than orders are executed, the last one counts
            self._run.order(lambda run: _drive(run, ("foxglove", client.id), robot, self._take_velocity(key)))

    def _complain(self, text: str) -> None:
        """Shows an error to all viewers, at most once per second."""
        now = time.monotonic()
        if self.server is not None and now - self._complained >= 1:
            self._complained = now
            self.server.publish_status(text, StatusLevel.Warning)

    def _take_velocity(self, key: tuple[int, str]) -> tuple[float, float, float]:
        with self._lock:
            return self._velocities.pop(key)

    def on_get_parameters(self, client: Client, param_names: list[str],
                          request_id: str | None = None) -> list[Parameter]:
        known: list[Parameter] = self._run.order(lambda run: _parameters(run.state())).result(WAIT)
        return [parameter for parameter in known if not param_names or parameter.name in param_names]

    def on_set_parameters(self, client: Client, parameters: list[Parameter],
                          request_id: str | None = None) -> list[Parameter]:
        for parameter in parameters:
            try:
                _set(self._run, parameter.name, parameter.get_value())
            except (ValueError, StageError, TimeoutError) as error:  # the answer contains the unchanged value
                self._complain(str(error) or f"{parameter.name}: the world did not answer in {WAIT:g} s")
        return self.on_get_parameters(client, [parameter.name for parameter in parameters])


def _set(run: Show, name: str, value: Any) -> None:
    if value is None:
        raise ValueError(f"{name}: found nothing, expected a value")
    fields = {name: value}
    orders: dict[str, Callable[[Show], None]] = {
        "speed": lambda run: run.set_speed(number(fields, name)), "paused": lambda run: run.pause(flag(fields, name)),
        "seed": lambda run: run.reset(seed(fields))}
    if name in orders:
        run.order(orders[name]).result(WAIT)


def _parameters(state: State) -> list[Parameter]:
    return [Parameter("speed", value=state.speed, type=foxglove.ParameterType.Float64),
            Parameter("paused", value=state.paused), Parameter("seed", value=str(state.seed))]


def _drive(run: Show, owner: Any, robot: str, velocity: tuple[float, float, float]) -> None:
    for thing, name in zip(run.scene.things, run.scene.names):
        if thing.robot and robot in ("", name):
            run.drive(owner, thing.id, velocity, HOLD)
            return


def _object(data: bytes) -> dict[str, Any]:
    try:
        given = json.loads(data)
    except (ValueError, RecursionError):
        raise ValueError("found something that is not JSON") from None
    if not isinstance(given, dict):
        raise ValueError(f"found {found(given)}, expected an object")
    return given


def _velocity(twist: dict[str, Any]) -> tuple[float, float, float]:
    """Speeds forwards, to the left and turning of a Twist or a TwistStamped. Raises ValueError if it is neither."""
    twist = twist.get("twist", twist)
    parts = [twist.get(name) if isinstance(twist, dict) else None for name in ("linear", "angular")]
    if not all(isinstance(part, dict) for part in parts):
        raise ValueError("found no Twist, expected one with linear and angular")
    linear, angular = parts
    return number(linear, "x", 0.0), number(linear, "y", 0.0), number(angular, "z", 0.0)


def _schema(name: str, content: dict[str, Any]) -> Schema:
    return Schema(name=name, encoding="jsonschema", data=json.dumps(content).encode())


def _stamp(now: int) -> Timestamp:
    return Timestamp(sec=now // 10**9, nsec=now % 10**9)


def _turn(angle: float) -> Quaternion:
    return Quaternion(x=0, y=0, z=math.sin(angle / 2), w=math.cos(angle / 2))


def _transform(name: str, pose: tuple[float, float, float], z: float, stamp: int) -> FrameTransform:
    x, y, a = pose
    return FrameTransform(timestamp=_stamp(stamp), parent_frame_id=WORLD, child_frame_id=name,
                          translation=Vector3(x=x, y=y, z=z), rotation=_turn(a))


def _transforms(frame: Frame, now: int, scans: dict[int, list[Scan]]) -> FrameTransforms:
    """Where things are now, and where those with scans were at the stamps of their scans."""
    things, names, index = frame.scene.things, frame.scene.names, frame.scene.index
    sensed = {(thing, scan.time): scan.place for thing, of_thing in scans.items() for scan in of_thing
              if math.isfinite(scan.place[0])}
    return FrameTransforms(transforms=[
        *(_transform(names[index[thing]], place, things[index[thing]].ground, stamp)
          for (thing, stamp), place in sensed.items()),
        *(_transform(name, place, thing.ground, now)
          for thing, name, place in zip(things, names, frame.places.tolist()) if math.isfinite(place[0]))])


def _message_of(scan: Scan) -> LaserScan:
    """The scan in the frame of the world, with the time at which it was sensed."""
    x, y, a = scan.origin
    return LaserScan(
        timestamp=_stamp(scan.time), frame_id=WORLD, start_angle=scan.bearings[0], end_angle=scan.bearings[-1],
        pose=Pose(position=Vector3(x=x, y=y, z=0), orientation=_turn(a)), ranges=list(scan.ranges))
