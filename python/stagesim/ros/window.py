# SPDX-License-Identifier: GPL-2.0-or-later
"""The page of stagesim.live as the node's window.

The node makes the steps, in its thread and at its pace. What the page wants is done there as well, like what
comes from ROS: a pause by the page and one by the service are the same thing.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

import numpy as np
from rclpy.parameter import Parameter

from ..live.server import Server
from ..live.show import Show, checked_count, checked_speed

if TYPE_CHECKING:
    from .node import StageNode


class NodeRun(Show):
    """A node's world as the page sees it.

    Args:
        node: whose world it is.
        wake: has the node's thread call soon what it is given; any thread may call it.
    """

    def __init__(self, node: StageNode, wake: Callable[[Callable[[], None]], None]) -> None:
        super().__init__(node.world)
        self._node, self._wake = node, wake
        self._known = self._mode()

    # ---- from anywhere ----

    def start(self) -> None:
        """Nothing: the node's run() does it."""

    def stop(self, patience: float | None = None) -> None:
        """From now on the page gets nothing more. There is no step to wait for: the node makes them."""
        self._end()

    def order(self, do: Callable[[Show], Any]) -> Future[Any]:
        """As Show has it; the node waits no longer for ROS."""
        future = super().order(do)
        if not self._over.is_set():
            self._wake(self._take_orders)
        return future

    # ---- in orders ----

    def pause(self, on: bool) -> None:
        """As the service does."""
        self._node.pause(on)

    def set_speed(self, speed: float) -> None:
        """Sets the node's parameter."""
        change = Parameter("speed", value=checked_speed(speed))
        result = self._node.set_parameters([change])[0]
        if not result.successful:
            raise ValueError(result.reason)

    def make_steps(self, count: int) -> None:
        """So many, and then pauses. ROS is answered between them, other than with the service."""
        self._node.ask_steps(checked_count(count))

    def reset(self, seed: int | None = None) -> None:
        """As the service does; the parameter `seed` stays what it is."""
        self._node.reset(seed)

    def move(self, thing: int, pose: tuple[float, float, float]) -> None:
        """As Show has it; in a pause, who listens gets the new places."""
        super().move(thing, pose)
        self._node.moved()

    # ---- by the node ----

    def turn(self) -> float:
        """Called between steps. Shows what is new; returns how long nothing is to be done here (seconds)."""
        self._release_old()
        mode = self._mode()
        if mode != self._known:  # ROS may have changed it
            self._known = mode
            self._marks.clear()
            self.has_changed(note="")
        self._show()
        return max(0.0, self._next_frame - time.monotonic()) if self._changed else math.inf

    def has_changed(self, note: str | None = None) -> None:
        """There is something new to be seen; `note`: why the world stands still, if there is a reason."""
        self._changed = True
        if note is not None:
            self._note = note

    def world_is_new(self) -> None:
        """After a reset or a restore: nobody drives."""
        for driven in self._driven.values():
            driven.fleet.cmd[:] = np.nan
        self._driven.clear()
        self._marks.clear()
        self.has_changed(note="")

    def _mode(self) -> tuple[bool, float]:
        return self._node.paused and not self._node.steps_asked, self._node.speed

    def _pace(self) -> tuple[bool, float, float]:
        paused, speed = self._mode()
        times = self._node.times
        # ROS takes infinity as well, which is as fast as 0, and which JSON has no number for.
        return paused, speed if math.isfinite(speed) else 0.0, times["step"] + times["publish"]


def open_window(node: StageNode, wake: Callable[[Callable[[], None]], None], port: int) -> tuple[NodeRun, Server]:
    """Serves the page to programs of this machine.

    Args:
        node: whose world is shown.
        wake: see NodeRun.
        port: 0: any that is free.

    Raises:
        StageError: the port can't be had, or the package websockets is missing.
    """
    run = NodeRun(node, wake)
    return run, Server(node.world, port=port, run=run).start()
