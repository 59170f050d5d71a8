# SPDX-License-Identifier: GPL-2.0-or-later
"""Seeds of many worlds."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Optional, Union

import numpy as np
import numpy.typing as npt

from .._options import checked

#: One seed for the first world, whose followers get the next numbers; a seed or None for each world; or None.
Seeds = Optional[Union[int, Iterable[Optional[int]]]]


def seeds_of(seed: Seeds, n: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.uint64]]:
    """The numbers of the worlds that get a seed, and these seeds.

    Raises TypeError or ValueError if a seed is not a whole number from 0 to 2**64 - 1, or their number is not n.
    """
    if seed is None:
        return np.zeros(0, np.int64), np.zeros(0, np.uint64)
    if not isinstance(seed, Iterable) or isinstance(seed, (str, bytes)):
        first = checked("seed", seed)
        checked("seed", first + n - 1)
        return np.arange(n), np.uint64(first) + np.arange(n, dtype=np.uint64)
    given = list(seed)
    if len(given) != n:
        raise ValueError(f"found {len(given)} seeds, expected {n}")
    ids = [i for i, number in enumerate(given) if number is not None]
    return np.array(ids, np.int64), np.array([checked("seed", given[i]) for i in ids], np.uint64)
