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
from .errors import StageError, WorldError
from .world import Column, Recipe, World

#: Different combinations of those values that a batch may have of which each has a scene of about a megabyte.
MOST_COMBINATIONS = 1024
#: Properties whose numbers are pairs of a least and a largest value.
_IN_ORDER = ("velocity_bounds", "acceleration_bounds")
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
    in_scenes: tuple[bool, ...]  # by target: different values need different scenes


class Source(NamedTuple):
    """Where the values of a column are."""

    varied: Varied
    target: int  # index in `varied.targets`
    number: int  # third index of `varied.values`


class Plan(NamedTuple):
    """How worlds with the same recipe get their values: some are columns of rows, the others need scenes."""

    recipe: Recipe  # with the columns
    sources: tuple[Source, ...]  # of the columns
    needs_scenes: bool


class Variation:
    """All properties that differ between the worlds of a batch, and the recipes of these worlds.

    Numbers that change no shape are columns of rows: they cost nothing. Others need a scene for each combination.
    """

    def __init__(self, n: int) -> None:
        self.all: dict[str, Varied] = {}  #: by the names that were given, in the order in which they apply
        self._waiting = np.zeros(n, bool)  # for their next reset, since something was changed
        self._known: dict[str, tuple[World, Sections]] = {}  # by the key of the recipe
        self._plans: dict[str, Plan] = {}  # likewise, until something is changed

    def copy(self) -> Variation:
        """A variation that can be changed on its own."""
        copied = Variation(len(self._waiting))
        copied.all, copied._waiting, copied._known = dict(self.all), self._waiting.copy(), dict(self._known)
        return copied

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_known": {}, "_plans": {}}

    def waits(self, i: int) -> bool:
        """True if world `i` has not been reset since the last change."""
        return bool(self._waiting[i])

    def waits_anywhere(self) -> bool:
        """True if some worlds have not been reset since the last change."""
        return bool(self._waiting.any())

    def is_idle(self) -> bool:
        """True if nothing differs, and nothing has differed since the last resets."""
        return not self.all and not self.waits_anywhere()

    def note_reset(self, ids: npt.NDArray[np.uint32]) -> None:
        """Notes that the values are in force in these worlds."""
        self._waiting[ids] = False

    def wait(self, ids: npt.NDArray[np.uint32]) -> None:
        """Lets these worlds get their values at their next reset."""
        self._waiting[ids] = True

    def set(self, name: str, values: Any, bases: Sequence[Recipe], shares_scene: bool = False) -> None:
        """Sets the values of a property; None: those of the file. `bases` are the recipes of all worlds.

        `shares_scene`: the worlds must share a scene, so that each value must be a column.
        """
        before = dict(self.all)
        once = {id(base): base for base in bases}
        varied = None if values is None else self._checked(name, values, once.values())
        if varied is None and name not in self.all:
            raise ValueError(f"vary({name!r}): found a name that is not varied, expected "
                             f"{' or '.join(map(repr, self.all)) or 'one that is'}{_similar(name, self.all)}")
        if varied and shares_scene and any(varied.in_scenes):
            raise StageError(f"vary({name!r}): the worlds of this batch are on a device and share a scene, in which "
                             f"{varied.property!r} can't differ; make the batch from two scenes or more")
        self._plans.clear()
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
            self._plans.clear()
            raise
        self._waiting[:] = True

    def recipe(self, i: int, base: Recipe) -> Recipe:
        """The recipe of world `i` alone, which without variation would be that of `base`."""
        return base.plain()._replace(varied=self._settings(i, base, True))

    def recipes(self, bases: Mapping[int, Recipe]) -> dict[int, Recipe]:
        """The recipes of these worlds in a batch. Raises WorldError if values do not go together."""
        plans = {id(base): self._plan(base) for base in {id(base): base for base in bases.values()}.values()}
        for key, plan in plans.items():
            wrong = self._first_out_of_order(plan, [i for i, base in bases.items() if id(base) == key])
            if wrong is not None:
                raise WorldError(f"values of vary() can't be in force: "
                                 f"{self.why_not_made({wrong: self.recipe(wrong, bases[wrong])})}")
        recipes = {}
        for i, base in bases.items():
            plan = plans[id(base)]
            recipes[i] = (plan.recipe._replace(varied=self._settings(i, base, False)) if plan.needs_scenes
                          else plan.recipe)
        return recipes

    def values(self, ids: npt.NDArray[np.uint32], recipes: Sequence[Recipe]) -> Values | None:
        """The values of the columns of these worlds: shape (ids, most columns). None: no world has columns."""
        most = max((len(recipe.columns) for recipe in recipes), default=0)
        if most == 0:
            return None
        keys = np.array([id(recipe) for recipe in recipes])
        values = np.zeros((len(ids), most))
        for recipe in {id(recipe): recipe for recipe in recipes}.values():
            rows = np.flatnonzero(keys == id(recipe))
            for column, source in enumerate(self._plan(recipe).sources):
                values[rows, column] = source.varied.values[ids[rows], source.target, source.number]
        return values

    def values_in(self, ids: npt.NDArray[np.uint32], recipe: Recipe) -> Values:
        """The values of the columns of a recipe, some of which may not vary any more: shape (ids, columns).

        NaN stands for the value of the file.
        """
        plan = self._plan(recipe)
        places = {column: place for place, column in enumerate(recipe.columns)}
        values = np.full((len(ids), len(places)), np.nan)
        for column, source in zip(plan.recipe.columns, plan.sources):
            values[:, places[column]] = source.varied.values[ids, source.target, source.number]
        return values

    def _settings(self, i: int, base: Recipe, whole: bool) -> tuple[str, ...]:
        """The values of world `i` as settings; not `whole`: without those that are columns."""
        if not self.all:
            return ()
        sections = self.sections(base)
        texts: dict[tuple[int, str], tuple[list[str], bool]] = {}
        for name, varied in self.all.items():
            for j, target in enumerate(varied.targets):
                if target in sections.targets and (whole or not self._is_column(target, varied.property, sections)):
                    place = sections.targets[target], varied.property
                    own = texts[place][0] if place in texts else None
                    texts[place] = _texts(varied, i, j, own, sections, name)
        return tuple(f"#{number}.{name}={'[' + ' '.join(each) + ']' if is_tuple else each[0]}"
                     for (number, name), (each, is_tuple) in texts.items())

    def _is_column(self, target: Target, property: str, sections: Sections) -> bool:
        return property in _kinds(sections.type_of(target)) and sections.place_in_rows(target, property) is not None

    def _plan(self, base: Recipe) -> Plan:
        key = key_of(base.plain())
        if key not in self._plans:
            self._plans[key] = self._made_plan(base)
        return self._plans[key]

    def _made_plan(self, base: Recipe) -> Plan:
        sections = self.sections(base) if self.all else None
        sources: dict[Column, Source] = {}
        needs_scenes = False
        for varied in self.all.values():
            for j, target in enumerate(varied.targets):
                if not sections or target not in sections.targets:
                    continue
                if not self._is_column(target, varied.property, sections):
                    needs_scenes = True
                    continue
                place = sections.place_in_rows(target, varied.property)
                assert place
                for k in range(varied.values.shape[2]):
                    element = k if varied.index is None else varied.index
                    sources[Column(sections.targets[target], varied.property, element, *place)] = Source(varied, j, k)
        columns = tuple(sorted(sources))  # the order in which properties are given does not make another scene
        return Plan(base._replace(varied=(), columns=columns), tuple(sources[column] for column in columns), needs_scenes)

    def _first_out_of_order(self, plan: Plan, ids: Sequence[int]) -> int | None:
        """The first of these worlds in which a least value is above the largest one."""
        places = {(column.section, column.property, column.element): source
                  for column, source in zip(plan.recipe.columns, plan.sources)}
        wrong = np.zeros(len(ids), bool)
        for (section, property, element), source in places.items():
            if property not in _IN_ORDER:
                continue
            own = source.varied.values[ids, source.target, source.number].astype(float)
            other = places.get((section, property, element ^ 1))
            if other:
                others: Any = other.varied.values[ids, other.target, other.number].astype(float)
            else:
                others = float(self.sections(plan.recipe).texts_of(section, property)[element ^ 1])
            wrong |= own > others if element % 2 == 0 else own < others
        return ids[int(wrong.argmax())] if wrong.any() else None

    def why_not_made(self, recipes: Mapping[int, Recipe]) -> str:
        """The reason why the first of these worlds that can't be made can't be made; "": all can."""
        for i, recipe in recipes.items():
            try:
                World._from_recipe(recipe)
            except WorldError as error:
                text = re.sub(r"^.*?--set #(\d+)\.(\w+)(:\d+)*: (property \"\w+\": )?", "", str(error).splitlines()[0])
                return re.sub(r" of \"#\d+\"", " of what it chooses", f"{text}, in world {i}")
        return ""

    def sections(self, base: Recipe) -> Sections:
        """The sections of the file of a recipe."""
        key = key_of(base.plain())
        if key not in self._known:
            while len(self._known) >= _REMEMBERED:
                del self._known[next(iter(self._known))]
            world = World._from_recipe(base.plain()._replace(options={**base.options, "threads": 1}))
            self._known[key] = world, Sections(world)
        return self._known[key][1]

    def _checked(self, name: str, values: Any, bases: Iterable[Recipe]) -> Varied:
        pattern, property, index = _parts(name)
        found: dict[Target, Sections] = {}
        asked: set[str] = set()
        names: set[str] = set()
        for base in bases:
            sections = self.sections(base)
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
        in_scenes = tuple(not self._is_column(target, property, sections) for target, sections in found.items())
        made = Varied(property, index, tuple(found), np.array(values), array, is_tuple, None not in kinds, in_scenes)
        _check_values(name, made, kinds)
        return made

    def _check_combinations(self, name: str) -> None:
        n = len(self._waiting)
        rows = [np.unique(varied.values[:, varied.in_scenes].reshape(n, -1), axis=0, return_inverse=True)[1].reshape(-1, 1)
                for varied in self.all.values() if any(varied.in_scenes)]
        count = len(np.unique(np.concatenate(rows, axis=1), axis=0)) if rows else 0
        if count > MOST_COMBINATIONS:
            raise ValueError(f"vary({name!r}): found {count} worlds that all differ, expected up to {MOST_COMBINATIONS} "
                             "different combinations of values; give several worlds the same ones")


def key_of(recipe: Recipe) -> str:
    """A text that recipes of equal worlds have in common."""
    options = [f"{name}={value}" for name, value in recipe.options.items() if name not in ("seed", "threads")]
    return "\0".join([recipe.path, recipe.text or "", *options, *recipe.varied, *map(str, recipe.columns)])


def recipe_with(values: Sequence[float], recipe: Recipe, sections: Sections) -> Recipe:
    """The recipe of a world alone that has these values of the columns of `recipe`; NaN: those of the file."""
    texts: dict[tuple[int, str], list[str]] = {}
    for column, value in zip(recipe.columns, values):
        if math.isnan(value):
            continue
        place = column.section, column.property
        if place not in texts:
            count = sum((each.section, each.property) == place for each in recipe.columns)
            own = list(sections.texts_of(*place)) or _DEFAULTS.get(column.property, [])
            texts[place] = own + ["0"] * (max(count, column.element + 1) - len(own))
        while len(texts[place]) <= column.element:
            texts[place].append("0")
        texts[place][column.element] = repr(value)
    settings = [f"#{section}.{name}={'[' + ' '.join(each) + ']' if len(each) > 1 else each[0]}"
                for (section, name), each in texts.items()]
    return recipe._replace(varied=(*recipe.varied, *settings), columns=())


#: Texts of properties that have several numbers and are not in the file, of which one is given.
_DEFAULTS = {"noise": ["0"] * 3}


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
    if all(_are_valid(varied.values[:, j], _element(kind, varied.index)) for j, kind in enumerate(kinds)):
        return
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


def _are_valid(values: Values, kind: Any) -> bool:
    """True if these are surely numbers that a property can have; False: each must be checked."""
    from .scenes.properties import Number, Numbers

    if values.dtype.kind not in "iuf" or not isinstance(kind, (Number, Numbers)):
        return False
    if isinstance(kind, Numbers) and (kind.in_order or kind.may_be_infinite):
        return False
    above = kind.above if isinstance(kind, Number) else -math.inf
    return bool(np.isfinite(values).all() and values.min() >= kind.least and values.min() > above
                and values.max() <= kind.most)


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
    texts = texts or list(_DEFAULTS.get(varied.property, []))
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
