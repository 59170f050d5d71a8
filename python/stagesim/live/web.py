# SPDX-License-Identifier: GPL-2.0-or-later
"""The page, and what goes to and fro with it."""

from __future__ import annotations

import asyncio
import http
import ipaddress
import logging
import os
import secrets
import socket
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import Server as SocketServer
from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from ..errors import StageError
from .messages import LONGEST_ORDER, error_message, frame_message, order_of, places_words, scene_message
from .scene import Frame, Scene, Wish
from .show import Show

MOST_CLIENTS = 32
_PAGE = Path(__file__).parent / "page"
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
_POLICY = "default-src 'self'; connect-src 'self' ws: wss:; frame-ancestors 'none'; base-uri 'none'"


def is_loopback(host: str) -> bool:
    """Whether only programs of this machine can come there."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


class Door:
    """Who may come in.

    A page of somebody else's, open in a browser of this machine, must not reach the server: browsers say
    with Origin where a script came from. Nor may such a page's name be made to point here (DNS rebinding):
    Host has to be an address or a name of this machine.
    """

    def __init__(self, host: str) -> None:
        self.token = "" if is_loopback(host) else secrets.token_urlsafe(16)  #: empty: none is needed
        self._names = {"localhost", host.lower(), socket.gethostname().lower()}

    def refusal(self, request: Request) -> str:
        """Why the request is refused; empty: it is not."""
        hosts = request.headers.get_all("Host")
        if len(hosts) != 1 or not self._is_ours(hosts[0]):
            return "this is not the name of the server"
        origins = request.headers.get_all("Origin")
        if origins and (len(origins) > 1 or not self._is_same(origins[0], hosts[0])):
            return "pages of other sites may not come here"
        return ""

    def knows(self, request: Request) -> bool:
        """Whether it has the token, if one is needed."""
        given = parse_qs(urlsplit(request.path).query).get("token", [""])[0]
        return not self.token or secrets.compare_digest(given.encode(), self.token.encode())

    def _is_ours(self, host: str) -> bool:
        try:
            name = (urlsplit(f"//{host}").hostname or "").lower()
        except ValueError:
            return False
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return name in self._names or name.removesuffix(".local") in self._names
        return True

    @staticmethod
    def _is_same(origin: str, host: str) -> bool:
        return origin.lower() in (f"http://{host}".lower(), f"https://{host}".lower())


class Client:
    """Somebody who looks. Frames that come while one is being sent are left out, but for the last."""

    def __init__(self, connection: ServerConnection) -> None:
        self.connection = connection
        self.wish = Wish(all_scans=True)
        self.latest: tuple[Frame, bytes] | None = None
        self.news = asyncio.Event()
        self.scene: Scene | None = None  # that was sent last

    async def send_frames(self, world: str, dt: float) -> None:
        """Until the connection ends."""
        while True:
            await self.news.wait()
            self.news.clear()
            assert self.latest is not None
            frame, places = self.latest
            if frame.scene is not self.scene:
                await self.connection.send(scene_message(frame.scene, self._shapes(frame.scene), world, dt))
                self.scene = frame.scene
            await self.connection.send(frame_message(frame, places, self.wish))

    def _shapes(self, scene: Scene) -> int:
        """How many of the scene's table it has already."""
        return self.scene.shape_count if self.scene and self.scene.shapes is scene.shapes else 0


class Web:
    """Serves the page and shows it a run. All but show() belongs to the event loop."""

    def __init__(self, run: Show, host: str) -> None:
        self.door = Door(host)
        self._run = run
        self._world, self._dt = os.path.basename(run.world._core.name), run.world.dt
        self._clients: set[Client] = set()
        self._files = {f"/{file.name}": file for file in sorted(_PAGE.iterdir())}
        self._files["/"] = _PAGE / "index.html"
        self._loop: asyncio.AbstractEventLoop | None = None

    async def open(self, host: str, port: int) -> SocketServer:
        """Begins to serve. Raises OSError if the port can't be had."""
        self._loop = asyncio.get_running_loop()
        logger = logging.getLogger("stagesim.live")
        logger.setLevel(logging.CRITICAL)  # what clients do wrong is nobody's business here
        server = await serve(self._serve, host, port, process_request=self._request, logger=logger,
                             max_size=LONGEST_ORDER, max_queue=8, compression=None, server_header=None)
        self._run.order(lambda run: run.listen(self.show, lambda: bool(self._clients)))
        return server

    def show(self, frame: Frame) -> None:
        """Called by the run."""
        if self._loop is not None:
            try:
                self._loop.call_soon_threadsafe(self._hand_out, frame)
            except RuntimeError:  # the loop has just been closed
                pass

    def _hand_out(self, frame: Frame) -> None:
        latest = (frame, places_words(frame))
        for client in self._clients:
            client.latest = latest
            client.news.set()

    # ---- plain requests ----

    def _request(self, connection: ServerConnection, request: Request) -> Response | None:
        """None lets a connection become a WebSocket."""
        refusal = self.door.refusal(request)
        if refusal:
            return connection.respond(http.HTTPStatus.FORBIDDEN, refusal + "\n")
        path = urlsplit(request.path).path
        if path == "/live":
            if not self.door.knows(request):
                return connection.respond(http.HTTPStatus.FORBIDDEN, "the token is missing\n")
            if len(self._clients) >= MOST_CLIENTS:
                return connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, "too many look already\n")
            return None
        file = self._files.get(path)
        if file is None:
            return connection.respond(http.HTTPStatus.NOT_FOUND, "there is no such page\n")
        return _response(file)

    # ---- WebSockets ----

    async def _serve(self, connection: ServerConnection) -> None:
        client = Client(connection)
        self._clients.add(client)
        sender = asyncio.create_task(client.send_frames(self._world, self._dt))
        self._run.order(lambda run: run.wish(client, client.wish))
        try:
            async for message in connection:
                await self._obey(client, message)
        except ConnectionClosed:
            pass
        finally:
            self._clients.discard(client)
            self._run.order(lambda run: run.wish(client, None))
            sender.cancel()
            await asyncio.gather(sender, return_exceptions=True)

    async def _obey(self, client: Client, message: str | bytes) -> None:
        """Carries out an order before the next one of this client is read."""
        try:
            wish = await asyncio.wrap_future(self._run.order(order_of(message, client)))
            if isinstance(wish, Wish):
                client.wish = wish
        except (ValueError, StageError) as error:
            await client.connection.send(error_message(str(error)))


def _response(file: Path) -> Response:
    body = file.read_bytes()
    headers = Headers({
        "Content-Type": f"{_TYPES.get(file.suffix, 'application/octet-stream')}; charset=utf-8",
        "Content-Length": str(len(body)), "Cache-Control": "no-cache", "Connection": "close",
        "Content-Security-Policy": _POLICY, "X-Content-Type-Options": "nosniff",
        "Cross-Origin-Resource-Policy": "same-origin", "Referrer-Policy": "no-referrer"})
    return Response(200, "OK", headers, body)
