# SPDX-License-Identifier: GPL-2.0-or-later
"""Maximum rates of topics, and overrides of their quality of service."""

from __future__ import annotations

from typing import Any, Callable

import pytest
import stagesim as st
from nav_msgs.msg import Odometry
from rclpy.qos import ReliabilityPolicy
from ros_testing import Client, Process, node_here, time_of
from sensor_msgs.msg import LaserScan
from stagesim.ros.topics import KINDS, Limit


@pytest.mark.parametrize(("rate", "passed"), [(0, 100), (1, 10), (4, 40), (7.5, 75), (10, 100), (50, 100), (0.5, 5)])
def test_limits_drop_messages_and_keep_the_rate(rate: float, passed: int) -> None:
    limit = Limit("odom")
    limit.rate = rate
    times = [step * 100_000 for step in range(100)]
    assert sum(map(limit.passes, times)) == passed
    assert limit.passes(0)  # time has gone back


def test_a_kind_of_topics_has_a_rate(client: Client, two: str) -> None:
    parameters = {"topics.odom.rate": 2.0}
    with st.World(two) as world, node_here(world, **parameters) as node:
        slow, fast = client.listen(Odometry, "/b/odom"), client.listen(LaserScan, "/b/base_scan")

        def listen() -> bool:
            node.advance()
            return bool(slow and fast)

        client.until(listen)
        client.spin(0.1)
        slow.clear(), fast.clear()
        for _ in range(50):
            node.advance()
        client.until(lambda: time_of(fast[-1]) == node.now if fast else False)
        assert len(slow) == 10 and len(fast) == 50
        # The stamps are those of the data: messages are not delayed.
        assert {time_of(message) % 500_000 for message in slow} == {0}


def test_all_kinds_are_known(ros: None) -> None:
    with st.World("zoo.world") as world, node_here(world, publish_map_tf=True) as node:
        found = {limit.kind for limit in node.team.limits}
        assert found <= set(KINDS) and {"tf", "scan", "image", "imu", "amcl_pose", "contacts"} <= found


def test_overrides_change_the_quality_of_service(ros: None, two: str) -> None:
    overrides = {"qos_overrides./b/odom.publisher.reliability": "best_effort"}
    with st.World(two) as world, node_here(world, **overrides) as node:
        efforts = {name: node.get_publishers_info_by_topic(f"/{name}/odom")[0].qos_profile.reliability for name in "ab"}
        assert efforts == {"a": ReliabilityPolicy.RELIABLE, "b": ReliabilityPolicy.BEST_EFFORT}


@pytest.mark.parametrize(("name", "value", "complaint"), [
    ("topics.odom.rate", -1, "parameter topics.odom.rate: found -1, expected a number, 0 or more"),
    ("qos_overrides./odom.publisher.reliability", "sometimes",
     "qos_overrides./odom.publisher: Unexpected QoS override for policy `reliability`: `sometimes`")])
def test_bad_values_are_told_in_one_line(start: Callable[..., Process], one: str, name: str, value: Any,
                                         complaint: str) -> None:
    status, text = start(one, **{name: value}).wait()
    assert status == 1 and len(text.splitlines()) == 1 and complaint in text, text
