# SPDX-License-Identifier: GPL-2.0-or-later
"""Requests as they come from the network, and why some are refused.

The package websockets knows GET alone, and closes a connection without a word where it can't read a request. Here the
head of each request is read first, so that everybody gets an answer of one line.
"""

from __future__ import annotations

import asyncio
import http
import re
from typing import Any
from urllib.parse import urlsplit

from websockets.asyncio.server import ServerConnection

from .fields import found

_LONGEST_HEAD = 16_384  # bytes
_LONGEST_LINE = 8_000
_MOST_LINES = 100
_PATIENCE = 8.0  # seconds that a head may take; websockets gives up after 10
_LINGER = 2.0  # seconds in which a client that is refused may read why
_LINE = re.compile(rb"([!-~]+) ([!-~]+) (HTTP/\d\.\d)")
_FIELD = re.compile(rb"[!#$%&'*+.^_`|~0-9A-Za-z-]+:[\t -~\x80-\xff]*")


class Refused(Exception):
    """A request that gets an answer and nothing else.

    Attributes:
        status: of HTTP.
        headers: that the answer has to have.
    """

    def __init__(self, status: http.HTTPStatus, text: str, **headers: str) -> None:
        super().__init__(text)
        self.status, self.headers = status, headers

    def answer(self) -> bytes:
        """As it goes to the client."""
        body = f"{self}\n".encode()
        head = {"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body)), "Connection": "close",
                **self.headers}
        lines = [f"HTTP/1.1 {self.status.value} {self.status.phrase}", *(f"{name}: {head[name]}" for name in head)]
        return "\r\n".join([*lines, "", ""]).encode() + body


def method_of(head: bytes) -> str:
    """GET or HEAD.

    Args:
        head: the lines of a request, without the empty one at its end.

    Raises:
        Refused: it is no request, or none that is served here.
    """
    first, *rest = head.split(b"\r\n")
    method = _method_of_line(first)
    if len(rest) > _MOST_LINES:
        raise Refused(http.HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE,
                      f"found {len(rest)} header fields, expected {_MOST_LINES} at most")
    for line in rest:
        if len(line) > _LONGEST_LINE:
            raise Refused(http.HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE,
                          f"found a header field of {len(line)} bytes, expected {_LONGEST_LINE} at most")
        if not _FIELD.fullmatch(line):
            raise Refused(http.HTTPStatus.BAD_REQUEST, f"found {_shown(line)}, expected a header field: NAME: VALUE")
        name, _, value = line.partition(b":")
        if name.lower() == b"transfer-encoding" or (name.lower() == b"content-length" and value.strip() != b"0"):
            raise Refused(http.HTTPStatus.BAD_REQUEST, "found a request with a body, expected none")
    return method


def _method_of_line(line: bytes) -> str:
    if len(line) > _LONGEST_LINE:
        raise Refused(http.HTTPStatus.REQUEST_URI_TOO_LONG,
                      f"found a request of {len(line)} bytes or more, expected {_LONGEST_LINE} at most")
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
    """What a request asks for: a path and a query, and the server's name if it is a whole URL.

    Raises:
        Refused: it is neither.
    """

    def __init__(self, text: str) -> None:
        self.authority: str | None = None
        if not text.startswith("/"):
            try:
                parts = urlsplit(text)
                parts.port  # noqa: B018  # which raises ValueError if it is none
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
    """A connection whose request is looked at before websockets gets it.

    Attributes:
        method: of the request, once there is one.
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
        """Takes the head, if all of it is there."""
        while self._head.startswith(b"\r\n"):  # as RFC 9112 has it
            del self._head[:2]
        head, end, _ = bytes(self._head[:_LONGEST_HEAD]).partition(b"\r\n\r\n")
        if end:
            self.method = method_of(head)
            return
        first, line_end, _ = head.partition(b"\n")
        if line_end or len(first) > _LONGEST_LINE or not first[:1].isalpha():
            if first:
                _method_of_line(first.removesuffix(b"\r") if first.endswith(b"\r") else first + line_end)
        if len(self._head) >= _LONGEST_HEAD:
            raise Refused(http.HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE,
                          f"found {_LONGEST_HEAD} bytes of header fields or more, expected fewer")

    def _refuse(self, refused: Refused) -> None:
        """Answers, and takes nothing more. The connection ends a little later, so that the answer arrives."""
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
