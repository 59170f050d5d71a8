# SPDX-License-Identifier: GPL-2.0-or-later
"""Kinds of properties of world files: how their values are checked and written."""

from __future__ import annotations

import dataclasses
import math
import numbers
from collections.abc import Iterable
from typing import Any, Protocol

import numpy as np

from .._checks import shown

MOST_TEXT = 1000  # bytes


class Kind(Protocol):
    """A kind of property."""

    expected: str

    def checked(self, value: Any) -> Any:
        """The value in the form in which it is kept. Raises TypeError or ValueError without a message."""

    def text(self, value: Any) -> str:
        """A checked value as a world file has it."""


@dataclasses.dataclass(frozen=True)
class Number:
    """A finite number."""

    expected: str
    least: float = -math.inf
    above: float = -math.inf
    most: float = math.inf

    def checked(self, value: Any) -> float:
        if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
            raise TypeError
        number = float(value)
        if not (math.isfinite(number) and self.least <= number <= self.most and number > self.above):
            raise ValueError
        return number

    def text(self, value: float) -> str:
        return repr(value)


@dataclasses.dataclass(frozen=True)
class Whole:
    """A whole number."""

    expected: str
    least: int = -2**31
    most: int = 2**31 - 1

    def checked(self, value: Any) -> int:
        if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Integral):
            raise TypeError
        if not self.least <= value <= self.most:
            raise ValueError
        return int(value)

    def text(self, value: int) -> str:
        return str(value)


@dataclasses.dataclass(frozen=True)
class Flag:
    """True or False."""

    expected: str = "True or False"

    def checked(self, value: Any) -> bool:
        if not isinstance(value, (bool, np.bool_)):
            raise TypeError
        return bool(value)

    def text(self, value: bool) -> str:
        return str(int(value))


@dataclasses.dataclass(frozen=True)
class Text:
    """A text, which may be one of a few."""

    expected: str = f"a text of one line without quotation marks, up to {MOST_TEXT} bytes"
    choices: tuple[str, ...] = ()

    def checked(self, value: Any) -> str:
        if not isinstance(value, str):
            raise TypeError
        if (not value or len(value.encode(errors="replace")) > MOST_TEXT or '"' in value or not value.isprintable()
                or (self.choices and value not in self.choices)):
            raise ValueError
        return value

    def text(self, value: str) -> str:
        return f'"{value}"'


def choice(*choices: str) -> Text:
    """The kind of a text that must be one of these."""
    return Text(" or ".join(map(repr, choices)), choices)


@dataclasses.dataclass(frozen=True)
class Texts:
    """One or several texts."""

    expected: str = f"texts of one line without quotation marks, up to {MOST_TEXT} bytes each"

    def checked(self, value: Any) -> tuple[str, ...]:
        return tuple(Text().checked(text) for text in ([value] if isinstance(value, str) else value))

    def text(self, value: tuple[str, ...]) -> str:
        return f"[{' '.join(map(Text().text, value))}]"


@dataclasses.dataclass(frozen=True)
class Numbers:
    """A tuple of finite numbers, of which the last may be infinite."""

    expected: str
    count: int
    least: float = -math.inf
    most: float = math.inf
    in_order: bool = False
    may_be_infinite: bool = False

    def checked(self, value: Any) -> tuple[float, ...]:
        given = _listed(value)
        if len(given) != self.count:
            raise ValueError
        last = given[-1:] if self.may_be_infinite and given[-1] == math.inf else []
        kind = Number("", self.least, most=self.most)
        found = (*map(kind.checked, given[:len(given) - len(last)]), *map(float, last))
        if self.in_order and any(a > b for a, b in zip(found, found[1:])):
            raise ValueError
        return found

    def text(self, value: tuple[float, ...]) -> str:
        texts = ['"inf"' if number == math.inf else repr(number) for number in value]
        return f"[{' '.join(texts)}]"


@dataclasses.dataclass(frozen=True)
class Place:
    """A pose: x, y and heading, or x, y, z and heading. It is kept as four numbers."""

    expected: str = "three or four numbers: x, y, heading, or x, y, z, heading, in metres and radians"

    def checked(self, value: Any) -> tuple[float, ...]:
        given = _listed(value)
        if len(given) not in (3, 4):
            raise ValueError
        found = tuple(map(Number("").checked, given))
        return found if len(found) == 4 else (*found[:2], 0.0, found[2])

    def text(self, value: tuple[float, ...]) -> str:
        return f"[{' '.join(map(repr, value))}]"


def _listed(value: Any) -> list[Any]:
    if isinstance(value, (str, bytes)) or not isinstance(value, Iterable):
        raise TypeError
    return list(value)


def prop(kind: Kind, default: Any = None, written: bool = True) -> Any:
    """A field of a dataclass that is a property. None stands for the default of world files, and is not written.

    `written`: False if the class writes the property itself.
    """
    return dataclasses.field(default=default, metadata={"kind": kind, "written": written})


def checked(kind: Kind, value: Any, place: str) -> Any:
    """The value in the form in which it is kept. Raises TypeError or ValueError with one line."""
    try:
        return kind.checked(value)
    except (TypeError, ValueError, OverflowError) as error:
        wrong = TypeError if isinstance(error, TypeError) else ValueError
        raise wrong(f"{place}: found {shown(value)}, expected {kind.expected}") from None


def check_fields(of: Any) -> None:
    """Checks the properties of a frozen dataclass and keeps them in the form of their kinds."""
    for field in dataclasses.fields(of):
        value = getattr(of, field.name)
        if "kind" in field.metadata and value is not None:
            kept = checked(field.metadata["kind"], value, f"{type(of).__name__}.{field.name}")
            object.__setattr__(of, field.name, kept)


def check_members(of: Any, name: str, kind: type | tuple[type, ...], expected: str) -> None:
    """Checks that a field of a frozen dataclass has objects of a type, and keeps them as a tuple."""
    given = getattr(of, name)
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        raise TypeError(f"{type(of).__name__}.{name}: found {shown(given)}, expected a list of {expected}")
    members = tuple(given)
    for i, member in enumerate(members):
        if not isinstance(member, kind):
            raise TypeError(f"{type(of).__name__}.{name}[{i}]: found {shown(member)}, expected {expected}")
    object.__setattr__(of, name, members)


def lines_of(of: Any) -> list[str]:
    """The properties of a dataclass as lines of a world file."""
    return [f"{field.name} {field.metadata['kind'].text(getattr(of, field.name))}" for field in dataclasses.fields(of)
            if field.metadata.get("written") and getattr(of, field.name) is not None]


def other_lines(given: Any, place: str) -> list[str]:
    """Properties without fields of their own, as lines of a world file."""
    lines = []
    for name, value in dict(given).items():
        if not isinstance(name, str) or not name.replace("[", "").replace("]", "").replace("_", "").isalnum():
            raise ValueError(f"{place}: found the name {shown(name)}, expected that of a property")
        lines.append(f"{name} {_other_text(value, f'{place}[{name!r}]')}")
    return lines


def _other_text(value: Any, place: str) -> str:
    if isinstance(value, (bool, np.bool_)):
        return str(int(value))
    if isinstance(value, str):
        return Text().text(checked(Text(), value, place))
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        return repr(checked(Number("a finite number"), value, place))
    if isinstance(value, Iterable):
        return f"[{' '.join(_other_text(each, place) for each in value)}]"
    raise TypeError(f"{place}: found {shown(value)}, expected a number, a text, a truth value or a list of these")


def section(type_: str, lines: list[str]) -> list[str]:
    """A section of a world file: its type, and its lines in brackets."""
    return [type_, "(", *(f"  {line}" for line in lines), ")"]
