# SPDX-License-Identifier: GPL-2.0-or-later
"""Serves the page and its WebSocket."""

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

from ..text import printable
from .floor import FieldPicture
from .messages import MAX_ORDER_BYTES, error_message, field_message, frame_message, order_of, places_words, scene_message
from .requests import Connection, Refused, Target
from .scene import Frame, Scene, Wish
from .show import Show

MAX_CLIENTS = 32
#: Orders per second of a client and of all clients, and the number of orders in a burst.
CLIENT_RATE, ALL_RATE, BURST = 100.0, 1000.0, 50.0
_PAGE = Path(__file__).parent / "page"
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
_POLICY = "default-src 'self'; connect-src 'self' ws: wss:; frame-ancestors 'none'; base-uri 'none'"


def is_loopback(host: str) -> bool:
    """True if only this machine can reach the host."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


class Door:
    """Access control.

    Pages of other sites in a browser on this machine must not reach the server, so the header Origin must name the
    server itself. Against DNS rebinding, Host must be an address or a name of this machine. If other machines can
    reach the server, clients also need a token.
    """

    def __init__(self, host: str) -> None:
        self.token = "" if is_loopback(host) else secrets.token_urlsafe(16)  #: empty: no token is needed
        self._names = {"localhost", host.lower(), socket.gethostname().lower()}

    def refusal(self, request: Request, target: Target) -> str:
        """The reason for refusing the request; empty: it is accepted."""
        hosts = request.headers.get_all("Host")
        if len(hosts) != 1 or not self._is_ours(hosts[0]):
            return "this is not the name of the server"
        if target.authority is not None and not self._is_ours(target.authority):
            return "this is not the name of the server"
        origins = request.headers.get_all("Origin")
        if origins and (len(origins) > 1 or not self._is_same(origins[0], hosts[0])):
            return "pages of other sites may not come here"
        return ""

    def knows(self, target: Target) -> bool:
        """True if the request has the token, or none is needed."""
        try:
            given = parse_qs(target.query, max_num_fields=8).get("token", [""])[0]
        except ValueError:  # the query has too many fields
            given = ""
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


class Allowance:
    """A rate limiter: delays orders to `rate` per second, after a burst of `burst`."""

    def __init__(self, rate: float, burst: float = BURST) -> None:
        self._each, self._most_saved = 1 / rate, burst / rate
        self._next = 0.0  # earliest time of the next order, without a burst

    async def wait(self) -> None:
        """Waits until the next order is allowed."""
        now = asyncio.get_running_loop().time()
        self._next = max(self._next, now - self._most_saved) + self._each
        if self._next > now:
            await asyncio.sleep(self._next - now)


class Client:
    """A connected viewer. While a frame is being sent, only the last new frame is kept."""

    def __init__(self, connection: ServerConnection) -> None:
        self.connection = connection
        self.allowance = Allowance(CLIENT_RATE)
        self.wish = Wish(all_scans=True)
        self.latest: tuple[Frame, bytes] | None = None
        self.news = asyncio.Event()
        self.scene: Scene | None = None  # the last scene sent
        self.fields: dict[int, FieldPicture] = {}  # the last pictures sent

    async def send_frames(self, world: str, dt: float) -> None:
        """Sends frames, and scenes before their first frame, until the connection is closed."""
        while True:
            await self.news.wait()
            self.news.clear()
            assert self.latest is not None
            frame, places = self.latest
            if frame.scene is not self.scene:
                await self.connection.send(scene_message(frame.scene, self._shapes(frame.scene), world, dt))
                self.scene = frame.scene
            for picture in frame.fields.values():
                if self.fields.get(picture.id) != picture:
                    await self.connection.send(field_message(picture))
            self.fields = dict(frame.fields)
            await self.connection.send(frame_message(frame, places, self.wish))

    def _shapes(self, scene: Scene) -> int:
        """The number of shapes of the scene's table that the viewer already has."""
        return self.scene.shape_count if self.scene and self.scene.shapes is scene.shapes else 0


class Web:
    """Serves the page and sends it the frames of a run. Call everything but show() in the event loop."""

    def __init__(self, run: Show, host: str) -> None:
        self.door = Door(host)
        self._run = run
        self._world, self._dt = printable(os.path.basename(run.world._core.name)), run.world.dt
        self._clients: set[Client] = set()
        self._allowance = Allowance(ALL_RATE)
        self._files = {f"/{file.name}": file for file in sorted(_PAGE.iterdir())}
        self._files["/"] = _PAGE / "index.html"
        self._loop: asyncio.AbstractEventLoop | None = None

    async def open(self, host: str, port: int) -> SocketServer:
        """Starts to serve. Raises OSError if the port can't be opened."""
        self._loop = asyncio.get_running_loop()
        logger = logging.getLogger("stagesim.live")
        logger.setLevel(logging.CRITICAL)  # errors of clients are not logged
        server = await serve(self._serve, host, port, process_request=self._request, logger=logger,
                             create_connection=Connection, close_timeout=2, max_size=MAX_ORDER_BYTES, max_queue=8,
                             compression=None, server_header=None)
        self._run.order(lambda run: run.listen(self.show, lambda: bool(self._clients)))
        return server

    def show(self, frame: Frame) -> None:
        """Sends a frame to all viewers. Called by the run, in its thread."""
        if self._loop is not None:
            try:
                self._loop.call_soon_threadsafe(self._distribute, frame)
            except RuntimeError:  # the event loop has been closed
                pass

    def _distribute(self, frame: Frame) -> None:
        latest = (frame, places_words(frame))
        for client in self._clients:
            client.latest = latest
            client.news.set()

    # ---- plain requests ----

    def _request(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answers a request; returns None for a connection that becomes a WebSocket."""
        try:
            target = Target(request.path)
        except Refused as refused:
            return connection.respond(refused.status, f"{refused}\n")
        is_head = isinstance(connection, Connection) and connection.method == "HEAD"
        response = self._response(connection, request, target, is_head)
        if is_head and response is not None:
            response.body = b""
        return response

    def _response(self, connection: ServerConnection, request: Request, target: Target,
                  is_head: bool) -> Response | None:
        refusal = self.door.refusal(request, target)
        if refusal:
            return connection.respond(http.HTTPStatus.FORBIDDEN, refusal + "\n")
        if target.path == "/live":
            if not self.door.knows(target):
                return connection.respond(http.HTTPStatus.FORBIDDEN, "the token is missing\n")
            if len(self._clients) >= MAX_CLIENTS:
                return connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, "too many look already\n")
            if is_head or "websocket" not in request.headers.get("Upgrade", "").lower():
                response = connection.respond(http.HTTPStatus.UPGRADE_REQUIRED, "expected a WebSocket\n")
                response.headers["Upgrade"] = "websocket"
                return response
            return None
        file = self._files.get(target.path)
        if file is None:
            return connection.respond(http.HTTPStatus.NOT_FOUND, "there is no such page\n")
        return _page(file)

    # ---- WebSockets ----

    async def _serve(self, connection: ServerConnection) -> None:
        client = Client(connection)
        self._clients.add(client)
        sender = asyncio.create_task(client.send_frames(self._world, self._dt))
        self._run.order(lambda run: run.wish(client, client.wish))
        try:
            async for message in connection:
                await client.allowance.wait()
                await self._allowance.wait()
                await self._obey(client, message)
        except ConnectionClosed:
            pass
        finally:
            self._clients.discard(client)
            self._run.order(lambda run: run.wish(client, None))
            sender.cancel()
            await asyncio.gather(sender, return_exceptions=True)

    async def _obey(self, client: Client, message: str | bytes) -> None:
        """Executes an order and waits for it, before the next one of this client is read."""
        try:
            wish = await asyncio.wrap_future(self._run.order(order_of(message, client)))
            if isinstance(wish, Wish):
                client.wish = wish
        except ConnectionClosed:
            raise
        except Exception as error:  # every error is sent to the client, which stays connected
            await client.connection.send(error_message(str(error) or type(error).__name__))


def _page(file: Path) -> Response:
    body = file.read_bytes()
    headers = Headers({
        "Content-Type": f"{_TYPES.get(file.suffix, 'application/octet-stream')}; charset=utf-8",
        "Content-Length": str(len(body)), "Cache-Control": "no-cache", "Connection": "close",
        "Content-Security-Policy": _POLICY, "X-Content-Type-Options": "nosniff",
        "Cross-Origin-Resource-Policy": "same-origin", "Referrer-Policy": "no-referrer"})
    return Response(200, "OK", headers, body)
