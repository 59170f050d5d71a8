# SPDX-License-Identifier: GPL-2.0-or-later
"""Robots that are made while a node runs: their types, names and namespaces."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Iterable

from .._checks import shown
from .._core import Model
from ..maps.robots import shipped_macros
from ..world import World
from .names import ros_name
from .team import free_name

if TYPE_CHECKING:
    from .node import StageNode

#: Max coordinate of a new robot, metres, and max length of a name, characters.
MOST_PLACE, MOST_NAME = 1e5, 100
NAMESPACE = re.compile(r"[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*")


def robot_types(world: World) -> dict[str, str]:
    """Types of robots that can be made: macros of the world file, and those of the folder `robots`.

    Returns:
        The file that defines each macro; empty: the world file and what it includes.
    """
    return {**shipped_macros(), **{macro: "" for macro in world._core.macros("position")}}


def checked_namespace(namespace: str, taken: Iterable[str]) -> str:
    """A namespace without slashes at its ends. Raises ValueError if it is invalid or another robot's."""
    name = namespace.strip("/")
    if not NAMESPACE.fullmatch(name) or len(name) > MOST_NAME:
        raise ValueError(f"found the namespace {shown(namespace)}, expected words of letters, digits and underscores")
    if name in taken:
        raise ValueError(f"found the namespace {shown(namespace)}, which another robot has")
    return name


def spawn(node: StageNode, type: str, name: str, pose: tuple[float, float, float], namespace: str) -> Model:
    """Makes a robot: see StageNode.spawn()."""
    world, types = node.world, robot_types(node.world)
    if type not in types:
        raise ValueError(f"found the robot {shown(type)}, expected {', '.join(sorted(types))}")
    if not all(math.isfinite(part) for part in pose) or max(abs(part) for part in pose[:2]) > MOST_PLACE:
        raise ValueError(f"found the pose {pose}, expected finite numbers, and places within {MOST_PLACE:g} m")
    names, taken = [model.name for model in world.models], [robot.prefix for robot in node.team.robots]
    if not name:
        name = free_name(type, names)
    if name in names or len(name) > MOST_NAME or not name.isprintable():
        raise ValueError(f"found the name {shown(name)}, expected up to {MOST_NAME} printable characters that no other "
                         "model has")
    prefix = checked_namespace(namespace, taken) if namespace else free_name(ros_name(name), taken)
    if types[type]:
        world.include(types[type])
    made = world.create(type, name=name, pose=pose)
    node.team.prefixes[made.id, made.name] = prefix
    return made
