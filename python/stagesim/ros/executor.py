# SPDX-License-Identifier: GPL-2.0-or-later
"""Lets ROS into a thread that has other things to do as well."""

from __future__ import annotations

import time
from typing import Callable

from rclpy.executors import Executor as RosExecutor
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

#: Seconds of real time in which spin() takes what has arrived, at least.
SLICE = 0.02

make_executor: Callable[[], RosExecutor] = SingleThreadedExecutor
try:  # since ROS 2 Kilted; it takes a twentieth of the time where there are hundreds of topics
    from rclpy.experimental.events_executor import EventsExecutor
except ModuleNotFoundError:
    pass
else:
    make_executor = EventsExecutor


class Executor:
    """Calls the callbacks of a node, in the thread that calls spin().

    Attributes:
        calls: to be raised by callbacks, which shows that more may be waiting.
    """

    def __init__(self, node: Node) -> None:
        self.calls = 0
        self._executor = make_executor()
        self._executor.add_node(node)

    def spin(self, seconds: float) -> float:
        """Waits so long for something to arrive, and takes all that has arrived.

        It goes on for that time, and for a slice at most: clients that send without end leave the rest to others.

        Returns:
            Seconds of processor time that it took.
        """
        start = time.thread_time()
        try:
            end = time.monotonic() + max(seconds, SLICE)
            calls = self.calls
            self._executor.spin_once(timeout_sec=seconds)
            while self.calls != calls and time.monotonic() < end:
                calls = self.calls
                self._executor.spin_once(timeout_sec=0)
        except ExternalShutdownException:
            pass  # the node sees it by rclpy.ok()
        return time.thread_time() - start

    def wake(self, do: Callable[[], None]) -> None:
        """May be called by any thread: spin() ends its wait and calls do()."""
        def task() -> None:
            self.calls += 1
            do()

        self._executor.create_task(task)

    def close(self) -> None:
        """Forgets the node."""
        self._executor.shutdown()
