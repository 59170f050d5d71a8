# SPDX-License-Identifier: GPL-2.0-or-later
"""The exceptions of stagesim."""

from __future__ import annotations

import re


class StageError(Exception):
    """Something that the simulator can't do. Its text says what was found, and what was expected."""


class WorldError(StageError):
    """A world that can't be loaded.

    Attributes:
        file: the world file, or what it includes, or None if the mistake is in none.
        line: where in it, from 1, or None.
        column: where in the line, from 1, or None.
        message: what was found there, and what was expected.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        place = re.match(r"(.*?):(\d+):(\d+): ", text, re.S)
        self.file: str | None = place.group(1) if place else None
        self.line: int | None = int(place.group(2)) if place else None
        self.column: int | None = int(place.group(3)) if place else None
        self.message: str = text[place.end():] if place else text

    def _about(self, path: str, name: str) -> WorldError:
        """The same of a file that is called otherwise, and known even where no line is at fault."""
        if not str(self).startswith(path + ":"):
            return self
        error = WorldError(name + str(self)[len(path):])
        if error.file is None:
            error.file, error.message = name, str(error)[len(name) + 2:]
        return error


class GoneError(StageError, LookupError):
    """A model, or a world, that does not exist any more, or never did."""
