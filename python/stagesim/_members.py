# SPDX-License-Identifier: GPL-2.0-or-later
"""Finds the models of each variant that the arrays of a batch show, by their names."""

from __future__ import annotations

from collections import Counter
from typing import Union

from .errors import GoneError
from .world import World, is_named

#: For each variant the ids of its models; None: it lacks the model.
Ids = list[list[Union[int, None]]]


def _merged(lists: list[list[tuple[str, int]]]) -> list[tuple[str, int]]:
    """All keys once, in the order of each list where they agree: models are subscribed to in that order."""
    merged: list[tuple[str, int]] = []
    for keys in lists:
        known = set(merged)
        before: dict[tuple[str, int], list[tuple[str, int]]] = {}
        new: list[tuple[str, int]] = []
        for key in keys:
            if key in known:
                before[key], new = new, []
            else:
                new.append(key)
        merged = [each for key in merged for each in (*before.get(key, ()), key)] + new
    return merged


def fitted(found: tuple[Ids, tuple[str, ...]], names: tuple[str, ...], others: bool = False) -> list[int | None]:
    """The ids of the models of one variant in the order of `names`; None: it lacks the model.

    `others`: models that `names` lacks are left out. Otherwise they are a ValueError.
    """
    ids: list[int | None] = [None] * len(names)
    seen: Counter[str] = Counter()
    for id_, name in zip(found[0][0], found[1]):
        places = [place for place, known in enumerate(names) if known == name]
        if seen[name] >= len(places):
            if others:
                continue
            raise ValueError(f"found a robot {name!r} more than the batch has, expected only {len(names)} robots with the "
                             "names of Batch.names; make the batch from the scene with all robots")
        ids[places[seen[name]]] = id_
        seen[name] += 1
    return ids


def robots_of(prototypes: list[World], robots: str | None,
               may_lack: bool = False) -> tuple[Ids, tuple[str, ...]]:
    """The ids of each variant's robots, None for those that it lacks, and the names of all."""
    chosen: list[list[tuple[int, str]]] = []
    for prototype in prototypes:
        try:
            chosen.append(list(zip(*prototype._choose(robots))))
        except GoneError:
            if len(prototypes) == 1 and not may_lack:
                raise
            chosen.append([])
    ids, names = _united(chosen)
    if not names and not may_lack:
        raise GoneError("there are no such robots")
    return ids, names


def placed_of(prototypes: list[World], pattern: str | None,
               may_lack: bool = False) -> tuple[Ids, tuple[str, ...]]:
    """The ids of each variant's models that are placed, None for those that it lacks, and the names of all."""
    if pattern is None:
        return [[] for _ in prototypes], ()
    chosen = []
    for prototype in prototypes:
        robots = {id_ for id_, *_ in prototype._core.robots()}
        chosen.append([(model.id, model.name) for model in prototype.models
                       if model.parent is None and model.id not in robots
                       and is_named(model.name, model.type, pattern)])
    ids, names = _united(chosen)
    if not names and not may_lack:
        raise GoneError(f"there is no model on the ground with a name or type like {pattern!r}")
    return ids, names


def _united(chosen: list[list[tuple[int, str]]]) -> tuple[Ids, tuple[str, ...]]:
    """The ids of each variant's models, given with their names; None for those that it lacks. And all names."""
    found: list[dict[tuple[str, int], int]] = []
    for of_variant in chosen:
        seen: Counter[str] = Counter()
        found.append({})
        for id_, name in of_variant:
            found[-1][name, seen[name]] = id_
            seen[name] += 1
    keys = _merged([list(ids) for ids in found])
    return [[ids.get(key) for key in keys] for ids in found], tuple(name for name, _ in keys)
