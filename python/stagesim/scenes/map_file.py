# SPDX-License-Identifier: GPL-2.0-or-later
"""Maps of ROS's map_server: a file map.yaml that names a picture."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from ..errors import StageError

MODES = ("trinary", "scale", "raw")


class MapFile(NamedTuple):
    """A map that has been read: cells as in nav_msgs/OccupancyGrid."""

    array: npt.NDArray[np.int8]
    resolution: float
    origin: tuple[float, float, float]
    threshold: float  # percentage from which on cells are walls


def read_map_file(path: str) -> MapFile:
    """Reads a map. Raises ValueError or OSError."""
    with open(path, encoding="utf-8", errors="replace") as file:
        values = _Values(path, _parse(file.read(), path))
    picture = os.path.join(os.path.dirname(path), values.text("image"))
    mode = values.text("mode", "trinary")
    if mode not in MODES:
        raise ValueError(f"{path}: mode: found {mode!r}, expected {', '.join(MODES)}")
    occupied, free = values.number("occupied_thresh", 0.65), values.number("free_thresh", 0.196)
    if not 0 <= free < occupied <= 1:
        raise ValueError(f"{path}: found free_thresh {free} and occupied_thresh {occupied}, expected 0 <= free_thresh < "
                         "occupied_thresh <= 1")
    resolution = values.number("resolution")
    if not resolution > 0:
        raise ValueError(f"{path}: resolution: found {resolution}, expected metres above 0")
    negate = values.number("negate", 0) != 0
    try:
        array = read_picture(picture, mode, occupied, free, negate)
    except ValueError as error:
        raise ValueError(f"{path}: image: {error}") from None
    threshold = 100 * occupied if mode == "raw" else 100
    return MapFile(array, resolution, values.pose("origin"), threshold)


def read_picture(path: str, mode: str = "trinary", occupied: float = 0.65, free: float = 0.196,
                 negate: bool = False) -> npt.NDArray[np.int8]:
    """Occupancies of the pixels of a PGM or PNG, from the lowest row on. Raises ValueError."""
    try:
        samples = _core.read_samples(path)
    except StageError as error:
        raise ValueError(str(error)) from None
    return _cells(samples, mode, occupied, free, negate)[::-1]


def _cells(samples: npt.NDArray[np.uint8], mode: str, occupied: float, free: float,
           negate: bool) -> npt.NDArray[np.int8]:
    """Occupancies of pixels, by the rules of map_server."""
    channels = samples.shape[2]
    has_opacity = channels in (2, 4)
    # In the mode "trinary", map_server averages the opacity as well.
    averaged = channels if mode == "trinary" or not has_opacity else channels - 1
    grey = samples[:, :, :averaged].sum(axis=2, dtype=np.float64) / averaged
    if mode == "raw":
        value = np.rint(grey)
        return np.where(value <= 100, value, -1).astype(np.int8)
    share = grey / 255 if negate else (255 - grey) / 255
    cells = np.full(share.shape, -1, np.int8)
    if mode == "scale":
        between = np.rint(1 + 98 * (share - free) / (occupied - free)).clip(1, 99)
        visible = samples[:, :, -1] == 255 if has_opacity else np.ones(share.shape, bool)
        cells[visible] = between[visible].astype(np.int8)
    cells[share > occupied] = 100
    cells[share < free] = 0
    return cells


class _Values:
    """The values of a map file, with errors that tell where they are."""

    def __init__(self, path: str, values: dict[str, Any]) -> None:
        self._path, self._values = path, values

    def _get(self, name: str, default: Any) -> Any:
        value = self._values.get(name, default)
        if value is None:
            raise ValueError(f"{self._path}: found no {name}, expected one")
        return value

    def text(self, name: str, default: str | None = None) -> str:
        value = self._get(name, default)
        if not isinstance(value, str) or not value:
            raise ValueError(f"{self._path}: {name}: found {value!r}, expected a text")
        return value

    def number(self, name: str, default: float | None = None) -> float:
        value = self._get(name, default)
        words = {"true": 1.0, "false": 0.0} if name == "negate" else {}
        try:
            number = words[value.lower()] if isinstance(value, str) and value.lower() in words else float(value)
        except (TypeError, ValueError):
            number = float("nan")
        if not np.isfinite(number):
            raise ValueError(f"{self._path}: {name}: found {value!r}, expected a number")
        return number

    def pose(self, name: str) -> tuple[float, float, float]:
        value = self._get(name, None)
        try:
            numbers = [float(each) for each in value] if isinstance(value, list) else []
        except ValueError:
            numbers = []
        if len(numbers) != 3 or not np.isfinite(numbers).all():
            raise ValueError(f"{self._path}: {name}: found {value!r}, expected [x, y, heading] in metres and radians")
        return numbers[0], numbers[1], numbers[2]


def _parse(text: str, path: str) -> dict[str, Any]:
    """The values of the simple YAML that map files consist of: texts, and lists of texts."""
    values: dict[str, Any] = {}
    last = None
    for number, line in enumerate(text.lstrip("\ufeff").splitlines(), 1):
        content = _without_comment(line).strip()
        if not content or content == "---" or content.startswith("%YAML"):
            continue
        if content.startswith("- ") and last is not None:
            if not isinstance(values[last], list):
                values[last] = []
            values[last].append(_unquoted(content[2:]))
            continue
        name, colon, value = content.partition(":")
        if not colon:
            raise ValueError(f"{path}:{number}: found {content[:60]!r}, expected NAME: VALUE")
        last, value = _unquoted(name), value.strip()
        is_list = value.startswith("[") and value.endswith("]")
        values[last] = [_unquoted(each) for each in value[1:-1].split(",")] if is_list else _unquoted(value)
    return values


def _without_comment(line: str) -> str:
    """The line up to a # that is at its start or follows a blank, outside of quotation marks."""
    quote = ""
    for i, letter in enumerate(line):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "'\"":
            quote = letter
        elif letter == "#" and (i == 0 or line[i - 1] in " \t"):
            return line[:i]
    return line


def _unquoted(text: str) -> str:
    stripped = text.strip()
    return stripped[1:-1] if len(stripped) > 1 and stripped[0] == stripped[-1] and stripped[0] in "'\"" else stripped
