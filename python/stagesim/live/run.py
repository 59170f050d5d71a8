# SPDX-License-Identifier: GPL-2.0-or-later
"""A world that runs in a thread of its own, at a pace, and takes orders from many."""

from __future__ import annotations

import logging
import math
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import GoneError, StageError
from ..fleet import Fleet
from ..world import World
from .scene import Frame, Scene, State, Wish, details_of, model_of, places_of, rangers_of, scans_of

MOST_SPEED = 1e6
_SLICE = 0.012  # seconds of steps before orders are looked at
_LAG = 0.25  # seconds that it makes up for; what is lost beyond is lost
_WINDOW = 1.0  # seconds that rates are measured over
_SHARE = 0.1  # of the time may go into frames


@dataclass
class _Driven:
    """A robot that somebody drives."""

    owner: Hashable
    fleet: Fleet
    until: float


class Run:
    """A world in a thread of its own. Nobody else may use the world while it runs.

    All methods but start(), stop() and order() are for orders, which are carried out between two steps:
    `order(lambda run: run.reset(5))`, or `order(lambda run: run.world.model("r0").pose).result()`.

    Args:
        world: what runs.
        speed: simulated seconds for each real one, 0: as many as can be.
        paused: wait for somebody to let it run.
        control: called before each step, with the world: a controller of all robots, say.
        frames: that are shown in a second, at most.
    """

    def __init__(self, world: World, *, speed: float = 1.0, paused: bool = False,
                 control: Callable[[World], object] | None = None, frames: float = 30.0) -> None:
        self.world = world
        self._control = control
        self.scene = Scene(world)
        self._speed = checked_speed(speed)
        self._paused, self._note = paused, ""
        self._orders: queue.SimpleQueue[tuple[Callable[[Run], Any], Future[Any]]] = queue.SimpleQueue()
        self._listeners: list[tuple[Callable[[Frame], None], Callable[[], bool]]] = []
        self._wishes: dict[Hashable, Wish] = {}
        self._driven: dict[int, _Driven] = {}
        self._steps_asked = 0
        self._quit_minded = True
        self._step_cost = math.inf  # seconds; not known yet
        self._busy = 0.0
        self._marks: deque[tuple[float, float, float]] = deque()
        self._origin = (time.monotonic(), world.time)
        self._period, self._next_frame, self._changed = 1 / frames, 0.0, True
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._work, name="stagesim.live", daemon=True)

    # ---- from anywhere ----

    def start(self) -> None:
        """Begins."""
        self._thread.start()

    def stop(self) -> None:
        """Ends after the step that is being made. The world can be used by others then."""
        self._stopping.set()
        self.order(lambda run: None)
        if self._thread.is_alive():
            self._thread.join()
        self._refuse_orders()

    def order(self, do: Callable[[Run], Any]) -> Future[Any]:
        """Lets the thread call do(run) soon. What it returns or raises is in the future."""
        future: Future[Any] = Future()
        self._orders.put((do, future))
        if self._stopping.is_set() and not self._thread.is_alive():
            self._refuse_orders()
        return future

    # ---- in orders ----

    def listen(self, listener: Callable[[Frame], None], is_wanted: Callable[[], bool]) -> None:
        """From now on calls it, in this thread, with each frame that is_wanted() asks for."""
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

    def pause(self, on: bool) -> None:
        """Stops, or goes on: also past the quit time of the file, and if a controller wanted an end."""
        if not on:
            self._note = ""
            if self.world.ended:
                self.world._core.cancel_quit()
            self._quit_minded = not self._is_over()
        self._paused = on
        self._steps_asked = 0
        self._marks.clear()
        self._rebase()

    def set_speed(self, speed: float) -> None:
        """Simulated seconds for each real one; 0: as many as can be."""
        self._speed = checked_speed(speed)
        self._rebase()

    def make_steps(self, count: int) -> None:
        """So many, and then pauses."""
        if not 1 <= count <= 1_000_000:
            raise ValueError(f"found {count} steps, expected 1 to 1000000")
        self.pause(False)
        self._paused, self._steps_asked = True, self._steps_asked + count

    def reset(self, seed: int | None = None) -> None:
        """Begins anew; None: with the same seed."""
        self.world.reset(seed)
        self._driven.clear()
        self._marks.clear()
        self._steps_asked, self._quit_minded, self._note = 0, True, ""
        self._rebase()

    def move(self, thing: int, pose: tuple[float, float, float]) -> None:
        """Puts a thing somewhere else: x, y, heading in the frame of the world."""
        if not self._thing(thing).movable:
            raise ValueError(f"{self._thing(thing).name!r} is not to be moved")
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
            raise ValueError(f"{self._thing(thing).name!r} can't drive")
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

    # ---- the thread ----

    def _work(self) -> None:
        try:
            while not self._stopping.is_set():
                self._take_orders()
                if not self._stopping.is_set():
                    self._advance()
                    self._show()
        except GoneError as error:  # somebody has closed the world, or a controller has deleted it
            logging.getLogger("stagesim").error("%s", error)
        finally:
            self._stopping.set()
            self._refuse_orders()

    def _take_orders(self) -> None:
        """Waits for the first one no longer than until there is something to do."""
        wait = self._time_to_wait()
        try:
            do, future = self._orders.get(timeout=wait) if wait > 0 else self._orders.get_nowait()
            while True:
                self._carry_out(do, future)
                do, future = self._orders.get_nowait()
        except queue.Empty:
            pass

    def _carry_out(self, do: Callable[[Run], Any], future: Future[Any]) -> None:
        if not future.set_running_or_notify_cancel():
            return
        try:
            future.set_result(do(self))
        except Exception as error:  # whoever gave the order is told
            future.set_exception(error)
        self._changed = True

    def _refuse_orders(self) -> None:
        while True:
            try:
                _, future = self._orders.get_nowait()
            except queue.Empty:
                return
            if not future.done():
                future.set_exception(GoneError("the run has ended"))

    def _time_to_wait(self) -> float:
        now = time.monotonic()
        longest = max(0.0, self._next_frame - now) if self._changed else 0.2
        if self._steps_asked or (not self._paused and self._speed == 0):
            return 0.0
        if self._paused:
            return longest
        began, origin = self._origin
        due = began + (self.world.time + self.world.dt - origin) / self._speed
        return min(longest, max(0.0, due - now))

    def _advance(self) -> None:
        self._release_old()
        count = self._steps_due()
        if count == 0:
            return
        count = max(1, min(count, int(_SLICE / max(self._step_cost, 1e-7))))
        began = time.monotonic()
        made = self._step(count)
        took = time.monotonic() - began
        self._busy += took
        if made:
            self._step_cost = took / made
            self._changed = True
        self._steps_asked = max(0, self._steps_asked - made)
        if made < count and not self._paused:
            self._stop_with("a controller wants to quit" if self.world.ended else "")
        elif self._quit_minded and self._is_over():
            self._quit_minded = False
            self._stop_with("the quit time of the world file has come")

    def _step(self, count: int) -> int:
        """Returns how many were made."""
        made = 0
        try:
            if self._control is None:
                return self.world.step(count)
            while made < count:
                self._control(self.world)
                if self.world.step() == 0:
                    break
                made += 1
        except Exception as error:  # of a controller, or of control()
            if not self.world._core.is_open:
                raise
            if not isinstance(error, StageError):
                logging.getLogger("stagesim").exception("a controller in Python has failed")
            self._stop_with(f"{type(error).__name__}: {error}")
        return made

    def _steps_due(self) -> int:
        if self._steps_asked or self._paused:
            return self._steps_asked
        if self._speed == 0:
            return self._steps_to_quit(1_000_000)
        began, origin = self._origin
        wanted = origin + (time.monotonic() - began) * self._speed
        late = wanted - self.world.time
        if late > _LAG * self._speed + self.world.dt:
            self._rebase()
            late = self.world.dt
        return self._steps_to_quit(math.floor(late / self.world.dt + 1e-9))

    def _steps_to_quit(self, count: int) -> int:
        if not self._quit_minded or self.world.quit_time is None:
            return count
        left = math.ceil((self.world.quit_time - self.world.time) / self.world.dt - 1e-9)
        return min(count, max(1, left)) if count else 0

    def _is_over(self) -> bool:
        return self.world.quit_time is not None and self.world.time >= self.world.quit_time

    def _stop_with(self, note: str) -> None:
        self._paused, self._steps_asked, self._note, self._changed = True, 0, note, True
        self._marks.clear()

    def _rebase(self) -> None:
        self._origin = (time.monotonic(), self.world.time)

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
        self._marks.append((now, world.time, self._busy))
        while len(self._marks) > 2 and now - self._marks[1][0] >= _WINDOW:
            self._marks.popleft()
        began, time_then, busy_then = self._marks[0]
        passed = now - began
        rate = (world.time - time_then) / passed if passed > 0 else 0.0
        busy = (self._busy - busy_then) / passed if passed > 0 else 0.0
        return State(world.time, world.steps, world.seed, self._paused and not self._steps_asked,
                     self._speed, rate, busy, self._note)


def checked_speed(speed: float) -> float:
    """The speed; ValueError if it can't be one."""
    if not (speed == 0 or 1e-3 <= speed <= MOST_SPEED):
        raise ValueError(f"found the speed {speed}, expected 0 or 0.001 to 1000000")
    return float(speed)


def _finite(values: tuple[float, float, float]) -> tuple[float, float, float]:
    if not all(math.isfinite(value) for value in values):
        raise ValueError(f"found {values}, expected finite numbers")
    return values
