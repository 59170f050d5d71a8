# SPDX-License-Identifier: GPL-2.0-or-later
"""Arguments that are checked before they go further, so that what is wrong with one is said in one line."""

from __future__ import annotations

import operator
from collections.abc import Iterable
from typing import Any

import numpy as np

MOST_SEED = 2**64 - 1
MOST_THREADS = 1024


def integer(value: Any, name: str, least: int, most: int | None = None) -> int:
    """The value as an int.

    Raises:
        TypeError: it is no integer. Floats are refused, whole ones too: a fraction would be cut off unseen.
        ValueError: it is less than `least` or more than `most`.
    """
    expected = f"a whole number, {least} or more" if most is None else f"a whole number, {least} to {most}"
    if isinstance(value, (bool, np.bool_)):
        raise TypeError(f"found {value!r} as {name}, expected {expected}")
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"found {_shown(value)} as {name}, expected {expected}") from None
    if number < least or (most is not None and number > most):
        raise ValueError(f"found {number} as {name}, expected {expected}")
    return number


def seed(value: Any) -> int:
    """The value as a seed, 0 to 2**64 - 1; TypeError or ValueError if it is none."""
    return integer(value, "a seed", 0, MOST_SEED)


def seeds(values: Iterable[Any], n: int) -> list[int]:
    """The values as seeds; ValueError unless there are `n`."""
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise TypeError(f"found {_shown(values)} as seeds, expected {n} whole numbers")
    listed = [seed(value) for value in values]
    if len(listed) != n:
        raise ValueError(f"found {len(listed)} seeds, expected {n}")
    return listed


def threads(value: Any) -> int:
    """The value as a number of threads, 1 to 1024; TypeError or ValueError if it is none."""
    return integer(value, "the number of threads", 1, MOST_THREADS)


def steps(value: Any) -> int:
    """The value as a number of steps, 0 or more; TypeError or ValueError if it is none."""
    return integer(value, "the number of steps", 0)


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
