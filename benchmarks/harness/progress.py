# SPDX-License-Identifier: GPL-2.0-or-later
"""How far a series is: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import shutil
import sys
import time
from typing import TextIO

LINE_EVERY = 30.0  # seconds, where there is no terminal
BAR_WIDTH = 24


def duration_text(seconds: float) -> str:
    """Such as 40 s, 7 min, 3.5 h; people do not need more."""
    if seconds < 90:
        return f"{max(0.0, seconds):.0f} s"
    if seconds < 5400:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"


class Progress:
    """Writes to standard error: standard output is for results."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream or sys.stderr
        self._terminal = self._stream.isatty()
        self._last_line = -LINE_EVERY
        self._bar_shown = False

    def show(self, done: int, total: int, what: str, seconds_left: float) -> None:
        """Before each run: how many are done, and what comes now."""
        left = f"about {duration_text(seconds_left)} left"
        if not self._terminal:
            if time.monotonic() - self._last_line >= LINE_EVERY:
                self._last_line = time.monotonic()
                self.say(f"{done}/{total} runs done, {left}; now {what}")
            return
        filled = BAR_WIDTH * done // max(1, total)
        bar = "#" * filled + "-" * (BAR_WIDTH - filled)
        columns = shutil.get_terminal_size().columns
        text = f"[{bar}] {done}/{total}, {left}; {what}"
        self._stream.write("\r\033[K" + text[:columns - 1])
        self._stream.flush()
        self._bar_shown = True

    def say(self, text: str) -> None:
        """A line that stays."""
        self.clear()
        self._stream.write(text + "\n")
        self._stream.flush()

    def clear(self) -> None:
        if self._bar_shown:
            self._stream.write("\r\033[K")
            self._stream.flush()
            self._bar_shown = False
