# SPDX-License-Identifier: GPL-2.0-or-later
"""Values of properties that differ between the worlds of a batch."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _options
from ._checks import shown
from ._sections import Sections, Target
from .errors import WorldError
from .world import Recipe, World

#: Different combinations of values that a batch may have: each has a scene of its own, of about a megabyte.
MOST_COMBINATIONS = 1024
#: Files whose sections are remembered.
_REMEMBERED = 64

Values = npt.NDArray[Any]


class Varied(NamedTuple):
    """A property that differs between worlds."""

    property: str
    index: int | None  # of one of its numbers; None: all
    targets: tuple[Target, ...]
    given: Values  # as the caller gave them
    values: Values  # shape (n, targets, numbers)
    is_tuple: bool  # written in brackets
    has_ranges: bool  # a table says which values are valid


class Variation:
    """All properties that differ between the worlds of a batch, and the recipes of these worlds."""

    def __init__(self, n: int) -> None:
        self.all: dict[str, Varied] = {}  #: by the names that were given, in the order in which they apply
        self._waiting = np.zeros(n, bool)  # for their next reset, since something was changed
        self._known: dict[str, tuple[World, Sections]] = {}  # by the key of the recipe

    def copy(self) -> Variation:
        """A variation that can be changed on its own."""
        copied = Variation(len(self._waiting))
        copied.all, copied._waiting, copied._known = dict(self.all), self._waiting.copy(), dict(self._known)
        return copied

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_known": {}}

    def waits(self, i: int) -> bool:
        """True if world `i` has not been reset since the last change."""
        return bool(self._waiting[i])

    def is_idle(self) -> bool:
        """True if nothing differs, and nothing has differed since the last resets."""
        return not self.all and not self._waiting.any()

    def note_reset(self, ids: npt.NDArray[np.uint32]) -> None:
        """Notes that the values are in force in these worlds."""
        self._waiting[ids] = False

    def set(self, name: str, values: Any, bases: Sequence[Recipe]) -> None:
        """Sets the values of a property; None: those of the file. `bases` are the recipes of all worlds."""
        before = dict(self.all)
        once = {id(base): base for base in bases}
        varied = None if values is None else self._checked(name, values, once.values())
        if varied is None and name not in self.all:
            raise ValueError(f"vary({name!r}): found a name that is not varied, expected "
                             f"{' or '.join(map(repr, self.all)) or 'one that is'}{_similar(name, self.all)}")
        self.all.pop(name, None)
        if varied:
            self.all[name] = varied
        try:
            if varied:
                self._check_combinations(name)
                wrong = self.why_not_made({i: self.recipe(i, bases[i]) for i in _worlds_to_try(varied)})
                if wrong:
                    raise ValueError(f"vary({name!r}): {wrong}")
        except Exception:
            self.all = before
            raise
        self._waiting[:] = True

    def recipe(self, i: int, base: Recipe) -> Recipe:
        """The recipe of world `i`, which without variation would be that of `base`."""
        if not self.all:
            return base._replace(varied=())
        sections = self._sections(base)
        texts: dict[tuple[int, str], tuple[list[str], bool]] = {}
        for name, varied in self.all.items():
            for j, target in enumerate(varied.targets):
                if target in sections.targets:
                    place = sections.targets[target], varied.property
                    own = texts[place][0] if place in texts else None
                    texts[place] = _texts(varied, i, j, own, sections, name)
        settings = [f"#{number}.{name}={'[' + ' '.join(each) + ']' if is_tuple else each[0]}"
                    for (number, name), (each, is_tuple) in texts.items()]
        return base._replace(varied=tuple(settings))

    def why_not_made(self, recipes: Mapping[int, Recipe]) -> str:
        """The reason why the first of these worlds that can't be made can't be made; "": all can."""
        for i, recipe in recipes.items():
            try:
                World._from_recipe(recipe)
            except WorldError as error:
                text = re.sub(r"^.*?--set #(\d+)\.(\w+)(:\d+)*: (property \"\w+\": )?", "", str(error).splitlines()[0])
                return re.sub(r" of \"#\d+\"", " of what it chooses", f"{text}, in world {i}")
        return ""

    def _sections(self, base: Recipe) -> Sections:
        key = key_of(base._replace(varied=()))
        if key not in self._known:
            while len(self._known) >= _REMEMBERED:
                del self._known[next(iter(self._known))]
            world = World._from_recipe(base._replace(varied=(), options={**base.options, "threads": 1}))
            self._known[key] = world, Sections(world)
        return self._known[key][1]

    def _checked(self, name: str, values: Any, bases: Iterable[Recipe]) -> Varied:
        pattern, property, index = _parts(name)
        found: dict[Target, Sections] = {}
        asked: set[str] = set()
        names: set[str] = set()
        for base in bases:
            sections = self._sections(base)
            names |= sections.names()
            asked |= set(sections.asked())
            found.update({target: found.get(target, sections) for target in sections.chosen(pattern, property)})
        if not found:
            raise ValueError(f"vary({name!r}): found nothing with a name or type like {pattern!r}, expected "
                             f"\"world\", or a model of the world file{_similar(pattern, names)}")
        fields = {target: _kinds(sections.type_of(target)) for target, sections in found.items()}
        known = asked | {known for kinds in fields.values() for known in kinds}
        if property not in known or property == "name":
            raise ValueError(f"vary({name!r}): found the property {property!r}, which {pattern!r} lacks, expected one of "
                             f"docs/properties.md{_similar(property, known - {'name'})}")
        kinds = [fields[target].get(property) for target in found]
        counts = [_count(kind) or len(sections.texts(target, property))
                  for kind, (target, sections) in zip(kinds, found.items())]
        array = _shaped(name, values, len(self._waiting), len(found), 1 if index is not None else max(counts))
        is_tuple = array.shape[2] > 1 or isinstance(values, np.ndarray) and values.ndim == 3
        made = Varied(property, index, tuple(found), np.array(values), array, is_tuple, None not in kinds)
        _check_values(name, made, kinds)
        return made

    def _check_combinations(self, name: str) -> None:
        rows = [np.unique(varied.values.reshape(len(self._waiting), -1), axis=0, return_inverse=True)[1].reshape(-1, 1)
                for varied in self.all.values()]
        count = len(np.unique(np.concatenate(rows, axis=1), axis=0))
        if count > MOST_COMBINATIONS:
            raise ValueError(f"vary({name!r}): found {count} worlds that all differ, expected up to {MOST_COMBINATIONS} "
                             "different combinations of values; give several worlds the same ones")


def key_of(recipe: Recipe) -> str:
    """A text that recipes of equal worlds have in common."""
    options = [f"{name}={value}" for name, value in recipe.options.items() if name not in ("seed", "threads")]
    return "\0".join([recipe.path, recipe.text or "", *options, *recipe.varied])


def _parts(name: str) -> tuple[str, str, int | None]:
    """The pattern, the property, and the index of one of its numbers."""
    found = re.fullmatch(r"(.+)\.(\w+)(?:\[(\d+)\])?", name) if isinstance(name, str) else None
    if not found:
        wrong = ValueError if isinstance(name, str) else TypeError
        raise wrong(f"vary(): found {shown(name)}, expected PATTERN.PROPERTY or PATTERN.PROPERTY[INDEX], such as "
                    "\"robot*.mass\" or \"ranger.noise[0]\"")
    return found[1], found[2], None if found[3] is None else int(found[3])


def _similar(text: str, candidates: Collection[str]) -> str:
    import difflib  # rarely needed

    near = difflib.get_close_matches(text, sorted(candidates), 3)
    return f"; did you mean {' or '.join(map(repr, near))}?" if near else ""


@functools.cache
def _kinds(type_: str) -> dict[str, Any]:
    """The kinds of the properties that sections of a type have."""
    import dataclasses  # rarely needed

    from . import scenes
    from .scenes.models import Thing

    classes = {cls.type: cls for cls in vars(scenes).values()
               if isinstance(cls, type) and issubclass(cls, Thing) and "type" in vars(cls)}
    of = {"world": scenes.Scene, "sensor": scenes.Sensor}.get(type_) or classes.get(type_, Thing)
    return {field.name: field.metadata["kind"] for field in dataclasses.fields(of) if "kind" in field.metadata}


def _worlds_to_try(varied: Varied) -> list[int]:
    """The first world, and those with the least and the largest values if no table has their range."""
    columns = varied.values.reshape(len(varied.values), -1)
    if varied.has_ranges or columns.dtype.kind == "U":
        return [0]
    return sorted({0, *columns.argmin(0).tolist(), *columns.argmax(0).tolist()})


def _count(kind: Any) -> int:
    """How many numbers a kind of property has; 0: unknown."""
    from .scenes.properties import Numbers, Place, Texts

    if isinstance(kind, Numbers):
        return kind.count
    return 4 if isinstance(kind, Place) else 0 if kind is None or isinstance(kind, Texts) else 1


def _shaped(name: str, values: Any, n: int, matches: int, count: int) -> Values:
    """The values as an array of shape (n, matches, numbers)."""
    array = np.asarray(values)
    numbers = f"({n}, {matches}, {count})"
    expected = numbers if count > 1 else f"({n},), ({n}, {matches}) or {numbers}"
    hint = f", or [0] to [{count - 1}] after the name for one of the numbers" if count > 1 else ""
    if array.dtype.kind not in "biufU":
        raise TypeError(f"vary({name!r}): found values of the type {array.dtype}, expected numbers, truth values or texts")
    if array.dtype.kind == "f" and np.isnan(array).any():
        world = int(np.argwhere(np.isnan(array))[0][0]) if array.ndim else 0
        raise ValueError(f"vary({name!r}): found NaN for world {world}, expected a number")
    fits = array.ndim in (1, 2, 3) and array.shape[0] == n and (array.ndim == 1 or array.shape[1] in (1, matches))
    if fits:
        array = array.reshape(n, array.shape[1] if array.ndim > 1 else 1, array.shape[2] if array.ndim == 3 else 1)
        fits = array.shape[2] == count or count == 0 or (count == 4 and array.shape[2] == 3)
    if not fits or not array.size:
        raise ValueError(f"vary({name!r}): found the shape {np.shape(values)}, expected {expected}: {n} worlds and "
                         f"{matches} matches{hint}")
    return np.ascontiguousarray(np.broadcast_to(array, (n, matches, array.shape[2])))


def _check_values(name: str, varied: Varied, kinds: list[Any]) -> None:
    """Raises TypeError or ValueError for the first value that its property can't have."""
    n, matches, _ = varied.values.shape
    whole = varied.values.tolist()
    for j in range(matches):
        kind = _element(kinds[j], varied.index)
        for i in range(n):
            given = whole[i][j]
            try:
                _text(kind, given, varied.is_tuple)
            except (TypeError, ValueError) as error:
                value = given if len(given) > 1 else given[0]
                wrong = TypeError if isinstance(error, TypeError) else ValueError
                raise wrong(f"vary({name!r}): found {shown(value)} for world {i}, expected "
                            f"{kind.expected if kind else 'finite numbers'}") from None


def _element(kind: Any, index: int | None) -> Any:
    """The kind of one of the numbers of a property, or of all of them."""
    from .scenes.properties import Number, Numbers

    if index is None or kind is None:
        return kind
    return Number(f"one of {kind.expected}", kind.least, most=kind.most) if isinstance(kind, Numbers) else None


def _text(kind: Any, given: list[Any], is_tuple: bool) -> list[str]:
    """The values of a property as texts of a world file."""
    if kind is not None:
        text = kind.text(kind.checked(given if _count(kind) != 1 else given[0]))
        return text.strip("[]").split(" ") if text.startswith("[") else [text]
    if any(isinstance(value, float) and not math.isfinite(value) for value in given):
        raise ValueError
    return [repr(value) if isinstance(value, float) else _options.setting_text(value) for value in given]


def _texts(varied: Varied, i: int, j: int, own: list[str] | None, sections: Sections,
           name: str) -> tuple[list[str], bool]:
    """The values of a property of a section as a world file has them, and whether they are in brackets."""
    target = varied.targets[j]
    kind = _kinds(sections.type_of(target)).get(varied.property)
    given = varied.values[i, j].tolist()
    if varied.index is None:
        texts = _text(kind, given, varied.is_tuple)
        return texts, varied.is_tuple or len(texts) > 1
    texts = list(own) if own else [each if _is_number(each) else f'"{each}"'
                                        for each in sections.texts(target, varied.property)]
    if not texts and varied.property == "noise":
        texts = ["0"] * 3
    if varied.index >= len(texts):
        raise ValueError(f"vary({name!r}): found {len(texts)} values of {varied.property!r} in the world file, expected "
                         f"more than {varied.index}; give all of them instead")
    texts[varied.index] = _text(_element(kind, varied.index), given, True)[0]
    return texts, True


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return math.isfinite(float(text))
