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

    def __init__(self, scenes: Sequence[Scene | None]) -> None:
        self._fixed = len(scenes)  # variants that the batch was made with keep their scenes
        self._count = len(scenes)
        self._numbers: dict[str, int] = {}  # by text, the least recently used one first
        for number, scene in enumerate(scenes):
            if scene is not None:
                self._numbers.setdefault(scene.text(), number)

    def __copy__(self) -> SceneVariants:
        copied = SceneVariants([])
        copied._fixed, copied._count, copied._numbers = self._fixed, self._count, dict(self._numbers)
        return copied

    def find(self, scene: Scene) -> int | None:
        """The number of the variant with this scene; None: there is none."""
        text = scene.text()
        number = self._numbers.pop(text, None)
        if number is not None:
            self._numbers[text] = number
        return number

    def number_for_new(self, used: Collection[int]) -> int:
        """The number of the variant that a new scene replaces, or the next one; those in `used` stay."""
        idle = [number for number in self._numbers.values() if number >= self._fixed and number not in used]
        return idle[0] if len(idle) >= KEPT else self._count

    def add(self, scene: Scene, number: int) -> None:
        """Notes that a variant has this scene now."""
        for text, known in list(self._numbers.items()):
            if known == number:
                del self._numbers[text]
        self._numbers[scene.text()] = number
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
