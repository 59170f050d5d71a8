# SPDX-License-Identifier: GPL-2.0-or-later
"""Overlaps of bodies with regions of space, and hulls of bodies. Bodies are upright prisms over polygons."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Iterable, Sequence

import numpy as np

from ..shapes import Area
from .messages import Array

Pose = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Prism:
    """An upright prism.

    Attributes:
        outlines: polygons from above, each with its corners x and y in order: shape (n, 2). One within another is a hole.
        low, high: its range of heights, metres.
    """

    outlines: Sequence[Array]
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Sphere:
    """A sphere with a centre x, y, z, and a radius, metres."""

    centre: Array
    radius: float


def prisms_of(areas: Iterable[Area], pose: Pose = (0.0, 0.0, 0.0), z: float = 0.0) -> list[Prism]:
    """The prisms of a body whose frame has the pose x, y, heading and the height z."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    turn = np.array([[c, s], [-s, c]])
    return [Prism([np.asarray(outline) @ turn + pose[:2] for outline in area.outlines], area.low + z, area.high + z)
            for area in areas]


def box_of(corner: Sequence[float], other: Sequence[float]) -> Prism:
    """The box with two opposite corners x, y, z. Two equal heights mean all heights."""
    (x0, x1), (y0, y1) = sorted((corner[0], other[0])), sorted((corner[1], other[1]))
    return Prism([np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])], *_heights([corner[2], other[2]]))


def hull_of(points: Array) -> Prism:
    """The prism over the convex hull, seen from above, of points x, y, z. Equal heights of all mean all heights.

    Raises:
        ValueError: from above, the points lie on a line.
    """
    outline = convex(points[:, :2])
    if len(outline) < 3:
        raise ValueError("found points on a line, expected three or more that span an area")
    return Prism([outline], *_heights(points[:, 2]))


def _heights(values: Iterable[float]) -> tuple[float, float]:
    low, high = min(values), max(values)
    return (low, high) if low < high else (-math.inf, math.inf)


def convex(points: Array) -> Array:
    """The corners of the convex hull of points, shape (n, 2), counterclockwise, without those on its sides."""
    ordered = np.unique(points, axis=0)  # sorted
    if len(ordered) < 3:
        return ordered.reshape(-1, 2)

    def chain(corners: Array) -> list[Array]:
        found: list[Array] = []
        for corner in corners:
            while len(found) > 1 and _turn(found[-2], found[-1], corner) <= 0:
                found.pop()
            found.append(corner)
        return found[:-1]

    return np.array(chain(ordered) + chain(ordered[::-1]))


def _turn(a: Array, b: Array, c: Array) -> Array:
    """Positive if the path from a over b to c turns to the left, for points of shape (..., 2)."""
    return np.asarray((b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1])
                      - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0]))


def overlaps(prism: Prism, region: Prism | Sphere) -> bool:
    """Whether a prism of a body overlaps the region or touches it."""
    if isinstance(region, Sphere):
        gap = max(0.0, prism.low - region.centre[2], region.centre[2] - prism.high)
        return math.hypot(distance(prism.outlines, region.centre[:2]), gap) <= region.radius
    if prism.high < region.low or prism.low > region.high:
        return False
    other = region.outlines[0]
    return contains(prism.outlines, other[0]) or any(
        contains(region.outlines, outline[0]) or _cross(outline, other) for outline in prism.outlines)


def contains(outlines: Sequence[Array], point: Array) -> bool:
    """Whether polygons with holes contain a point, by the number of sides to the right of the point."""
    a, b = np.concatenate(outlines), np.concatenate([np.roll(outline, -1, 0) for outline in outlines])
    straddles = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    a, b = a[straddles], b[straddles]
    x = a[:, 0] + (point[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool(np.count_nonzero(x > point[0]) % 2)


def distance(outlines: Sequence[Array], point: Array) -> float:
    """The distance of a point from polygons with holes; 0 inside."""
    if contains(outlines, point):
        return 0.0
    a = np.concatenate(outlines)
    along = np.concatenate([np.roll(outline, -1, 0) for outline in outlines]) - a
    lengths = np.maximum((along**2).sum(1), 1e-300)
    share = np.clip(((point - a) * along).sum(1) / lengths, 0, 1)
    return float(np.hypot(*(a + share[:, None] * along - point).T).min())


def _cross(one: Array, other: Array) -> bool:
    """Whether two polygons have sides that meet."""
    a, b = one[:, None], np.roll(one, -1, 0)[:, None]
    c, d = other[None], np.roll(other, -1, 0)[None]

    def lie_across(p: Array, q: Array, r: Array, s: Array) -> Array:
        """Whether r and s are on different sides of the line from p to q, or on it."""
        return np.asarray(np.sign(_turn(p, q, r)) * np.sign(_turn(p, q, s)) <= 0)

    boxes_meet = ((np.minimum(a, b) <= np.maximum(c, d)) & (np.minimum(c, d) <= np.maximum(a, b))).all(-1)
    return bool((lie_across(a, b, c, d) & lie_across(c, d, a, b) & boxes_meet).any())
