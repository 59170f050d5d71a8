# SPDX-License-Identifier: GPL-2.0-or-later
"""Random numbers of many episodes at once, each from a stream of its own."""

from __future__ import annotations

import math
from typing import Any, Union

from .arrays import Array, Arrays

# The constants of SplitMix64: Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014, as signed
# 64-bit numbers. All arithmetic is modulo 2**64.
_GAMMA = 0x9E3779B97F4A7C15 - 2**64
_FIRST = 0xBF58476D1CE4E5B9 - 2**64
_SECOND = 0x94D049BB133111EB - 2**64

Shape = Union[int, tuple[int, ...]]


class Randoms:
    """Random numbers for the episodes that begin in m worlds.

    All arrays have a first axis of m worlds. The numbers of a world depend only on its seed, on how many episodes it
    has begun since, and on the calls before. They don't depend on other worlds, or on the library of the arrays, with
    the exception of the last bits of normal().

    Args:
        keys: a key of each world: int64, shape (m,).
        arrays: the library of the arrays.
    """

    def __init__(self, keys: Array, arrays: Arrays) -> None:
        self._keys = keys
        self._arrays = arrays
        self._calls = 0

    def __len__(self) -> int:
        return int(self._keys.shape[0])

    def bits(self, shape: Shape = ()) -> Array:
        """Whole numbers of 64 random bits: int64, shape (m, *shape)."""
        axes = (shape,) if isinstance(shape, int) else tuple(shape)
        count = math.prod(axes)
        xp = self._arrays.xp
        first = self._calls * 2**32 + 1
        self._calls += 1
        counters = xp.arange(first, first + count, dtype=xp.int64, **self._place())
        return xp.reshape(mixed(self._keys[:, None] + counters * _GAMMA), (len(self), *axes))

    def split(self) -> Randoms:
        """Further streams, for a number of calls that differs between worlds."""
        return Randoms(self.bits(), self._arrays)

    def part(self, rows: Array) -> Randoms:
        """The streams of some of the worlds, as they are now."""
        made = Randoms(self._keys[rows], self._arrays)
        made._calls = self._calls
        return made

    def uniform(self, shape: Shape = (), low: float | Array = 0.0, high: float | Array = 1.0) -> Array:
        """Numbers from `low` up to below `high`: float64, shape (m, *shape)."""
        xp = self._arrays.xp
        unit = xp.astype(_shifted(self.bits(shape), 11), xp.float64) * 2.0**-53
        return low + (high - low) * unit

    def integers(self, bound: int | Array, shape: Shape = ()) -> Array:
        """Whole numbers from 0 to `bound` - 1, where `bound` is at most 2**31: int64, shape (m, *shape)."""
        xp = self._arrays.xp
        return xp.astype(xp.floor(self.uniform(shape) * bound), xp.int64)

    def normal(self, shape: Shape = ()) -> Array:
        """Numbers of the standard normal distribution (Box and Muller, 1958): float64, shape (m, *shape)."""
        xp = self._arrays.xp
        radius = xp.sqrt(-2 * xp.log(1 - self.uniform(shape)))
        return radius * xp.cos(2 * math.pi * self.uniform(shape))

    def headings(self, count: int) -> Array:
        """Angles from -pi to pi, radians: shape (m, count)."""
        return self.uniform(count, -math.pi, math.pi)

    def _place(self) -> dict[str, Any]:
        return {} if self._arrays.is_numpy else {"device": self._keys.device}


def mixed(values: Array) -> Array:
    """Mixes the bits of each number: int64."""
    values = (values ^ _shifted(values, 30)) * _FIRST
    values = (values ^ _shifted(values, 27)) * _SECOND
    return values ^ _shifted(values, 31)


def keys_of(seeds: Array, begun: Array) -> Array:
    """Keys of streams: of worlds with these seeds, in which so many episodes have begun. All are int64."""
    return mixed(mixed(seeds + _GAMMA) + begun * _GAMMA)


def _shifted(values: Array, by: int) -> Array:
    """Shifts the bits of signed numbers to the right and fills in zeros."""
    return (values >> by) & (2**(64 - by) - 1)
