# SPDX-License-Identifier: GPL-2.0-or-later
"""Maps of worlds, and files of maps."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence

import numpy as np

from ..scenes import GridMap
from ..scenes.grid_map import MOST_CELLS, MOST_SIDE
from ..world import World
from .files import PICTURE_HEAD, YAML_HEAD, write

#: Parts of a cell by which a world may be larger than its cells, because of rounding.
ROUNDING = 1e-3
KIND = "an earlier map of stage export"


def map_of(world: World, resolution: float = 0.05, *, height: float | None = None,
           area: Sequence[float] | None = None, like: GridMap | None = None) -> GridMap:
    """Makes a map of what stands still in a world: not robots, nor what robots can push or take.

    A cell is occupied if a body overlaps it. Areas within bodies are occupied, holes in pictures are not.

    Args:
        world: the world, at its present state.
        resolution: side of a cell, metres.
        height: of a lidar, metres: the map has the bodies that such a lidar sees. None: all bodies that stop robots or
            that rangers see, at any height.
        area: the least x and y, and the greatest ones, of the map; None: the smallest rectangle around all bodies, and
            pictures with their margins.
        like: a map with the wanted resolution, size and origin, instead of these arguments.

    Raises:
        ValueError: there is nothing to map, or the map would be too large.
    """
    if like is not None:
        resolution, origin, (rows, columns) = like.resolution, tuple(like.origin), like.shape
        origin = (origin[0], origin[1], origin[3])
    else:
        x0, y0, x1, y1 = _area_of(world, height) if area is None else area
        origin = (x0, y0, 0.0)
        columns, rows = (_cells_in(extent / resolution) for extent in (x1 - x0, y1 - y0))
    if max(rows, columns) > MOST_SIDE or rows * columns > MOST_CELLS:
        raise ValueError(f"found a map of {rows} x {columns} cells, expected at most {MOST_SIDE} in each direction and "
                         f"{MOST_CELLS} in all; choose a larger resolution")
    return GridMap(world._core.draw_scenery(height, rows, columns, resolution, origin), resolution, origin)


def _area_of(world: World, height: float | None) -> tuple[float, float, float, float]:
    found = world._core.scenery_bounds(height)
    if found is None or not all(map(math.isfinite, found)):
        raise ValueError(f"found nothing {'' if height is None else f'at the height of {height:g} m '}that stands still")
    return found


def _cells_in(extent: float) -> int:
    """The number of cells in an extent, which is given in cells."""
    return max(1, math.ceil(min(extent, 1e9) - ROUNDING))


def write_map(map: GridMap, file: str | os.PathLike[str]) -> str:
    """Writes map.yaml and its picture for ROS's map_server; earlier files of this function are replaced.

    Args:
        map: the map. Cells below its threshold become free, unknown ones stay unknown.
        file: path of map.yaml; the picture has the same name with the ending .pgm.

    Returns:
        The path of the picture.

    Raises:
        ValueError: there is another file.
        OSError: a file can't be written.
    """
    path = os.fspath(file)
    stem, ending = os.path.splitext(path)
    if ending not in (".yaml", ".yml"):
        raise ValueError(f"found the file {path!r}, expected a name that ends with .yaml")
    picture = stem + ".pgm"
    rows, columns = map.shape
    cells = np.asarray(map.array)
    grey = np.where(map.occupied, 0, 254).astype(np.uint8)
    if cells.dtype != bool:
        grey[(cells < 0) & ~map.occupied] = 205
    write(picture, PICTURE_HEAD + b"\n%d %d\n255\n" % (columns, rows) + grey[::-1].tobytes(), PICTURE_HEAD, KIND)
    x, y, _, heading = map.origin
    text = (f"image: {_quoted(os.path.basename(picture))}\nmode: trinary\nresolution: {map.resolution!r}\n"
            f"origin: [{x!r}, {y!r}, {heading!r}]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n")
    write(path, YAML_HEAD + b".\n" + os.fsencode(text), YAML_HEAD, KIND)
    return picture


def _quoted(name: str) -> str:
    """The name as YAML has it."""
    return name if name.replace("_", "a").replace("-", "a").replace(".", "a").isalnum() else f'"{name}"'
