# SPDX-License-Identifier: GPL-2.0-or-later
"""A limit for the duration of work, kept by another thread."""

from __future__ import annotations

import threading
import time
from typing import Callable


class Deadline:
    """Calls a function while work takes too long, once per piece of work.

    Args:
        late: the function, called in another thread.
    """

    def __init__(self, late: Callable[[], None]) -> None:
        self._late = late
        self._change = threading.Condition()
        self._end: float | None = None  # of the present work, on the clock of time.monotonic()
        self._is_late = self._closed = False
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def begin(self, seconds: float) -> None:
        """Starts a piece of work that may take so long."""
        with self._change:
            self._end, self._is_late = time.monotonic() + seconds, False
            self._change.notify()

    def finish(self) -> bool:
        """Ends a piece of work. Returns whether it was in time; if not, the function has been called."""
        with self._change:
            if self._end is not None and time.monotonic() >= self._end:
                self._tell()
            self._end = None
            return not self._is_late

    def close(self) -> None:
        """Ends the thread."""
        with self._change:
            self._closed = True
            self._change.notify()
        self._thread.join()

    def _tell(self) -> None:
        self._end, self._is_late = None, True
        self._late()

    def _watch(self) -> None:
        with self._change:
            while not self._closed:
                left = None if self._end is None else self._end - time.monotonic()
                if left is not None and left <= 0:
                    self._tell()
                else:
                    self._change.wait(left)
