# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs a world in its own thread, at a given speed, with orders from other threads."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable

from ..errors import GoneError, StageError
from ..pace import Pace
from ..world import World
from .show import MAX_STEPS, Show, checked_count, checked_speed

_SLICE = 0.012  # approximate max duration of steps between two checks for orders, seconds
_LAG = 0.25  # max delay in real time that the world catches up, seconds


class Run(Show):
    """Runs a world in its own thread, which also executes the orders. No other code may use the world meanwhile.

    Args:
        world: the world to run.
        speed: simulated seconds per real second; 0: as fast as possible.
        paused: True: start paused.
        control: called with the world before each step, for example to control all robots.
        frames: max number of frames per second.
    """

    def __init__(self, world: World, *, speed: float = 1.0, paused: bool = False,
                 control: Callable[[World], object] | None = None, frames: float = 30.0) -> None:
        super().__init__(world, frames)
        self._control = control
        self._speed = checked_speed(speed)
        self._paused = paused
        self._steps_asked = 0
        self._quit_minded = True
        self._step_cost = math.inf  # seconds per step; infinity: unknown
        self._busy = 0.0
        self._clock = Pace(self._speed, not paused, _LAG)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._work, name="stagesim.live", daemon=True)

    # ---- any thread ----

    def start(self) -> None:
        """Starts the thread."""
        self._thread.start()

    def stop(self, patience: float | None = None) -> None:
        """Stops after the current step. Afterwards, other code can use the world.

        Args:
            patience: max seconds to wait for that step; None: no limit.
        """
        self._stopping.set()
        self.order(lambda run: None)  # wakes the thread
        if self._thread.is_alive():
            self._thread.join(patience)
        self._end()

    # ---- for orders ----

    def pause(self, on: bool) -> None:
        """Pauses, or goes on, even past the file's quit time or after a controller asked to quit."""
        if not on:
            self._note = ""
            if self.world.ended:
                self.world._core.cancel_quit()
            self._quit_minded = not self._is_over()
        self._paused = on
        self._steps_asked = 0
        self._marks.clear()
        self._clock.change(running=not on)

    def set_speed(self, speed: float) -> None:
        """Sets the simulated seconds per real second; 0: as fast as possible."""
        self._speed = checked_speed(speed)
        self._clock.change(speed=self._speed)

    def make_steps(self, count: int) -> None:
        """Makes `count` steps, then pauses."""
        count = checked_count(count)
        asked = self._steps_asked
        self.pause(False)  # allows steps past the quit time of the file
        self.pause(True)
        self._steps_asked = min(asked + count, MAX_STEPS)

    def reset(self, seed: int | None = None) -> None:
        """Resets the world with the seed; None: with the current one."""
        self.world.reset(seed)
        self._driven.clear()
        self._marks.clear()
        self._steps_asked, self._quit_minded, self._note = 0, True, ""
        self._clock.begin()

    # ---- the thread ----

    def _work(self) -> None:
        self._clock.begin()
        try:
            while not self._stopping.is_set():
                self._process_orders(self._time_to_wait())
                if not self._stopping.is_set():
                    self._advance()
                    self._show()
        except GoneError as error:  # the world was closed, or a controller has deleted it
            logging.getLogger("stagesim").error("%s", error)
        finally:
            self._end()

    def _time_to_wait(self) -> float:
        """Max seconds to wait for an order until a step or a frame is due."""
        now = time.monotonic()
        longest = max(0.0, self._next_frame - now) if self._changed else 0.2
        return 0.0 if self._steps_asked else min(longest, self._clock.wait(self.world.dt))

    def _advance(self) -> None:
        self._release_expired()
        count = self._steps_due()
        if count == 0:
            return
        is_asked = self._steps_asked > 0
        count = max(1, min(count, int(_SLICE / max(self._step_cost, 1e-7))))
        began = time.monotonic()
        made = self._step(count)
        took = time.monotonic() - began
        self._busy += took
        if made:
            self._step_cost = took / made
            self._changed = True
        if is_asked:
            self._steps_asked = max(0, self._steps_asked - made)
        else:
            self._clock.made(made * self.world.dt)
        if made < count and not self._paused:
            self._stop_with("a controller wants to quit" if self.world.ended else "")
        elif self._quit_minded and self._is_over():
            self._quit_minded = False
            self._stop_with("the quit time of the world file has come")

    def _step(self, count: int) -> int:
        """Makes up to `count` steps; returns their number. An exception of a controller pauses the run."""
        made = 0
        try:
            if self._control is None:
                return self.world.step(count)
            while made < count:
                self._control(self.world)
                if self.world.step() == 0:
                    break
                made += 1
        except Exception as error:  # thrown by a controller or by control()
            if _is_gone(self.world):
                raise
            if not isinstance(error, StageError):
                logging.getLogger("stagesim").exception("a controller in Python has failed")
            self._stop_with(f"{type(error).__name__}: {error}")
        return made

    def _steps_due(self) -> int:
        if self._steps_asked or self._paused:
            return self._steps_asked
        if self._clock.is_unlimited:
            return self._steps_to_quit(1_000_000)
        return self._steps_to_quit(self._clock.steps_due(self.world.dt))

    def _steps_to_quit(self, count: int) -> int:
        if not self._quit_minded or self.world.quit_time is None:
            return count
        left = math.ceil((self.world.quit_time - self.world.time) / self.world.dt - 1e-9)
        return min(count, max(1, left)) if count else 0

    def _is_over(self) -> bool:
        return self.world.quit_time is not None and self.world.time >= self.world.quit_time

    def _stop_with(self, note: str) -> None:
        self._paused, self._steps_asked, self._note, self._changed = True, 0, note, True
        self._clock.change(running=False)
        self._marks.clear()

    def _pace(self) -> tuple[bool, float, float]:
        return self._paused and not self._steps_asked, self._speed, self._busy


def _is_gone(world: World) -> bool:
    """True if the world is closed or deleted; False if that is unknown because another thread is using it."""
    try:
        return not world._core.is_open
    except StageError:
        return False
