# SPDX-License-Identifier: GPL-2.0-or-later
"""Maps that are arrays of cells, as in nav_msgs/OccupancyGrid."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from .._checks import shown
from .map_file import read_map_file
from .properties import Number, Numbers, Place, Text, check_fields, choice, prop, section

MOST_SIDE, MOST_CELLS = 32_768, 100_000_000  # limits of pictures


@dataclass(frozen=True, eq=False)
class GridMap:
    """A map of square cells, of which the occupied ones are walls.

    Args:
        array: cells in rows; row 0 is the lowest, as in nav_msgs/OccupancyGrid. Truth values: True is occupied. Whole
            numbers: -1 is unknown, 0 to 100 the probability in percent that the cell is occupied.
        resolution: side of a cell, metres.
        origin: x, y and heading of the lower left corner of the cell in row 0 and column 0.
        threshold: cells with at least this percentage are walls.
        unknown: "free", or "occupied": unknown cells are walls.
        height: that of the walls, metres.
        name: that of the model with the walls.
        color_rgba: its colour.
    """

    array: npt.ArrayLike
    resolution: float = prop(Number("metres above 0", above=0, most=1e6), 0.05)
    origin: Sequence[float] = prop(Place(), (0, 0, 0))
    threshold: float = prop(Number("a percentage from 0 to 100, more than 0", above=0, most=100), 65)
    unknown: str = prop(choice("free", "occupied"), "free")
    height: float = prop(Number("metres above 0", above=0), 1.0)
    name: str = prop(Text(), "map")
    color_rgba: Sequence[float] = prop(Numbers("four numbers from 0 to 1", 4, 0, 1), (0.35, 0.35, 0.38, 1.0))

    def __post_init__(self) -> None:
        for name in ("resolution", "origin", "threshold", "unknown", "height", "name", "color_rgba"):
            if getattr(self, name) is None:
                raise TypeError(f"GridMap.{name}: found None, expected a value")
        check_fields(self)
        object.__setattr__(self, "array", _checked_array(self.array, self.threshold))

    @classmethod
    def from_file(cls, file: str | os.PathLike[str], *, height: float = 1.0, unknown: str = "free") -> GridMap:
        """Reads a map of ROS's map_server: a file map.yaml and its picture, PGM or PNG.

        Pixels darker than `occupied_thresh` are walls; `negate`, `free_thresh` and `mode` are obeyed.

        Raises:
            ValueError: a file has a mistake; one line says where.
            OSError: the file map.yaml can't be read.
        """
        read = read_map_file(os.fspath(file))
        return cls(read.array, read.resolution, read.origin, threshold=read.threshold, height=height, unknown=unknown)

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        rows, columns = np.shape(self.array)
        return rows, columns

    @cached_property
    def occupied(self) -> npt.NDArray[np.bool_]:
        """True where there are walls: an array of the map's shape that can't be changed."""
        cells = np.asarray(self.array)
        walls = cells if cells.dtype == bool else cells >= self.threshold
        if self.unknown == "occupied" and cells.dtype != bool:
            walls = walls | (cells < 0)
        walls = np.array(walls)
        walls.setflags(write=False)
        return walls

    @cached_property
    def picture(self) -> tuple[str, bytes]:
        """The map as a PBM file, and a name that follows from its content."""
        rows, columns = self.shape
        content = b"P4\n%d %d\n" % (columns, rows) + np.packbits(self.occupied[::-1], axis=1).tobytes()
        return f"map_{hashlib.blake2b(content, digest_size=12).hexdigest()}.pbm", content

    def cell_at(self, x: float, y: float) -> tuple[int, int] | None:
        """Row and column of the cell at a place; None: it is outside of the map."""
        row, column = self._in_cells(np.array([[x, y]], float))[0]
        inside = 0 <= row < self.shape[0] and 0 <= column < self.shape[1]
        return (int(row), int(column)) if inside else None

    def centers(self, cells: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """The centres of cells, given by row and column in shape (n, 2): x and y in shape (n, 2)."""
        rows_columns = np.asarray(cells, np.float64).reshape(-1, 2)
        x, y = (rows_columns[:, 1] + 0.5) * self.resolution, (rows_columns[:, 0] + 0.5) * self.resolution
        cosine, sine = self._turn()
        return np.stack([self.origin[0] + x * cosine - y * sine, self.origin[1] + x * sine + y * cosine], axis=1)

    def _in_cells(self, places: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        cosine, sine = self._turn()
        x, y = places[:, 0] - self.origin[0], places[:, 1] - self.origin[1]
        return np.floor(np.stack([y * cosine - x * sine, x * cosine + y * sine], axis=1) / self.resolution)

    def _turn(self) -> tuple[float, float]:
        return (float(np.cos(self.origin[3])), float(np.sin(self.origin[3]))) if self.origin[3] else (1.0, 0.0)

    def lines(self, degrees: bool = False) -> list[str]:
        """The section of a world file that stands for the map. `degrees`: the unit of angles is not the radian."""
        rows, columns = self.shape
        size = [columns * self.resolution, rows * self.resolution, self.height]
        body = [f'bitmap "{self.picture[0]}"', 'bitmap_frame "picture"'] if self.occupied.any() else ["noblocks 1"]
        pose = (*self.origin[:3], math.degrees(self.origin[3]) if degrees else self.origin[3])
        return section("model", [f'name "{self.name}"', f"color_rgba [{' '.join(map(repr, self.color_rgba))}]",
                                 f"pose {Place().text(pose)}",
                                 f"origin [{size[0] / 2!r} {size[1] / 2!r} 0 0]",
                                 f"size [{' '.join(map(repr, size))}]", *body, "gui_move 0"])

    def pictures(self) -> dict[str, bytes]:
        """Contents of the pictures that the section needs, by name."""
        return dict([self.picture]) if self.occupied.any() else {}

    def with_array(self, array: npt.ArrayLike) -> GridMap:
        """A map like this one with other cells."""
        return GridMap(array, self.resolution, self.origin, self.threshold, self.unknown, self.height, self.name,
                       self.color_rgba)

    def free_places(self, n: int, radius: float, seed: int = 0) -> npt.NDArray[np.float64]:
        """Finds random places for robots: see stagesim.scenes.free_places()."""
        from .places import free_places  # which needs this module

        return free_places(self, n, radius, seed)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, GridMap) and self.lines() == other.lines()

    def __hash__(self) -> int:
        return hash(tuple(self.lines()))

    def __repr__(self) -> str:
        return f"<GridMap of {self.shape[0]} x {self.shape[1]} cells of {self.resolution:g} m>"


def _checked_array(given: npt.ArrayLike, threshold: float) -> npt.NDArray[np.bool_ | np.int8]:
    """A copy of the cells that can't be changed: truth values, or int8 from -1 to 100."""
    expected = "an array of rows and columns, of the type bool or int8"
    try:
        cells = np.asarray(given)
    except ValueError:
        raise ValueError(f"GridMap.array: found {shown(given)}, expected {expected}") from None
    if cells.ndim != 2 or cells.size == 0:
        raise ValueError(f"GridMap.array: found the shape {cells.shape}, expected {expected} with a cell or more")
    if max(cells.shape) > MOST_SIDE or cells.size > MOST_CELLS:
        raise ValueError(f"GridMap.array: found {cells.shape[0]} x {cells.shape[1]} cells, expected at most {MOST_SIDE} "
                         f"in each direction and {MOST_CELLS} in all")
    if cells.dtype.kind not in "biu":
        raise TypeError(f"GridMap.array: found the type {cells.dtype}, expected bool (True is occupied), or int8 from -1 "
                        "to 100")
    if cells.dtype != bool and not (cells.min() >= -1 and cells.max() <= 100):
        raise ValueError(f"GridMap.array: found numbers from {cells.min()} to {cells.max()}, expected -1 (unknown) to "
                         "100; for a picture of 0 to 255, compare it with a threshold")
    if threshold > 1 and cells.dtype not in (bool, np.int8) and cells.min() >= 0 and cells.max() == 1:
        raise ValueError("GridMap.array: found only the numbers 0 and 1, which are 0 and 1 percent, expected truth values "
                         "(array == 1), or probabilities up to 100")
    kept = np.array(cells, bool if cells.dtype == bool else np.int8)
    kept.setflags(write=False)
    return kept
