# SPDX-License-Identifier: GPL-2.0-or-later
"""A world that is shown to many and takes orders from them, whatever makes its steps."""

from __future__ import annotations

import math
import queue
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import GoneError, StageError
from ..fleet import Fleet
from ..text import printable
from ..world import World
from .scene import Frame, Scene, State, Wish, details_of, model_of, places_of, rangers_of, scans_of

MOST_SPEED = 1e6
MOST_STEPS = 1_000_000  #: that may be asked for
MOST_ORDERS = 4096  #: that wait to be carried out
_WINDOW = 1.0  # seconds that rates are measured over
_SHARE = 0.1  # of the time may go into frames
_ORDERS_SLICE = 0.006  # seconds of orders before a step is looked at


@dataclass
class _Driven:
    """A robot that somebody drives."""

    owner: Hashable
    fleet: Fleet
    until: float


class Show(ABC):
    """A world that is shown and operated. Who makes its steps is a subclass's business, and at what pace.

    All methods but start(), stop() and order() are for orders, which are carried out between two steps:
    `order(lambda run: run.reset(5))`, or `order(lambda run: run.world.model("r0").pose).result()`.

    Args:
        world: what runs.
        frames: that are shown in a second, at most.
    """

    def __init__(self, world: World, frames: float = 30.0) -> None:
        self.world = world
        self.scene = Scene(world)
        self._note = ""  # why it stands still, if there is a reason
        self._orders: queue.SimpleQueue[tuple[Callable[[Any], Any], Future[Any]]] = queue.SimpleQueue()
        self._over = threading.Event()  # no orders are taken any more
        self._listeners: list[tuple[Callable[[Frame], None], Callable[[], bool]]] = []
        self._wishes: dict[Hashable, Wish] = {}
        self._driven: dict[int, _Driven] = {}
        self._marks: deque[tuple[float, float, float]] = deque()
        self._period, self._next_frame, self._changed = 1 / frames, 0.0, True

    # ---- from anywhere ----

    @abstractmethod
    def start(self) -> None:
        """Begins."""

    @abstractmethod
    def stop(self, patience: float | None = None) -> None:
        """Ends after the step that is being made. The world can be used by others then.

        Args:
            patience: seconds to wait for that step at most; None: as long as it takes.
        """

    def order(self, do: Callable[[Show], Any]) -> Future[Any]:
        """Has do(run) called soon, between two steps. What it returns or raises is in the future.

        If MOST_ORDERS wait already, the future has a StageError.
        """
        future: Future[Any] = Future()
        if self._orders.qsize() >= MOST_ORDERS:
            future.set_exception(StageError(f"found {MOST_ORDERS} orders that wait already, expected fewer"))
            return future
        self._orders.put((do, future))
        if self._over.is_set():
            self._refuse_orders()
        return future

    # ---- in orders ----

    def listen(self, listener: Callable[[Frame], None], is_wanted: Callable[[], bool]) -> None:
        """From now on calls it, where steps are made, with each frame that is_wanted() asks for."""
        self._listeners.append((listener, is_wanted))

    def wish(self, owner: Hashable, wish: Wish | None) -> Wish | None:
        """What the owner wants to see; None: it has gone, and drives no robot any more. Returns it."""
        if wish is None:
            self._wishes.pop(owner, None)
            for thing in [t for t, driven in self._driven.items() if driven.owner == owner]:
                self._release(thing)
        else:
            self._wishes[owner] = wish
        return wish

    @abstractmethod
    def pause(self, on: bool) -> None:
        """Stops, or goes on."""

    @abstractmethod
    def set_speed(self, speed: float) -> None:
        """Simulated seconds for each real one; 0: as many as can be."""

    @abstractmethod
    def make_steps(self, count: int) -> None:
        """So many, and then pauses."""

    @abstractmethod
    def reset(self, seed: int | None = None) -> None:
        """Begins anew; None: with the same seed."""

    def move(self, thing: int, pose: tuple[float, float, float]) -> None:
        """Puts a thing somewhere else: x, y, heading in the frame of the world."""
        if not self._thing(thing).movable:
            raise ValueError(f"{printable(self._thing(thing).name)!r} is not to be moved")
        self._model(thing).global_pose = _finite(pose)

    def drive(self, owner: Hashable, thing: int, velocity: tuple[float, float, float],
              hold: float = 0.6) -> None:
        """Drives a robot for a short while, over what its controller says; to be repeated until it is let go.

        Args:
            owner: who does it.
            thing: the robot.
            velocity: forwards, to the left (m/s), turning (rad/s). All 0 lets it go.
            hold: seconds of real time.
        """
        if not self._thing(thing).robot:
            raise ValueError(f"{printable(self._thing(thing).name)!r} can't drive")
        velocity = _finite(velocity)
        driven = self._driven.get(thing)
        if not any(velocity):
            if driven is not None:
                self._release(thing)
            return
        if driven is None:
            driven = self._driven[thing] = _Driven(owner, self.world.fleet([self._model(thing)]), 0)
        driven.owner, driven.until = owner, time.monotonic() + hold
        driven.fleet.cmd[:] = velocity

    def sense(self, thing: int) -> None:
        """Lets the rangers of a thing work from now on, as a controller that subscribes to them does."""
        for ranger in rangers_of(self._model(thing)):
            if not ranger.subscribers:
                ranger.subscribe()

    # ---- orders, and their end ----

    def _take_orders(self, wait: float = 0.0) -> None:
        """Carries out those that there are; waits so long for the first one (seconds).

        It takes a slice of time at most, or clients that give orders without end would leave none for steps.
        """
        try:
            do, future = self._orders.get(timeout=wait) if wait > 0 else self._orders.get_nowait()
            end = time.monotonic() + _ORDERS_SLICE
            self._carry_out(do, future)
            while time.monotonic() < end:
                self._carry_out(*self._orders.get_nowait())
        except queue.Empty:
            pass

    def _carry_out(self, do: Callable[[Any], Any], future: Future[Any]) -> None:
        if not future.set_running_or_notify_cancel():
            return
        try:
            future.set_result(do(self))
        except Exception as error:  # whoever gave the order is told
            future.set_exception(error)
        self._changed = True

    def _end(self) -> None:
        """From now on orders are refused."""
        self._over.set()
        self._refuse_orders()

    def _refuse_orders(self) -> None:
        while True:
            try:
                _, future = self._orders.get_nowait()
            except queue.Empty:
                return
            if not future.done():
                future.set_exception(GoneError("the run has ended"))

    # ---- driving ----

    def _release_old(self) -> None:
        now = time.monotonic()
        for thing in [t for t, driven in self._driven.items() if driven.until < now]:
            self._release(thing)

    def _release(self, thing: int) -> None:
        """Stops the robot; its controller, if it has one, goes on."""
        driven = self._driven.pop(thing)
        driven.fleet.cmd[:] = np.nan
        if thing in self.scene.index:
            try:
                self._model(thing).drive(0.0)
            except GoneError:
                pass

    def _thing(self, thing: int) -> Any:
        index = self.scene.index.get(thing)
        if index is None:
            raise GoneError(f"there is no thing number {thing}")
        return self.scene.things[index]

    def _model(self, thing: int) -> Any:
        return model_of(self.world, self._thing(thing).id)

    # ---- frames ----

    def _show(self) -> None:
        now = time.monotonic()
        if not self._changed or now < self._next_frame:
            return
        self._changed = False
        listeners = [listener for listener, is_wanted in self._listeners if is_wanted()]
        if not listeners:
            return
        frame = self._frame()
        for listener in listeners:
            listener(frame)
        took = time.monotonic() - now
        self._next_frame = now + max(self._period, took / _SHARE)

    def _frame(self) -> Frame:
        if self.world._core.scene_key() != self.scene.key:
            self.scene = Scene(self.world, self.scene)
        places, stalled = places_of(self.world, self.scene)
        wishes = list(self._wishes.values())
        details = {wish.chosen: details_of(self.world, self.scene, wish.chosen) for wish in wishes
                   if wish.chosen is not None and wish.chosen in self.scene.index}
        return Frame(self.scene, self.state(), places, stalled,
                     scans_of(self.world, self.scene, wishes), details)

    def state(self) -> State:
        """How it goes on now."""
        now, world = time.monotonic(), self.world
        paused, speed, in_steps = self._pace()
        self._marks.append((now, world.time, in_steps))
        while len(self._marks) > 2 and now - self._marks[1][0] >= _WINDOW:
            self._marks.popleft()
        began, time_then, busy_then = self._marks[0]
        passed = now - began
        rate = (world.time - time_then) / passed if passed > 0 else 0.0
        busy = (in_steps - busy_then) / passed if passed > 0 else 0.0
        return State(world.time, world.steps, world.seed, paused, speed, rate, busy, self._note)

    @abstractmethod
    def _pace(self) -> tuple[bool, float, float]:
        """Whether it is paused, its speed, and the seconds that have gone into steps so far."""


def checked_speed(speed: float) -> float:
    """The speed; ValueError if it can't be one."""
    if not (speed == 0 or 1e-3 <= speed <= MOST_SPEED):
        raise ValueError(f"found the speed {speed}, expected 0 or 0.001 to 1000000")
    return float(speed)


def checked_count(count: int) -> int:
    """The number of steps; ValueError if nobody may ask for so many."""
    if not 1 <= count <= MOST_STEPS:
        raise ValueError(f"found {count} steps, expected 1 to {MOST_STEPS}")
    return count


def _finite(values: tuple[float, float, float]) -> tuple[float, float, float]:
    if not all(math.isfinite(value) for value in values):
        raise ValueError(f"found {values}, expected finite numbers")
    return values
