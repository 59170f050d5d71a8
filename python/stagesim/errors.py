# SPDX-License-Identifier: GPL-2.0-or-later
"""The exceptions of stagesim."""

from __future__ import annotations

import re


class StageError(Exception):
    """The simulator can't do what was asked. The message says what was found and what was expected."""


class WorldError(StageError):
    """A world can't be loaded.

    Attributes:
        file: the file with the error: the world file or one that it includes; None: no file is at fault.
        line: line number, from 1; None: unknown.
        column: column in the line, from 1; None: unknown.
        message: the error without its place.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        place = re.match(r"(.*?):(\d+):(\d+): ", text, re.S)
        self.file: str | None = place.group(1) if place else None
        self.line: int | None = int(place.group(2)) if place else None
        self.column: int | None = int(place.group(3)) if place else None
        self.message: str = text[place.end():] if place else text

    def _about(self, path: str, name: str) -> WorldError:
        """This error with `path` replaced by `name`; `file` is set even if the error has no line."""
        if not str(self).startswith(path + ":"):
            return self
        error = WorldError(name + str(self)[len(path):])
        if error.file is None:
            error.file, error.message = name, str(error)[len(name) + 2:]
        return error

    def _with(self, advice: str) -> WorldError:
        """Returns this error with advice appended."""
        return WorldError(f"{self}{advice}") if advice else self


class GoneError(StageError, LookupError):
    """A model or a world does not exist, or no longer exists."""
