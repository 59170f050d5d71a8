# SPDX-License-Identifier: GPL-2.0-or-later
"""Fields of a world as pictures of shades, which lie on the floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .._core import field_frame
from ..field import Field
from ..world import World

MAX_PATCHES = 160  #: max number of columns and of rows of a picture, as in the window


@dataclass(frozen=True)
class FieldPicture:
    """The values of a field as shades, in patches of equal numbers of cells; the last of a row may have fewer."""

    id: int  #: that of the model
    pose: tuple[float, float, float]  #: global x, y (metres) and heading (radians) of the middle
    size: tuple[float, float]  #: metres
    patch: tuple[float, float]  #: width and height of a patch, metres
    rgb: tuple[int, int, int]  #: the colour of the field, each part 0 to 255
    shape: tuple[int, int]  #: numbers of rows and columns
    shades: bytes  #: a byte for each patch: 0 at the lowest mean of all, 255 at the highest; the southern row first


def pictures_of(world: World) -> dict[int, FieldPicture]:
    """Returns the pictures of all fields, by the numbers of the models."""
    pictures = (picture_of(field) for field in world.fields.values())
    return {picture.id: picture for picture in pictures}


def picture_of(field: Field) -> FieldPicture:
    """Returns the picture of a field."""
    step = 1 + (max(field.shape) - 1) // MAX_PATCHES
    shades = _shades(_means(field.values, step))
    width, height = field.cell_size
    rows, columns = field.shape
    red, green, blue = (round(255 * part) for part in field.model.color[:3])
    return FieldPicture(field.model.id, field_frame(field.model), (columns * width, rows * height),
                        (step * width, step * height), (red, green, blue), (shades.shape[0], shades.shape[1]),
                        shades.tobytes())


def _means(values: npt.NDArray[np.float64], step: int) -> npt.NDArray[np.float64]:
    """The means of patches of `step` times `step` values."""
    if step == 1:
        return values
    starts = [np.arange(0, count, step) for count in values.shape]
    counts = [np.diff(start, append=count) for start, count in zip(starts, values.shape)]
    sums = np.add.reduceat(np.add.reduceat(values, starts[0], 0), starts[1], 1)
    means: npt.NDArray[np.float64] = sums / np.outer(*counts)
    return means


def _shades(means: npt.NDArray[np.float64]) -> npt.NDArray[np.uint8]:
    """The means from 0 at the lowest one to 255 at the highest one. If all are equal, they are 255, or 0 for zeros."""
    lowest, highest = means.min(), means.max()
    if not highest > lowest:
        return np.full(means.shape, 0 if highest == 0 else 255, np.uint8)
    return np.rint((means - lowest) / (highest - lowest) * 255).astype(np.uint8)
