# SPDX-License-Identifier: GPL-2.0-or-later
"""An executor for a thread that does other work beside ROS callbacks."""

from __future__ import annotations

import ctypes
import time
from typing import Callable

from rclpy.executors import Executor as RosExecutor
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

#: Min time in seconds during which spin() keeps calling callbacks while there are any.
SLICE = 0.02

make_executor: Callable[[], RosExecutor] = SingleThreadedExecutor
try:  # since ROS 2 Kilted; 20 times as fast with hundreds of topics
    from rclpy.experimental.events_executor import EventsExecutor
except ModuleNotFoundError:
    pass
else:
    make_executor = EventsExecutor


class Executor:
    """Calls the callbacks of a node in the thread that calls spin().

    Attributes:
        calls: counter that callbacks increment, so that spin() sees whether any callback was called.
    """

    def __init__(self, node: Node) -> None:
        self.calls = 0
        self._executor = make_executor()
        self._executor.add_node(node)

    def spin(self, seconds: float) -> float:
        """Waits up to `seconds` for a message, then calls callbacks until no message is left.

        It returns after max(seconds, SLICE) at the latest, so that clients that never pause don't stop the world.

        Returns:
            The processor time used, seconds.
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
            pass  # the node checks rclpy.ok()
        except BaseException:
            # A signal may have ended rclpy's executor while it took on new topics, some of which it now does not know.
            # Its destructor would abort the process because of them, so it is never called.
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(self._executor))
            raise
        return time.thread_time() - start

    def wake(self, do: Callable[[], None]) -> None:
        """Makes spin() stop waiting and call do(). Any thread may call it."""
        def task() -> None:
            self.calls += 1
            do()

        self._executor.create_task(task)

    def close(self) -> None:
        """Shuts the executor down."""
        self._executor.shutdown()
