# SPDX-License-Identifier: GPL-2.0-or-later
"""The contacts of the worlds of a batch as arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from . import _core

Floats = npt.NDArray[np.float64]


class BatchContacts(NamedTuple):
    """The places where bodies touch in the worlds of a batch, see Contacts. Unused elements are -1 or NaN."""

    models: npt.NDArray[np.int64]
    """Shape (worlds, most, 2): `Model.id` of both models. The first one can move."""
    robots: npt.NDArray[np.int64]
    """Shape (worlds, most, 2): numbers of their robots, in the order of `Batch.names`; -1: it belongs to none."""
    points: Floats
    """Shape (worlds, most, 2): x and y in metres, halfway between the outlines."""
    normals: Floats
    """Shape (worlds, most, 2): unit vectors from the first model to the second."""
    gaps: Floats
    """Shape (worlds, most): distances of the outlines in metres, usually 0.0004."""


def found(core: _core.Batch, chosen: npt.NDArray[np.uint32], most: int) -> BatchContacts:
    """The contacts of these worlds, up to `most` of each."""
    models, robots = (np.full((len(chosen), most, 2), -1, np.int64) for _ in range(2))
    numbers = np.full((len(chosen), most, 5), np.nan)
    core.find_contacts(chosen, models, robots, numbers)
    return BatchContacts(models, robots, numbers[..., :2], numbers[..., 2:4], numbers[..., 4])
