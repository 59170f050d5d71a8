# SPDX-License-Identifier: GPL-2.0-or-later
"""Overlaps of bodies with regions of space."""

from __future__ import annotations

import math

import numpy as np
import pytest
from stagesim.ros.regions import Prism, Sphere, box_of, convex, distance, hull_of, overlaps, prisms_of
from stagesim.shapes import Area

SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
ARCH = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [2.0, 2.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]])


def test_the_distance_of_a_polygon_is_that_of_its_nearest_side() -> None:
    assert distance([SQUARE], np.array([1.0, 1.0])) == 0
    assert distance([SQUARE], np.array([3.0, 1.0])) == pytest.approx(1)
    assert distance([SQUARE], np.array([3.0, 3.0])) == pytest.approx(math.sqrt(2))
    assert distance([ARCH], np.array([1.5, 1.75])) == pytest.approx(0.5)  # in the opening


@pytest.mark.parametrize("gap", [0.0, 0.6, 0.999])
def test_a_sphere_meets_a_prism_within_its_radius(gap: float) -> None:
    prism = Prism([SQUARE], 0.0, 1.0)
    reach = math.sqrt(1 - gap**2)  # of a sphere of radius 1 at that height above the prism
    for far, expected in ((reach - 1e-9, True), (reach + 1e-9, False)):
        assert overlaps(prism, Sphere(np.array([2 + far, 1.0, 1 + gap]), 1.0)) is expected
    assert not overlaps(prism, Sphere(np.array([1.0, 1.0, 2.1]), 1.0))


@pytest.mark.parametrize(("low", "high", "expected"), [
    ((1.2, 1.2, 0), (1.8, 1.9, 1), False),  # in the opening of the arch
    ((1.2, 0.9, 0), (1.8, 1.9, 1), True),  # a side lies in the box
    ((-1, -1, 0), (4, 3, 1), True),  # the body is inside
    ((0.2, 0.2, 0), (0.4, 0.4, 1), True),  # the box is inside
    ((0.2, 0.2, 1.1), (0.4, 0.4, 2), False),  # above the body
    ((0.2, 0.2, 5), (0.4, 0.4, 5), True),  # all heights
    ((3.0, 0.5, 0), (4, 0.6, 1), True),  # they touch
    ((3.01, 0.5, 0), (4, 0.6, 1), False)])
def test_a_box_meets_a_prism_with_an_opening(low: tuple[float, ...], high: tuple[float, ...], expected: bool) -> None:
    assert overlaps(Prism([ARCH], 0.0, 1.0), box_of(high, low)) is expected


def test_hulls_have_the_outermost_points() -> None:
    points = np.array([[0, 0], [1, 0], [2, 0], [2, 2], [0, 2], [1, 1], [2, 1]], float)
    assert sorted(map(tuple, convex(points))) == [(0, 0), (0, 2), (2, 0), (2, 2)]
    made = hull_of(np.column_stack([points, np.arange(7.0)]))
    assert (made.low, made.high) == (0, 6) and len(made.outlines[0]) == 4
    with pytest.raises(ValueError, match="on a line"):
        hull_of(np.array([[0, 0, 0], [1, 1, 0], [2, 2, 5]], float))


def test_prisms_are_turned_and_moved() -> None:
    area = Area((0, 0, 0, 1), 0.0, 0.5, [[(1.0, 0.0), (2.0, 0.0), (2.0, 1.0)]])
    prism, = prisms_of([area], (10.0, 20.0, math.pi / 2), 0.25)
    assert prism.outlines[0] == pytest.approx(np.array([[10, 21], [10, 22], [9, 22]]))
    assert (prism.low, prism.high) == (0.25, 0.75)


def test_a_hole_belongs_to_no_body() -> None:
    ring = Prism([4 * SQUARE - 4, SQUARE - 1], 0.0, 1.0)  # 8 m, with a hole of 2 m around the origin
    assert not overlaps(ring, box_of((-0.9, -0.9, 0), (0.9, 0.9, 1))) and overlaps(ring, box_of((0, 0, 0), (1.1, 0, 1)))
    assert distance(ring.outlines, np.zeros(2)) == pytest.approx(1) and distance(ring.outlines, np.full(2, 2.0)) == 0
