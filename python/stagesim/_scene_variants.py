# SPDX-License-Identifier: GPL-2.0-or-later
"""The scenes that the variants of a batch are made from, and the maps that its worlds are given."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any, Union

import numpy as np

from ._checks import shown

if TYPE_CHECKING:  # imported when they are needed
    from .scenes import GridMap, Scene

#: Variants without worlds that are kept, so that their scenes need not be made again.
KEPT = 64

#: A map for worlds of a batch: an array of cells, a map, or a whole scene.
MapLike = Union[Any, "GridMap", "Scene"]


class SceneVariants:
    """Finds the variant with a scene by its content, and the number for a new one."""

    def __init__(self, keys: Sequence[str]) -> None:
        self.count_fixed = len(keys)  #: variants that the batch was made with keep their scenes
        self._count = len(keys)
        self._numbers: dict[str, int] = {}  # by key, the least recently used one first
        self._keys: dict[int, str] = {}  # the other way round
        for number, key in enumerate(keys):
            if key not in self._numbers:
                self._numbers[key] = number
                self._keys[number] = key

    def copy(self) -> SceneVariants:
        """Variants that can be changed on their own."""
        copied = SceneVariants([])
        copied.count_fixed, copied._count = self.count_fixed, self._count
        copied._numbers, copied._keys = dict(self._numbers), dict(self._keys)
        return copied

    def find(self, key: str) -> int | None:
        """The number of the variant with this content; None: there is none."""
        number = self._numbers.pop(key, None)
        if number is not None:
            self._numbers[key] = number
        return number

    def numbers_for_new(self, used: Collection[int], count: int) -> list[int]:
        """The numbers of the variants that new scenes replace, followed by the next ones; those in `used` stay."""
        idle = [number for number in self._numbers.values() if number >= self.count_fixed and number not in used]
        replaced = idle[:max(0, len(idle) - KEPT + 1)]
        return [*replaced, *range(self._count, self._count + count)][:count]

    def add(self, key: str, number: int) -> None:
        """Notes that a variant has this content now."""
        if number in self._keys:
            del self._numbers[self._keys[number]]
        self._numbers[key] = number
        self._keys[number] = key
        self._count = max(self._count, number + 1)


def each_map(given: MapLike | Sequence[MapLike], count: int) -> list[MapLike]:
    """The maps of `count` worlds: one for all, or one each. Raises ValueError for another number."""
    from .scenes import GridMap, Scene

    if isinstance(given, (GridMap, Scene)):
        return [given] * count
    several = isinstance(given, (list, tuple)) and any(isinstance(each, (GridMap, Scene, np.ndarray)) for each in given)
    maps = list(given) if several or np.ndim(given) == 3 else [given] * count
    if len(maps) != count:
        raise ValueError(f"found {len(maps)} maps, expected one, or one for each of {count} worlds")
    return maps


def scene_with(given: MapLike, base: Scene | None, world: int) -> Scene:
    """The scene `base`, which a world has now, with another map; or the whole other scene."""
    from .scenes import GridMap, Scene

    if isinstance(given, Scene):
        return given
    if base is None:
        raise ValueError(f"found {shown(given)} for world {world}, which was made from a file, expected a scene: "
                         "stagesim.scenes.Scene()")
    if isinstance(given, GridMap):
        return base.with_map(given)
    if base.map is None:
        raise ValueError(f"found an array for world {world}, whose scene has no map, expected GridMap(array, resolution)")
    return base.with_map(base.map.with_array(given))
