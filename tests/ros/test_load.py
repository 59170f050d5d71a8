# SPDX-License-Identifier: GPL-2.0-or-later
"""The load of the node on /diagnostics."""

from __future__ import annotations

import time
from typing import Any

import pytest
import stagesim as st
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from ros_testing import Client, node_here
from stagesim.ros import load


def numbers(message: Any) -> dict[str, float]:
    return {each.key: float(each.value) for each in message.status[0].values}


def test_shares_of_time_add_up_and_the_speed_is_that_of_the_world(client: Client, two: str, monkeypatch: Any) -> None:
    monkeypatch.setattr(load, "PERIOD", 0.0)
    now = [0.0]
    real = 2.0  # seconds
    with st.World(two) as world, node_here(world) as node:
        got = client.listen(DiagnosticArray, "/diagnostics")
        client.until(lambda: node._load_feed._publisher.get_subscription_count() > 0)
        monkeypatch.setattr(load.time, "monotonic", lambda: now[0])
        node._load_feed.look()  # begins to count
        node.advance()
        now[0] = real
        node.times.update(step=node.times["step"] + 0.5, publish=node.times["publish"] + 0.25)
        node._load_feed.look()
        node.reset(None)
        node._load_feed.look()  # time has gone back: counts anew
        monkeypatch.undo()
        client.until(lambda: got)
        client.spin(0.2)
    assert len(got) == 1
    status, shares = got[0].status[0], numbers(got[0])
    assert shares["speed"] == pytest.approx(0.1 / real, abs=1e-3)
    assert shares["step, % of time"] == pytest.approx(100 * 0.5 / real, abs=2)
    assert shares["publish, % of time"] == pytest.approx(100 * 0.25 / real, abs=2)
    assert sum(shares[f"{part}, % of time"] for part in ("step", "publish", "serve", "idle")) == pytest.approx(100, abs=0.3)
    assert status.name == "stage: load" and status.level == DiagnosticStatus.WARN  # slower than the parameter speed


def test_nothing_is_computed_without_a_subscriber(ros: None, two: str, monkeypatch: Any) -> None:
    monkeypatch.setattr(load, "PERIOD", 0.0)
    with st.World(two) as world, node_here(world, speed=0) as node:
        monkeypatch.setattr(load.Moment, "now", lambda _: pytest.fail("computed"))
        node.run(0.5)


def test_there_is_a_message_per_second(start: Any, client: Client, two: str) -> None:
    start(two)
    got = client.listen(DiagnosticArray, "/diagnostics")
    client.until(lambda: got)
    begun = time.monotonic()
    client.until(lambda: len(got) > 2)
    assert 1.0 < time.monotonic() - begun < 60
    assert all(set(numbers(message)) == {"speed", "step, % of time", "publish, % of time", "serve, % of time",
                                         "idle, % of time", "process, % of a core"} for message in got)
