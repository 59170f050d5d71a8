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

from ..text import printable
from .messages import LONGEST_ORDER, error_message, frame_message, order_of, places_words, scene_message
from .requests import Connection, Refused, Target
from .scene import Frame, Scene, Wish
from .show import Show

MOST_CLIENTS = 32
#: Orders a second, and how many may come at once: of each client, and of all.
CLIENT_RATE, ALL_RATE, BURST = 100.0, 1000.0, 50.0
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

    def refusal(self, request: Request, target: Target) -> str:
        """Why the request is refused; empty: it is not."""
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
        """Whether it has the token, if one is needed."""
        try:
            given = parse_qs(target.query, max_num_fields=8).get("token", [""])[0]
        except ValueError:  # too many fields
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
    """Lets so many orders through in a second. More have to wait."""

    def __init__(self, rate: float, burst: float = BURST) -> None:
        self._each, self._most_saved = 1 / rate, burst / rate
        self._next = 0.0  # when the next one may come, were none saved up

    async def wait(self) -> None:
        """Until one more may come."""
        now = asyncio.get_running_loop().time()
        self._next = max(self._next, now - self._most_saved) + self._each
        if self._next > now:
            await asyncio.sleep(self._next - now)


class Client:
    """Somebody who looks. Frames that come while one is being sent are left out, but for the last."""

    def __init__(self, connection: ServerConnection) -> None:
        self.connection = connection
        self.allowance = Allowance(CLIENT_RATE)
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
        self._world, self._dt = printable(os.path.basename(run.world._core.name)), run.world.dt
        self._clients: set[Client] = set()
        self._allowance = Allowance(ALL_RATE)
        self._files = {f"/{file.name}": file for file in sorted(_PAGE.iterdir())}
        self._files["/"] = _PAGE / "index.html"
        self._loop: asyncio.AbstractEventLoop | None = None

    async def open(self, host: str, port: int) -> SocketServer:
        """Begins to serve. Raises OSError if the port can't be had."""
        self._loop = asyncio.get_running_loop()
        logger = logging.getLogger("stagesim.live")
        logger.setLevel(logging.CRITICAL)  # what clients do wrong is nobody's business here
        server = await serve(self._serve, host, port, process_request=self._request, logger=logger,
                             create_connection=Connection, close_timeout=2, max_size=LONGEST_ORDER, max_queue=8,
                             compression=None, server_header=None)
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
            if len(self._clients) >= MOST_CLIENTS:
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
        """Carries out an order before the next one of this client is read."""
        try:
            wish = await asyncio.wrap_future(self._run.order(order_of(message, client)))
            if isinstance(wish, Wish):
                client.wish = wish
        except ConnectionClosed:
            raise
        except Exception as error:  # whatever it is, the client is told, and goes on
            await client.connection.send(error_message(str(error) or type(error).__name__))


def _page(file: Path) -> Response:
    body = file.read_bytes()
    headers = Headers({
        "Content-Type": f"{_TYPES.get(file.suffix, 'application/octet-stream')}; charset=utf-8",
        "Content-Length": str(len(body)), "Cache-Control": "no-cache", "Connection": "close",
        "Content-Security-Policy": _POLICY, "X-Content-Type-Options": "nosniff",
        "Cross-Origin-Resource-Policy": "same-origin", "Referrer-Policy": "no-referrer"})
    return Response(200, "OK", headers, body)
