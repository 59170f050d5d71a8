# SPDX-License-Identifier: GPL-2.0-or-later
"""Robots as URDF, made from their models: bodies with masses, frames of sensors, actuators and wheels."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Callable, Iterable, Iterator, Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

from .._core import Model
from ..shapes import Area, areas_of
from ..world import World
from .endpoints import Endpoints
from .messages import Array
from .motion import STEERING, Wheels
from .names import joined
from .parameters import undeclare
from .robots import Joint, Look, Robot, composed, relative
from .solids import Solid, inertia_of, solid_of

if TYPE_CHECKING:
    from .node import StageNode

WHEEL_WIDTH = 0.4  #: of a wheel, as a share of its radius
DEFAULT_MASS = 10.0  #: of robots without a mass, kilograms, as in contacts
JOINT_TYPES = {"linear": "prismatic", "rotational": "revolute"}  #: by the kinds of actuators


def publish_descriptions(node: StageNode, endpoints: Endpoints, look: Look, robots: Sequence[Robot],
                         wheels: Sequence[Wheels], before: Sequence[Robot] = ()) -> None:
    """Publishes the URDF of each robot once, for late subscribers too, and declares a parameter with it.

    A value given to the parameter replaces the URDF that is made from the model.

    Args:
        node: the node.
        endpoints: makes the publishers.
        look: the names of frames.
        robots: the robots.
        wheels: their wheels.
        before: robots with descriptions. Those that `robots` lacks lose their parameters.
    """
    kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    described = {(robot.model.id, robot.prefix) for robot in before}
    for _, prefix in described - {(robot.model.id, robot.prefix) for robot in robots}:
        undeclare(node, parameter_of(prefix))
    for robot, own in zip(robots, wheels):
        publisher = endpoints.publisher(String, joined(robot.prefix, "robot_description"), kept, fixed=True)
        if (robot.model.id, robot.prefix) in described:
            continue
        made = describe(robot, look, own, node.world)
        text = node.declare_parameter(parameter_of(robot.prefix), made, ParameterDescriptor(
            description="the robot as URDF", read_only=True)).value
        publisher.publish(String(data=text))


def parameter_of(prefix: str) -> str:
    """The parameter with the URDF of the robot with that prefix."""
    return f"{prefix}.robot_description".removeprefix(".").replace("/", ".")


def describe(robot: Robot, look: Look, wheels: Wheels, world: World) -> str:
    """The URDF of a robot.

    Args:
        robot: the robot, whose frames are links.
        look: the names of frames.
        wheels: its wheels.
        world: its world.
    """
    root = Element("robot", name=robot.prefix or robot.model.name)

    def frame(name: str) -> str:
        return look.frame(robot.prefix, name)

    SubElement(root, "link", name=frame(look.footprint))
    bodies = {look.base: robot.model, **{joint.child: joint.sensor for joint in robot.actuators}}
    masses = masses_of(robot.model, list(bodies.values()))
    for child in [child for _, child, _ in robot.mounts] + [joint.child for joint in robot.actuators]:
        link = SubElement(root, "link", name=frame(child))
        if child in bodies:
            _add_body(link, list(_areas_on(bodies[child], world, bodies.values())), masses[bodies[child].id])
    for parent, child, pose in robot.mounts:
        _add_joint(root, child, "fixed", frame(parent), frame(child), list(pose[:3]), angles_of(pose[3:]))
    for joint in robot.actuators:
        _add_actuator(root, joint, frame)
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


def _rigid(model: Model, links: Iterable[Model]) -> Iterator[Model]:
    """A model and all that it carries but for robots and the models of other links."""
    yield model
    for child in model.children:
        if child.type != "position" and all(child.id != link.id for link in links):
            yield from _rigid(child, links)


def masses_of(robot: Model, links: Sequence[Model]) -> dict[int, float]:
    """The masses of links in kilograms, by the ids of their models. Robots without a mass have that of contacts."""
    masses = {link.id: sum(model.mass for model in _rigid(link, links)) for link in links}
    return masses if any(masses.values()) else {**masses, robot.id: DEFAULT_MASS}


def _areas_on(link: Model, world: World, links: Iterable[Model]) -> Iterator[Area]:
    """The areas of a link in its frame."""
    for model in _rigid(link, list(links)):
        x, y, z, heading = relative(model.pose_in_tree, link.pose_in_tree)
        c, s = math.cos(heading), math.sin(heading)
        for area in areas_of(world._core.body(model.id)):
            outlines = [[(x + c * p - s * q, y + s * p + c * q) for p, q in outline] for outline in area.outlines]
            yield Area(area.rgba, area.low + z, area.high + z, outlines)


def _add_body(link: Element, areas: Sequence[Area], mass: float) -> None:
    solids = []
    for number, area in enumerate(areas):
        for outline in area.outlines:
            solids.append(solid_of(outline, round(area.low, 6), round(area.high, 6)))
            for purpose in ("visual", "collision"):
                part = SubElement(link, purpose)
                _add_solid(part, solids[-1])
                if purpose == "visual":
                    material = SubElement(part, "material", name=f"{link.get('name')}_{number}")
                    SubElement(material, "color", rgba=_numbers(list(area.rgba)))
    if mass > 0:
        _add_inertia(link, mass, solids)


def _add_inertia(link: Element, mass: float, solids: Sequence[Solid]) -> None:
    """The inertia of solids of one density, about their centre of mass."""
    middle, inertia = inertia_of(mass, solids)
    part = SubElement(link, "inertial")
    _add_origin(part, list(middle), [0.0] * 3)
    SubElement(part, "mass", value=_numbers([mass]))
    axes = "xyz"
    SubElement(part, "inertia", {f"i{axes[i]}{axes[j]}": _numbers([inertia[i, j]])
                                 for i in range(3) for j in range(i, 3)})


def _add_actuator(root: Element, joint: Joint, frame: Callable[[str], str]) -> None:
    """A joint whose origin is the place of the actuator at its position 0."""
    state, model = joint.sensor.actuator, joint.sensor
    x, y, z, heading = relative(model.pose_in_tree, joint.robot.pose_in_tree)
    if state.kind == "rotational":
        heading -= state.position
    else:
        moved = composed((0.0, 0.0, 0.0, heading), (*(state.position * part for part in state.axis), 0.0))
        x, y, z = x - moved[0], y - moved[1], z - moved[2]
    made = _add_joint(root, joint.child.removesuffix("_link"), JOINT_TYPES[state.kind], frame(joint.parent),
                      frame(joint.child), [x, y, z], [0.0, 0.0, heading])
    SubElement(made, "axis", xyz=_numbers(list(state.axis)))
    SubElement(made, "limit", lower=_numbers([state.min_position]), upper=_numbers([state.max_position]), effort="0",
               velocity=_numbers([state.max_speed]))


def _add_solid(part: Element, solid: Solid) -> None:
    _add_origin(part, list(solid.middle), [0.0, 0.0, solid.turn])
    size = list(solid.size)
    if solid.is_round:
        geometry = ("cylinder", {"radius": _numbers(size[:1]), "length": _numbers(size[1:])})
    else:
        geometry = ("box", {"size": _numbers(size)})
    SubElement(SubElement(part, "geometry"), geometry[0], geometry[1])


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
