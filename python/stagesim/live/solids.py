# SPDX-License-Identifier: GPL-2.0-or-later
"""Converts shapes of things to entities of Foxglove."""

from __future__ import annotations

from foxglove.messages import (
    Color, KeyValuePair, LinePrimitive, LinePrimitiveLineType, Point3, SceneEntity, TriangleListPrimitive)

from .._core import Thing
from ..shapes import Area, Corners, areas_of


def entity_of(thing: Thing, frame: str) -> SceneEntity:
    """The entity of a thing: the sides of all areas, and lids except for scenery, which may have holes."""
    triangles, lines = [], []
    for area in areas_of(thing.shape):
        triangles.append(_sides(area, lids=thing.robot or thing.movable))
        lines += [_edge(outline, area) for outline in area.outlines]
    metadata = [KeyValuePair(key="name", value=frame), KeyValuePair(key="type", value=thing.type)]
    return SceneEntity(frame_id=frame, id=str(thing.id), frame_locked=True, triangles=triangles, lines=lines,
                       metadata=metadata)


def _sides(area: Area, lids: bool) -> TriangleListPrimitive:
    points: list[Point3] = []
    corners: list[int] = []
    for outline in area.outlines:
        first, count = len(points), len(outline)
        points += [Point3(x=x, y=y, z=z) for z in (area.low, area.high) for x, y in outline]
        for i in range(count):
            a, b = first + i, first + (i + 1) % count
            corners += [a, b, b + count, a, b + count, a + count]
        if lids:
            top = first + count
            corners += [c for i in range(1, count - 1) for c in (top, top + i, top + i + 1)]
    return TriangleListPrimitive(points=points, indices=corners, color=_color(area.rgba))


def _edge(outline: Corners, area: Area) -> LinePrimitive:
    red, green, blue, opacity = area.rgba
    return LinePrimitive(type=LinePrimitiveLineType.LineLoop, thickness=1.5, scale_invariant=True,
                         points=[Point3(x=x, y=y, z=area.high) for x, y in outline],
                         color=_color((0.6 * red, 0.6 * green, 0.6 * blue, opacity)))


def _color(rgba: tuple[float, float, float, float]) -> Color:
    return Color(r=rgba[0], g=rgba[1], b=rgba[2], a=rgba[3])
