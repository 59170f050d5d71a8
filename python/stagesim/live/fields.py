# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks the values that clients send, with one-line errors.

All functions but found() take a JSON object and the name of a field, and raise ValueError if its value is invalid.
"""

from __future__ import annotations

import math
from typing import Any

MAX_NUMBER = 1e300
_LONGEST = 40  # max characters of a value in a message


def found(value: Any) -> str:
    """Formats a value for a message, shortened, because it may have any size."""
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**_LONGEST:
        return f"a number of {len(f'{abs(value):x}')} hexadecimal digits"  # Python limits decimal conversions
    if isinstance(value, (list, dict)):
        return "a list" if isinstance(value, list) else "an object"
    return "nothing" if value is None else ascii(value)[:_LONGEST]


def number(fields: dict[str, Any], name: str, default: float | None = None) -> float:
    """A finite number with an absolute value up to MAX_NUMBER."""
    value = fields.get(name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= MAX_NUMBER:
        raise ValueError(f"{name}: found {found(value)}, expected a number")
    return float(value)


def integer(fields: dict[str, Any], name: str, default: int | None = None) -> int:
    """An unsigned 32-bit integer."""
    value = fields.get(name, default)
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not is_number or not 0 <= value < 2**32 or value != math.floor(value):
        raise ValueError(f"{name}: found {found(value)}, expected a whole number, 0 to {2**32 - 1}")
    return int(value)


def flag(fields: dict[str, Any], name: str, default: bool | None = None) -> bool:
    """True or false."""
    value = fields.get(name, default)
    if not isinstance(value, bool):
        raise ValueError(f"{name}: found {found(value)}, expected true or false")
    return value


def items(fields: dict[str, Any], name: str) -> list[Any]:
    """A list."""
    value = fields.get(name)
    if not isinstance(value, list):
        raise ValueError(f"{name}: found {found(value)}, expected a list")
    return value


def triple(fields: dict[str, Any], name: str) -> tuple[float, float, float]:
    """Three finite numbers."""
    values = items(fields, name)
    if len(values) != 3:
        raise ValueError(f"{name}: found a list of {len(values)}, expected three numbers")
    x, y, a = (number({name: value}, name) for value in values)
    return x, y, a


def seed(fields: dict[str, Any], name: str = "seed") -> int | None:
    """An unsigned 64-bit seed, as a number or as digits (JavaScript's numbers have 53 bits); None: not given."""
    value = fields.get(name)
    if value is None:
        return None
    is_whole = isinstance(value, int) and not isinstance(value, bool)
    is_text = isinstance(value, str) and value.isascii() and value.isdecimal() and len(value) <= 20
    if (not is_whole and not is_text) or not 0 <= int(value) < 2**64:
        raise ValueError(f"{name}: found {found(value)}, expected a whole number, 0 to {2**64 - 1}")
    return int(value)
