# SPDX-License-Identifier: GPL-2.0-or-later
"""The lifecycle node: its states, what each transition does, and what repeated transitions leave behind."""

from __future__ import annotations

import gc
import os
import threading
from pathlib import Path
from typing import Any, Iterator

import pytest
import stagesim as st
from lifecycle_msgs.msg import State, Transition, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from ros_testing import Client, node_here
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger
from stagesim.ros.lifecycle import LifecycleStageNode

CONFIGURE, CLEANUP, ACTIVATE, DEACTIVATE = (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_CLEANUP,
                                            Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_DEACTIVATE)


def change(client: Client, transition: int) -> bool:
    return bool(client.call("/stage/change_state", ChangeState, transition=Transition(id=transition)).success)


def state(client: Client) -> str:
    return str(client.call("/stage/get_state", GetState).current_state.label)


def set_world(client: Client, file: str) -> Any:
    messages = [Parameter("world_file", value=file).to_parameter_msg()]
    return client.call("/stage/set_parameters", SetParameters, parameters=messages).results[0]


def test_transitions_load_run_pause_and_free_the_world(start: Any, client: Client, two: str, one: str) -> None:
    process = start("missing.world", "--lifecycle", speed=4.0)
    clock, events = client.listen(Clock, "/clock"), client.listen(TransitionEvent, "/stage/transition_event")
    assert state(client) == "unconfigured"
    names = client.call("/stage/get_available_transitions", GetAvailableTransitions).available_transitions
    assert {each.transition.label for each in names} == {"configure", "shutdown"}
    assert not change(client, CONFIGURE) and state(client) == "unconfigured"
    client.until(lambda: process.output())
    lines = [line for line in process.output().splitlines() if "not configured" in line]
    assert len(lines) == 1 and "missing.world" in lines[0]

    assert set_world(client, two).successful
    assert change(client, CONFIGURE) and state(client) == "inactive"
    client.until(lambda: client.node.count_publishers("/b/odom") == 1)
    odom = client.listen(Odometry, "/b/odom")
    refused = set_world(client, one)
    assert not refused.successful and "cleanup" in refused.reason
    answer = client.call("/stage/step")
    assert not answer.success and "inactive" in answer.message
    client.spin(0.3)
    assert not odom and not clock  # topics are there, and nothing comes

    assert change(client, ACTIVATE) and state(client) == "active"
    client.until(lambda: len(odom) > 3 and len(clock) > 3)
    assert change(client, DEACTIVATE) and state(client) == "inactive"
    client.spin(0.3)  # what is on its way
    seen = len(odom), len(clock)
    client.call("/stage/reset")
    client.spin(0.3)
    assert seen == (len(odom), len(clock)) and client.node.count_publishers("/b/odom") == 1
    assert change(client, ACTIVATE)
    client.until(lambda: len(odom) > seen[0] + 3)

    assert change(client, DEACTIVATE) and change(client, CLEANUP) and state(client) == "unconfigured"
    client.until(lambda: client.node.count_publishers("/b/odom") == 0)
    assert set_world(client, one).successful and change(client, CONFIGURE)
    client.until(lambda: client.node.count_publishers("/odom") == 1)
    assert change(client, Transition.TRANSITION_INACTIVE_SHUTDOWN)
    client.until(lambda: events[-1].goal_state.label == "finalized")
    status, output = process.wait()
    assert status == 0 and "Traceback" not in output, output


@pytest.mark.parametrize("transitions", [[], [CONFIGURE, ACTIVATE]])
def test_a_signal_ends_the_node_in_each_state(start: Any, client: Client, one: str, transitions: list[int]) -> None:
    process = start(one, "--lifecycle")
    assert state(client) == "unconfigured"
    assert all(change(client, transition) for transition in transitions)
    status, output = process.end()
    assert status == 0 and "Traceback" not in output, output


@pytest.fixture
def here(ros: None) -> Iterator[Any]:
    """A function that makes a lifecycle node in this process."""
    made: list[LifecycleStageNode] = []

    def make(file: str, **parameters: Any) -> LifecycleStageNode:
        made.append(LifecycleStageNode(lambda name: (name, st.World(name)), parameters={"speed": 0, **parameters},
                                       first=file))
        return made[-1]

    yield make
    for node in made:
        node.close()


def label(node: LifecycleStageNode) -> str:
    return str(node._state_machine.current_state[1])


def end(node: LifecycleStageNode) -> None:
    if label(node) != "finalized":
        node.trigger_shutdown()


def test_states_of_the_world_are_those_without_lifecycle(here: Any) -> None:
    with st.World("simple.world") as world, node_here(world, speed=0, always_on=True) as plain:
        plain.run(2.0)
        expected = world.state_hash()
    node = here("simple.world", always_on=True)
    for _ in range(2):
        node.trigger_configure()
        node.trigger_activate()
        node.run(1.0)
        node.trigger_deactivate()
        node.trigger_activate()
        node.run(2.0)
        assert node.world.state_hash() == expected
        node.trigger_deactivate()
        node.trigger_cleanup()


def test_an_error_in_a_step_leads_to_on_error_and_a_fresh_start(here: Any, two: str, monkeypatch: Any,
                                                                 capfd: Any) -> None:
    node = here(two)
    node.trigger_configure()
    node.trigger_activate()

    def fail() -> int:
        raise st.StageError("a plug-in has failed")

    monkeypatch.setattr(node.world, "step", fail)
    monkeypatch.setattr(node, "_answer", lambda _: end(node))  # as soon as the node serves ROS
    node.run()
    assert not node.is_loaded and "a step has failed: a plug-in has failed" in capfd.readouterr().err


def test_after_an_error_the_node_can_be_configured_again(here: Any, two: str) -> None:
    node = here(two)
    node.trigger_configure()
    node.trigger_activate()
    node._fail(ValueError("no reason"))
    assert label(node) == "unconfigured" and not node.is_loaded
    node.trigger_configure()
    node.trigger_activate()
    node.run(0.5)
    assert label(node) == "active" and node.world.time == 0.5


def test_the_end_of_the_world_deactivates_the_node(here: Any, two: str, monkeypatch: Any) -> None:
    node = here(two)
    node.trigger_configure()
    node.trigger_activate()

    class Ended:
        ended, time, dt, steps = True, 0.0, 0.1, 0

        def __getattr__(self, name: str) -> Any:
            return getattr(world, name)

    world, node.world = node.world, Ended()
    monkeypatch.setattr(node, "_answer", lambda _: end(node) if label(node) != "active" else None)
    node.run()
    node.world = world
    assert label(node) == "finalized"


def memory() -> int:
    """Resident memory of this process, bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


def test_fifty_cycles_leave_nothing_behind(here: Any, two: str) -> None:
    node = here(two, publish_map=True, publish_map_tf=True, map_resolution=0.5)

    def cycle() -> None:
        node.trigger_configure()
        node.trigger_activate()
        node.run(0.2)
        node.trigger_deactivate()
        node.trigger_cleanup()
        assert label(node) == "unconfigured"

    def counts() -> tuple[int, ...]:
        gc.collect()
        worlds = sum(isinstance(thing, st.World) for thing in gc.get_objects())
        return (len(list(node.publishers)), len(list(node.subscriptions)), len(list(node.services)), worlds,
                len(list(node.waitables)), len(node.get_parameters_by_prefix("")), threading.active_count(),
                len(os.listdir("/proc/self/task")), len(os.listdir("/proc/self/fd")))

    for _ in range(5):
        cycle()
    before, size = counts(), memory()
    for _ in range(50):
        cycle()
    assert counts() == before
    grown = memory() - size
    print(f"grown by {grown} bytes")
    assert grown < 4_000_000


def test_a_closed_node_leaves_no_services(client: Client) -> None:
    """Clients would send requests to services that remain, and wait for ever."""
    node = LifecycleStageNode(lambda name: (name, st.World(name)), "brief", first="simple.world")

    def services() -> list[Any]:
        return client.node.get_publishers_info_by_topic("rr/brief/change_stateReply", no_mangle=True)

    client.until(services)
    gc.disable()
    try:
        node.close()
        client.until(lambda: not services(), 30)
    finally:
        gc.enable()
