# SPDX-License-Identifier: GPL-2.0-or-later
"""The services and the action of simulation_interfaces, called in a node of this process."""

from __future__ import annotations

import math
import time
from typing import Any, Iterator

import pytest
import stagesim as st
from patience import PATIENCE, slowness
from rclpy.action import ActionClient
from ros_testing import TWO, Client, node_here

srv = pytest.importorskip("simulation_interfaces.srv", reason="skipped: there is no simulation_interfaces; try "
                          "python -m stagesim.ros.make_messages simulation_interfaces")
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped, Vector3
from simulation_interfaces.action import SimulateSteps
from simulation_interfaces.msg import (Bounds, EntityCategory, EntityFilters, EntityState, Result, SimulationState,
                                       SimulatorFeatures, TagsFilter)
from sensor_msgs.msg import LaserScan
from stagesim.ros.standard_services import UNSUPPORTED, snake

OK, UNSUPPORTED_FEATURE, NOT_FOUND = Result.RESULT_OK, Result.RESULT_FEATURE_UNSUPPORTED, Result.RESULT_NOT_FOUND
INCORRECT, FAILED = Result.RESULT_INCORRECT_STATE, Result.RESULT_OPERATION_FAILED
SPAWN = srv.SpawnEntity.Response
STATE = srv.SetSimulationState.Response
STOPPED, PLAYING, PAUSED = (SimulationState.STATE_STOPPED, SimulationState.STATE_PLAYING,
                            SimulationState.STATE_PAUSED)


class Asker:
    """Calls the services of a node while running it."""

    def __init__(self, node: Any, client: Client) -> None:
        self.node, self.client = node, client
        self._clients: dict[str, Any] = {}

    def until(self, condition: Any) -> None:
        """Runs the node until the condition holds."""
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, "nothing happened in time"
            self.node._turn()
            self.client.spin()

    def ask(self, name: str, /, **request: Any) -> Any:
        """The response of the service with the type `name`."""
        kind = getattr(srv, name)
        if name not in self._clients:
            self._clients[name] = self.client.node.create_client(kind, f"/{snake(name)}")
            self.until(self._clients[name].service_is_ready)
            self.client.spin(0.5 * slowness())  # the node drops the response to a client not discovered yet
        future = self._clients[name].call_async(kind.Request(**request))
        self.until(future.done)
        return future.result()

    def code(self, name: str, /, **request: Any) -> int:
        """The result code; each refusal has a reason, and nothing else has one."""
        result = self.ask(name, **request).result
        assert (result.result == OK) == (result.error_message == ""), result
        return int(result.result)

    def entities(self, **filters: Any) -> list[str]:
        answer = self.ask("GetEntities", filters=EntityFilters(**filters))
        assert answer.result.result == OK, answer.result.error_message
        return list(answer.entities)


@pytest.fixture
def asker(client: Client) -> Iterator[Asker]:
    with st.World.from_text(TWO) as world, node_here(world, paused=True, base_watchdog_timeout=0.0) as node:
        yield Asker(node, client)


def pose(x: float = 1.0, y: float = -1.0, heading: float = 0.0, frame: str = "", **other: float) -> PoseStamped:
    made = PoseStamped()
    made.header.frame_id = frame
    made.pose.position.x, made.pose.position.y = float(x), float(y)
    made.pose.orientation.z, made.pose.orientation.w = math.sin(heading / 2), math.cos(heading / 2)
    for name, value in other.items():
        setattr(made.pose.orientation, name, value)
    return made


def state(where: PoseStamped, ahead: float = 0.0) -> EntityState:
    made = EntityState(header=where.header, pose=where.pose)
    made.twist.linear.x = ahead
    return made


def test_features_are_those_that_work(asker: Asker) -> None:
    answer = asker.ask("GetSimulatorFeatures").features
    assert SimulatorFeatures.STEP_SIMULATION_ACTION in answer.features
    assert SimulatorFeatures.WORLD_LOADING not in answer.features
    assert list(answer.spawn_formats) == ["box", "robot"] and answer.custom_info.startswith("Stage ")
    for name in UNSUPPORTED:
        assert asker.code(name) == UNSUPPORTED_FEATURE, name


def test_entities_can_be_listed_and_filtered(asker: Asker) -> None:
    assert asker.entities() == ["wall", "a", "b"]
    assert asker.entities(filter="^[ab]$") == ["a", "b"]
    robots = [EntityCategory(category=EntityCategory.CATEGORY_ROBOT)]
    assert asker.entities(categories=robots, filter="b") == ["b"]
    either = TagsFilter(tags=["position", "model"], filter_mode=TagsFilter.FILTER_MODE_ANY)
    both = TagsFilter(tags=["position", "model"], filter_mode=TagsFilter.FILTER_MODE_ALL)
    assert asker.entities(tags=either) == ["wall", "a", "b"] and asker.entities(tags=both) == []
    for name in ("GetEntities", "GetEntitiesStates"):
        assert asker.code(name, filters=EntityFilters(filter="(")) == FAILED
        for bad in (bounds(Bounds.TYPE_SPHERE), bounds(Bounds.TYPE_BOX, (0, 0, 0)), bounds(4, (0, 0, 0), (1, 1, 1)),
                    bounds(Bounds.TYPE_CONVEX_HULL, (0, 0, 0), (1, 1, 0), (2, 2, 1)),
                    bounds(Bounds.TYPE_SPHERE, (0, 0, 0), (-1, 0, 0)), bounds(Bounds.TYPE_BOX, (0, 0, 0), (math.nan, 1, 1))):
            assert asker.code(name, filters=EntityFilters(bounds=bad)) == FAILED
    states = asker.ask("GetEntitiesStates", filters=EntityFilters(filter="b"))
    assert list(states.entities) == ["b"] and states.states[0].pose.position.y == 2


def test_entities_can_be_filtered_by_bounds(asker: Asker) -> None:
    """The wall has its face at x = 2.95, a its front at 0.2, and b the same at y = 2."""
    for radius, expected in ((0.9, []), (1.06, ["wall"]), (1.81, ["wall", "a"])):
        assert asker.entities(bounds=bounds(Bounds.TYPE_SPHERE, (2.0, 0.0, 0.2), (radius, 0, 0))) == expected, radius
    assert asker.entities(bounds=bounds(Bounds.TYPE_BOX, (0.5, 3, 0.3), (-1, 1, 0))) == ["b"]
    assert asker.entities(bounds=bounds(Bounds.TYPE_BOX, (0.5, 3, 0.5), (-1, 1, 2)), filter="b") == []  # above b's body
    hull = bounds(Bounds.TYPE_CONVEX_HULL, (-0.5, -0.5, 0), (4, -0.5, 0), (-0.5, 2.5, 0))
    assert asker.entities(bounds=hull) == ["wall", "a", "b"]
    asker.node.world.model("b").pose = (0, 3, 0)
    assert asker.entities(bounds=hull) == ["wall", "a"]


def test_bounds_of_an_entity(asker: Asker) -> None:
    found = asker.ask("GetEntityBounds", entity="wall").bounds
    assert found.type == Bounds.TYPE_BOX
    assert [(p.x, p.y, p.z) for p in found.points] == [pytest.approx((0.05, 4, 1)), pytest.approx((-0.05, -4, 0))]
    asker.node.spawn("khepera4", "k", (1.0, -3.0, 1.0))
    found = asker.ask("GetEntityBounds", entity="k").bounds
    assert found.type == Bounds.TYPE_CONVEX_HULL and len(found.points) >= 16
    assert max(math.hypot(p.x, p.y) for p in found.points) == pytest.approx(0.0703, abs=0.003)
    assert asker.code("GetEntityBounds", entity="nobody") == NOT_FOUND


def bounds(kind: int, *points: tuple[float, float, float]) -> Bounds:
    return Bounds(type=kind, points=[Vector3(x=float(x), y=float(y), z=float(z)) for x, y, z in points])


def test_infos_and_states_of_an_entity(asker: Asker) -> None:
    info = asker.ask("GetEntityInfo", entity="wall").info
    assert info.category.category == EntityCategory.CATEGORY_STATIC_OBJECT and list(info.tags) == ["model"]
    asker.node.world.model("b").drive(0.5)
    assert asker.code("StepSimulation", steps=3) == OK
    found = asker.ask("GetEntityState", entity="b").state
    assert found.header.frame_id == "map" and found.header.stamp.nanosec == 300_000_000
    assert (found.twist.linear.x, found.twist.linear.y) == pytest.approx((0, 0.5))  # its heading is 90 degrees
    for name in ("GetEntityInfo", "GetEntityState", "DeleteEntity", "SetEntityState"):
        assert asker.code(name, entity="nobody") == NOT_FOUND, name


def test_an_entity_can_be_put_elsewhere(asker: Asker) -> None:
    assert asker.code("SetEntityState", entity="b", state=state(pose(1, -1, 0.5))) == OK
    assert asker.node.world.model("b").global_pose == pytest.approx((1, -1, 0.5))
    assert asker.code("SetEntityState", entity="wall", state=state(pose(1, 0, frame="b/base_link"))) == OK
    assert asker.node.world.model("wall").global_pose == pytest.approx((1 + math.cos(0.5), math.sin(0.5) - 1, 0.5))
    invalid = srv.SetEntityState.Response.INVALID_POSE
    for bad in (pose(math.nan), pose(1e6), pose(w=0.0), pose(x=1, frame="nowhere"), pose(z=math.inf)):
        assert asker.code("SetEntityState", entity="b", state=state(bad)) == invalid
    assert asker.code("SetEntityState", entity="b", state=state(pose(), 1.0)) == UNSUPPORTED_FEATURE
    assert asker.code("SetEntityState", entity="wall", state=state(pose(), 1.0)) == FAILED
    assert asker.node.world.model("b").global_pose == pytest.approx((1, -1, 0.5))


def test_boxes_can_be_spawned_and_deleted(asker: Asker) -> None:
    names = [spawnable.uri for spawnable in asker.ask("GetSpawnables").spawnables if spawnable.uri.startswith("box")]
    for uri in names:
        assert asker.code("SpawnEntity", name=uri, uri=uri, initial_pose=pose(2, 1, 0.5)) == OK
    box = asker.node.world.model(names[1])
    assert box.size == (1, 0.5, 2) and box.pose == pytest.approx((2, 1, 0.5)) and box.obstacle_return
    for name, expected in (("box", "box_0"), ("", "box_1")):
        answer = asker.ask("SpawnEntity", name=name, uri="box", allow_renaming=True)
        assert answer.result.result == OK and answer.entity_name == expected
    assert asker.code("DeleteEntity", entity="box_1") == OK and "box_1" not in asker.entities()
    assert asker.code("ResetSimulation", scope=srv.ResetSimulation.Request.SCOPE_SPAWNED) == OK
    assert asker.entities() == ["wall", "a", "b"]


def test_robots_can_be_spawned_and_deleted(asker: Asker) -> None:
    names = [spawnable.uri for spawnable in asker.ask("GetSpawnables").spawnables]
    assert {"robot:bot", "robot:turtlebot3_burger", "robot:khepera4"} <= set(names)
    answer = asker.ask("SpawnEntity", name="a", uri="bot", allow_renaming=True, entity_namespace="/fleet/a",
                       initial_pose=pose(2, 1, 0.5))
    assert answer.result.result == OK and answer.entity_name == "a_0", answer
    assert [robot.prefix for robot in asker.node.robots] == ["a", "b", "fleet/a"]
    assert asker.node.world.model("a_0").global_pose == pytest.approx((2, 1, 0.5))
    scans = asker.client.listen(LaserScan, "/fleet/a/base_scan")
    assert asker.code("StepSimulation", steps=2) == OK
    asker.until(lambda: asker.code("StepSimulation", steps=1) == OK and scans)
    assert asker.code("SpawnEntity", name="c", uri="robot:turtlebot3_burger", initial_pose=pose(1, -2)) == OK
    assert asker.code("SpawnEntity", name="d", uri="bot", entity_namespace="c") == SPAWN.NAMESPACE_INVALID
    assert asker.code("SpawnEntity", name="d", uri="bot", entity_namespace="1") == SPAWN.NAMESPACE_INVALID
    info = asker.ask("GetEntityInfo", entity="c").info
    assert info.category.category == EntityCategory.CATEGORY_ROBOT
    for name in ("a", "a_0"):
        assert asker.code("DeleteEntity", entity=name) == OK
    assert [robot.prefix for robot in asker.node.robots] == ["b", "c"]
    assert not [topic for topic, _ in asker.node.get_publisher_names_and_types_by_node("stage", "/")
                if topic.startswith(("/a/", "/fleet"))]
    assert asker.code("ResetSimulation", scope=srv.ResetSimulation.Request.SCOPE_SPAWNED) == OK
    assert asker.entities() == ["wall", "b"]
    assert asker.code("ResetSimulation", scope=srv.ResetSimulation.Request.SCOPE_ALL) == OK
    assert asker.entities() == ["wall", "a", "b"] and [robot.prefix for robot in asker.node.robots] == ["a", "b"]


@pytest.mark.parametrize("request_, code", (
    ({"name": "a"}, SPAWN.NAME_NOT_UNIQUE), ({"name": ""}, SPAWN.NAME_INVALID), ({"name": "a\n"}, SPAWN.NAME_INVALID),
    ({"name": "x" * 101}, SPAWN.NAME_INVALID), ({"uri": ""}, SPAWN.NO_RESOURCE),
    ({"uri": "", "resource_string": "box()"}, UNSUPPORTED_FEATURE), ({"uri": "robot:r2d2"}, SPAWN.UNSUPPORTED_FORMAT),
    ({"uri": "box:1,2"}, SPAWN.UNSUPPORTED_FORMAT), ({"uri": "box:1,2,x"}, SPAWN.RESOURCE_PARSE_ERROR),
    ({"uri": "box:1,0,1"}, SPAWN.RESOURCE_PARSE_ERROR), ({"uri": "box:1,nan,1"}, SPAWN.RESOURCE_PARSE_ERROR),
    ({"uri": "box:1,1,1e9"}, SPAWN.RESOURCE_PARSE_ERROR), ({"entity_namespace": "n"}, SPAWN.NAMESPACE_INVALID),
    ({"initial_pose": pose(math.inf)}, SPAWN.INVALID_POSE),
))
def test_boxes_that_make_no_sense_are_refused(asker: Asker, request_: dict[str, Any], code: int) -> None:
    assert asker.code("SpawnEntity", **{"name": "new", "uri": "box", **request_}) == code
    assert asker.entities() == ["wall", "a", "b"]


def test_reset_and_states_of_the_simulation(asker: Asker) -> None:
    def now() -> int:
        return int(asker.ask("GetSimulationState").state.state)

    def change(wanted: int) -> int:
        return asker.code("SetSimulationState", state=SimulationState(state=wanted))

    world, scopes = asker.node.world, srv.ResetSimulation.Request
    assert now() == PAUSED and change(PAUSED) == STATE.ALREADY_IN_TARGET_STATE
    for scope, code in ((scopes.SCOPE_TIME, UNSUPPORTED_FEATURE), (scopes.SCOPE_STATE, UNSUPPORTED_FEATURE),
                        (scopes.SCOPE_ALL, OK), (scopes.SCOPE_DEFAULT, OK), (7, OK), (8, UNSUPPORTED_FEATURE)):
        world.step()
        assert asker.code("ResetSimulation", scope=scope) == code
        assert (world.time == 0) == (code == OK)
    assert change(PLAYING) == OK and now() == PLAYING
    asker.until(lambda: world.steps > 1)
    assert asker.code("StepSimulation", steps=1) == FAILED
    assert change(STOPPED) == OK and now() == STOPPED and world.steps == 0
    assert change(STOPPED) == STATE.ALREADY_IN_TARGET_STATE and change(PAUSED) == OK and now() == PAUSED
    for odd in (SimulationState.STATE_NO_WORLD, 200):
        assert change(odd) == UNSUPPORTED_FEATURE and now() == PAUSED


def test_steps_by_the_service(asker: Asker) -> None:
    for steps, code in ((1, OK), (5, OK), (0, FAILED), (2**64 - 1, FAILED)):
        before = asker.node.world.steps
        assert asker.code("StepSimulation", steps=steps) == code
        assert asker.node.world.steps - before == (steps if code == OK else 0) and asker.node.paused


def test_steps_by_the_action(asker: Asker) -> None:
    world, steps = asker.node.world, ActionClient(asker.client.node, SimulateSteps, "/simulate_steps")
    feedback: list[tuple[int, int]] = []

    def send(count: int) -> Any:
        future = steps.send_goal_async(SimulateSteps.Goal(steps=count), lambda message: feedback.append(
            (message.feedback.completed_steps, message.feedback.remaining_steps)))
        asker.until(future.done)
        return future.result()

    def end(goal: Any) -> tuple[int, int]:
        future = goal.get_result_async()
        asker.until(future.done)
        return future.result().status, future.result().result.result.result

    asker.until(steps.server_is_ready)
    assert end(send(4)) == (GoalStatus.STATUS_SUCCEEDED, OK)
    assert world.steps == 4 and asker.node.paused
    assert end(send(0)) == (GoalStatus.STATUS_ABORTED, FAILED)
    long = send(1_000_000)
    assert end(send(1)) == (GoalStatus.STATUS_ABORTED, INCORRECT)
    assert asker.code("StepSimulation", steps=1) == INCORRECT
    feedback.clear()
    asker.until(lambda: len(feedback) > 1)
    assert all(made + rest == 1_000_000 for made, rest in feedback) and feedback[0][0] < feedback[1][0] <= world.steps
    cancelled = long.cancel_goal_async()
    asker.until(cancelled.done)
    assert end(long) == (GoalStatus.STATUS_CANCELED, FAILED) and 4 < world.steps < 1_000_000
    long = send(1_000_000)
    asker.node.pause(False)
    assert end(long) == (GoalStatus.STATUS_ABORTED, FAILED)
    assert end(send(1)) == (GoalStatus.STATUS_ABORTED, FAILED)
    steps.destroy()
