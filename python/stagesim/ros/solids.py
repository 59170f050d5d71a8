# SPDX-License-Identifier: GPL-2.0-or-later
"""Boxes and cylinders that stand for the bodies of robots, and their inertia."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence

import numpy as np

from ..shapes import Corners
from .messages import Array

MIN_ROUND = 12  #: corners of an outline that counts as round


@dataclass(frozen=True, eq=False)
class Solid:
    """A box or an upright cylinder.

    Attributes:
        is_round: True: a cylinder.
        size: radius and height of a cylinder, or length, width and height of a box, metres.
        middle: x, y, z of its centre, metres.
        turn: the heading of a box, radians.
    """

    is_round: bool
    size: tuple[float, ...]
    middle: tuple[float, float, float]
    turn: float = 0.0

    @property
    def volume(self) -> float:
        """Cubic metres."""
        return math.pi * self.size[0]**2 * self.size[1] if self.is_round else math.prod(self.size)

    def inertia(self) -> Array:
        """Moments of inertia of one kilogram about the centre, square metres: shape (3, 3)."""
        if self.is_round:
            radius, height = self.size
            across = radius**2 / 4 + height**2 / 12
            return np.diag([across, across, radius**2 / 2])
        x, y, z = (side**2 / 12 for side in self.size)
        c, s = math.cos(self.turn), math.sin(self.turn)
        turned = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        return np.asarray(turned @ np.diag([y + z, x + z, x + y]) @ turned.T)


def inertia_of(mass: float, solids: Sequence[Solid]) -> tuple[Array, Array]:
    """Centre of mass (metres) and moments of inertia about it (kg m2, shape (3, 3)) of solids of one density.

    Without a volume, the mass is a point at the origin.
    """
    volume = sum(solid.volume for solid in solids)
    if not volume > 0:
        return np.zeros(3), np.zeros((3, 3))
    masses = np.array([mass * solid.volume / volume for solid in solids])
    places = np.array([solid.middle for solid in solids])
    middle = masses @ places / mass
    inertia = np.zeros((3, 3))
    for part, solid, offset in zip(masses, solids, places - middle):
        inertia += part * (solid.inertia() + offset @ offset * np.eye(3) - np.outer(offset, offset))
    return middle, inertia


def solid_of(outline: Corners, low: float, high: float) -> Solid:
    """A cylinder for a round outline, a box for a rectangle, and the box around any other outline."""
    corners = np.round(outline, 6)  # shapes have single precision
    middle, z, height = (corners.min(0) + corners.max(0)) / 2, (low + high) / 2, high - low
    radii = np.hypot(*(corners - middle).T)
    if len(corners) >= MIN_ROUND and np.ptp(radii) < 0.02 * radii.max():
        return Solid(True, (round(radii.max(), 5), height), (*middle, z))
    if not is_rectangle(corners):
        return Solid(False, (*np.ptp(corners, 0), height), (*middle, z))
    turn = math.atan2(corners[1, 1] - corners[0, 1], corners[1, 0] - corners[0, 0])
    sides = [round(math.dist(corners[i], corners[i + 1]), 5) for i in (0, 1)]
    return Solid(False, (*sides, height), (*corners.mean(0), z), turn)


def is_rectangle(corners: Array) -> bool:
    """True for four corners with right angles."""
    if len(corners) != 4:
        return False
    sides = np.roll(corners, -1, 0) - corners
    across = np.abs((sides * np.roll(sides, -1, 0)).sum(1))
    return bool((across < 1e-3 * (sides**2).sum(1).max()).all())
