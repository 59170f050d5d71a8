# SPDX-License-Identifier: GPL-2.0-or-later
"""Shows progress: a bar on a terminal, a line from time to time elsewhere."""

from __future__ import annotations

import shutil
import sys
import threading
import time
from typing import TextIO

LINE_EVERY = 30.0  # seconds between lines if there is no terminal
BAR_WIDTH = 24


def duration_text(seconds: float) -> str:
    """Formats a duration, such as 40 s, 7 min or 3.5 h."""
    if seconds < 90:
        return f"{max(0.0, seconds):.0f} s"
    if seconds < 5400:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"


class Progress:
    """Writes to standard error, because standard output is for results. Threads may share it.

    Use show() if the number of runs and their duration are known. Use advance() if each piece of
    work has an approximate weight, whose sum is `total`.
    """

    def __init__(self, stream: TextIO | None = None, total: float = 1.0) -> None:
        self._stream = stream or sys.stderr
        self._terminal = self._stream.isatty()
        self._last_line = -LINE_EVERY
        self._bar_shown = False
        self._lock = threading.Lock()
        self._total = max(total, 1e-9)
        self._done = 0.0
        self._start = time.monotonic()

    def show(self, done: int, total: int, what: str, seconds_left: float) -> None:
        """Call before each run: `done` of `total` runs are done, and `what` comes next."""
        self._draw(done / max(1, total), f"{done}/{total}", "runs done", what, seconds_left)

    def advance(self, weight: float, what: str) -> None:
        """Call after each piece of work."""
        with self._lock:
            self._done += weight
            share = min(1.0, self._done / self._total)
            left = (time.monotonic() - self._start) * (1 - share) / max(share, 1e-9)
            self._draw(share, f"{share:.0%}", "done", what, left)

    def _draw(self, share: float, count: str, unit: str, what: str, seconds_left: float) -> None:
        left = f"about {duration_text(seconds_left)} left"
        if not self._terminal:
            if time.monotonic() - self._last_line >= LINE_EVERY:
                self._last_line = time.monotonic()
                self.say(f"{count} {unit}, {left}; now {what}")
            return
        filled = int(BAR_WIDTH * share)
        bar = "#" * filled + "-" * (BAR_WIDTH - filled)
        columns = shutil.get_terminal_size().columns
        text = f"[{bar}] {count}, {left}; {what}"
        self._stream.write("\r\033[K" + text[:columns - 1])
        self._stream.flush()
        self._bar_shown = True

    def say(self, text: str) -> None:
        """Prints a line that stays."""
        self.clear()
        self._stream.write(text + "\n")
        self._stream.flush()

    def clear(self) -> None:
        if self._bar_shown:
            self._stream.write("\r\033[K")
            self._stream.flush()
            self._bar_shown = False
