# SPDX-License-Identifier: GPL-2.0-or-later
"""The topics /map and /map_metadata, and a node that starts from a map and a list of robots."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest
import stagesim as st
from nav_msgs.msg import MapMetaData, Odometry, OccupancyGrid
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_testing import Client, Process, node_here
from sensor_msgs.msg import LaserScan
from stagesim.maps import map_of, write_map
from stagesim.ros import map_feed
from stagesim.scenes import GridMap

KEPT = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
WORLD = 'model( name "wall" pose [2 1 0 0] size [1 2 1] ) position( name "r" pose [0 0 0 0] size [.2 .2 .2] )'


def cells_of(message: OccupancyGrid) -> np.ndarray:
    return np.array(message.data).reshape(message.info.height, message.info.width)


def test_a_map_and_robots_suffice(tmp_path: Path, start: Callable[..., Process], client: Client) -> None:
    given = np.random.default_rng(2).choice(np.array([-1, 0, 100], np.int8), (40, 60))
    given[10:30, 10:50] = 0
    write_map(GridMap(given, 0.1, (-3, -2, 0.5)), tmp_path / "map.yaml")
    grid = GridMap.from_file(tmp_path / "map.yaml")
    (x, y), (other_x, other_y) = grid.centers([[15, 20], [20, 40]])
    node = start("--map", str(tmp_path / "map.yaml"), "--robot", f"turtlebot3_burger:{x},{y}", "--robot",
                 f"turtlebot3_burger:{other_x},{other_y},90", "--duration", "600", publish_map=True)
    scans, poses = client.listen(LaserScan, "/r0/base_scan"), client.listen(Odometry, "/r1/ground_truth")
    client.until(lambda: scans and poses)
    place = poses[-1].pose.pose
    assert [place.position.x, place.position.y] == pytest.approx([other_x, other_y])
    assert place.orientation.z == pytest.approx(np.sqrt(0.5))
    # This subscriber is late.
    maps, metadata = client.listen(OccupancyGrid, "/map", KEPT), client.listen(MapMetaData, "/map_metadata", KEPT)
    client.until(lambda: maps and metadata)
    assert (cells_of(maps[0]) == given).all() and maps[0].header.frame_id == "map"
    assert maps[0].info == metadata[0] and metadata[0].resolution == pytest.approx(0.1)
    origin = metadata[0].origin
    assert [origin.position.x, origin.position.y, origin.orientation.z] == pytest.approx([-3, -2, np.sin(0.25)])
    client.spin(1.2 * map_feed.PERIOD)
    assert len(maps) == len(metadata) == 1
    assert node.end()[0] == 0


def test_the_map_is_published_again_when_the_world_changes(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(map_feed, "PERIOD", 0.0)
    with st.World.from_text(WORLD) as world, node_here(world, publish_map=True, map_resolution=0.5, speed=0) as node:
        maps = client.listen(OccupancyGrid, "/map", KEPT)

        def run(until: Callable[[], Any]) -> None:
            client.until(lambda: (node.run(world.time + 1), until())[1])

        run(lambda: maps)
        assert cells_of(maps[0]).shape == (4, 2) and (cells_of(maps[0]) == 100).all()
        world.model("wall").pose = (5, 1, np.pi / 2)
        run(lambda: len(maps) > 1)
        assert cells_of(maps[1]).shape == (2, 4) and maps[1].info.origin.position.x == pytest.approx(4)
        node.reset(None)
        run(lambda: len(maps) > 2)
        assert maps[2].info == maps[0].info or cells_of(maps[2]).shape == (4, 2)
        run(lambda: world.time > 20)
        assert len(maps) == 3
        assert (map_of(world, 0.5).occupied == (cells_of(maps[2]) == 100)).all()


def test_there_is_no_map_by_default(ros: None) -> None:
    with st.World.from_text(WORLD) as world, node_here(world) as node:
        topics = {name for name, _ in node.get_publisher_names_and_types_by_node("stage", "/")}
        assert not topics & {"/map", "/map_metadata"}


@pytest.mark.parametrize(("words", "message"), [
    (["--map", "map.yaml"], "found --map without --robot"), (["simple.world", "--robot", "epuck:0,0"], "found --robot without --map"),
    (["simple.world", "--map", "map.yaml", "--robot", "epuck"], "found --map and a world"),
    (["--map", "absent.yaml", "--robot", "epuck"], "absent.yaml"), (["--map", "a.yaml", "--robot", "lathe"], "found the robot 'lathe'"),
])
def test_mistakes_are_told_in_one_line(ros: None, monkeypatch: pytest.MonkeyPatch, words: list[str], message: str) -> None:
    from stagesim.ros import main

    monkeypatch.setattr(main.rclpy, "init", lambda **_: None)
    monkeypatch.setattr(main.rclpy, "try_shutdown", lambda: None)
    argv = ["stagesim.ros", *words]
    told = main.run(argv)
    assert isinstance(told, str) and message in told and told.startswith("stagesim.ros: ") and "\n" not in told
