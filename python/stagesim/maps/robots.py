# SPDX-License-Identifier: GPL-2.0-or-later
"""Robots of a map: macros of the shipped worlds, at places."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

from .._checks import shown
from .._paths import WORLDS

EXPECTED = "MACRO:X,Y or MACRO:X,Y,DEGREES, such as turtlebot3_burger:1,2,90"


@dataclass(frozen=True)
class PlacedRobot:
    """A robot that a macro describes.

    Args:
        macro: name of the macro.
        x, y: metres.
        degrees: the heading.
        include: the file with the macro, as a world file includes it.
    """

    macro: str
    x: float = 0.0
    y: float = 0.0
    degrees: float = 0.0
    include: str = ""

    def line(self, name: str) -> str:
        """The line of a world file with units of degrees."""
        return f'{self.macro}( name "{name}" pose [{self.x!r} {self.y!r} 0 {self.degrees!r}] )'


def robot_of(text: str) -> PlacedRobot:
    """Returns the robot that MACRO:X,Y,DEGREES describes; without a place it is at the origin.

    Raises:
        ValueError: the text has a mistake, or no shipped file of robots has the macro.
    """
    macro, colon, place = text.partition(":")
    try:
        numbers = [float(number) for number in place.split(",")] if colon else [0.0, 0.0]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not all(map(math.isfinite, numbers)):
        raise ValueError(f"found the robot {shown(text)}, expected {EXPECTED}")
    known = shipped_macros()
    if macro not in known:
        raise ValueError(f"found the robot {shown(macro)}, expected {', '.join(sorted(known))}")
    x, y, degrees = [*numbers, 0.0][:3]
    return PlacedRobot(macro, x, y, degrees, known[macro])


def shipped_macros() -> dict[str, str]:
    """Files of shipped robots by the names of their macros."""
    found = {}
    for file in sorted(Path(WORLDS[0], "robots").glob("*.inc")):
        for macro in re.findall(r"^define\s+(\w+)\s+position\b", file.read_text(encoding="utf-8"), re.MULTILINE):
            found[macro] = f"robots/{file.name}"
    return found
