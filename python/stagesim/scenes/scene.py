# SPDX-License-Identifier: GPL-2.0-or-later
"""A world as an object: its properties, its map and its models."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from .._checks import shown
from .grid_map import GridMap
from .models import Robot, Thing
from .properties import Number, Text, check_fields, check_members, choice, lines_of, other_lines, prop


@dataclass(frozen=True)
class Scene:
    """A world as an object, for World.of() and Batch.of(). It never changes; dataclasses.replace() makes another one.

    Properties have the names and units of docs/properties.md. Those that are None have the defaults of world files.

    Args:
        map: walls.
        models: robots and things, in this order after the map.
        resolution: side of the cells for collisions and rays, metres; that of the map is independent.
        name: the name of the world.
        interval_sim: simulated milliseconds of a step.
        quit_time: seconds of simulated time.
        ray_model: "cell" or "exact".
        contacts: "outlines" or "cells".
        properties: other properties by their names.
    """

    map: GridMap | None = None
    models: Sequence[Thing] = ()
    _: dataclasses.KW_ONLY
    resolution: float | None = prop(Number("metres from 1e-6 to 1e6", least=1e-6, most=1e6))
    name: str | None = prop(Text())
    interval_sim: float | None = prop(Number("milliseconds, 0.001 or more", least=0.001))
    quit_time: float | None = prop(Number("seconds, 0 or more", least=0))
    ray_model: str | None = prop(choice("cell", "exact"))
    contacts: str | None = prop(choice("outlines", "cells"))
    properties: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.map is not None and not isinstance(self.map, GridMap):
            raise TypeError(f"Scene.map: found {shown(self.map)}, expected GridMap(array, resolution)")
        check_members(self, "models", Thing, "models of stagesim.scenes, such as Robot()")
        check_fields(self)
        if not isinstance(self.properties, Mapping):
            raise TypeError(f"Scene.properties: found {shown(self.properties)}, expected a mapping of names to values")
        object.__setattr__(self, "properties", dict(self.properties))
        other_lines(self.properties, "Scene.properties")  # checks them

    def text(self) -> str:
        """Returns the world file that the scene stands for. Its numbers are exactly those of the scene."""
        return self._text

    @cached_property
    def _text(self) -> str:
        parts = [['unit_angle "radians"', *lines_of(self), *other_lines(self.properties, "Scene.properties")]]
        parts += [self.map.lines()] if self.map is not None else []
        parts += [model.lines() for model in self._named()]
        return "\n".join("\n".join(lines) + "\n" for lines in parts)

    def pictures(self) -> dict[str, bytes]:
        """Returns the contents of the picture files that the world file needs, by name."""
        return {} if self.map is None else self.map.pictures()

    def save(self, folder: str | os.PathLike[str], name: str = "scene") -> str:
        """Writes the world file NAME.world and its pictures, so that `stage FOLDER/NAME.world` runs the same.

        Args:
            folder: the folder, which is made if it does not exist.
            name: the name of the world file without its ending.

        Returns:
            The path of the world file.
        """
        if not isinstance(name, str) or not name or os.path.basename(name) != name:
            raise ValueError(f"found the name {shown(name)}, expected that of a file without a folder")
        place = Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        for picture, content in self.pictures().items():
            (place / picture).write_bytes(content)
        file = place / f"{name}.world"
        file.write_text(self.text(), encoding="utf-8")
        return str(file)

    def with_map(self, map: GridMap | None) -> Scene:
        """Returns the scene with another map."""
        return dataclasses.replace(self, map=map)

    def _named(self) -> list[Thing]:
        """The models; robots without a name get one by their number."""
        taken = {model.name for model in self.models}
        number = 0
        named: list[Thing] = []
        for model in self.models:
            if isinstance(model, Robot):
                if model.name is None:
                    name = f"r{number}"
                    while name in taken:
                        number += 1
                        name = f"r{number}"
                    taken.add(name)
                    model = dataclasses.replace(model, name=name)
                number += 1
            named.append(model)
        return named

    def __repr__(self) -> str:
        return f"<Scene of {'no map' if self.map is None else repr(self.map)} and {len(self.models)} models>"
