# SPDX-License-Identifier: GPL-2.0-or-later
"""Models of a scene: robots, boxes, polygons, and any other type of model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from .._checks import shown
from .properties import (Flag, Number, Numbers, Place, Text, Texts, Whole, check_fields, check_members, choice, lines_of,
                         other_lines, prop, section)

MOST_POINTS = 100_000
SPEEDS = "four numbers: metres per second along x, y and z, radians per second"
BOUNDS = "eight numbers: the least and the largest of each, of x, y, z and turning, in metres and radians"


@dataclass(frozen=True, kw_only=True)
class Thing:
    """Properties that all models have. Those that are None have the defaults of world files.

    Names, units and meanings are those of docs/properties.md, except that angles are in radians.

    Args:
        name: the name; None: one by type and number. Robots without one are called r0, r1 and so on.
        pose: x, y, heading, or x, y, z, heading, in the frame of the model that carries it.
        origin: the centre of the body relative to the pose.
        size: metres along x, y and z.
        color, color_rgba: a colour by name, or as four numbers from 0 to 1.
        mass, friction, floor_friction, pushable, round: how it moves, and whether others can push it.
        obstacle_return, ranger_return, blob_return, gripper_return, fiducial_return, fiducial_key: how others sense it.
        stack_children: whether what it carries is on its top, instead of at its bottom.
        update_interval: simulated milliseconds between two updates.
        ctrl: controllers.
        properties: other properties by their names.
    """

    type: ClassVar[str] = "model"

    name: str | None = prop(Text())
    pose: Sequence[float] | None = prop(Place())
    origin: Sequence[float] | None = prop(Place())
    size: Sequence[float] | None = prop(Numbers("three numbers: metres along x, y and z, 0 or more", 3, least=0))
    color: str | None = prop(Text())
    color_rgba: Sequence[float] | None = prop(Numbers("four numbers from 0 to 1", 4, 0, 1))
    mass: float | None = prop(Number("kilograms, 0 or more", least=0))
    friction: float | None = prop(Number("a coefficient, 0 or more", least=0))
    floor_friction: float | None = prop(Number("a coefficient, 0 or more", least=0))
    pushable: bool | None = prop(Flag())
    round: bool | None = prop(Flag())
    obstacle_return: bool | None = prop(Flag())
    ranger_return: float | None = prop(Number("a finite number"))
    blob_return: bool | None = prop(Flag())
    gripper_return: bool | None = prop(Flag())
    fiducial_return: int | None = prop(Whole("a whole number"))
    fiducial_key: int | None = prop(Whole("a whole number"))
    stack_children: bool | None = prop(Flag())
    update_interval: int | None = prop(Whole("milliseconds, a whole number, 0 or more", 0))
    ctrl: str | Sequence[str] | None = prop(Texts())
    properties: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_fields(self)
        place = f"{type(self).__name__}.properties"
        if not isinstance(self.properties, Mapping):
            raise TypeError(f"{place}: found {shown(self.properties)}, expected a mapping of names to values")
        object.__setattr__(self, "properties", dict(self.properties))
        other_lines(self.properties, place)  # checks them

    def lines(self) -> list[str]:
        """The section of a world file that stands for the model."""
        inner = [*lines_of(self), *other_lines(self.properties, f"{type(self).__name__}.properties"), *self.body()]
        return section(self.section_type(), inner)

    def section_type(self) -> str:
        """The type of model."""
        return self.type

    def body(self) -> list[str]:
        """Lines that the fields of the class stand for together."""
        return []


@dataclass(frozen=True, kw_only=True)
class Box(Thing):
    """A box, or a disc if `round` is True."""


@dataclass(frozen=True, kw_only=True)
class Model(Thing):
    """A model of any type, with properties by their names.

    Args:
        model: the type, such as "gripper" or "wifi".
        models: models that it carries.
    """

    model: str = prop(Text(), "model", written=False)
    models: Sequence[Thing] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        check_members(self, "models", Thing, "models of stagesim.scenes")
        if not self.model.replace("_", "").isalnum():
            raise ValueError(f"Model.model: found {self.model!r}, expected the name of a type of models")

    def section_type(self) -> str:
        return self.model

    def body(self) -> list[str]:
        return [line for model in self.models for line in model.lines()]


@dataclass(frozen=True, kw_only=True)
class Robot(Thing):
    """A robot: a model of the type position.

    Args:
        drive: "diff", "omni" or "car".
        wheelbase, steering_limit, steering_rate, car_command: those of a car.
        velocity: until the first command.
        velocity_bounds, acceleration_bounds, limit_acceleration: limits of commands.
        localization, localization_origin, odom_error, odom_noise, wheel_slip: how it estimates its pose.
        stack_children: False unless given, so that rangers are at the height of all other robots.
        sensors: models that it carries, such as Ranger().
    """

    type: ClassVar[str] = "position"

    stack_children: bool | None = prop(Flag(), False)
    drive: str | None = prop(choice("diff", "omni", "car"))
    wheelbase: float | None = prop(Number("metres above 0", above=0))
    steering_limit: float | None = prop(Number("radians, 0 or more", least=0))
    steering_rate: float | None = prop(Number("radians per second, 0 or more", least=0))
    car_command: str | None = prop(choice("steering", "turn"))
    velocity: Sequence[float] | None = prop(Numbers(SPEEDS, 4))
    velocity_bounds: Sequence[float] | None = prop(Numbers(BOUNDS, 8))
    acceleration_bounds: Sequence[float] | None = prop(Numbers(BOUNDS, 8))
    limit_acceleration: bool | None = prop(Flag())
    localization: str | None = prop(choice("gps", "odom"))
    localization_origin: Sequence[float] | None = prop(Place())
    odom_error: Sequence[float] | None = prop(Numbers("four numbers: fractions of a motion along x, y, z, and radians", 4))
    odom_noise: Sequence[float] | None = prop(Numbers("four numbers, 0 or more", 4, least=0))
    wheel_slip: float | None = prop(Number("a fraction from 0 to 1", least=0, most=1))
    sensors: Sequence[Thing] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        check_members(self, "sensors", Thing, "models of stagesim.scenes, such as Ranger()")

    def body(self) -> list[str]:
        return [line for sensor in self.sensors for line in sensor.lines()]


@dataclass(frozen=True)
class Polygon(Thing):
    """A prism on a polygon.

    Args:
        points: its corners in either direction, metres relative to the pose: shape (n, 2), n from 3 to 100 000.
        height: metres.
    """

    points: npt.ArrayLike = ()
    height: float = prop(Number("metres above 0", above=0), 1.0, written=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.size is not None or self.origin is not None:
            raise ValueError("Polygon: found size or origin, expected only points, which decide both")
        object.__setattr__(self, "points", _points(self.points))

    def body(self) -> list[str]:
        assert isinstance(self.points, tuple)
        xs, ys = ([point[axis] for point in self.points] for axis in (0, 1))
        low, high = (min(xs), min(ys)), (max(xs), max(ys))
        centre = [a + (b - a) / 2 for a, b in zip(low, high)]
        corners = [f"point[{i}] [{x!r} {y!r}]" for i, (x, y) in enumerate(self.points)]
        return [f"size [{high[0] - low[0]!r} {high[1] - low[1]!r} {self.height!r}]",
                f"origin [{centre[0]!r} {centre[1]!r} 0 0]",
                *section("block", [f"points {len(corners)}", *corners])]


def _points(given: npt.ArrayLike) -> tuple[tuple[float, float], ...]:
    """Checked corners of a polygon."""
    expected = "an array of shape (n, 2) with n from 3 to 100 000"
    try:
        points = np.asarray(given, np.float64)
    except (TypeError, ValueError):
        raise TypeError(f"Polygon.points: found {shown(given)}, expected {expected}") from None
    if points.ndim != 2 or points.shape[1] != 2 or not 3 <= len(points) <= MOST_POINTS:
        raise ValueError(f"Polygon.points: found the shape {points.shape}, expected {expected}")
    if not np.isfinite(points).all():
        raise ValueError("Polygon.points: found a number that is not finite, expected metres")
    extent = np.ptp(points, axis=0)
    if not (extent > 0).all() or not math.isfinite(extent.max()):
        raise ValueError(f"Polygon.points: found an extent of {extent[0]} by {extent[1]} m, expected one above 0 in both "
                         "directions")
    return tuple((float(x), float(y)) for x, y in points)
