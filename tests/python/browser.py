# SPDX-License-Identifier: GPL-2.0-or-later
"""Headless Chromium for tests of pages, controlled by its DevTools protocol."""

from __future__ import annotations

import base64
import itertools
import json
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Any

from patience import PATIENCE
from websockets.sync.client import connect

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")


def find_browser() -> str | None:
    """The path of Chromium, or None."""
    return next((path for path in map(shutil.which, PROGRAMS) if path), None)


class Browser:
    """A page in a separate Chromium. Errors of the page's scripts raise AssertionError."""

    def __init__(self, width: int = 1200, height: int = 760, *, dark: bool = False) -> None:
        self._folder = tempfile.mkdtemp(prefix="stage_browser_")
        program = find_browser()
        assert program is not None
        self._process = subprocess.Popen(
            [program, "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
             "--remote-debugging-port=0", "--remote-allow-origins=*", f"--user-data-dir={self._folder}",
             f"--window-size={width},{height}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self._numbers = itertools.count(1)
        self.errors: list[str] = []
        port = self._wait_for_port()
        with connect(f"ws://127.0.0.1:{port[0]}{port[1]}", max_size=None) as whole:
            whole.send(json.dumps({"id": 0, "method": "Target.getTargets"}))
            answer = json.loads(whole.recv())
        target = next(t["targetId"] for t in answer["result"]["targetInfos"] if t["type"] == "page")
        self._socket = connect(f"ws://127.0.0.1:{port[0]}/devtools/page/{target}", max_size=None).__enter__()
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.call("Emulation.setEmulatedMedia",
                  features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def _wait_for_port(self) -> list[str]:
        file = Path(self._folder) / "DevToolsActivePort"
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            lines = file.read_text().split() if file.exists() else []
            if len(lines) == 2:
                return lines
            time.sleep(0.05)
        raise AssertionError("the browser did not start")

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._socket.close()
        self._process.terminate()
        self._process.wait()
        shutil.rmtree(self._folder, ignore_errors=True)

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Calls a method of the protocol and returns its result."""
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv(timeout=PATIENCE))
            if message.get("method") == "Runtime.exceptionThrown":
                self.errors.append(json.dumps(message["params"]["exceptionDetails"])[:2000])
            if message.get("method") == "Log.entryAdded" and message["params"]["entry"]["level"] == "error":
                self.errors.append(message["params"]["entry"]["text"])
            if message.get("id") == number:
                assert "error" not in message, message
                return message["result"]

    def open(self, url: str) -> None:
        """Opens a page and waits until it is loaded."""
        self.call("Page.navigate", url=url)
        self.wait(f"location.href === {json.dumps(url)} && document.readyState === 'complete'")

    def value(self, expression: str) -> Any:
        """Evaluates a JavaScript expression in the page."""
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def wait(self, expression: str, seconds: float = PATIENCE) -> None:
        """Waits until the expression is true."""
        end = time.monotonic() + seconds
        while not self.value(expression):
            assert time.monotonic() < end, f"still not so: {expression}"
            time.sleep(0.05)

    def key(self, key: str, code: str, down: bool = True, up: bool = True) -> None:
        text = {"text": key} if len(key) == 1 else {}
        for wanted, kind in ((down, "keyDown"), (up, "keyUp")):
            if wanted:
                self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code,
                          **(text if kind == "keyDown" else {}))

    def mouse(self, kind: str, x: float, y: float, modifiers: int = 0) -> None:
        """Sends a mouse event; `kind` is Pressed, Moved or Released."""
        self.call("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, button="left",
                  buttons=int(kind != "Released"), clickCount=1, modifiers=modifiers)

    def click(self, x: float, y: float) -> None:
        self.mouse("Pressed", x, y)
        self.mouse("Released", x, y)

    def wheel(self, x: float, y: float, pixels: float) -> None:
        self.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=pixels)

    def screenshot(self, file: str | os.PathLike[str]) -> bytes:
        """Writes a PNG file with a screenshot of the page."""
        data = base64.b64decode(self.call("Page.captureScreenshot")["data"])
        Path(file).write_bytes(data)
        return data
