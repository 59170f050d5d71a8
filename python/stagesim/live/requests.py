# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks HTTP requests before the package websockets gets them.

websockets only supports GET and closes a connection without an answer if it can't parse a request. Here the head of
each request is parsed first, so that every client gets an answer in one line.
"""

from __future__ import annotations

import asyncio
import http
import re
from typing import Any
from urllib.parse import urlsplit

from websockets.asyncio.server import ServerConnection

from .fields import found

_MAX_HEAD = 16_384  # bytes
_MAX_LINE = 8_000  # bytes
_MAX_LINES = 100
_PATIENCE = 8.0  # max seconds until the head is complete; websockets gives up after 10
_LINGER = 2.0  # seconds until the connection of a refused client is closed
_LINE = re.compile(rb"([!-~]+) ([!-~]+) (HTTP/\d\.\d)")
_FIELD = re.compile(rb"[!#$%&'*+.^_`|~0-9A-Za-z-]+:[\t -~\x80-\xff]*")


class Refused(Exception):
    """A request is refused with an HTTP error.

    Attributes:
        status: the HTTP status.
        headers: additional header fields of the answer.
    """

    def __init__(self, status: http.HTTPStatus, text: str, **headers: str) -> None:
        super().__init__(text)
        self.status, self.headers = status, headers

    def answer(self) -> bytes:
        """The whole answer for the client."""
        body = f"{self}\n".encode()
        head = {"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body)), "Connection": "close",
                **self.headers}
        lines = [f"HTTP/1.1 {self.status.value} {self.status.phrase}", *(f"{name}: {head[name]}" for name in head)]
        return "\r\n".join([*lines, "", ""]).encode() + body


def method_of(head: bytes) -> str:
    """Returns the method of a request: GET or HEAD.

    Args:
        head: the lines of the request without the empty one at the end.

    Raises:
        Refused: it is not a valid request, or not supported.
    """
    first, *rest = head.split(b"\r\n")
    method = _method_of_line(first)
    if len(rest) > _MAX_LINES:
        raise Refused(http.HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE,
                      f"found {len(rest)} header fields, expected {_MAX_LINES} at most")
    for line in rest:
        if len(line) > _MAX_LINE:
            raise Refused(http.HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE,
                          f"found a header field of {len(line)} bytes, expected {_MAX_LINE} at most")
        if not _FIELD.fullmatch(line):
            raise Refused(http.HTTPStatus.BAD_REQUEST, f"found {_shown(line)}, expected a header field: NAME: VALUE")
        name, _, value = line.partition(b":")
        if name.lower() == b"transfer-encoding" or (name.lower() == b"content-length" and value.strip() != b"0"):
            raise Refused(http.HTTPStatus.BAD_REQUEST, "found a request with a body, expected none")
    return method


def _method_of_line(line: bytes) -> str:
    if len(line) > _MAX_LINE:
        raise Refused(http.HTTPStatus.REQUEST_URI_TOO_LONG,
                      f"found a request of {len(line)} bytes or more, expected {_MAX_LINE} at most")
    match = _LINE.fullmatch(line)
    if match is None:
        raise Refused(http.HTTPStatus.BAD_REQUEST, f"found {_shown(line)}, expected a request such as GET / HTTP/1.1")
    method, _, version = (part.decode() for part in match.groups())
    if version not in ("HTTP/1.0", "HTTP/1.1"):
        raise Refused(http.HTTPStatus.HTTP_VERSION_NOT_SUPPORTED, f"found {version}, expected HTTP/1.1")
    if method not in ("GET", "HEAD"):
        raise Refused(http.HTTPStatus.METHOD_NOT_ALLOWED, f"found the method {found(method)}, expected GET or HEAD",
                      Allow="GET, HEAD")
    return method


def _shown(line: bytes) -> str:
    return found(line.decode("latin-1"))


class Target:
    """The target of a request: a path and a query; of an absolute URL also the server's name (`authority`).

    Raises:
        Refused: it is neither a path nor a URL.
    """

    def __init__(self, text: str) -> None:
        self.authority: str | None = None
        if not text.startswith("/"):
            try:
                parts = urlsplit(text)
                parts.port  # noqa: B018  # raises ValueError if the port is invalid
            except ValueError:
                parts = urlsplit("")
            if parts.scheme not in ("http", "https", "ws", "wss") or not parts.netloc:
                raise Refused(http.HTTPStatus.BAD_REQUEST, f"found {found(text)}, expected a path or a URL")
            self.authority = parts.netloc
            text = text[text.index(parts.netloc) + len(parts.netloc):]
        text = text.partition("#")[0]
        self.path, _, self.query = text.partition("?")
        self.path = self.path or "/"


class Connection(ServerConnection):
    """A connection that checks its request before websockets gets it.

    Attributes:
        method: the method of the request; empty until its head is complete.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.method = ""
        self._head = bytearray()
        self._is_refused = False
        self._timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called by the event loop."""
        super().connection_made(transport)
        late = Refused(http.HTTPStatus.REQUEST_TIMEOUT, f"found no whole request in {_PATIENCE:g} seconds")
        self._timer = self.loop.call_later(_PATIENCE, self._refuse, late)

    def data_received(self, data: bytes) -> None:
        """Called by the event loop."""
        if self._is_refused:
            return
        if self.method:
            super().data_received(data)
            return
        self._head += data
        try:
            self._look()
        except Refused as refused:
            self._refuse(refused)
            return
        if self.method:
            self._stop_timer()
            whole, self._head = bytes(self._head), bytearray()
            super().data_received(whole)

    def connection_lost(self, exc: Exception | None) -> None:
        """Called by the event loop."""
        self._stop_timer()
        super().connection_lost(exc)

    def _look(self) -> None:
        """Parses the head if it is complete. Raises Refused as soon as it is invalid."""
        while self._head.startswith(b"\r\n"):  # RFC 9112, 2.2: empty lines before a request are ignored
            del self._head[:2]
        head, end, _ = bytes(self._head[:_MAX_HEAD]).partition(b"\r\n\r\n")
        if end:
            self.method = method_of(head)
            return
        first, line_end, _ = head.partition(b"\n")
        if line_end or len(first) > _MAX_LINE or not first[:1].isalpha():
            if first:
                _method_of_line(first.removesuffix(b"\r") if first.endswith(b"\r") else first + line_end)
        if len(self._head) >= _MAX_HEAD:
            raise Refused(http.HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE,
                          f"found {_MAX_HEAD} bytes of header fields or more, expected fewer")

    def _refuse(self, refused: Refused) -> None:
        """Sends the answer and ignores further data. The connection is closed later, so that the answer arrives."""
        self._is_refused = True
        self._stop_timer()
        if self.transport.is_closing():
            return
        self.transport.write(refused.answer())
        if self.transport.can_write_eof():
            self.transport.write_eof()
        self._timer = self.loop.call_later(_LINGER, self.transport.close)

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
