# SPDX-License-Identifier: GPL-2.0-or-later
"""The options of worlds, from the table in libstage: as arguments of functions and of command lines."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Union

import numpy as np
import numpy.typing as npt

from . import _checks, _core

if TYPE_CHECKING:
    import argparse

#: Values that replace those of a world file: strings "NAME=VALUE", or a mapping of names to values.
Settings = Union[Iterable[str], Mapping[str, Any]]

OPTIONS = {option.name: option for option in _core.run_options() if option.of_world}

#: Types of options by their kinds, for signatures.
TYPES = {"switch": "bool", "number": "int", "choice": "str", "device": "bool | str", "texts": "Settings"}
#: Valid values of an option by its kind, for docstrings.
VALUES = {"device": " True, or the name of the device as in `stage --opencl=`.",
          "texts": ' Strings "NAME=VALUE", or a mapping such as {"robots": 10, "world.resolution": 0.05}.'}


def setting_text(value: Any) -> str:
    """Formats a value as in world files: tuples in brackets, booleans as 1 or 0."""
    if isinstance(value, (bool, np.bool_)):
        return str(int(value))
    if isinstance(value, (list, tuple, np.ndarray)):
        return f"[{' '.join(map(setting_text, value))}]"
    return str(value)


def settings_list(settings: Settings) -> list[str]:
    """Converts settings to strings "NAME=VALUE". Raises TypeError for a single string."""
    if isinstance(settings, str):
        raise TypeError(f"found the text {settings!r} as settings, expected a list of texts or a mapping")
    if isinstance(settings, Mapping):
        return [f"{name}={setting_text(value)}" for name, value in settings.items()]
    texts = list(settings)
    for text in texts:
        if not isinstance(text, str):
            raise TypeError(f"found {text!r} as a setting, expected a text such as 'robots=10'")
    return texts


def checked(name: str, value: Any) -> Any:
    """Converts the value of an option to its type. Raises TypeError or ValueError."""
    option = OPTIONS[name]
    if value is None and option.default is None:
        return None
    if option.kind == "number":
        return _checks.integer(value, name, option.min, option.max)
    if option.kind == "texts":
        return settings_list(value)
    if option.kind == "choice" and value not in option.choices:
        raise ValueError(f"found {value!r} as {name}, expected {option.expected}")
    if isinstance(value, str) and option.kind != "switch":
        return value
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"found {value!r} as {name}, expected True or False")
    return bool(value) if option.kind == "switch" else "" if value else None


def seeds(values: Iterable[Any], n: int) -> npt.NDArray[np.uint64]:
    """Converts the values to seeds. Raises ValueError unless there are exactly `n`."""
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise TypeError(f"found {_checks.shown(values)} as seeds, expected {n} whole numbers")
    if isinstance(values, np.ndarray) and values.ndim == 1 and values.dtype.kind in "iu":
        made = _seeds_of_array(values)
    else:
        made = np.array([checked("seed", value) for value in values], np.uint64)
    if len(made) != n:
        raise ValueError(f"found {len(made)} seeds, expected {n}")
    return made


def _seeds_of_array(values: npt.NDArray[Any]) -> npt.NDArray[np.uint64]:
    """Converts whole numbers without a Python object for each of them, which would take longer than a reset."""
    if values.size and values.dtype.kind == "i" and values.min() < 0:
        checked("seed", values.min())  # raises ValueError
    return np.ascontiguousarray(values, np.uint64)


def complete(given: Mapping[str, Any], without: Collection[str] = ()) -> dict[str, Any]:
    """The values of all options but those in `without`. Raises TypeError or ValueError if a given one is invalid."""
    names = [name for name in OPTIONS if name not in without]
    for name in given:
        if name not in names:
            raise TypeError(f"found the argument {name!r}, expected {', '.join(names)}")
    return {name: checked(name, given[name]) if name in given else OPTIONS[name].default for name in names}


# ---- docstrings and signatures ----


def documented(text: str | None) -> str | None:
    """Replaces the line OPTIONS of a docstring by the descriptions of all options."""
    return text and text.replace("        OPTIONS", "\n".join(map(_documentation, OPTIONS)))


def _documentation(name: str) -> str:
    option = OPTIONS[name]
    start = f"{not option.default}: " if option.kind == "switch" else ""
    choices = f" {' or '.join(map(repr, option.choices))}." if option.choices else ""
    end = "" if option.changes_results else " Results don't depend on it."
    return textwrap.fill(f"{name}: {start}{option.summary}.{VALUES.get(option.kind, choices)}{end}", 110,
                         initial_indent=" " * 8, subsequent_indent=" " * 12)


def accepting(without: Collection[str] = ()) -> Callable[[Any], Any]:
    """A decorator of functions with **options: their signature has the options but those in `without`."""
    def decorate(function: Any) -> Any:
        own = inspect.signature(function)
        parameters = [parameter for parameter in own.parameters.values() if parameter.kind != parameter.VAR_KEYWORD]
        for name, option in OPTIONS.items():
            if name not in without:
                default = {"texts": (), "device": False}.get(option.kind, option.default)
                kind = TYPES[option.kind] + (" | None" if default is None else "")
                parameters.append(inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default,
                                                    annotation=kind))
        function.__signature__ = own.replace(parameters=parameters)
        return function
    return decorate


# ---- command lines ----


def add_to(parser: argparse.ArgumentParser) -> None:
    """Adds all options."""
    from argparse import SUPPRESS

    for option in OPTIONS.values():
        kinds: dict[str, dict[str, Any]] = {
            "switch": {"action": "store_const", "const": not option.default},
            "number": {"type": int, "metavar": option.placeholder},
            "choice": {"choices": option.choices},
            "device": {"nargs": "?", "const": "", "metavar": option.placeholder},
            "texts": {"action": "append", "metavar": option.placeholder}}
        parser.add_argument(f"--{option.flag}", dest=option.name, default=SUPPRESS, help=option.summary,
                            **kinds[option.kind])


def unambiguous(words: Sequence[str]) -> list[str]:
    """Replaces --opencl by --opencl=, so that a device can only be given as --opencl=DEVICE, as with `stage`."""
    flags = [f"--{option.flag}" for option in OPTIONS.values() if option.kind == "device"]
    return [f"{word}=" if word in flags else word for word in words]


def given_in(parsed: argparse.Namespace) -> dict[str, Any]:
    """The options that a command line has, as arguments of World()."""
    return {name: getattr(parsed, name) for name in OPTIONS if hasattr(parsed, name)}
