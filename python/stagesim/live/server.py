# SPDX-License-Identifier: GPL-2.0-or-later
"""The server, which runs a world and shows it in browsers."""

from __future__ import annotations

import asyncio
import atexit
import socket
import threading
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING

from ..errors import StageError
from ..world import World
from .run import Run
from .show import Show

if TYPE_CHECKING:
    from .bridge import Bridge

_PATIENCE = 5.0  #: max seconds that the exit of the program waits for the step of each server
_running: set[Server] = set()


class Server:
    """Runs a world in its own thread, unless `run` is given, and shows it in browsers.

    It runs from start() to stop(), or in a `with` statement; the exit of the program stops it, too. Meanwhile no
    other code may use the world, except through orders to `run`: see `Run.order`.

    Args:
        world: the world to run.
        host: the address to serve at. Only this machine can reach the default one.
        port: port of the page; 0: any free port; None: no page.
        foxglove: port of the server for Foxglove; 0: any free port; None: no such server.
        speed: simulated seconds per real second; 0: as fast as possible; None: the speed in the world file, or
            else 1.
        paused: True: start paused.
        control: called with the world before each step, for example to control all robots.
        run: an object that makes the steps in place of this server's thread; `speed`, `paused` and `control` are
            then ignored.

    Raises:
        StageError: a port can't be opened, or a package is missing.
    """

    def __init__(self, world: World, *, host: str = "127.0.0.1", port: int | None = 0,
                 foxglove: int | None = None, speed: float | None = None, paused: bool = False,
                 control: Callable[[World], object] | None = None, run: Show | None = None) -> None:
        if speed is None:
            speed = world._core.speedup if world._core.speedup > 0 else 1.0
        self.run: Show = run or Run(world, speed=speed, paused=paused, control=control)
        self.url = ""  #: URL of the page; empty: no page
        self.foxglove_url = ""  #: URL for Foxglove; empty: none
        self._host, self._port, self._foxglove_port = host, port, foxglove
        self._bridge: Bridge | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread: threading.Thread | None = None

    def start(self) -> Server:
        """Starts to serve and to run; returns this object."""
        try:
            if self._port is not None:
                self._start_page()
            if self._foxglove_port is not None:
                self._start_bridge()
        except BaseException:
            self.stop()
            raise
        _running.add(self)
        self.run.start()
        return self

    def stop(self) -> None:
        """Stops serving and running. The world stays in the state after its last step."""
        self._stop(None)

    def _stop(self, patience: float | None) -> None:
        """Stops both; waits up to `patience` seconds each for the world's step and for the page."""
        _running.discard(self)
        self.run.stop(patience)
        if self._bridge is not None:
            self._bridge.close()
            self._bridge = None
        if self._thread is not None and self._loop is not None:
            self._loop.call_soon_threadsafe(self._done.set)
            self._thread.join(patience)
            self._thread = None

    def __enter__(self) -> Server:
        return self.start()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.stop()

    # ---- the page ----

    def _start_page(self) -> None:
        try:
            from .web import Web
        except ModuleNotFoundError as error:
            raise StageError(f"there is no package {error.name!r}; try pip install \"stagesim[live]\"") from None
        self._web = Web(self.run, self._host)
        ready = threading.Event()
        self._error: OSError | None = None
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve(ready)), daemon=True,
                                        name="stagesim.live page")
        self._thread.start()
        ready.wait()
        if self._error is not None:
            self._thread.join()
            self._thread = None
            raise StageError(f"can't serve at {_at(self._host, self._port or 0)}: {self._error.strerror}")

    async def _serve(self, ready: threading.Event) -> None:
        self._loop, self._done = asyncio.get_running_loop(), asyncio.Event()
        try:
            server = await self._web.open(self._host, self._port or 0)
            port = next(iter(server.sockets)).getsockname()[1]
            token = self._web.door.token
            self.url = f"http://{_at(_shown(self._host), port)}/" + (f"?token={token}" if token else "")
        except OSError as error:
            self._error = error
            return
        finally:
            ready.set()
        await self._done.wait()
        server.close()
        await server.wait_closed()

    # ---- Foxglove ----

    def _start_bridge(self) -> None:
        try:
            from .bridge import Bridge
        except ModuleNotFoundError as error:
            raise StageError(
                f"there is no package {error.name!r}; try pip install \"stagesim[foxglove]\"") from None
        self._bridge = Bridge(self.run, self._host, self._foxglove_port or 0)
        self.foxglove_url = f"ws://{_at(_shown(self._host), self._bridge.port)}"


@atexit.register
def _stop_all() -> None:
    """Stops all servers when the program exits."""
    for server in list(_running):
        server._stop(_PATIENCE)


def _shown(host: str) -> str:
    """The host in URLs: the name of this machine if all of its addresses are served."""
    return socket.gethostname() if host in ("0.0.0.0", "::", "") else host


def _at(host: str, port: int) -> str:
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
