# SPDX-License-Identifier: GPL-2.0-or-later
"""Nodes in separate processes, and a client for them."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from functools import cached_property
from typing import IO, Any, Callable, Iterator, Mapping, Sequence

import rclpy
from patience import PATIENCE
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_srvs.srv import Trigger

#: The QoS of sensor topics, with a long queue so that slow tests lose no messages.
SENSOR = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)


class Client:
    """A node like that of a user's program."""

    def __init__(self) -> None:
        self.node = Node("client")
        self._executor = rclpy.executors.SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._services: dict[str, Any] = {}  # clients of services, by names
        self._met: set[tuple[int, ...]] = set()  # servers that know the clients of their services
        self._nodes: list[Node] = []

    def close(self) -> None:
        self._executor.shutdown()
        for node in self._nodes:
            node.destroy_node()
        self.node.destroy_node()

    def serve(self, node: Any) -> Any:
        """Serves another node as well, which is destroyed at the end; returns it."""
        self._executor.add_node(node)
        self._nodes.append(node)
        return node

    def drop(self, node: Any) -> None:
        """Destroys a node that was served."""
        self._executor.remove_node(node)
        self._nodes.remove(node)
        node.destroy_node()

    def listen(self, kind: type, topic: str, qos: Any = 1000) -> list[Any]:
        """Subscribes to a topic; returns the growing list of its messages."""
        got: list[Any] = []
        self.node.create_subscription(kind, topic, got.append, qos)
        return got

    def talk(self, kind: type, topic: str) -> Any:
        """Makes a publisher and waits until it has a subscriber."""
        publisher = self.node.create_publisher(kind, topic, 10)
        self.until(lambda: publisher.get_subscription_count() > 0)
        return publisher

    def spin(self, seconds: float = 0.0) -> None:
        """Handles messages for `seconds`."""
        end = time.monotonic() + seconds
        while True:
            self._executor.spin_once(timeout_sec=max(0.0, min(0.05, end - time.monotonic())))
            if time.monotonic() >= end:
                return

    def until(self, condition: Callable[[], Any], seconds: float = PATIENCE) -> None:
        """Handles messages until the condition holds."""
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, "nothing happened in time"
            self._executor.spin_once(timeout_sec=0.02)

    def call(self, name: str, kind: Any = None, **request: Any) -> Any:
        """Calls a service, a Trigger by default; returns its response."""
        kind = kind or Trigger
        if name not in self._services:
            self._services[name] = self.node.create_client(kind, name)
        assert self._services[name].wait_for_service(PATIENCE), name
        self._meet_servers_of(name)
        future = self._services[name].call_async(kind.Request(**request))
        self.until(future.done)
        return future.result()

    def _meet_servers_of(self, name: str) -> None:
        """Waits until the node with a service has discovered the client of that service.

        Before that, it would drop its response. It hears of clients in the order in which they were created, so the
        client waits for an answer to one that was created later. Questions with lost answers are asked again.
        """
        servers: list[Any] = []

        def find() -> bool:
            found = self.node.get_publishers_info_by_topic(f"rr{name}Reply", no_mangle=True)
            servers[:] = [server for server in found if not server.node_name.startswith("_")]  # known by name
            return bool(servers)

        self.until(find)
        known = {tuple(server.endpoint_gid) for server in servers}
        if known <= self._met:
            return
        newest = servers[-1]
        later = self.node.create_client(GetParameters, f"{newest.node_namespace.rstrip('/')}/{newest.node_name}"
                                                       "/get_parameters")
        answer = asked = None
        end = time.monotonic() + PATIENCE
        while answer is None or not answer.done():
            assert time.monotonic() < end, f"{name}: its node does not answer"
            if later.service_is_ready() and (asked is None or time.monotonic() > asked + 2):
                answer, asked = later.call_async(GetParameters.Request()), time.monotonic()
            self.spin(0.02)
        self.node.destroy_client(later)
        self._met |= known

    def step(self, count: int = 1) -> tuple[float, str]:
        """Makes the node do `count` steps; returns its time and its state hash."""
        for _ in range(count):
            answer = self.call("/stage/step")
        assert answer.success, answer.message
        found = re.search(r"time (\S+), state (\S+)", answer.message)
        assert found
        return float(found[1]), found[2]

    def set(self, **parameters: Any) -> None:
        """Sets parameters of the node."""
        from rcl_interfaces.srv import SetParameters
        from rclpy.parameter import Parameter

        messages = [Parameter(name, value=value).to_parameter_msg() for name, value in parameters.items()]
        answer = self.call("/stage/set_parameters", SetParameters, parameters=messages)
        assert all(result.successful for result in answer.results), answer.results


class Process:
    """A node in a separate process. It opens no browser unless the environment is changed.

    Its output goes to files, because a full pipe that nobody reads would block the node.

    Args:
        module: the module of the node.
        names: new names by old ones: of topics, of the node and of its namespace.
        more: further arguments of ROS.
    """

    def __init__(self, world: str, *options: str, environment: Mapping[str, str] | None = None,
                 module: str = "stagesim.ros", names: Mapping[str, str] | None = None, more: Sequence[str] = (),
                 **parameters: Any) -> None:
        command = [sys.executable, "-m", module, world, *options, "--ros-args", *more]
        for old, new in (names or {}).items():
            command += ["-r", f"{old}:={new}"]
        for name, value in parameters.items():
            text = str(value).lower() if isinstance(value, bool) else value
            command += ["-p", f"{name}:={text}"]
        self._out, self._err = tempfile.TemporaryFile(), tempfile.TemporaryFile()
        self.process = subprocess.Popen(command, stdout=self._out, stderr=self._err, env={
            **os.environ, "DISPLAY": "", "WAYLAND_DISPLAY": "", **(environment or {})})

    @cached_property
    def url(self) -> str:
        """Waits for the line with the URL of the page, and returns the URL."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            has_ended = self.process.poll() is not None
            found = re.search(r"the window is the page (http://127\.0\.0\.1:\d+/)\n", self._text(self._err))
            if found:
                return found[1]
            assert not has_ended, self._text(self._err)
            time.sleep(0.02)
        raise AssertionError("there is no page")

    def end(self, sign: int = signal.SIGINT) -> tuple[int, str]:
        """Ends the process with a signal; returns its exit status and its output."""
        self.ask_to_end(sign)
        return self.wait()

    def wait(self) -> tuple[int, str]:
        """Waits for the end of the process; returns its exit status and its output."""
        status = self.process.wait(PATIENCE)
        return status, self.output()

    def output(self) -> str:
        """Returns what the process has printed so far."""
        return self._text(self._out) + self._text(self._err)

    def ask_to_end(self, sign: int = signal.SIGINT) -> None:
        """Sends a signal if the process still runs."""
        if self.process.poll() is None:
            self.process.send_signal(sign)

    def make_end(self) -> None:
        """Waits for the end of the process; kills it after 20 s.

        A node that shuts down announces it. A killed one counts as alive for 20 s, during which clients would send it
        messages for the node of the next test.
        """
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait(PATIENCE)
        self._out.close()
        self._err.close()

    @staticmethod
    def _text(file: IO[bytes]) -> str:
        size = os.fstat(file.fileno()).st_size
        return os.pread(file.fileno(), size, 0).decode(errors="replace")

    def statistics(self) -> dict[str, Any]:
        """Waits for the end of the process; returns the output of --stats."""
        status, text = self.wait()
        assert status == 0, text
        return json.loads(next(line for line in text.splitlines() if line.startswith("{")))


@contextmanager
def node_here(world: Any, **parameters: Any) -> Iterator[Any]:
    """A node in this process."""
    from stagesim.ros.node import StageNode

    made = StageNode(world, parameters=parameters)
    try:
        yield made
    finally:
        made.close()


def time_of(message: Any) -> int:
    """The time stamp of a message, or of the first part of one that has parts, microseconds."""
    parts = getattr(message, "transforms", None) or getattr(message, "markers", None)
    stamp = (parts[0] if parts else message).header.stamp
    return stamp.sec * 1_000_000 + stamp.nanosec // 1000


TWO = """
resolution 0.02
model( name "wall" pose [3 0 0 0] size [0.1 8 1] )
define eye ranger( size [0.1 0.1 0.1]
  sensor( range [0 5] fov 90 samples 5 pose [0.1 0 0 0] )
  sensor( range [0 4] fov 15 samples 1 pose [0 0.1 0 90] ) )
define bot position( size [0.4 0.4 0.4] drive "omni" localization "odom" localization_origin [0 0 0 0]
  odom_error [0.02 0.02 0 0.05] joules 1000 eye() )
bot( name "a" pose [0 0 0 0] )
bot( name "b" pose [0 2 0 90] )
"""
