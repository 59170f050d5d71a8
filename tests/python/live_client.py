# SPDX-License-Identifier: GPL-2.0-or-later
"""A client of stagesim.live for tests."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from patience import PATIENCE
from stagesim.live import Run, Server
from stagesim.live.messages import unpacked
from websockets.sync.client import ClientConnection, connect

Message = tuple[dict[str, Any], bytes]


def do(server: Server, what: Callable[[Run], Any]) -> Any:
    """Executes an order and returns its result."""
    return server.run.order(what).result(PATIENCE)


class Client:
    """A client that keeps the last scene and frame."""

    def __init__(self, server: Server, **options: Any) -> None:
        address = server.url.replace("http", "ws", 1)
        path, _, query = address.partition("?")
        connecting = connect(f"{path}live" + (f"?{query}" if query else ""), max_size=None, close_timeout=1,
                             **options)
        self.socket: ClientConnection = connecting.__enter__()
        self.scene: dict[str, Any] = {}
        self.shapes: list[bytes] = []
        self.frame: dict[str, Any] = {}
        self.words = b""
        self.fields: dict[int, tuple[dict[str, Any], np.ndarray]] = {}  # headers and shades
        self.fields_received = 0

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def send(self, what: str, **parts: Any) -> None:
        self.socket.send(json.dumps({"do": what, **parts}))

    def next(self) -> str:
        """Receives one message and returns its type."""
        message = self.socket.recv(timeout=PATIENCE)
        assert isinstance(message, bytes)
        header, words = unpacked(message)
        if header["type"] == "scene":
            self.scene = header
            ends = 4 * np.cumsum([0, *header["lengths"]])
            self.shapes[header["first"]:] = [words[a:b] for a, b in zip(ends, ends[1:])]
        elif header["type"] == "field":
            shape = header["rows"], header["columns"]
            self.fields[header["id"]] = header, np.frombuffer(words, np.uint8, shape[0] * shape[1]).reshape(shape)
            self.fields_received += 1
        elif header["type"] == "frame":
            self.frame, self.words = header, words
        else:
            self.error = header["text"]
        return str(header["type"])

    def until(self, holds: Callable[[], Any], seconds: float = PATIENCE) -> None:
        """Receives messages until the condition holds after a frame."""
        end = time.monotonic() + seconds
        while True:
            if self.next() == "frame" and holds():
                return
            assert time.monotonic() < end, "it never came to that"

    def until_error(self) -> str:
        while self.next() != "error":
            pass
        return self.error

    # ---- of the last frame ----

    @property
    def places(self) -> np.ndarray:
        return np.frombuffer(self.words, "<f4", 3 * self.frame["things"]).reshape(-1, 3)

    @property
    def stalled(self) -> np.ndarray:
        count = self.frame["things"]
        bits = np.frombuffer(self.words, np.uint8, -(-count // 8), 12 * count)
        return np.unpackbits(bits, count=count, bitorder="little").astype(bool)

    @property
    def _glows_begin(self) -> int:
        count = int(self.frame["things"])
        return 12 * count + 4 * -(-count // 32)

    @property
    def glows(self) -> list[tuple[list[float], list[int]]]:
        """X, y and radius of each glow, and its colour."""
        ends = range(self._glows_begin, self._glows_begin + 16 * self.frame["glows"], 16)
        return [(np.frombuffer(self.words, "<f4", 3, at).tolist(), list(self.words[at + 12:at + 16])) for at in ends]

    @property
    def scans(self) -> list[dict[str, Any]]:
        at, found = self._glows_begin + 16 * self.frame["glows"], []
        while at < len(self.words):
            thing, samples = np.frombuffer(self.words, "<u4", 2, at)
            time = np.frombuffer(self.words[at + 8:at + 16], "<u8")[0] / 1e6
            place, pose, view = np.split(np.frombuffer(self.words, "<f4", 8, at + 16), (3, 6))
            ranges, bearings = np.frombuffer(self.words, "<f4", 2 * samples, at + 48).reshape(2, -1)
            found.append({"thing": int(thing), "time": time, "place": place, "pose": pose, "fov": view[0],
                          "reach": view[1], "ranges": ranges, "bearings": bearings})
            at += 48 + 8 * int(samples)
        return found

    def thing(self, name: str) -> int:
        """The id of the thing with this name."""
        return int(next(thing["id"] for thing in self.scene["things"] if thing["name"] == name))

    def place(self, name: str) -> np.ndarray:
        """The place of the thing with this name."""
        return self.places[[thing["name"] for thing in self.scene["things"]].index(name)]
