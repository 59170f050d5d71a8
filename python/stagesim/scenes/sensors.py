# SPDX-License-Identifier: GPL-2.0-or-later
"""Sensors that robots of a scene carry."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from .models import Thing
from .properties import (Flag, Number, Numbers, Place, Texts, Whole, check_fields, check_members, checked, choice,
                         lines_of, prop, section)

_RANGE = Numbers("two numbers: the least and the largest range in metres, from 0 on and in order", 2, least=0,
                 in_order=True, may_be_infinite=True)
_NOISE = Numbers("three numbers, 0 or more: the variance in square metres, a fraction, and radians", 3, least=0)
_LENGTH = Number("metres, 0 or more", least=0)
_TIME = Number("seconds, 0 or more", least=0)
_SHARE = Number("a probability, 0 to 1", least=0, most=1)
_INCIDENCE = Number("radians, 0 to pi / 2", least=0, most=math.pi / 2)
#: Properties of a Sensor that a Ranger with only one sensor has itself.
_OF_ONLY_SENSOR = ("range", "fov", "samples", "noise", "loss", "blind_near", "steepest", "range_step",
                   "time_increment", "ray_model")


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """One of several sensors of a Ranger.

    Args:
        pose: its place in the frame of the ranger.
        size: metres along x, y and z; rays start at half its height.
        range: the least and the largest range, metres.
        fov: field of view, radians.
        samples: number of rays.
        noise: random errors: variance of a range, largest fraction of it, and radians.
        loss: probability that a ray has no return.
        blind_near: whether nothing is measured below the least range.
        steepest: greatest angle between a ray and the normal of a surface with a return, radians.
        range_step: metres; ranges are multiples of it, or not rounded if it is 0.
        time_increment: seconds from ray to ray, or 0 if all are cast at once.
        ray_model: "cell" or "exact".
    """

    pose: Sequence[float] | None = prop(Place())
    size: Sequence[float] | None = prop(Numbers("three numbers: metres along x, y and z, 0 or more", 3, least=0))
    range: Sequence[float] | None = prop(_RANGE)
    fov: float | None = prop(Number("radians"))
    samples: int | None = prop(Whole("a whole number, 0 to 1 000 000", 0, 1_000_000))
    noise: Sequence[float] | None = prop(_NOISE)
    loss: float | None = prop(_SHARE)
    blind_near: bool | None = prop(Flag())
    steepest: float | None = prop(_INCIDENCE)
    range_step: float | None = prop(_LENGTH)
    time_increment: float | None = prop(_TIME)
    ray_model: str | None = prop(choice("cell", "exact"))

    def __post_init__(self) -> None:
        check_fields(self)

    def lines(self) -> list[str]:
        """The section of a world file that stands for the sensor."""
        return section("sensor", lines_of(self))


@dataclass(frozen=True, kw_only=True)
class Ranger(Thing):
    """A range finder, such as a laser scanner.

    Args:
        range, fov, samples, noise, loss, blind_near, steepest, range_step, time_increment, ray_model: those of its only
            sensor, see Sensor.
        sensor: several sensors instead.
    """

    type: ClassVar[str] = "ranger"

    range: Sequence[float] | None = prop(_RANGE, written=False)
    fov: float | None = prop(Number("radians"), written=False)
    samples: int | None = prop(Whole("a whole number, 0 to 1 000 000", 0, 1_000_000), written=False)
    noise: Sequence[float] | None = prop(_NOISE, written=False)
    loss: float | None = prop(_SHARE, written=False)
    blind_near: bool | None = prop(Flag(), written=False)
    steepest: float | None = prop(_INCIDENCE, written=False)
    range_step: float | None = prop(_LENGTH, written=False)
    time_increment: float | None = prop(_TIME, written=False)
    ray_model: str | None = prop(choice("cell", "exact"), written=False)
    sensor: Sequence[Sensor] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        check_members(self, "sensor", Sensor, "Sensor() of stagesim.scenes")
        if self.sensor and any(value is not None for value in self._only().values()):
            raise ValueError("Ranger.sensor: found several sensors and properties of a single one, expected either")

    def body(self) -> list[str]:
        return [line for sensor in self.sensor or (Sensor(**self._only()),) for line in sensor.lines()]

    def _only(self) -> dict[str, object]:
        """The properties of the only sensor."""
        return {name: getattr(self, name) for name in _OF_ONLY_SENSOR}


@dataclass(frozen=True, kw_only=True)
class Bumper(Thing):
    """Lines that feel touches.

    Args:
        bpose: the centre of each line and the direction that it faces: x, y, heading.
        blength: length of all lines, or of each, metres.
    """

    type: ClassVar[str] = "bumper"

    bpose: Sequence[Sequence[float]] = ()
    blength: float | Sequence[float] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        poses = tuple(checked(Place(), pose, f"Bumper.bpose[{i}]") for i, pose in enumerate(self.bpose))
        each = list(self.blength) if isinstance(self.blength, Iterable) else [self.blength] * len(poses)
        if len(each) != len(poses):
            raise ValueError(f"Bumper.blength: found {len(each)} lengths, expected one, or one for each of {len(poses)} "
                             "lines")
        lengths = tuple(checked(_LENGTH, length, f"Bumper.blength[{i}]") for i, length in enumerate(each))
        object.__setattr__(self, "bpose", poses)
        object.__setattr__(self, "blength", lengths)

    def body(self) -> list[str]:
        assert isinstance(self.blength, tuple)
        lines = [f"bcount {len(self.bpose)}"]
        for i, (pose, length) in enumerate(zip(self.bpose, self.blength)):
            lines += [f"bpose[{i}] {Place().text(tuple(pose))}", f"blength[{i}] {length!r}"]
        return lines


@dataclass(frozen=True, kw_only=True)
class Fiducial(Thing):
    """A finder of models with a `fiducial_return`.

    Args:
        range_min, range_max, range_max_id: metres; from the last on, numbers are reported as 0.
        fov: field of view, radians.
        ignore_zloc: whether targets are found that the ray passes above.
    """

    type: ClassVar[str] = "fiducial"

    range_min: float | None = prop(_LENGTH)
    range_max: float | None = prop(_LENGTH)
    range_max_id: float | None = prop(_LENGTH)
    fov: float | None = prop(Number("radians, 0 or more", least=0))
    ignore_zloc: bool | None = prop(Flag())


@dataclass(frozen=True, kw_only=True)
class Blobfinder(Thing):
    """A finder of colours.

    Args:
        image: width and height of the image, pixels.
        range: metres.
        fov, pan: field of view and heading of the image's centre, radians.
        colors: names of the colours to report; None: all.
    """

    type: ClassVar[str] = "blobfinder"

    image: Sequence[int] | None = prop(Numbers("two numbers: width and height in pixels", 2, 1, 100_000), written=False)
    range: float | None = prop(_LENGTH)
    fov: float | None = prop(Number("radians"))
    pan: float | None = prop(Number("radians"))
    colors: Sequence[str] | None = prop(Texts())

    def body(self) -> list[str]:
        lines = [] if self.image is None else [f"image [{' '.join(str(int(pixels)) for pixels in self.image)}]"]
        return lines if self.colors is None else [*lines, f"colors_count {len(self.colors)}"]
