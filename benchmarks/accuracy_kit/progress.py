# SPDX-License-Identifier: GPL-2.0-or-later
"""A bar with the time that is left."""

from __future__ import annotations

import sys
import threading
import time


def duration(seconds: float) -> str:
    """Such as 45 s, 3 min 05 s, 2 h 10 min."""
    seconds = max(0, round(seconds))
    if seconds < 60:
        return f"{seconds} s"
    if seconds < 3600:
        return f"{seconds // 60} min {seconds % 60:02} s"
    return f"{seconds // 3600} h {seconds % 3600 // 60:02} min"


class Progress:
    """Counts weights, as jobs differ in length; the weights need only be about right."""

    WIDTH = 30

    def __init__(self, total: float) -> None:
        self._total = max(total, 1e-9)
        self._done = 0.0
        self._start = time.monotonic()
        self._lock = threading.Lock()
        self._terminal = sys.stderr.isatty()
        self._printed = -1.0

    def advance(self, weight: float, what: str) -> None:
        with self._lock:
            self._done += weight
            share = min(1.0, self._done / self._total)
            left = (time.monotonic() - self._start) * (1 - share) / max(share, 1e-9)
            filled = round(share * self.WIDTH)
            line = (f"[{'#' * filled}{'.' * (self.WIDTH - filled)}] {100 * share:3.0f} %, about "
                    f"{duration(left)} left: {what}")
            if self._terminal:
                print(f"\r{line[:118]:118}", end="", file=sys.stderr, flush=True)
            elif share - self._printed >= 0.05 or share == 1:
                print(line, file=sys.stderr, flush=True)
                self._printed = share

    def close(self) -> None:
        if self._terminal:
            print(file=sys.stderr)
