# SPDX-License-Identifier: GPL-2.0-or-later
"""Scenes, which have the things of a world with their shapes, and frames, which have their current poses."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .._core import Model
from ..errors import GoneError
from ..fleet import sensor_types
from ..text import printable
from ..world import World
from .floor import FieldPicture

#: Max number of robots of which all scans are sent.
MAX_SCANNED_ROBOTS = 64
#: Max number of samples of all scans in a frame, about a megabyte.
MAX_SAMPLES = 120_000
#: Max number of readings among the details of a thing, and of values of each.
MAX_READINGS = 24
MAX_VALUES = 4


class Shapes:
    """The table of all shapes that things of a run have had. Each viewer gets each shape once.

    When the table is full, a new one replaces it, which numbers its shapes from 0.
    """

    MOST = 4096

    def __init__(self) -> None:
        self.table: dict[bytes, int] = {}

    def next(self) -> Shapes:
        """Returns this table, or a new one if this is full."""
        return self if len(self.table) < self.MOST else Shapes()

    def number(self, shape: bytes) -> int:
        """Returns the number of a shape; adds it to the table if necessary."""
        return self.table.setdefault(shape, len(self.table))

    def after(self, known: int) -> list[bytes]:
        """Returns the shapes from number `known` on."""
        return list(itertools.islice(self.table, known, None))


class Scene:
    """The things of a world and their shapes. Things of equal shape share it.

    A thing is a rigid group of models: a robot, or a model on the ground with everything that it carries except for
    robots.
    """

    def __init__(self, world: World, before: Scene | None = None) -> None:
        self.number: int = before.number + 1 if before else 1  #: number of the scene in this run, from 1
        self.key = world._core.scene_key()  #: hash of the state that it shows
        self.things = world._core.things()
        self.names = [printable(thing.name) for thing in self.things]
        self.ids = np.array([thing.id for thing in self.things], np.uint32)
        self.shapes: Shapes = before.shapes.next() if before else Shapes()
        self.shape_of = [self.shapes.number(thing.shape) for thing in self.things]
        self.shape_count = len(self.shapes.table)
        self.index = {thing.id: at for at, thing in enumerate(self.things)}
        self.robot_ids = [thing.id for thing in self.things if thing.robot]


@dataclass(frozen=True)
class Scan:
    """The readings of one sensor, and the instant that they belong to.

    A step of the world senses first, then moves. A scan belongs to the beginning of its step, so its end points lie on
    the objects that the rays have hit although the thing has moved since.
    """

    time: int  #: simulated time in nanoseconds at which the step of the reading began
    place: tuple[float, float, float]  #: global x, y and heading of the thing at that time; NaN: unknown
    origin: tuple[float, float, float]  #: global x, y and heading of the sensor at that time
    ranges: tuple[float, ...]  #: metres
    bearings: tuple[float, ...]  #: radians, relative to the sensor


def unpacked_scans(words: bytes) -> list[Scan]:
    """The scans of a thing, from the words that scene.hh describes."""
    scans, at, head = [], 0, struct.Struct("<IIQ8f")
    while at < len(words):
        _, count, time, *numbers = head.unpack_from(words, at)
        values = struct.unpack_from(f"<{2 * count}f", words, at + head.size)
        at += head.size + 8 * count
        scans.append(Scan(time * 1000, tuple(numbers[:3]), tuple(numbers[3:6]), values[:count], values[count:]))
    return scans


@dataclass(frozen=True)
class State:
    """The state of a run."""

    time: float  #: simulated time, seconds
    steps: int
    seed: int
    paused: bool
    speed: float  #: requested simulated seconds per real second; 0: as fast as possible
    rate: float  #: actual simulated seconds per real second
    busy: float  #: fraction of the time spent in steps
    note: str  #: reason why the world stands still; may be empty


@dataclass(frozen=True)
class Frame:
    """The state of a world at one moment."""

    scene: Scene
    state: State
    places: npt.NDArray[np.float32]  #: x, y (metres) and heading (radians) of each thing: shape (things, 3)
    stalled: npt.NDArray[np.bool_]
    #: The scans that viewers wish to see, by things, packed as in scene.hh.
    scans: Mapping[int, bytes] = field(default_factory=dict)
    details: Mapping[int, dict[str, Any]] = field(default_factory=dict)
    fields: Mapping[int, FieldPicture] = field(default_factory=dict)  #: pictures of all fields, by their models
    glows: bytes = b""  #: glows of all lights that are on, packed as in scene.hh

    @property
    def r_acc(self) -> float:
        """Number of robots times simulated seconds per real second."""
        return len(self.scene.robot_ids) * self.state.rate


@dataclass(frozen=True)
class Wish:
    """The data that a viewer wishes to see in addition to all poses."""

    chosen: int | None = None  #: the thing whose details are shown
    scans: tuple[int, ...] = ()  #: things whose scans are shown
    all_scans: bool = False  #: also show the scans of all robots, if there are at most MAX_SCANNED_ROBOTS


def places_of(world: World, scene: Scene) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.bool_]]:
    """Returns x, y and heading of each thing, and whether it is stalled."""
    places = np.empty((len(scene.ids), 3), np.float32)
    stalled = np.empty(len(scene.ids), bool)
    world._core.places(scene.ids, places, stalled)
    return places, stalled


def scans_of(world: World, scene: Scene, wishes: list[Wish]) -> dict[int, bytes]:
    """Returns the scans that viewers wish to see, by things."""
    wanted = {thing for wish in wishes for thing in wish.scans if thing in scene.index}
    if any(wish.all_scans for wish in wishes) and len(scene.robot_ids) <= MAX_SCANNED_ROBOTS:
        wanted.update(scene.robot_ids)
    scans, room = {}, MAX_SAMPLES
    for thing in sorted(wanted):
        data = world._core.scans(np.array([thing], np.uint32), room)
        if data:
            scans[thing] = data
            room -= len(data) // 8
    return scans


def model_of(world: World, thing: int) -> Model:
    """Returns the model with this id. Raises GoneError if it no longer exists."""
    model = world._core.find_id(thing)
    if model is None:
        raise GoneError(f"there is no model number {thing}")
    return model


def details_of(world: World, scene: Scene, thing: int) -> dict[str, Any]:
    """Returns the details of a thing for the page."""
    described = scene.things[scene.index[thing]]
    model = model_of(world, thing)
    sensors = sensors_of(model)
    working = [sensor for sensor in sensors if sensor.subscribers > 0]
    details: dict[str, Any] = {
        "id": thing, "name": printable(described.name), "type": described.type, "pose": list(model.global_pose),
        "stalled": model.stalled, "energy": model.energy, "sensors": len(sensors),
        "sensing": len(working), "readings": list(itertools.islice(
            (row for sensor in working for row in readings_of(sensor)), MAX_READINGS))}
    if described.robot:
        details["velocity"] = list(model.velocity)
    return details


def sensors_of(model: Model) -> list[Model]:
    """Returns the sensors that a model carries, without those of robots on it."""
    found = [model] if model.sensor_type else []
    for child in model.children:
        if child.type != "position":
            found += sensors_of(child)
    return found


def readings_of(sensor: Model) -> Iterator[dict[str, Any]]:
    """Yields each reading of a sensor with its name, unit and shape, and the first values if it has at most one axis."""
    arrays = sensor.readings
    for reading in sensor_types()[sensor.sensor_type or ""]:
        array = arrays[reading.name]
        yield {"name": f"{printable(sensor.type)} {reading.name}", "unit": reading.unit, "shape": list(array.shape),
               "values": array.ravel()[:MAX_VALUES].astype(float).tolist() if array.ndim < 2 else []}
