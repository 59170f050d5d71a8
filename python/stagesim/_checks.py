# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks of arguments, with one-line errors."""

from __future__ import annotations

import operator
from collections.abc import Iterable
from typing import Any

import numpy as np

MAX_SEED = 2**64 - 1
MAX_THREADS = 1024


def integer(value: Any, name: str, least: int, most: int | None = None) -> int:
    """Converts the value of the argument `name` to an int.

    Raises:
        TypeError: the value is no integer. Floats are refused, even whole ones.
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
    """Converts the value to a seed, 0 to 2**64 - 1. Raises TypeError or ValueError."""
    return integer(value, "a seed", 0, MAX_SEED)


def seeds(values: Iterable[Any], n: int) -> list[int]:
    """Converts the values to seeds. Raises ValueError unless there are exactly `n`."""
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise TypeError(f"found {_shown(values)} as seeds, expected {n} whole numbers")
    listed = [seed(value) for value in values]
    if len(listed) != n:
        raise ValueError(f"found {len(listed)} seeds, expected {n}")
    return listed


def threads(value: Any) -> int:
    """Converts the value to a number of threads, 1 to 1024. Raises TypeError or ValueError."""
    return integer(value, "the number of threads", 1, MAX_THREADS)


def steps(value: Any) -> int:
    """Converts the value to a number of steps, 0 or more. Raises TypeError or ValueError."""
    return integer(value, "the number of steps", 0)


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
