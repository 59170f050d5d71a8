# SPDX-License-Identifier: GPL-2.0-or-later
"""The node as a lifecycle node: clients say when it loads a world, and when the world runs."""

from __future__ import annotations

import gc
from typing import Any, Callable, Mapping

import rclpy
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter

from ..errors import StageError, WorldError
from ..text import printable
from ..world import World
from .belongings import Belongings
from .node import StageNode
from .parameters import declare
from .topics import RATES

SUCCESS, FAILURE, ERROR = (TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE,
                           TransitionCallbackReturn.ERROR)
WAIT = 0.1  #: seconds of real time for which the node waits for messages while no world runs


def text_of(error: BaseException) -> str:
    """An error in one line, with its type unless that is one which messages to users have."""
    expected = (WorldError, StageError, ValueError, OSError, ModuleNotFoundError)
    text = " ".join(str(error).split())
    return printable(text if isinstance(error, expected) else f"{type(error).__name__}: {text}")


class LifecycleStageNode(StageNode, LifecycleNode):
    """A StageNode whose world comes and goes by the transitions of ROS's lifecycle.

    Args:
        world_of: returns the name in the log, and the world, for the parameter `world_file`.
        name: name of the node.
        parameters: see StageNode.
        first: first value of the parameter `world_file`; empty: that of the parameters.
        gui: see StageNode.
        loaded: called with the node and the name of the world after each transition configure.

    Attributes:
        is_loaded: True in the states inactive and active: there is a world.

    Raises:
        ValueError: a parameter has an invalid value.
    """

    def __init__(self, world_of: Callable[[str], tuple[str, World]], name: str = "stage",
                 parameters: Mapping[str, Any] | None = None, first: str = "", gui: int | None = None,
                 loaded: Callable[[StageNode, str], None] = lambda *_: None) -> None:
        self._world_of, self._first, self._gui, self._loaded = world_of, first, gui, loaded
        self.is_loaded, self._has_ended = False, False
        self._failed: Exception | None = None
        super().__init__(None, name, parameters)

    def _start(self, world: World | None, gui: int | None) -> None:
        """Declares parameters; a transition loads the world."""
        self.silent = True
        declare(self, locked=lambda: self.is_loaded)
        declare(self, RATES)
        if self._first:
            self.set_parameters([Parameter("world_file", value=self._first)])

    # ---- transitions ----

    def on_configure(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Loads the world and makes publishers. On a failure, one line says why, and nothing is left."""
        self._belongings = Belongings(self)
        self.is_loaded = True
        try:
            file, self.world = self._world_of(self.value("world_file"))
            self._load(self.world, self._gui)
            self._loaded(self, file)
        except Exception as error:
            self.get_logger().error(f"not configured: {text_of(error)}")
            self._unload()
            return FAILURE
        return SUCCESS

    def on_activate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Lets the world run, unless it is paused, and publishes its state."""
        self.silent = False
        self._pace.change(running=not self.paused)
        self.publish(everything=True)
        return SUCCESS

    def on_deactivate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Stops the world. Fails if an error in a step is the reason."""
        self.silent = True
        self._pace.change(running=False)
        return SUCCESS if self._failed is None else ERROR

    def on_cleanup(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Frees the world and all that belongs to it."""
        self._unload()
        return SUCCESS

    def on_shutdown(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Ends run(), which may be in the middle of the world's turn: close() frees the world."""
        self.silent, self._has_ended = True, True
        return SUCCESS

    def on_error(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Frees the world, so that the node can be configured again."""
        self.silent, self._failed = True, None
        self._unload()
        return SUCCESS

    def _unload(self) -> None:
        """Destroys all that belongs to the world, and frees it."""
        if not self.is_loaded:
            return
        self._stop()
        self._belongings.release()
        if hasattr(self, "world"):
            self.world.close()
            del self.world
        if hasattr(self, "team"):
            del self.team
        self.is_loaded, self.url, self._snapshot = False, "", None
        gc.collect()  # robots and their topics refer to each other

    # ---- time ----

    def run(self, duration: float = float("inf")) -> None:
        """Serves ROS until it is shut down, by a transition too, or the world's time reaches `duration` (seconds)."""
        while rclpy.ok() and not self._has_ended:
            if self.silent:
                self._answer(WAIT)
                continue
            try:
                self._turn()
            except Exception as error:
                if not rclpy.ok():
                    raise
                self._fail(error)
            if self.silent:  # a transition, in which the world may be gone
                continue
            if self.world.time >= duration:
                return
            if self.world.ended:
                self.get_logger().info("the world has ended")
                self.trigger_deactivate()
        if self._has_ended and rclpy.ok():
            self._answer(WAIT)  # sends the response to the transition

    def _fail(self, error: Exception) -> None:
        """Goes from the state active to unconfigured by the transition that ROS has for errors."""
        self.get_logger().error(f"a step has failed: {text_of(error)}")
        self._failed = error
        self.trigger_deactivate()

    def close(self) -> None:
        """Destroys the node and frees the world."""
        super().close()  # ends the executor before what it serves, which it can't forget after ROS was shut down
        self._state_machine.destroy_when_not_in_use()  # whose services other nodes would find until it is collected
        if self.is_loaded and hasattr(self, "world"):
            self.world.close()
