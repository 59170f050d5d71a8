# SPDX-License-Identifier: GPL-2.0-or-later
"""What there is to be seen in a world, and the frames that tell where it is now."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .._core import Model
from ..errors import GoneError
from ..text import printable
from ..world import World

#: Scans of all robots are sent where there are no more robots than that.
FEW_ROBOTS = 64
#: Samples of all scans in a frame, about a megabyte.
MOST_SAMPLES = 120_000


class Shapes:
    """All shapes that things of a run have had: whoever looks gets each of them once.

    When they have become too many, another table takes over, which counts from 0.
    """

    MOST = 4096

    def __init__(self) -> None:
        self.table: dict[bytes, int] = {}

    def next(self) -> Shapes:
        """This one, or another if this is full."""
        return self if len(self.table) < self.MOST else Shapes()

    def number(self, shape: bytes) -> int:
        """Of a shape, as it is in the table."""
        return self.table.setdefault(shape, len(self.table))

    def after(self, known: int) -> list[bytes]:
        """Those beyond the first ones that somebody has already."""
        return list(itertools.islice(self.table, known, None))


class Scene:
    """The things of a world and their shapes. Robots are often alike: they share a shape.

    A thing is what moves as a whole: a robot, or a model on the ground with all that it carries.
    """

    def __init__(self, world: World, before: Scene | None = None) -> None:
        self.number: int = before.number + 1 if before else 1  #: of scenes of this run
        self.key = world._core.scene_key()  #: of the state that it shows
        self.things = world._core.things()
        self.names = [printable(thing.name) for thing in self.things]
        self.ids = np.array([thing.id for thing in self.things], np.uint32)
        self.shapes: Shapes = before.shapes.next() if before else Shapes()
        self.shape_of = [self.shapes.number(thing.shape) for thing in self.things]
        self.shape_count = len(self.shapes.table)
        self.index = {thing.id: at for at, thing in enumerate(self.things)}
        self.robot_ids = [thing.id for thing in self.things if thing.robot]


@dataclass(frozen=True)
class State:
    """How a run goes on."""

    time: float  #: simulated, seconds
    steps: int
    seed: int
    paused: bool
    speed: float  #: simulated seconds for each real one that are wished for; 0: as many as can be
    rate: float  #: those that there are
    busy: float  #: the share of the time in which steps are made
    note: str  #: why it stands still, if there is a reason


@dataclass(frozen=True)
class Frame:
    """A world at a moment."""

    scene: Scene
    state: State
    places: npt.NDArray[np.float32]  #: x, y and heading of each thing
    stalled: npt.NDArray[np.bool_]
    #: What the rangers of things read that somebody wants to see: see scene.hh.
    scans: Mapping[int, bytes] = field(default_factory=dict)
    details: Mapping[int, dict[str, Any]] = field(default_factory=dict)

    @property
    def r_acc(self) -> float:
        """Robots times simulated seconds for each real second."""
        return len(self.scene.robot_ids) * self.state.rate


@dataclass(frozen=True)
class Wish:
    """What somebody who looks wants to see beside all places."""

    chosen: int | None = None  #: details of that thing
    scans: tuple[int, ...] = ()  #: what the rangers of these things read
    all_scans: bool = False  #: and those of all robots, if they are few


def places_of(world: World, scene: Scene) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.bool_]]:
    """x, y and heading of each thing, and which are blocked."""
    places = np.empty((len(scene.ids), 3), np.float32)
    stalled = np.empty(len(scene.ids), bool)
    world._core.places(scene.ids, places, stalled)
    return places, stalled


def scans_of(world: World, scene: Scene, wishes: list[Wish]) -> dict[int, bytes]:
    """The readings that somebody wants to see, by things."""
    wanted = {thing for wish in wishes for thing in wish.scans if thing in scene.index}
    if any(wish.all_scans for wish in wishes) and len(scene.robot_ids) <= FEW_ROBOTS:
        wanted.update(scene.robot_ids)
    scans, room = {}, MOST_SAMPLES
    for thing in sorted(wanted):
        data = world._core.scans(np.array([thing], np.uint32), room)
        if data:
            scans[thing] = data
            room -= len(data) // 8
    return scans


def model_of(world: World, thing: int) -> Model:
    """The model of that number; raises GoneError if there is none any more."""
    model = world._core.find_id(thing)
    if model is None:
        raise GoneError(f"there is no model number {thing}")
    return model


def details_of(world: World, scene: Scene, thing: int) -> dict[str, Any]:
    """What the page says about a thing that has been chosen."""
    described = scene.things[scene.index[thing]]
    model = model_of(world, thing)
    rangers = rangers_of(model)
    details: dict[str, Any] = {
        "id": thing, "name": printable(described.name), "type": described.type, "pose": list(model.global_pose),
        "stalled": model.stalled, "energy": model.energy, "rangers": len(rangers),
        "sensing": sum(ranger.subscribers > 0 for ranger in rangers)}
    if described.robot:
        details["velocity"] = list(model.velocity)
    return details


def rangers_of(model: Model) -> list[Model]:
    """The rangers that a model carries, without those of robots on it."""
    found = [model] if model.type == "ranger" else []
    for child in model.children:
        if child.type != "position":
            found += rangers_of(child)
    return found
