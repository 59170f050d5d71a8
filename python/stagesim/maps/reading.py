# SPDX-License-Identifier: GPL-2.0-or-later
"""Maps and drawings from files."""

from __future__ import annotations

import os
from typing import Any, Callable

import numpy as np

from .._checks import shown
from ..scenes import GridMap
from ..scenes.map_file import read_picture
from .drawing import Drawing

#: Files above this size are refused, bytes.
MOST_BYTES = 200_000_000

#: Options of read_map() by the ending of a file; all have `height` as well.
OPTIONS = {
    ".yaml": {"unknown"}, ".yml": {"unknown"},
    ".pgm": {"unknown", "resolution", "origin", "negate"}, ".png": {"unknown", "resolution", "origin", "negate"},
    ".npy": {"unknown", "resolution", "origin"},
    ".svg": {"origin", "scale", "thickness"}, ".dxf": {"origin", "scale", "thickness"}}


def read_map(file: str | os.PathLike[str], **options: Any) -> GridMap | Drawing:
    """Reads walls from a file, by the ending of its name.

    Args:
        file: map.yaml of ROS's map_server, a PGM or PNG, a NumPy file (.npy) with an array as GridMap has it, an SVG, or
            a DXF.
        height: that of the walls, metres; 1 by default.
        unknown: "free" (the default), or "occupied": unknown cells are walls. Not for drawings.
        resolution: side of a cell of a picture or an array, metres; 0.05 by default.
        origin: x, y and heading (metres, radians) of the lower left corner of a picture or an array, or of the origin of
            a drawing.
        negate: True: light pixels of a picture are walls.
        scale: metres of a unit of a drawing; 1 by default, or what a DXF says about its units.
        thickness: that of walls along lines, metres; 0.02 by default.

    Raises:
        ValueError: the file has a mistake, or does not have such an option; one line says so.
        OSError: the file can't be read.
        ModuleNotFoundError: a package that reads the file is not installed; one line says which.
    """
    path = os.fspath(file)
    ending = os.path.splitext(path)[1].lower()
    if ending not in OPTIONS:
        raise ValueError(f"found the file {shown(path)}, expected a name that ends with {', '.join(OPTIONS)}")
    given = {name: value for name, value in options.items() if value is not None}
    for name in given.keys() - OPTIONS[ending] - {"height"}:
        raise ValueError(f"found the option {name}, which files {ending} don't have")
    size = os.stat(path).st_size
    if size > MOST_BYTES:
        raise ValueError(f"{path}: found {size} bytes, expected at most {MOST_BYTES}")
    return _READERS[ending](path, **given)


def _read_picture(path: str, negate: bool = False, **rest: Any) -> GridMap:
    return GridMap(read_picture(path, negate=negate), threshold=100, **rest)


def _read_array(path: str, **rest: Any) -> GridMap:
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except (ValueError, EOFError, OverflowError) as error:
        raise ValueError(f"{path}: not an array of NumPy: {str(error).splitlines()[0]}") from None
    if not isinstance(array, np.ndarray):
        raise ValueError(f"{path}: found several arrays, expected one")
    return GridMap(array, **rest)


def _read_svg(path: str, **rest: Any) -> Drawing:
    from .svg import read_svg

    return _placed(read_svg, path, **rest)


def _read_dxf(path: str, **rest: Any) -> Drawing:
    from .dxf import read_dxf

    return _placed(read_dxf, path, **rest)


def _placed(read: Callable[..., Drawing], path: str, origin: Any = (0, 0, 0), **rest: Any) -> Drawing:
    try:
        return read(path, **rest).moved(*origin)
    except ValueError as error:
        raise ValueError(f"{path}: {(str(error).splitlines() or [''])[0]}") from None


_READERS: dict[str, Callable[..., GridMap | Drawing]] = {
    ".yaml": GridMap.from_file, ".yml": GridMap.from_file, ".pgm": _read_picture, ".png": _read_picture,
    ".npy": _read_array, ".svg": _read_svg, ".dxf": _read_dxf}
