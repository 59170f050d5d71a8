# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks the arguments of cast()."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def poses(given: npt.ArrayLike) -> Floats:
    """Poses of shape (..., 3). Raises ValueError for another shape."""
    array = np.ascontiguousarray(given, np.float64)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"found poses of shape {array.shape}, expected (..., 3)")
    return array


def bearings(given: npt.ArrayLike) -> Floats:
    """Bearings of shape (k,). Raises ValueError for another shape."""
    angles = np.atleast_1d(np.asarray(given, np.float64))
    if angles.ndim != 1:
        raise ValueError(f"found bearings of shape {angles.shape}, expected (k,)")
    return angles


def check(max_range: float, ray_model: str | None) -> None:
    """Raises ValueError for a range or a ray model that there can't be."""
    if not max_range > 0:
        raise ValueError(f"found the range {max_range}, expected more than 0")
    if ray_model not in (None, "cell", "exact"):
        raise ValueError(f"found the ray model {ray_model!r}, expected 'cell' or 'exact'")


def result(shape: tuple[int, ...], out: Floats | None) -> Floats:
    """The array for the ranges. Raises ValueError if the one that was given doesn't fit."""
    if out is None:
        return np.empty(shape)
    if out.shape != shape or out.dtype != np.float64 or not out.flags.c_contiguous:
        raise ValueError(f"found an array to be filled of shape {out.shape}, {out.dtype}; "
                         f"expected {shape}, float64, contiguous")
    return out


def ignored(given: npt.ArrayLike | bool | None, count: int, robots: int) -> npt.NDArray[np.uint32]:
    """For each of `count` poses the number of the robot that its rays pass; 2**32 - 1: none. Raises ValueError."""
    nobody = 2**32 - 1
    if given is None or given is False:
        return np.full(count, nobody, np.uint32)
    numbers = np.arange(robots) if given is True else np.atleast_1d(np.asarray(given))
    if numbers.dtype.kind not in "iu":
        raise ValueError(f"found numbers of ignored robots of the type {numbers.dtype}, expected whole numbers or True")
    if numbers.shape not in ((1,), (count,)):
        raise ValueError(f"found {numbers.size} ignored robots, expected one for each of {count} poses")
    if numbers.size and not (-1 <= numbers.min() and numbers.max() < robots):
        raise ValueError(f"found the number of an ignored robot outside of -1 to {robots - 1}")
    return np.ascontiguousarray(np.broadcast_to(np.where(numbers < 0, nobody, numbers), (count,)), np.uint32)
