# SPDX-License-Identifier: GPL-2.0-or-later
"""Shapes of things, which scene.hh defines, as polygons with heights."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

Corners = list[tuple[float, float]]


@dataclass(frozen=True)
class Area:
    """Polygons of one colour and height range; `low` and `high` are in metres."""

    rgba: tuple[float, float, float, float]  #: each component is 0 to 1
    low: float
    high: float
    outlines: list[Corners]


def areas_of(shape: bytes) -> Iterator[Area]:
    """Yields the areas of a packed shape."""
    at = 0
    while at < len(shape):
        red, green, blue, opacity, low, high, count = struct.unpack_from("<4BffI", shape, at)
        at += 16
        outlines = []
        for _ in range(count):
            (corners,) = struct.unpack_from("<I", shape, at)
            values = struct.unpack_from(f"<{2 * corners}f", shape, at + 4)
            outlines.append(list(zip(values[::2], values[1::2])))
            at += 4 + 8 * corners
        yield Area((red / 255, green / 255, blue / 255, opacity / 255), low, high, outlines)
