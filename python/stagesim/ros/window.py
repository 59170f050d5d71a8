# SPDX-License-Identifier: GPL-2.0-or-later
"""The page of stagesim.live as the node's window.

The node makes the steps in its own thread. Orders of the page are executed there, too, like requests from ROS:
pausing by the page and pausing by the service have the same effect.
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
    """Shows the world of a node on the page.

    Args:
        node: the node.
        wake: wake(f) makes the node's thread call f() soon; any thread may call it.
    """

    def __init__(self, node: StageNode, wake: Callable[[Callable[[], None]], None]) -> None:
        super().__init__(node.world)
        self._node, self._wake = node, wake
        self._known = self._mode()

    # ---- any thread ----

    def start(self) -> None:
        """Does nothing: the node's run() makes the steps."""

    def stop(self, patience: float | None = None) -> None:
        """Stops showing the world and refuses further orders. The node's steps go on."""
        self._end()

    def order(self, do: Callable[[Show], Any]) -> Future[Any]:
        """See Show.order(). It also ends the node's wait for ROS."""
        future = super().order(do)
        if not self._over.is_set():
            self._wake(self._process_orders)
        return future

    # ---- for orders ----

    def pause(self, on: bool) -> None:
        """Pauses the world or lets it run, as the service `pause` does."""
        self._node.pause(on)

    def set_speed(self, speed: float) -> None:
        """Sets the node's parameter `speed`."""
        change = Parameter("speed", value=checked_speed(speed))
        result = self._node.set_parameters([change])[0]
        if not result.successful:
            raise ValueError(result.reason)

    def make_steps(self, count: int) -> None:
        """Makes steps, then pauses. Unlike with the service `step`, ROS is served between the steps."""
        self._node.ask_steps(checked_count(count))

    def reset(self, seed: int | None = None) -> None:
        """Resets the world as the service `reset` does; None: the current seed. The parameter `seed` is not used."""
        self._node.reset(seed)

    def move(self, thing: int, pose: tuple[float, float, float]) -> None:
        """See Show.move(). While paused, the new poses are published at once."""
        super().move(thing, pose)
        self._node.moved()

    # ---- for the node ----

    def turn(self) -> float:
        """Called between steps: shows changes. Returns the seconds until it must be called again."""
        self._release_expired()
        mode = self._mode()
        if mode != self._known:  # ROS may have changed it
            self._known = mode
            self._marks.clear()
            self.has_changed(note="")
        self._show()
        return max(0.0, self._next_frame - time.monotonic()) if self._changed else math.inf

    def has_changed(self, note: str | None = None) -> None:
        """Requests a new frame. `note` is the reason why the world stands still; None: unchanged."""
        self._changed = True
        if note is not None:
            self._note = note

    def on_world_reset(self) -> None:
        """Called after a reset or a restore: robots are no longer driven by the page."""
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
        # The parameter may be infinity, which means the same as 0, and which JSON can't represent.
        return paused, speed if math.isfinite(speed) else 0.0, times["step"] + times["publish"]


def open_window(node: StageNode, wake: Callable[[Callable[[], None]], None], port: int) -> tuple[NodeRun, Server]:
    """Serves the page to this machine.

    Args:
        node: the node whose world is shown.
        wake: see NodeRun.
        port: the port; 0: any free port.

    Raises:
        StageError: the port can't be opened, or the package websockets is missing.
    """
    run = NodeRun(node, wake)
    return run, Server(node.world, port=port, run=run).start()
