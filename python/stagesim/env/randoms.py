# SPDX-License-Identifier: GPL-2.0-or-later
"""Random numbers of many episodes at once, each from a stream of its own."""

from __future__ import annotations

import math
from typing import Union

import numpy as np
import numpy.typing as npt

from .. import _core
from ..fleet import Floats

Bits = npt.NDArray[np.uint64]
Shape = Union[int, tuple[int, ...]]

# The constants of SplitMix64: Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014.
_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)


class Randoms:
    """Random numbers for the episodes that begin in m worlds.

    All arrays are of NumPy and have a first axis of m worlds. The numbers of a world depend only on its seed, on how
    many episodes it has begun since, and on the calls before. They don't depend on other worlds.

    Args:
        keys: a key of each world: uint64, shape (m,).
    """

    def __init__(self, keys: Bits) -> None:
        self._keys = keys
        self._calls = 0

    def __len__(self) -> int:
        return len(self._keys)

    def bits(self, shape: Shape = ()) -> Bits:
        """Whole numbers of 64 random bits: uint64, shape (m, *shape)."""
        axes = (shape,) if isinstance(shape, int) else tuple(shape)
        first = self._calls * 2**32 + 1
        self._calls += 1
        made = np.empty((len(self), math.prod(axes)), np.uint64)
        _core.find_bits(self._keys, first, made)
        return made.reshape(len(self), *axes)

    def split(self) -> Randoms:
        """Further streams, for a number of calls that differs between worlds."""
        return Randoms(self.bits())

    def part(self, rows: npt.ArrayLike) -> Randoms:
        """The streams of some of the worlds, as they are now."""
        made = Randoms(self._keys[np.asarray(rows)])
        made._calls = self._calls
        return made

    def uniform(self, shape: Shape = (), low: float | Floats = 0.0, high: float | Floats = 1.0) -> Floats:
        """Numbers from `low` up to below `high`: float64, shape (m, *shape)."""
        unit = (self.bits(shape) >> np.uint64(11)) * 2.0**-53
        return low + (high - low) * unit

    def integers(self, bound: int | npt.NDArray[np.int64], shape: Shape = ()) -> npt.NDArray[np.int64]:
        """Whole numbers from 0 to `bound` - 1, where `bound` is at most 2**31: int64, shape (m, *shape)."""
        return (self.uniform(shape) * bound).astype(np.int64)

    def normal(self, shape: Shape = ()) -> Floats:
        """Numbers of the standard normal distribution (Box and Muller, 1958): float64, shape (m, *shape)."""
        radius = np.sqrt(-2 * np.log(1 - self.uniform(shape)))
        return radius * np.cos(2 * math.pi * self.uniform(shape))

    def headings(self, count: int) -> Floats:
        """Angles from -pi to pi, radians: shape (m, count)."""
        return self.uniform(count, -math.pi, math.pi)


def mixed(values: Bits) -> Bits:
    """Mixes the bits of each number of an array."""
    values = (values ^ (values >> np.uint64(30))) * _FIRST
    values = (values ^ (values >> np.uint64(27))) * _SECOND
    return values ^ (values >> np.uint64(31))


def keys_of(seeds: Bits, begun: Bits) -> Bits:
    """Keys of streams of worlds with these seeds, in which so many episodes have begun: uint64, shape (m,)."""
    return mixed(mixed(seeds + _GAMMA) + begun * _GAMMA)
