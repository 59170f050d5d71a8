# SPDX-License-Identifier: GPL-2.0-or-later
"""Robots as URDF, made from their models: bodies, frames of sensors, and wheels."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Callable, Iterable, Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

from ..shapes import Area, Corners, areas_of
from .messages import Array
from .motion import STEERING, Wheels
from .names import joined
from .robots import Look, Robot

if TYPE_CHECKING:
    from .node import StageNode

WHEEL_WIDTH = 0.4  #: of a wheel, as a share of its radius
MIN_ROUND = 12  #: corners of an outline that counts as round


def publish_descriptions(node: StageNode, look: Look, robots: Sequence[Robot], wheels: Sequence[Wheels]) -> None:
    """Publishes the URDF of each robot once, for late subscribers too, and declares a parameter with it.

    A value given to the parameter replaces the URDF that is made from the model.
    """
    shapes = {thing.id: thing.shape for thing in node.world._core.things() if thing.robot}
    kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    for robot, own in zip(robots, wheels):
        name = f"{robot.prefix}.robot_description".removeprefix(".")
        made = describe(robot, look, own, shapes[robot.model.id])
        text = node.declare_parameter(name, made, ParameterDescriptor(
            description="the robot as URDF", read_only=True)).value
        node.create_publisher(String, joined(robot.prefix, "robot_description"), kept).publish(String(data=text))


def describe(robot: Robot, look: Look, wheels: Wheels, shape: bytes) -> str:
    """The URDF of a robot.

    Args:
        robot: the robot, whose frames are links.
        look: the names of frames.
        wheels: its wheels.
        shape: its packed shape, as of Thing.shape.
    """
    root = Element("robot", name=robot.prefix or robot.model.name)

    def frame(name: str) -> str:
        return look.frame(robot.prefix, name)

    SubElement(root, "link", name=frame(look.footprint))
    for _, child, _ in robot.mounts:
        link = SubElement(root, "link", name=frame(child))
        if child == look.base:
            _add_body(link, areas_of(shape))
    for parent, child, pose in robot.mounts:
        _add_joint(root, child, "fixed", frame(parent), frame(child), list(pose[:3]), angles_of(pose[3:]))
    for number in range(len(wheels.names)):
        _add_wheel(root, frame, frame(look.base), wheels, number)
    indent(root)
    return '<?xml version="1.0"?>\n' + tostring(root, encoding="unicode")


def _numbers(values: list[float]) -> str:
    return " ".join(f"{value + 0.0:.10g}" for value in values)


def _add_origin(parent: Element, place: list[float], turned: list[float]) -> None:
    SubElement(parent, "origin", xyz=_numbers(place), rpy=_numbers(turned))


def _add_joint(root: Element, name: str, kind: str, parent: str, child: str, place: list[float],
               turned: list[float]) -> Element:
    joint = SubElement(root, "joint", name=f"{name}_joint", type=kind)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    _add_origin(joint, place, turned)
    return joint


def _add_body(link: Element, areas: Iterable[Area]) -> None:
    for number, area in enumerate(areas):
        for outline in area.outlines:
            for purpose in ("visual", "collision"):
                part = SubElement(link, purpose)
                _add_solid(part, outline, round(area.low, 6), round(area.high, 6))
                if purpose == "visual":
                    material = SubElement(part, "material", name=f"{link.get('name')}_{number}")
                    SubElement(material, "color", rgba=_numbers(list(area.rgba)))


def _add_solid(part: Element, outline: Corners, low: float, high: float) -> None:
    """A cylinder for a round outline, a box for a rectangle, and the box around any other outline."""
    corners = np.round(outline, 6)  # shapes have single precision
    turn = 0.0
    middle = (corners.min(0) + corners.max(0)) / 2
    radii = np.hypot(*(corners - middle).T)
    geometry: tuple[str, dict[str, str]]
    if len(corners) >= MIN_ROUND and np.ptp(radii) < 0.02 * radii.max():
        geometry = ("cylinder", {"radius": _numbers([round(radii.max(), 5)]), "length": _numbers([high - low])})
    else:
        if is_rectangle(corners):
            turn = math.atan2(corners[1, 1] - corners[0, 1], corners[1, 0] - corners[0, 0])
            size = [round(math.dist(corners[i], corners[i + 1]), 5) for i in (0, 1)]
            middle = corners.mean(0)
        else:
            size = list(np.ptp(corners, 0))
        geometry = ("box", {"size": _numbers([*size, high - low])})
    _add_origin(part, [*middle, (low + high) / 2], [0.0, 0.0, turn])
    SubElement(SubElement(part, "geometry"), geometry[0], geometry[1])


def is_rectangle(corners: Array) -> bool:
    """True for four corners with right angles."""
    if len(corners) != 4:
        return False
    sides = np.roll(corners, -1, 0) - corners
    across = np.abs((sides * np.roll(sides, -1, 0)).sum(1))
    return bool((across < 1e-3 * (sides**2).sum(1).max()).all())


def angles_of(quaternion: Array) -> list[float]:
    """Roll, pitch and yaw of a rotation (x, y, z, w)."""
    x, y, z, w = (float(part) for part in quaternion)
    return [math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            math.asin(min(1.0, max(-1.0, 2 * (w * y - z * x)))),
            math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))]


def _add_wheel(root: Element, frame: Callable[[str], str], base: str, wheels: Wheels, number: int) -> None:
    """A wheel on its joint; a front wheel of a car stands on a joint that steers it."""
    name, side = wheels.names[number], 1 if number % 2 == 0 else -1
    carrier, place = base, [0.0, side * wheels.separation / 2, wheels.radius]
    if number > 1:
        steering = STEERING[number - 2]
        carrier = frame(f"{steering}_link")
        SubElement(root, "link", name=carrier)
        place[0] = wheels.wheelbase
        joint = _add_joint(root, steering, "revolute", base, carrier, place, [0.0] * 3)
        SubElement(joint, "axis", xyz="0 0 1")
        limit = _numbers([math.pi])
        SubElement(joint, "limit", lower=f"-{limit}", upper=limit, effort="0", velocity="0")
        place = [0.0] * 3
    own = frame(f"{name}_link")
    visual = SubElement(SubElement(root, "link", name=own), "visual")
    _add_origin(visual, [0.0] * 3, [math.pi / 2, 0.0, 0.0])
    SubElement(SubElement(visual, "geometry"), "cylinder", radius=_numbers([wheels.radius]),
               length=_numbers([WHEEL_WIDTH * wheels.radius]))
    SubElement(_add_joint(root, name, "continuous", carrier, own, place, [0.0] * 3), "axis", xyz="0 1 0")
