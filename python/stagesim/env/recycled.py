# SPDX-License-Identifier: GPL-2.0-or-later
"""Memory of large arrays that nobody uses any more.

The system gives a large array fresh pages, which it clears when they are first written. For observations that takes
longer than computing them, so arrays are used again once no other object refers to them.
"""

from __future__ import annotations

import sys
from collections import deque
from typing import Any

import numpy as np
import numpy.typing as npt

LEAST = 2**16  # bytes; smaller arrays are made anew
MOST = 6  # arrays that are kept of one shape and type, of which a learner may hold some
SHAPES = 32  # shapes and types of which arrays are kept
UNUSED = 2  # references to an array that nobody else uses: a variable, and the argument of getrefcount()

_kept: dict[tuple[tuple[int, ...], np.dtype[Any]], deque[npt.NDArray[Any]]] = {}


def empty(shape: tuple[int, ...], dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """An array as numpy.empty() makes it, perhaps in the memory of one that nobody uses any more."""
    kind = np.dtype(dtype)
    key = tuple(shape), kind
    if int(np.prod(shape)) * kind.itemsize < LEAST or not getattr(sys, "_is_gil_enabled", lambda: True)():
        return np.empty(shape, kind)
    arrays = _kept.get(key)
    if arrays is None:
        while len(_kept) >= SHAPES:
            _kept.pop(next(iter(_kept)), None)
        arrays = _kept.setdefault(key, deque())
    for _ in range(len(arrays)):
        try:
            array = arrays.popleft()  # another thread can't take it now
        except IndexError:
            break
        unused = sys.getrefcount(array) == UNUSED
        arrays.append(array)
        if unused:
            return array
    array = np.empty(shape, kind)
    if len(arrays) < MOST:
        arrays.append(array)
    return array
