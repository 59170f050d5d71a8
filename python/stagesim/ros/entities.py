# SPDX-License-Identifier: GPL-2.0-or-later
"""The services of simulation_interfaces for entities: the models that stand on the ground of a world."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np
from geometry_msgs.msg import Vector3
from simulation_interfaces.msg import Bounds, EntityCategory, EntityState, Result, Spawnable, TagsFilter
from simulation_interfaces.srv import SetEntityState, SpawnEntity

from .._core import Model
from ..shapes import areas_of
from .messages import heading_of, stamp_of
from .refusal import Refusal
from .regions import Prism, Sphere, box_of, convex, hull_of, overlaps, prisms_of
from .spawning import MOST_NAME, MOST_PLACE, checked_namespace, robot_types

if TYPE_CHECKING:
    from .node import StageNode

MOST_SIZE = 1e3  #: max size that clients may ask for, metres
MOST_CORNERS = 1000  #: max number of points of bounds
BOX = re.compile(r"box(?::([^,]+),([^,]+),([^,]+))?")  #: resources that can be spawned
BOX_SIZE = (0.5, 0.5, 0.5)
EXPECTED = "box, box:LENGTH,WIDTH,HEIGHT or robot:MACRO"


def _region_of(bounds: Any) -> Prism | Sphere | None:
    """The region that bounds as a filter describe; None: all of the world. Raises Refusal."""
    if bounds.type == Bounds.TYPE_EMPTY:
        return None
    code, points = Result.RESULT_OPERATION_FAILED, np.array([(point.x, point.y, point.z) for point in bounds.points])
    if not np.isfinite(points).all():
        raise Refusal(code, "found bounds that are not finite, expected finite numbers")
    hull = bounds.type == Bounds.TYPE_CONVEX_HULL
    if bounds.type > Bounds.TYPE_SPHERE or hull and not 3 <= len(points) <= MOST_CORNERS or not hull and len(points) != 2:
        raise Refusal(code, f"found bounds of the type {bounds.type} with {len(points)} points, expected two for a box or "
                            f"a sphere, or 3 to {MOST_CORNERS} for a hull")
    if bounds.type == Bounds.TYPE_SPHERE and points[1, 0] < 0:
        raise Refusal(code, f"found the radius {points[1, 0]:g}, expected 0 or more")
    try:
        if hull:
            return hull_of(points)
    except ValueError as error:
        raise Refusal(code, str(error)) from None
    return box_of(*points) if bounds.type == Bounds.TYPE_BOX else Sphere(points[0], points[1, 0])


class Entities:
    """Handlers of the services, which raise Refusal; see StandardServices for the rest.

    Args:
        node: the node of the world.
        frame: the frame of the world.
    """

    def __init__(self, node: StageNode, frame: str) -> None:
        self._node, self._frame = node, frame

    def all(self) -> dict[str, Model]:
        """All entities by their names."""
        return {model.name: model for model in self._node.world.models if model.parent is None}

    def _named(self, name: str) -> Model:
        found = self.all().get(name)
        if found is None:
            raise Refusal(Result.RESULT_NOT_FOUND, f"there is no entity {name[:MOST_NAME]!a}")
        return found

    @property
    def spawned(self) -> list[Model]:
        """The spawned entities that still exist."""
        self._node.spawned = [model for model in self._node.spawned if model.exists]
        return self._node.spawned

    def remove_spawned(self) -> None:
        """Deletes all spawned entities."""
        for model in self.spawned:
            model.delete()
        self._node.update_team()
        self._node.moved()

    # ---- what they are ----

    def _category(self, model: Model) -> int:
        if model.type == "position":
            return int(EntityCategory.CATEGORY_ROBOT)
        return int(EntityCategory.CATEGORY_DYNAMIC_OBJECT if model.pushable else EntityCategory.CATEGORY_STATIC_OBJECT)

    def _chosen(self, filters: Any) -> list[Model]:
        """The entities that match the filters."""
        region = _region_of(filters.bounds)
        shapes = self._shapes() if region is not None else {}
        try:
            pattern = re.compile(filters.filter)
        except (re.error, RecursionError, OverflowError) as error:
            raise Refusal(Result.RESULT_OPERATION_FAILED, f"found the filter {filters.filter[:MOST_NAME]!a}, expected "
                                                          f"a regular expression: {error}") from None
        categories = {category.category for category in filters.categories}
        wanted = set(filters.tags.tags)
        matches = any if filters.tags.filter_mode == TagsFilter.FILTER_MODE_ANY else all
        return [model for name, model in self.all().items()
                if pattern.search(name) and (not categories or self._category(model) in categories)
                and (not wanted or matches(tag == model.type for tag in wanted))
                and (region is None or any(
                    overlaps(prism, region)
                    for prism in prisms_of(areas_of(shapes[model.id]), model.global_pose, model.z)))]

    def _shapes(self) -> dict[int, bytes]:
        """The shapes of all entities, with what they carry, by their ids."""
        return {thing.id: thing.shape for thing in self._node.world._core.things()}

    def list(self, request: Any, response: Any) -> None:
        """GetEntities."""
        response.entities = [model.name for model in self._chosen(request.filters)]

    def list_with_states(self, request: Any, response: Any) -> None:
        """GetEntitiesStates."""
        chosen = self._chosen(request.filters)
        response.entities = [model.name for model in chosen]
        response.states = [self._state(model) for model in chosen]

    def describe(self, request: Any, response: Any) -> None:
        """GetEntityInfo."""
        model = self._named(request.entity)
        length, width, height = model.size
        response.info.category.category = self._category(model)
        response.info.description = f"{model.type}, {length:g} x {width:g} x {height:g} m"
        response.info.tags = [model.type]

    def bounds(self, request: Any, response: Any) -> None:
        """GetEntityBounds."""
        prisms = prisms_of(areas_of(self._shapes()[self._named(request.entity).id]))
        if not prisms:
            return  # nothing to bound: TYPE_EMPTY
        corners = convex(np.concatenate([outline for prism in prisms for outline in prism.outlines]))
        low, high = min(prism.low for prism in prisms), max(prism.high for prism in prisms)
        (x0, y0), (x1, y1) = corners.min(0), corners.max(0)
        if len(corners) == 4 and {(x, y) for x, y in corners} == {(x, y) for x in (x0, x1) for y in (y0, y1)}:
            response.bounds.type = Bounds.TYPE_BOX
            points = [(x1, y1, high), (x0, y0, low)]
        else:
            response.bounds.type = Bounds.TYPE_CONVEX_HULL
            points = [(x, y, z) for z in (low, high) for x, y in corners]
        response.bounds.points = [Vector3(x=float(x), y=float(y), z=float(z)) for x, y, z in points]

    # ---- where they are ----

    def _state(self, model: Model) -> EntityState:
        x, y, heading = model.global_pose
        made = EntityState()
        made.header.frame_id = self._frame
        made.header.stamp.sec, made.header.stamp.nanosec = (int(part) for part in stamp_of(self._node.now))
        made.pose.position.x, made.pose.position.y, made.pose.position.z = x, y, model.z
        made.pose.orientation.z, made.pose.orientation.w = math.sin(heading / 2), math.cos(heading / 2)
        if model.type == "position":
            ahead, left, turn = model.velocity
            made.twist.linear.x = ahead * math.cos(heading) - left * math.sin(heading)
            made.twist.linear.y = ahead * math.sin(heading) + left * math.cos(heading)
            made.twist.angular.z = turn
        return made

    def state(self, request: Any, response: Any) -> None:
        """GetEntityState."""
        response.state = self._state(self._named(request.entity))

    def _pose(self, pose: Any, frame: str, code: int) -> tuple[float, float, float]:
        """A planar pose in the world. Raises Refusal with `code` if there is none."""
        place, turn = pose.position, pose.orientation
        numbers = (place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w)
        if not all(map(math.isfinite, numbers)) or max(abs(place.x), abs(place.y)) > MOST_PLACE:
            raise Refusal(code, f"found a pose with the numbers {numbers}, expected finite ones, and places within "
                                f"{MOST_PLACE:g} m")
        if abs(math.hypot(*numbers[3:]) - 1) > 0.1:
            raise Refusal(code, f"found the quaternion {numbers[3:]}, expected the length 1")
        try:
            return self._node.in_world((place.x, place.y, heading_of(turn)), frame)
        except ValueError as error:
            raise Refusal(code, str(error)) from None

    def set_state(self, request: Any, _: Any) -> None:
        """SetEntityState."""
        model, state = self._named(request.entity), request.state
        motion = (state.twist.linear, state.twist.angular, state.acceleration.linear, state.acceleration.angular)
        if any(part for vector in motion for part in (vector.x, vector.y, vector.z)):
            code = (Result.RESULT_FEATURE_UNSUPPORTED if model.type == "position" else Result.RESULT_OPERATION_FAILED)
            raise Refusal(code, "found a twist or an acceleration, expected zeros; cmd_vel drives robots")
        model.global_pose = self._pose(state.pose, state.header.frame_id, SetEntityState.Response.INVALID_POSE)
        self._node.moved()

    # ---- which there are ----

    def spawn(self, request: Any, response: Any) -> None:
        """SpawnEntity: makes a box or a robot."""
        codes, node = SpawnEntity.Response, self._node
        robot = request.uri.removeprefix("robot:")
        is_robot = robot in robot_types(node.world)
        if not request.uri:
            code = Result.RESULT_FEATURE_UNSUPPORTED if request.resource_string else codes.NO_RESOURCE
            raise Refusal(code, f"found no uri, expected {EXPECTED}")
        name = self._new_name(request.name, request.allow_renaming, robot if is_robot else "box")
        if request.entity_namespace:
            self._check_namespace(request.entity_namespace, is_robot)
        size = () if is_robot else self._box(request.uri)
        pose = self._pose(request.initial_pose.pose, request.initial_pose.header.frame_id, codes.INVALID_POSE)
        if is_robot:
            node.spawn(robot, name, pose, request.entity_namespace)
        else:
            node.spawned.append(node.world.create(pose=pose, size=size, name=name))
            node.moved()
        response.entity_name = name

    def _check_namespace(self, namespace: str, is_robot: bool) -> None:
        code = SpawnEntity.Response.NAMESPACE_INVALID
        if not is_robot:
            raise Refusal(code, "found a namespace, expected none; boxes have no topics")
        try:
            checked_namespace(namespace, [robot.prefix for robot in self._node.robots])
        except ValueError as error:
            raise Refusal(code, str(error)) from None

    def _new_name(self, name: str, may_differ: bool, kind: str) -> str:
        """The name of a new entity; `kind`: what it is called if it has none."""
        codes, taken = SpawnEntity.Response, {model.name for model in self._node.world.models}
        if len(name) > MOST_NAME or not name.isprintable():
            raise Refusal(codes.NAME_INVALID, f"found a name of {len(name)} characters, expected up to {MOST_NAME} "
                                              "printable ones")
        if not name and not may_differ:
            raise Refusal(codes.NAME_INVALID, "found no name, expected one or allow_renaming")
        if name and name not in taken:
            return name
        if not may_differ:
            raise Refusal(codes.NAME_NOT_UNIQUE, f"found the name {name!a}, which another model has")
        number = 0
        while f"{name or kind}_{number}" in taken:
            number += 1
        return f"{name or kind}_{number}"

    @staticmethod
    def _box(uri: str) -> tuple[float, ...]:
        """The size of the box that a uri asks for."""
        codes = SpawnEntity.Response
        found = BOX.fullmatch(uri)
        if found is None:
            raise Refusal(codes.UNSUPPORTED_FORMAT, f"found the uri {uri[:MOST_NAME]!a}, expected {EXPECTED}; "
                                                    "get_spawnables lists the robots")
        if found[1] is None:
            return BOX_SIZE
        try:
            size = tuple(float(text) for text in found.groups())
        except ValueError:
            size = ()
        if not size or not all(0 < side <= MOST_SIZE for side in size):
            raise Refusal(codes.RESOURCE_PARSE_ERROR, f"found the uri {uri[:MOST_NAME]!a}, expected sizes "
                                                      f"above 0 and up to {MOST_SIZE:g} m")
        return size

    def delete(self, request: Any, _: Any) -> None:
        """DeleteEntity."""
        model = self._named(request.entity)
        model.delete()
        self._node.update_team()
        self._node.moved()

    def spawnables(self, request: Any, response: Any) -> None:
        """GetSpawnables."""
        response.spawnables = [Spawnable(uri="box", description="a box of 0.5 m"),
                               Spawnable(uri="box:1,0.5,2", description="a box with these sizes, metres"),
                               *(Spawnable(uri=f"robot:{name}", description=f"a robot, by {file or 'the world file'}")
                                 for name, file in sorted(robot_types(self._node.world).items()))]
        if request.sources:
            response.result.error_message = f"not known: {', '.join(request.sources)[:MOST_NAME]!a}"
