# SPDX-License-Identifier: GPL-2.0-or-later
"""The sections of a world file, found by patterns of names and types."""

from __future__ import annotations

import fnmatch
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

from .errors import StageError

if TYPE_CHECKING:
    from .world import World

#: A section by its name, and its number among those with that name.
Target = tuple[str, int]

_PARTS = ("block", "sensor")  # parts of models
_OTHERS = ("window", "population", "metric")  # sections without models
_OF_SENSORS = ("range", "fov", "samples", "noise", "ray_model")  # properties of a ranger that its sensors have


class Section(NamedTuple):
    """A section of a world file."""

    type: str
    parent: int
    name: str  # of the model; parts of models are called after these
    model: int  # id; 0: it is a part of a model, or none


class Sections:
    """The sections of the file of a world that has just been loaded."""

    def __init__(self, world: World) -> None:
        self._core = world._core
        listed: list[tuple[str, int]] = world._core.sections()
        models = iter(sorted(world.models, key=lambda model: model.id))
        self._all = [Section("world", -1, "world", 0)]
        self._places: dict[tuple[Target, str], tuple[int, int] | None] = {}
        for type_, parent in listed[1:]:
            id_ = 0
            if type_ in _PARTS or type_ in _OTHERS:
                name = f"{self._all[parent].name}.{type_}" if parent > 0 else type_
            else:
                model = next(models, None)
                if model is None or model.type != type_:
                    raise StageError("the models of the world are not those of its file, so its values can't vary")
                name, id_ = model.name, model.id
            self._all.append(Section(type_, parent, name, id_))
        self.targets: dict[Target, int] = {}  #: the numbers of all sections
        seen: Counter[str] = Counter()
        for number, section in enumerate(self._all):
            self.targets[section.name, seen[section.name]] = number
            seen[section.name] += 1

    def type_of(self, target: Target) -> str:
        """The type of a section."""
        return self._all[self.targets[target]].type

    def place_in_rows(self, target: Target, property: str) -> tuple[int, int] | None:
        """The model and its sensor if rows of a batch can hold other values of a property; None: they can't."""
        if (target, property) not in self._places:
            number = self.targets[target]
            model, sensor = self._all[number].model, 0
            if self._all[number].type == "sensor":
                around = self._all[number].parent
                model, sensor = self._all[around].model, self._sensors_of(around).index(number)
            can = model > 0 and self._core.can_vary(model, sensor, property)
            self._places[target, property] = (model, sensor) if can else None
        return self._places[target, property]

    def texts(self, target: Target, name: str) -> list[str]:
        """The values of a property as the file has them; empty if it lacks the property."""
        return self._core.section_texts(self.targets[target], name)

    def texts_of(self, section: int, name: str) -> list[str]:
        """The values of a property of the section with this number, as in texts()."""
        return self._core.section_texts(section, name)

    def asked(self) -> list[str]:
        """Names of all properties that world files may have, as far as this world has looked for them."""
        return self._core.asked_names()

    def names(self) -> set[str]:
        """Names and types of all sections, for suggestions."""
        return {text for section in self._all for text in (section.name, section.type)}

    def chosen(self, pattern: str, property: str) -> list[Target]:
        """The sections that a pattern chooses and that may have the property, in the order of the file."""
        numbers: list[int] = []
        for number, section in enumerate(self._all):
            if self._fits(number, pattern):
                parts = property in _OF_SENSORS and section.type == "ranger"
                numbers += self._sensors_of(number) if parts else [number]
        targets = {number: target for target, number in self.targets.items()}
        return [targets[number] for number in dict.fromkeys(numbers)]

    def _sensors_of(self, ranger: int) -> list[int]:
        return [number for number, section in enumerate(self._all)
                if section.parent == ranger and section.type == "sensor"]

    def _fits(self, number: int, pattern: str) -> bool:
        """True if the whole name is like the pattern, part by part between dots; or if it is called so."""
        section = self._all[number]
        if pattern == section.name or self._is_called(number, pattern):
            return True
        if section.parent <= 0:
            return self._is_model(number) and fnmatch.fnmatchcase(section.name, pattern)
        around, dot, own = pattern.rpartition(".")
        if not dot or not self._fits(section.parent, around):
            return False
        own_name = section.name.removeprefix(f"{self._all[section.parent].name}.")
        return self._is_called(number, own) or (self._is_model(number) and fnmatch.fnmatchcase(own_name, own))

    def _is_model(self, number: int) -> bool:
        return number > 0 and self._all[number].type not in (*_PARTS, *_OTHERS)

    def _is_called(self, number: int, text: str) -> bool:
        """True if the text is the type, a define that it is made from, or its own name."""
        return self._all[number].type == text or self._core.is_called(number, text)
