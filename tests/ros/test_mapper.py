# SPDX-License-Identifier: GPL-2.0-or-later
"""The maps that a mapper makes of the node's scans and transforms, and the picture of them in docs/ros.md.

  STAGE_NEW_PICTURES=1 build/venv/bin/python -m pytest tests/ros/test_mapper.py -s   # with PYTHONPATH; a minute

writes the picture again.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st
from ros_testing import Client, node_here
from stagesim.maps import map_of

pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not there; try tools/setup --ros")

from mapper import Mapper  # noqa: E402  (from examples/ros)

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
NEW_PICTURES = os.environ.get("STAGE_NEW_PICTURES") == "1"
SECONDS = 90 if NEW_PICTURES else 10
MOST_BYTES = 60_000
CELL, SIDE = 0.05, 16.4
WORLD = """
include "maps.inc"
include "sensors.inc"
include "robots.inc"
resolution 0.02
ray_model "exact"
floorplan( name "rooms" size [16 16 0.8] bitmap "bitmaps/rooms.png" )
explorer( name "r" pose [0 -6 0 90] ctrl "wander" localization_origin [0 0 0 0] %s )
"""
#: Title of the map, properties of the robot, and whether the map is right.
MAPS = (("GPS", 'localization "gps"', True), ("odometry without errors", 'localization "odom" odom_error [0 0 0 0]', True),
        ("odometry with an error of 1 %", 'localization "odom" odom_error [0.01 0 0 0.01]', False))


def map_with(client: Client, properties: str) -> tuple[np.ndarray, np.ndarray]:
    """The mapper's map of the world with such a robot in percent, and which of its cells are walls."""
    with st.World.from_text(WORLD % properties, seed=1) as world, node_here(world) as node:
        mapper = client.serve(Mapper(side=SIDE, resolution=CELL, cli_args=[
            "--ros-args", "-r", "base_scan:=base_scan1"]))
        walls = map_of(world, CELL)

        def listen() -> bool:
            node.advance()
            client.spin(0.02)
            return mapper.scans > 0

        client.until(listen)
        while world.time < SECONDS:
            before = mapper.scans
            node.advance()
            client.until(lambda: mapper.scans > before)
        grid = mapper.map.grid
        standing = np.zeros(grid.cells.shape, bool)
        standing[tuple(grid.indices(walls.centers(np.argwhere(walls.occupied))).T)] = True
        client.drop(mapper)
        return mapper.map.occupancy(), standing


def widened(cells: np.ndarray) -> np.ndarray:
    """The cells and their eight neighbours."""
    wide = np.pad(cells, 1)
    rows, columns = cells.shape
    return np.any([wide[1 + i:1 + i + rows, 1 + j:1 + j + columns] for i in (-1, 0, 1) for j in (-1, 0, 1)], 0)


def draw(maps: list[tuple[str, np.ndarray, np.ndarray]], path: Path) -> None:
    """Writes the maps side by side, with the walls on them."""
    from PIL import Image
    from stagesim.reports import plots

    pyplot = plots.load_pyplot({"font.size": 9}, "tools/setup --sweep installs it")
    figure, axes = pyplot.subplots(1, len(maps), figsize=(9, 3.3), dpi=100, layout="constrained")
    at = (np.arange(len(maps[0][2])) + 0.5) * CELL - SIDE / 2
    for (title, percent, walls), ax in zip(maps, axes):
        shades = np.where(percent < 0, 0.8, 1 - percent / 100)
        ax.imshow(shades, cmap="gray", vmin=0, vmax=1, origin="lower", extent=(-SIDE / 2, SIDE / 2) * 2)
        ax.contour(at, at, walls, levels=[0.5], colors=[plots.ORANGE], linewidths=0.5)
        ax.set(xticks=[], yticks=[])
        ax.set_title(title, fontsize=9)
    figure.canvas.draw()
    picture = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB")
    picture.quantize(32, dither=Image.Dither.NONE).save(path, optimize=True)
    assert path.stat().st_size <= MOST_BYTES


def test_a_map_is_right_if_the_poses_are(client: Client) -> None:
    """With true poses, all occupied cells are within a cell of walls; with an error of 1 %, some are not."""
    maps: list[Any] = []
    for title, properties, is_right in MAPS if NEW_PICTURES else MAPS[:2]:
        percent, walls = map_with(client, properties)
        occupied = percent >= 65
        off = (occupied & ~widened(walls)).sum()
        print(f"{title}: {occupied.sum()} occupied cells, {off} of them away from walls")
        assert occupied.sum() > 200 and (off == 0) == is_right
        maps.append((title, percent, walls))
    if NEW_PICTURES:
        draw(maps, ROOT / "docs" / "pictures" / "ros_maps.png")
