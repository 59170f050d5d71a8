# SPDX-License-Identifier: GPL-2.0-or-later
"""Keeps a list of runs that were begun but did not end, for example because they crashed the board.

A series started at boot would repeat such a run forever, so the list is kept on disk.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

from benchkit.series.records import Key

BEGUN_FILE = "begun.json"
MOST_ATTEMPTS = 3


class Begun:
    """Counts for each run how often it was begun without ending."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / BEGUN_FILE
        try:
            noted = json.loads(self._path.read_text(encoding="utf-8"))
            self._attempts = {str(key): int(count) for key, count in noted.items()}
        except (OSError, ValueError, TypeError, AttributeError):
            self._attempts = {}  # no file, or damaged by a power failure

    def attempts(self, key: Key) -> int:
        return self._attempts.get(name_of(key), 0)

    def begin(self, key: Key) -> None:
        """Call before a run."""
        self._attempts[name_of(key)] = self.attempts(key) + 1
        self._write()

    def end(self, key: Key) -> None:
        """Call after a run, whether it succeeded or not."""
        del self._attempts[name_of(key)]
        self._write()

    def _write(self) -> None:
        """The file is complete on disk when this returns."""
        if not self._attempts:
            self._path.unlink(missing_ok=True)
            return
        fresh = self._path.with_suffix(".new")
        with open(fresh, "w", encoding="utf-8") as file:
            file.write(json.dumps(self._attempts, indent=1) + "\n")
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(self._path)


def name_of(key: Key) -> str:
    return " ".join(map(str, key))
