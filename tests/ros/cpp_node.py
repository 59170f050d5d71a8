# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs the C++ node and the Python node by the same commands, each in one process and without DDS.

The C++ node is compiled against tests/rclcpp_stub; its driver.cc describes the commands and what it prints.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, Iterable, Mapping, Sequence

import stagesim
from patience import PATIENCE
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from stagesim.ros.node import StageNode

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
BINARY = Path(os.environ.get("STAGE_BINARY_DIR") or ROOT / "build" / "release")
PACKAGE, STUB, BUILD = ROOT / "ros2" / "stage_ros2_cpp", ROOT / "tests" / "rclcpp_stub", BINARY / "tests" / "stage_ros2_cpp"
#: A command of the driver. Messages and requests are objects.
Command = tuple[Any, ...]


def build_cpp_node() -> Path:
    """Configures the colcon package with the stand-ins and compiles it; returns the path of the driver."""
    prefix = Path(sys.prefix)
    environment = {**os.environ, "AMENT_PREFIX_PATH": str(prefix)}
    for words in (["-S", PACKAGE, "-B", BUILD, f"-DCMAKE_PREFIX_PATH={STUB};{prefix}", f"-DPython3_EXECUTABLE={sys.executable}",
                   f"-DSTAGE_BINARY_DIR={BINARY}", "-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=0",
                   "-DCMAKE_CXX_FLAGS=-Werror"],
                  ["--build", BUILD]):
        done = subprocess.run(["cmake", *map(str, words)], env=environment, capture_output=True, text=True, check=False,
                              timeout=PATIENCE)
        assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return BUILD / "stage_node"


@dataclass
class Run:
    """The messages and responses of a node, and the topics it has made.

    Attributes:
        publishers: type, depth, reliability and durability of each topic, as the driver prints them.
        subscriptions: type of each topic that it listens to.
        events: topic or service, and message or response, in their order.
        refused: why the node or a parameter was refused.
    """

    publishers: dict[str, tuple[str, ...]] = field(default_factory=dict)
    subscriptions: dict[str, str] = field(default_factory=dict)
    events: list[tuple[str, Any]] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)


def message_type(name: str) -> Any:
    """The class of a type such as "sensor_msgs/msg/Image"."""
    package, folder, kind = name.split("/")
    return getattr(import_module(f"{package}.{folder}"), kind)


def _typed(value: Any) -> str:
    kind = {bool: "bool", int: "int", float: "double", str: "text"}[type(value)]
    return f"{kind} {str(value).lower() if kind == 'bool' else value}"


def _line_of(command: Command) -> str:
    name, *rest = command
    if name == "set":
        return f"set {rest[0]} {_typed(rest[1])}"
    if name in ("publish", "call"):
        return f"{name} {rest[0]} {serialize_message(rest[1]).hex()}"
    return " ".join(map(str, command))


def run_cpp(driver: Path, parameters: Mapping[str, Any], commands: Sequence[Command],
            responses: Mapping[str, type]) -> Run:
    """Runs the C++ node.

    Args:
        driver: its program.
        parameters: values of its parameters.
        commands: those of the driver; "early" and a command: it is given before the node is made.
        responses: the types of services' responses.
    """
    first = [f"parameter {name} {_typed(value)}" for name, value in parameters.items()]
    early = [_line_of(command) for command in commands if command[0] == "early"]
    lines = [*first, *(line.removeprefix("early ") for line in early), "node",
             *(_line_of(command) for command in commands if command[0] != "early")]
    done = subprocess.run([driver], input="\n".join(lines) + "\n", capture_output=True, text=True, check=False,
                          timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    run = Run()
    waiting = []  # messages of the constructor are printed before their topics
    for line in done.stdout.splitlines():
        kind, name, *rest = line.split(" ")
        if kind == "publisher":
            run.publishers[name] = tuple(rest)
        elif kind == "subscription":
            run.subscriptions[name] = rest[0]
        elif kind == "refused":
            run.refused.append(line.removeprefix("refused "))
        else:
            waiting.append((kind, name, bytes.fromhex(rest[0])))
    for kind, name, data in waiting:
        made = responses[name] if kind == "response" else message_type(run.publishers[name][0])
        run.events.append((name, deserialize_message(data, made)))
    return run


class _Publisher:
    """Records messages in a run."""

    def __init__(self, run: Run, kind: type, topic: str, listened: set[str]) -> None:
        self._run, self._kind, self._topic, self._listened = run, kind, topic, listened

    def publish(self, message: Any) -> None:
        data = message if isinstance(message, bytes) else serialize_message(message)
        self._run.events.append((self._topic, deserialize_message(data, self._kind)))

    def get_subscription_count(self) -> int:
        return int(self._topic in self._listened)


def _name_of(kind: type) -> str:
    package, folder = kind.__module__.split(".")[:2]
    return f"{package}/{folder}/{kind.__name__}"


class RecordedNode(StageNode):
    """The Python node with publishers, subscriptions and services of its own."""

    def __init__(self, world: Any, parameters: Mapping[str, Any], listened: Iterable[str]) -> None:
        self.run_record = Run()
        self.listened = set(listened)
        self.callbacks: dict[str, Any] = {}
        self.handlers: dict[str, tuple[type, Any]] = {}
        super().__init__(world, parameters=parameters)

    def create_publisher(self, msg_type: Any, topic: str, qos_profile: Any, **others: Any) -> Any:
        if msg_type.__module__.startswith("rcl_interfaces"):
            return super().create_publisher(msg_type, topic, qos_profile, **others)
        name = self.resolve_topic_name(topic)
        qos = QoSProfile(depth=qos_profile) if isinstance(qos_profile, int) else qos_profile
        self.run_record.publishers[name] = (
            _name_of(msg_type), str(qos.depth),
            "reliable" if qos.reliability == ReliabilityPolicy.RELIABLE else "best_effort",
            "kept" if qos.durability == DurabilityPolicy.TRANSIENT_LOCAL else "volatile")
        return _Publisher(self.run_record, msg_type, name, self.listened)

    def create_subscription(self, msg_type: Any, topic: str, callback: Any, *_: Any, **__: Any) -> Any:
        name = self.resolve_topic_name(topic)
        self.run_record.subscriptions[name] = _name_of(msg_type)
        self.callbacks[name] = callback

    def create_service(self, srv_type: Any, srv_name: str, callback: Any, **others: Any) -> Any:
        if not srv_type.__module__.startswith("std_srvs"):
            return super().create_service(srv_type, srv_name, callback, **others)
        self.handlers[self.resolve_service_name(srv_name)] = srv_type, callback
        return None


def run_python(world_file: str, parameters: Mapping[str, Any], commands: Sequence[Command], topics: Iterable[str]) -> Run:
    """Runs the Python node. `topics`: what the command "listen *" means."""
    topics = set(topics)

    def meant(name: str) -> set[str]:
        return topics if name == "*" else {name}

    early = set().union(*(meant(command[2]) for command in commands if command[0] == "early"))
    with stagesim.World(world_file) as world:
        node = RecordedNode(world, parameters, early)
        try:
            for name, *rest in commands:
                if name == "set":
                    result = node.set_parameters([Parameter(rest[0], value=rest[1])])[0]
                    if not result.successful:
                        node.run_record.refused.append(result.reason)
                elif name == "listen":
                    node.listened |= meant(rest[0])
                elif name == "leave":
                    node.listened -= meant(rest[0])
                elif name == "publish":
                    node.callbacks[rest[0]](rest[1])
                elif name == "call":
                    kind, handler = node.handlers[rest[0]]
                    response = handler(rest[1], kind.Response())
                    node.run_record.events.append((rest[0], response))
                elif name == "turn":
                    node._turn()
                elif name == "wait":
                    time.sleep(rest[0])
            return node.run_record
        finally:
            node.close()
