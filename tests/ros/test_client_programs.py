# SPDX-License-Identifier: GPL-2.0-or-later
"""The programs in examples/ros start as documented; other tests use what they do."""

from __future__ import annotations

import importlib
import os
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy

pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not there; try tools/setup --ros")

import transforms  # noqa: E402  (from examples/ros)
from grids import along  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
PROGRAMS = {"costmap": [], "follower": [], "localizer": [], "mapper": [], "pose_error": [], "save_map": ["map.yaml"],
            "wander": ["r0", "r1"]}


def test_each_program_is_tested() -> None:
    programs = {file.stem for file in (ROOT / "examples" / "ros").glob("*.py") if "def main()" in file.read_text()}
    assert programs == set(PROGRAMS)


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_starts_and_its_parameters_are_described(ros: None, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    nodes: list[Any] = []
    monkeypatch.setattr(rclpy, "init", lambda args: None)
    monkeypatch.setattr(rclpy, "spin", nodes.append)
    monkeypatch.setattr(rclpy, "spin_until_future_complete", lambda node, _: nodes.append(node))
    monkeypatch.setattr(sys, "argv", [name, *PROGRAMS[name]])
    module = importlib.import_module(name)
    module.main()
    node, = nodes
    own = set(node._parameters) - {"use_sim_time", "start_type_description_service"}
    assert own == {word for word in re.findall(r"`(\w+)`", module.__doc__) if word in own}
    node.destroy_node()


def test_poses_between_transforms_are_interpolated(ros: None) -> None:
    """A robot turns by 90 degrees in a second, across the heading of 180 degrees; its sensor is 1 m ahead."""
    from geometry_msgs.msg import TransformStamped

    def link(parent: str, child: str, second: int, x: float, turn: float) -> TransformStamped:
        made = TransformStamped()
        made.header.frame_id, made.child_frame_id, made.header.stamp.sec = parent, child, second
        made.transform.translation.x = x
        made.transform.rotation.z, made.transform.rotation.w = np.sin(turn / 2), np.cos(turn / 2)
        return made

    node = rclpy.create_node("asks")
    known = transforms.Transforms(node)
    known._fix(TFMessage(transforms=[link("base", "eye", 0, 1.0, 0.0)]))
    known._move(TFMessage(transforms=[link("odom", "base", 1, 0.0, 0.75 * np.pi), link("map", "odom", 0, 5.0, 0.0)]))
    assert known.pose("odom", "eye", 1_500_000_000) is None
    known._move(TFMessage(transforms=[link("odom", "base", 2, 0.0, -0.75 * np.pi)]))
    x, y, turn = known.pose("odom", "eye", 1_500_000_000)
    assert (x, y, np.cos(turn)) == pytest.approx((-1, 0, -1))
    assert known.pose("odom", "eye", 999_999_999) is None and known.pose("odom", "elsewhere", 1) is None
    assert known.pose("eye", "base", 2_000_000_000) == pytest.approx((-1, 0, 0))
    node.destroy_node()


def test_pose_error_lays_poses_on_each_other(ros: None) -> None:
    """A believed path is the true one, turned by 90 degrees and shifted, but for an error of (0.3, 0.4) at its end."""
    from pose_error import PoseError

    node = PoseError(align=True)
    true = np.array([[1.0, 2.0, 0.5], [2.0, 2.0, 1.0], [2.0, 3.0, -3.0]])
    believed = transforms.placed(np.array([5.0, -1.0, np.pi / 2]), true)
    believed[2, :2] += 0.3, 0.4
    node.poses = list(zip(believed, true))
    distances, turns = node.errors()
    assert distances == pytest.approx([0, 0, 0.5], abs=1e-12) and turns == pytest.approx([0, 0, 0], abs=1e-12)
    node.align = False
    assert node.errors()[0].min() > 1 and node.errors()[1] == pytest.approx([np.pi / 2] * 3)
    node.destroy_node()


def test_save_map_writes_what_map_server_reads(ros: None, tmp_path: Path) -> None:
    from grids import Grid
    from save_map import Saver
    from stagesim.scenes import GridMap

    cells = np.array([[0, 100, -1], [64, 65, 0]], np.int8)
    message = Grid(cells, 0.1, np.array([-1.0, 2.0])).message("map", rclpy.clock.Clock().now().to_msg(), cells)
    node = Saver(str(tmp_path / "mine.yaml"))
    node._save(message)
    assert node.saved.done()
    saved = GridMap.from_file(tmp_path / "mine.yaml")
    assert saved.occupied.tolist() == [[False, True, False], [False, True, False]]
    assert saved.origin[:2] == pytest.approx((-1, 2)) and saved.resolution == pytest.approx(0.1)
    node.destroy_node()


def test_points_along_rays_miss_no_length() -> None:
    ends = np.random.default_rng(1).uniform(-3, 3, (50, 2))
    points = along(np.array([1.0, 2.0]), ends, 0.1)
    lengths = np.hypot(*(ends - [1, 2]).T)
    assert len(points) == np.ceil(lengths / 0.1).sum()
    middle = ((ends - [1, 2]) / 2 * np.ceil(lengths / 0.1)[:, None]).sum(0)
    assert (points - [1, 2]).sum(0) == pytest.approx(middle)
