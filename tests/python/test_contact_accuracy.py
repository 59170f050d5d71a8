# SPDX-License-Identifier: GPL-2.0-or-later
"""Contacts of outlines agree with closed forms, as docs/accuracy.md and docs/motion.md say."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

from benchkit.contacts import (  # noqa: E402  pylint: disable=wrong-import-position
    SQUARE_ARM, Setting, gaps, push, push_in_theory, slide, slide_in_theory)


def test_closed_forms_begin_and_end_as_they_must() -> None:
    """The limits of both formulae, which need no simulation."""
    assert SQUARE_ARM == pytest.approx(0.38259785 * 0.4)
    times = np.array([0.0, 1e-3, 30.0])
    with_friction = slide_in_theory(times, 0.2)
    assert with_friction.ways[1] / times[1] == pytest.approx(0.5 * (0.75 ** 0.5 - 0.2 * 0.5), rel=1e-3)
    assert with_friction.headings[-1] == pytest.approx(np.pi / 2)  # the robot faces the wall
    np.testing.assert_allclose(slide_in_theory(times, 1e-5).ways[:2], slide_in_theory(times, 0).ways[:2],
                               rtol=1e-4, atol=1e-9)
    centred = push_in_theory(np.array([0.0, 0.3]), 1e-12)
    assert centred.x[1] == pytest.approx(0.3) and centred.turns[1] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("cell", [0.02, 0.1])
def test_gaps_to_walls_do_not_depend_on_speed_heading_cells_and_step(cell: float) -> None:
    np.testing.assert_allclose(gaps(Setting("outlines", cell, 100)), 4e-4, atol=1e-6)
    assert gaps(Setting("cells", cell, 100)).max() > 2 * cell


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_a_robot_slides_along_a_wall_as_the_closed_form_says(friction: float) -> None:
    found = slide(Setting(), friction, 5)
    theory = slide_in_theory(found.times, friction)
    np.testing.assert_allclose(found.ways, theory.ways, atol=0.005 * theory.ways[-1])
    np.testing.assert_allclose(found.headings, theory.headings, atol=0.004)
    assert found.ways[-1] > 0.5


@pytest.mark.parametrize("offset", [0.02, 0.05, 0.1])
def test_a_box_turns_as_lynch_and_mason_say(offset: float) -> None:
    found = push(Setting(), offset, 0.4)
    theory = push_in_theory(found.advances, offset)
    np.testing.assert_allclose(found.turns, theory.turns, atol=0.005 * abs(theory.turns[-1]))
    np.testing.assert_allclose(found.x, theory.x, atol=0.0005)
    np.testing.assert_allclose(found.y, theory.y, atol=0.0005)
    assert abs(found.turns[-1]) > 0.2
