# SPDX-License-Identifier: GPL-2.0-or-later
"""The services of the package simulation_interfaces, a standard for simulators."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Callable

import rclpy
from rclpy.action import ActionServer, CancelResponse
from rclpy.task import Future
from simulation_interfaces import srv
from simulation_interfaces.action import SimulateSteps
from simulation_interfaces.msg import Result, SimulationState, SimulatorFeatures

from .. import __version__
from ..errors import StageError
from .entities import Entities
from .refusal import Refusal

if TYPE_CHECKING:
    from .node import StageNode

FEATURES = (
    "SPAWNING", "DELETING", "ENTITY_TAGS", "ENTITY_BOUNDS", "ENTITY_BOUNDS_BOX", "ENTITY_BOUNDS_CONVEX",
    "ENTITY_CATEGORIES", "ENTITY_STATE_GETTING", "ENTITY_STATE_SETTING",
    "ENTITY_INFO_GETTING", "SPAWNABLES", "SIMULATION_RESET", "SIMULATION_RESET_SPAWNED", "SIMULATION_STATE_GETTING",
    "SIMULATION_STATE_SETTING", "SIMULATION_STATE_PAUSE", "STEP_SIMULATION_SINGLE", "STEP_SIMULATION_MULTIPLE",
    "STEP_SIMULATION_ACTION")
UNSUPPORTED = ("GetAvailableWorlds", "GetCurrentWorld", "GetNamedPoseBounds", "GetNamedPoses",
               "LoadWorld", "SetEntityInfo", "UnloadWorld")
STATES = {SimulationState.STATE_STOPPED: "stopped", SimulationState.STATE_PLAYING: "playing",
          SimulationState.STATE_PAUSED: "paused", SimulationState.STATE_QUITTING: "quitting"}


def snake(name: str) -> str:
    """The name of a service by the name of its type: get_entities for GetEntities."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


class _Goal:
    """A goal of the action simulate_steps.

    Attributes:
        handle: the goal in ROS.
        made: number of steps made.
        ended: done when there are no more steps to make.
    """

    def __init__(self, handle: Any) -> None:
        self.handle, self.made, self.ended = handle, 0, Future()


class StandardServices:
    """Offers the services and the action.

    Args:
        node: the node of the world.
        frame: the frame of the world.
        most_steps: max steps of a request.
    """

    def __init__(self, node: StageNode, frame: str, most_steps: int) -> None:
        self._node, self._most_steps = node, most_steps
        self._entities = entities = Entities(node, frame)
        self._stopped, self._quits = False, False
        self._goal: _Goal | None = None
        handlers = {
            "GetEntities": entities.list, "GetEntitiesStates": entities.list_with_states,
            "GetEntityInfo": entities.describe, "GetEntityBounds": entities.bounds, "GetEntityState": entities.state,
            "SetEntityState": entities.set_state, "SpawnEntity": entities.spawn, "DeleteEntity": entities.delete,
            "GetSpawnables": entities.spawnables, "ResetSimulation": self._reset, "StepSimulation": self._step,
            "GetSimulationState": self._get_state, "SetSimulationState": self._set_state,
            **{name: self._refuse for name in UNSUPPORTED}}
        for name, handler in handlers.items():
            node.create_service(getattr(srv, name), snake(name), self._answering(handler))
        node.create_service(srv.GetSimulatorFeatures, "get_simulator_features", self._features)
        self._action = ActionServer(node, SimulateSteps, "simulate_steps", self._simulate,
                                    cancel_callback=lambda _: CancelResponse.ACCEPT)

    def close(self) -> None:
        """Ends the action server, which the node does not end by itself."""
        self._action.destroy()

    def _answering(self, handler: Callable[[Any, Any], None]) -> Callable[[Any, Any], Any]:
        """A handler that reports refusals and errors by the result of its response."""
        def handle(request: Any, response: Any) -> Any:
            response.result.result = Result.RESULT_OK
            try:
                handler(request, response)
            except Refusal as refusal:
                response.result.result, response.result.error_message = refusal.code, str(refusal)
            except (StageError, ValueError) as error:
                response.result.result = Result.RESULT_OPERATION_FAILED
                response.result.error_message = str(error)
            return response

        return handle

    def _features(self, _: Any, response: Any) -> Any:
        response.features.features = [getattr(SimulatorFeatures, name) for name in FEATURES]
        response.features.spawn_formats = ["box", "robot"]
        response.features.custom_info = f"Stage {__version__}; docs/ros_reference.md describes its services"
        return response

    def _refuse(self, _: Any, __: Any) -> None:
        raise Refusal(Result.RESULT_FEATURE_UNSUPPORTED, "this simulator does not support this; get_simulator_features "
                                                         "lists what it supports")

    # ---- states ----

    def _reset(self, request: Any, _: Any) -> None:
        scopes = srv.ResetSimulation.Request
        every = scopes.SCOPE_TIME | scopes.SCOPE_STATE | scopes.SCOPE_SPAWNED
        if request.scope == scopes.SCOPE_SPAWNED:
            self._entities.remove_spawned()
        elif request.scope == scopes.SCOPE_DEFAULT or request.scope & every == every:
            self._node.reset(None)
        else:
            raise Refusal(Result.RESULT_FEATURE_UNSUPPORTED, f"found the scope {request.scope}, expected SCOPE_ALL or "
                                                             "SCOPE_SPAWNED: time and state go together")

    @property
    def _state(self) -> int:
        if not self._node.paused:
            return int(SimulationState.STATE_PLAYING)
        is_stopped = self._stopped and self._node.world.steps == 0
        return int(SimulationState.STATE_STOPPED if is_stopped else SimulationState.STATE_PAUSED)

    def _get_state(self, _: Any, response: Any) -> None:
        response.state.state = self._state

    def _set_state(self, request: Any, _: Any) -> None:
        wanted = request.state.state
        if wanted not in STATES:
            raise Refusal(Result.RESULT_FEATURE_UNSUPPORTED, f"found the state {wanted}, expected 0 to 3")
        if wanted == self._state:
            raise Refusal(srv.SetSimulationState.Response.ALREADY_IN_TARGET_STATE, f"it is {STATES[wanted]} already")
        self._node.pause(wanted != SimulationState.STATE_PLAYING)
        self._stopped = wanted == SimulationState.STATE_STOPPED
        self._quits = wanted == SimulationState.STATE_QUITTING
        if self._stopped:
            self._node.reset(None)

    # ---- steps ----

    def _check_steps(self, steps: int) -> None:
        if not self._node.paused:
            raise Refusal(Result.RESULT_OPERATION_FAILED, "found a running simulation, expected a paused one")
        if self._goal is not None:
            raise Refusal(Result.RESULT_INCORRECT_STATE, "simulate_steps is making steps")
        if not 1 <= steps <= self._most_steps:
            raise Refusal(Result.RESULT_OPERATION_FAILED, f"found {steps} steps, expected 1 to {self._most_steps}")

    def _step(self, request: Any, _: Any) -> None:
        self._check_steps(request.steps)
        for made in range(request.steps):
            if not rclpy.ok() or not self._node.advance():
                raise Refusal(Result.RESULT_OPERATION_FAILED, f"made {made} steps: the world has ended")

    async def _simulate(self, handle: Any) -> Any:
        """Makes the steps of a goal: waits while turn() makes them, between which ROS is served."""
        made = SimulateSteps.Result()
        made.result.result = Result.RESULT_OK
        try:
            self._check_steps(handle.request.steps)
            goal = self._goal = _Goal(handle)
            await goal.ended
            goal.ended.result()
        except Refusal as refusal:
            made.result.result, made.result.error_message = refusal.code, str(refusal)
        if made.result.result == Result.RESULT_OK:
            handle.succeed()
        elif handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return made

    def turn(self) -> bool:
        """Makes a step if an action asks for one, or ends the node if a client wants it; False: there was nothing."""
        if self._quits:
            rclpy.try_shutdown()
        goal = self._goal
        if goal is None:
            return self._quits
        try:
            self._advance(goal)
        except Refusal as refusal:
            self._goal = None
            goal.ended.set_exception(refusal)
        return True

    def _advance(self, goal: _Goal) -> None:
        """Makes a step of a goal. Raises Refusal if it can't."""
        wanted = goal.handle.request.steps
        if goal.handle.is_cancel_requested:
            raise Refusal(Result.RESULT_OPERATION_FAILED, f"cancelled after {goal.made} of {wanted} steps")
        if not self._node.paused:
            raise Refusal(Result.RESULT_OPERATION_FAILED, f"the simulation runs after {goal.made} of {wanted} steps")
        if not self._node.advance():
            raise Refusal(Result.RESULT_OPERATION_FAILED, f"made {goal.made} steps: the world has ended")
        goal.made += 1
        goal.handle.publish_feedback(SimulateSteps.Feedback(completed_steps=goal.made,
                                                            remaining_steps=wanted - goal.made))
        if goal.made == wanted:
            self._goal = None
            goal.ended.set_result(None)
