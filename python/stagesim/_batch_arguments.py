# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks arguments of the functions of a batch."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
#: Numbers of worlds or of variants.
Numbers = npt.NDArray[np.uint32]


def moves(pose: npt.ArrayLike, which: npt.ArrayLike | None, shape: tuple[int, int]) -> tuple[Floats, Bools]:
    """Poses of shape (*shape, 3) and a mask of those to move; raises ValueError if one of these is not finite."""
    mask = np.ascontiguousarray(np.broadcast_to(True if which is None else which, shape), bool)
    poses = np.ascontiguousarray(np.broadcast_to(pose, (*shape, 3)), np.float64)
    if not np.isfinite(poses).all() and not np.isfinite(poses[mask]).all():  # the second takes several times as long
        raise ValueError("found a pose that is not finite")
    return poses, mask


def device_choice(device: str | None) -> str | None:
    """The device as after `stage --opencl=`; None: none."""
    if device is None:
        return None
    kind, _, choice = device.partition(":") if isinstance(device, str) else ("", "", "")
    if kind != "opencl":
        raise ValueError(f"found the device {device!r}, expected None, \"opencl\", or \"opencl:NAME\" with a name as "
                         "after stage --opencl=")
    return choice


def variant_numbers(given: npt.ArrayLike, n: int, count: int) -> Numbers:
    """Numbers of `n` variants, below `count`."""
    array = np.asarray(given)
    if array.dtype.kind not in "iu":
        raise TypeError(f"found variants of the type {array.dtype}, expected whole numbers")
    if array.shape not in ((), (n,)):
        raise ValueError(f"found variants of shape {array.shape}, expected ({n},)")
    if array.size and not (0 <= array.min() and array.max() < count):
        raise ValueError(f"found a variant outside of 0 to {count - 1}")
    return np.ascontiguousarray(np.broadcast_to(array, (n,)), np.uint32)
