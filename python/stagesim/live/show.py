# SPDX-License-Identifier: GPL-2.0-or-later
"""The base class of runs: shows a world to viewers and takes orders from them."""

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
from .floor import pictures_of
from .scene import Frame, Scene, State, Wish, details_of, model_of, places_of, scans_of, sensors_of

MAX_SPEED = 1e6
MAX_STEPS = 1_000_000  #: max steps per order
MAX_ORDERS = 4096  #: max number of pending orders
_WINDOW = 1.0  # seconds over which rates are measured
_FRAME_FRACTION = 0.1  # max fraction of the time that is spent on frames
_ORDERS_SLICE = 0.006  # max seconds of orders between two steps


@dataclass
class _Driven:
    """A robot that a viewer drives, until the monotonic time `until`."""

    owner: Hashable
    fleet: Fleet
    until: float


class Show(ABC):
    """Shows a world and executes orders. Subclasses make the steps and determine their pace.

    All methods except for start(), stop() and order() are for orders, which are executed between two steps:
    `order(lambda run: run.reset(5))`, or `order(lambda run: run.world.model("r0").pose).result()`.

    Args:
        world: the world to show.
        frames: max number of frames per second.
    """

    def __init__(self, world: World, frames: float = 30.0) -> None:
        self.world = world
        self.scene = Scene(world)
        self._note = ""  # reason why the world stands still
        self._orders: queue.SimpleQueue[tuple[Callable[[Any], Any], Future[Any]]] = queue.SimpleQueue()
        self._over = threading.Event()  # set: orders are refused
        self._listeners: list[tuple[Callable[[Frame], None], Callable[[], bool]]] = []
        self._wishes: dict[Hashable, Wish] = {}
        self._driven: dict[int, _Driven] = {}
        self._marks: deque[tuple[float, float, float]] = deque()
        self._period, self._next_frame, self._changed = 1 / frames, 0.0, True

    # ---- any thread ----

    @abstractmethod
    def start(self) -> None:
        """Starts the run."""

    @abstractmethod
    def stop(self, patience: float | None = None) -> None:
        """Stops after the current step. Afterwards, other code can use the world.

        Args:
            patience: max seconds to wait for that step; None: no limit.
        """

    def order(self, do: Callable[[Show], Any]) -> Future[Any]:
        """Makes the run call do(run) soon, between two steps. The future gets its result or exception.

        If MAX_ORDERS orders are pending, the future gets a StageError; after the end of the run, a GoneError.
        """
        future: Future[Any] = Future()
        if self._orders.qsize() >= MAX_ORDERS:
            future.set_exception(StageError(f"found {MAX_ORDERS} orders that wait already, expected fewer"))
            return future
        self._orders.put((do, future))
        if self._over.is_set():
            self._refuse_orders()
        return future

    # ---- for orders ----

    def listen(self, listener: Callable[[Frame], None], is_wanted: Callable[[], bool]) -> None:
        """Adds a listener, which is called with each frame if is_wanted(), in the thread that makes the steps."""
        self._listeners.append((listener, is_wanted))

    def wish(self, owner: Hashable, wish: Wish | None) -> Wish | None:
        """Sets the data that a viewer wishes to see; None: it has gone, so its robots are released. Returns `wish`."""
        if wish is None:
            self._wishes.pop(owner, None)
            for thing in [t for t, driven in self._driven.items() if driven.owner == owner]:
                self._release(thing)
        else:
            self._wishes[owner] = wish
        return wish

    @abstractmethod
    def pause(self, on: bool) -> None:
        """Pauses the world or lets it run."""

    @abstractmethod
    def set_speed(self, speed: float) -> None:
        """Sets the simulated seconds per real second; 0: as fast as possible."""

    @abstractmethod
    def make_steps(self, count: int) -> None:
        """Makes `count` steps, then pauses."""

    @abstractmethod
    def reset(self, seed: int | None = None) -> None:
        """Resets the world with the seed; None: with the current one."""

    def move(self, thing: int, pose: tuple[float, float, float]) -> None:
        """Moves a thing to the pose x, y (metres), heading (radians) in the world frame."""
        if not self._thing(thing).movable:
            raise ValueError(f"{printable(self._thing(thing).name)!r} is not to be moved")
        self._model(thing).global_pose = _finite(pose)

    def drive(self, owner: Hashable, thing: int, velocity: tuple[float, float, float],
              hold: float = 0.6) -> None:
        """Drives a robot for a short time, overriding its controller. Repeat it until the robot is released.

        Args:
            owner: the viewer that drives it.
            thing: id of the robot.
            velocity: forwards, to the left (m/s), turning (rad/s). All 0 releases the robot.
            hold: seconds of real time after which the robot is released.
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
        """Subscribes to the sensors of a thing, so that they work from now on."""
        for sensor in sensors_of(self._model(thing)):
            if not sensor.subscribers:
                sensor.subscribe()

    # ---- orders ----

    def _process_orders(self, wait: float = 0.0) -> None:
        """Executes pending orders; waits up to `wait` seconds for the first one.

        It ends after _ORDERS_SLICE, so that clients that give orders without pause don't stop the steps.
        """
        try:
            do, future = self._orders.get(timeout=wait) if wait > 0 else self._orders.get_nowait()
            end = time.monotonic() + _ORDERS_SLICE
            self._execute_order(do, future)
            while time.monotonic() < end:
                self._execute_order(*self._orders.get_nowait())
        except queue.Empty:
            pass

    def _execute_order(self, do: Callable[[Any], Any], future: Future[Any]) -> None:
        if not future.set_running_or_notify_cancel():
            return
        try:
            future.set_result(do(self))
        except Exception as error:  # the future passes it to the client
            future.set_exception(error)
        self._changed = True

    def _end(self) -> None:
        """Refuses pending and further orders."""
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

    def _release_expired(self) -> None:
        now = time.monotonic()
        for thing in [t for t, driven in self._driven.items() if driven.until < now]:
            self._release(thing)

    def _release(self, thing: int) -> None:
        """Stops driving the robot; its controller, if it has one, takes over."""
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
        self._next_frame = now + max(self._period, took / _FRAME_FRACTION)

    def _frame(self) -> Frame:
        if self.world._core.scene_key() != self.scene.key:
            self.scene = Scene(self.world, self.scene)
        places, stalled = places_of(self.world, self.scene)
        wishes = list(self._wishes.values())
        details = {wish.chosen: details_of(self.world, self.scene, wish.chosen) for wish in wishes
                   if wish.chosen is not None and wish.chosen in self.scene.index}
        return Frame(self.scene, self.state(), places, stalled,
                     scans_of(self.world, self.scene, wishes), details, pictures_of(self.world),
                     self.world._core.glows())

    def state(self) -> State:
        """Returns the current state of the run."""
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
        """Returns whether the run is paused, its speed, and the seconds spent in steps so far."""


def checked_speed(speed: float) -> float:
    """Returns the speed. Raises ValueError unless it is 0, or 0.001 to MAX_SPEED."""
    if not (speed == 0 or 1e-3 <= speed <= MAX_SPEED):
        raise ValueError(f"found the speed {speed}, expected 0 or 0.001 to 1000000")
    return float(speed)


def checked_count(count: int) -> int:
    """Returns the number of steps. Raises ValueError unless it is 1 to MAX_STEPS."""
    if not 1 <= count <= MAX_STEPS:
        raise ValueError(f"found {count} steps, expected 1 to {MAX_STEPS}")
    return count


def _finite(values: tuple[float, float, float]) -> tuple[float, float, float]:
    if not all(math.isfinite(value) for value in values):
        raise ValueError(f"found {values}, expected finite numbers")
    return values
