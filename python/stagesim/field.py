# SPDX-License-Identifier: GPL-2.0-or-later
"""Fields: numbers on the floor, such as a pheromone, as arrays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from . import _core
from ._core import Model

Floats = npt.NDArray[np.float64]


def _places(given: npt.ArrayLike) -> Floats:
    """Places of shape (..., 2): the first two columns of poses are places, too. Raises ValueError."""
    array = np.asarray(given, np.float64)
    if array.ndim == 0 or array.shape[-1] not in (2, 3):
        raise ValueError(f"found places of shape {array.shape}, expected (..., 2), or poses of shape (..., 3)")
    return np.ascontiguousarray(array[..., :2])


class Field:
    """A grid of numbers on the floor: see `World.fields` and docs/fields.md.

    Its functions take effect at once and are for use between steps. Robots deposit during steps by ground sensors:
    `Model.deposit_rate`. Fleet.sensor("groundsensor") has what they read.
    """

    def __init__(self, model: Model) -> None:
        self.model = model  #: its model, with its name, pose and size
        self._rows, self._columns, *_ = _core.field_grid(model)

    def __repr__(self) -> str:
        return f"<Field {self.model.name!r} of {self._rows} x {self._columns} cells>"

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        return self._rows, self._columns

    @property
    def cell_size(self) -> tuple[float, float]:
        """Width and height of a cell, metres."""
        _, _, width, height = _core.field_grid(self.model)
        return width, height

    @property
    def values(self) -> Floats:
        """All values as a new array of shape (rows, columns).

        Row 0 is the southern one and column 0 the western one, in the frame of the field. Setting it takes any array
        that can be broadcast to that shape, with finite numbers up to 1e100; values nearer to 0 than 1e-30 become 0.
        """
        array = np.empty(self.shape)
        _core.copy_field_values(self.model, array)
        return array

    @values.setter
    def values(self, given: npt.ArrayLike) -> None:
        array = np.asarray(given, np.float64)
        try:
            full = np.ascontiguousarray(np.broadcast_to(array, self.shape))
        except ValueError:
            raise ValueError(f"found values of shape {array.shape}, expected {self.shape}") from None
        _core.set_field_values(self.model, full)

    @property
    def integral(self) -> float:
        """Sum of the values, each times the area of a cell."""
        return _core.field_integral(self.model)

    @property
    def diffusion(self) -> float:
        """How fast values spread, m^2/s, 0 or more."""
        return _core.field_rates(self.model)[0]

    @diffusion.setter
    def diffusion(self, rate: float) -> None:
        _core.set_field_rates(self.model, float(rate), self.evaporation)

    @property
    def evaporation(self) -> float:
        """How fast values decay, 1/s, 0 or more: by the factor exp(-evaporation t)."""
        return _core.field_rates(self.model)[1]

    @evaporation.setter
    def evaporation(self, rate: float) -> None:
        _core.set_field_rates(self.model, self.diffusion, float(rate))

    def read(self, places: npt.ArrayLike, interpolation: str = "linear") -> Floats:
        """Returns the values at places in the world frame.

        Args:
            places: x and y in metres, shape (..., 2); or poses, shape (..., 3).
            interpolation: "linear" between the middles of cells, or "nearest": the values of the cells.

        Returns:
            Values of shape (...); 0 outside of the field.

        Raises:
            ValueError: an argument has a wrong shape, or there is no such interpolation.
        """
        if interpolation not in ("linear", "nearest"):
            raise ValueError(f"found the interpolation {interpolation!r}, expected 'linear' or 'nearest'")
        at = _places(places)
        found = np.empty(at.shape[:-1])
        _core.read_field(self.model, at.reshape(-1, 2), interpolation == "linear", found.reshape(-1))
        return found

    def deposit(self, places: npt.ArrayLike, amounts: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Adds amounts to the cells at places in the world frame, one after the other.

        Args:
            places: x and y in metres, shape (..., 2); or poses, shape (..., 3).
            amounts: by how much the integral grows, shape (...) or a number: the value of a cell grows by the amount
                divided by the area of a cell.

        Returns:
            True where it was done, shape (...): not outside of the field, and not for amounts that are not finite.

        Raises:
            ValueError: an argument has a wrong shape.
        """
        at = _places(places)
        array = np.asarray(amounts, np.float64)
        try:
            each = np.ascontiguousarray(np.broadcast_to(array, at.shape[:-1]))
        except ValueError:
            raise ValueError(f"found amounts of shape {array.shape}, expected {at.shape[:-1]} or a number") from None
        done = np.zeros(at.shape[:-1], np.bool_)
        _core.deposit_in_field(self.model, at.reshape(-1, 2), each.reshape(-1), done.reshape(-1))
        return done
