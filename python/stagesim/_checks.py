# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks of arguments, with one-line errors."""

from __future__ import annotations

import operator
import re
from typing import Any

import numpy as np


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
        raise TypeError(f"found {shown(value)} as {name}, expected {expected}") from None
    if number < least or (most is not None and number > most):
        raise ValueError(f"found {number} as {name}, expected {expected}")
    return number


def steps(value: Any) -> int:
    """Converts the value to a number of steps, 0 or more. Raises TypeError or ValueError."""
    return integer(value, "the number of steps", 0)


def shown(value: Any) -> str:
    """A short representation of the value in one line, for messages."""
    text = re.sub(r"\s*\n\s*", " ", repr(value))
    return text if len(text) <= 80 else text[:77] + "..."
