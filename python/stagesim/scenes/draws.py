# SPDX-License-Identifier: GPL-2.0-or-later
"""Random numbers that are equal on every platform and with every version of NumPy."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .._checks import integer


class Draws:
    """A stream of random numbers, made from the raw bits of PCG64, which NumPy promises to keep."""

    def __init__(self, seed: int) -> None:
        self._bits = np.random.PCG64(integer(seed, "the seed", 0))

    def fractions(self, *shape: int) -> npt.NDArray[np.float64]:
        """Numbers from 0 up to, but without, 1."""
        raw = self._bits.random_raw(int(np.prod(shape, dtype=int)))
        return ((raw >> np.uint64(11)) * 2.0**-53).reshape(shape)

    def below(self, limit: int) -> int:
        """A whole number from 0 to limit - 1."""
        return int(self.fractions(1)[0] * limit)

    def between(self, least: int, most: int) -> int:
        """A whole number from `least` to `most`."""
        return least + self.below(most - least + 1)

    def order(self, count: int) -> npt.NDArray[np.int64]:
        """The numbers from 0 to count - 1 in random order."""
        return np.argsort(self._bits.random_raw(count), kind="stable")
