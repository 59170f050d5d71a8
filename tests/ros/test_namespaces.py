# SPDX-License-Identifier: GPL-2.0-or-later
"""Transforms of each robot in its own namespace, as Nav2 has several robots."""

from __future__ import annotations

import numpy as np
import pytest
import stagesim as st
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_testing import Client, node_here
from sensor_msgs.msg import LaserScan

TFMessage = pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not there; try tools/setup --ros").TFMessage
KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.mark.parametrize("namespaced", ("also", "only"))
def test_each_robot_has_transforms_without_prefixes(client: Client, two: str, namespaced: str) -> None:
    with st.World(two) as world, node_here(world, namespaced_tf=namespaced, publish_map_tf=True) as node:
        moving = {name: client.listen(TFMessage, f"{name}/tf") for name in ("", "/a", "/b")}
        fixed = {name: client.listen(TFMessage, f"{name}/tf_static", KEPT) for name in ("", "/a", "/b")}
        scans, odometry = client.listen(LaserScan, "/b/base_scan"), client.listen(Odometry, "/b/odom")
        shared = [""] if namespaced == "also" else []

        def have_come() -> bool:
            node.advance()
            return bool(scans and odometry and all(moving[name] and fixed[name] for name in ["/a", "/b", *shared]))

        client.until(have_come)
        for name in ("/a", "/b"):
            assert {(t.header.frame_id, t.child_frame_id) for t in moving[name][-1].transforms} == {
                ("odom", "base_footprint"), ("map", "odom")}
            assert {(t.header.frame_id, t.child_frame_id) for t in fixed[name][-1].transforms} == {
                ("base_footprint", "base_link"), ("base_link", "base_scan_link"),
                ("base_link", "base_scan_link_sensor_1")}
        assert scans[-1].header.frame_id == "base_scan_link"
        assert (odometry[-1].header.frame_id, odometry[-1].child_frame_id) == ("odom", "base_footprint")
        # Each robot has its own pose on its own topic.
        poses = {t.child_frame_id: t.transform for t in moving["/b"][-1].transforms}
        turned = poses["base_footprint"].rotation
        assert (poses["base_footprint"].translation.y, 2 * np.arctan2(turned.z, turned.w)) == pytest.approx(
            (2, np.pi / 2))
        if shared:
            assert {t.child_frame_id for t in moving[""][-1].transforms} == {
                "a/base_footprint", "b/base_footprint", "a/odom", "b/odom"}
            assert "b/base_scan_link" in {t.child_frame_id for t in fixed[""][-1].transforms}
        else:
            assert client.node.count_publishers("/tf") == client.node.count_publishers("/tf_static") == 0


def test_poses_in_frames_without_prefixes_are_those_of_the_receiver(client: Client, two: str) -> None:
    with st.World(two) as world, node_here(world, namespaced_tf="only") as node:
        message = PoseStamped()
        message.header.frame_id = "base_link"
        message.pose.position.x, message.pose.orientation.w = -1.0, 1.0
        node.team.teleport(1, message)
        assert world.model("b").global_pose == pytest.approx((0, 1, np.pi / 2))


def test_a_robot_without_a_prefix_stays_on_tf(ros: None, one: str) -> None:
    with st.World(one) as world, node_here(world, namespaced_tf="only") as node:
        published = {name for name, _ in node.get_publisher_names_and_types_by_node("stage", "/")}
        assert {"/tf", "/tf_static"} <= published
