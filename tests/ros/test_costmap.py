# SPDX-License-Identifier: GPL-2.0-or-later
"""A map of obstacles that is cleared by rays without a hit, as the obstacle layer of Nav2 does it by inf_is_valid."""

from __future__ import annotations

from contextlib import contextmanager
from typing import Any, Iterator

import numpy as np
import pytest
import stagesim as st
from ros_testing import Client, node_here

pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs is not there; try tools/setup --ros")

from costmap import FREE, OCCUPIED, UNKNOWN, Costmap  # noqa: E402  (from examples/ros)

# The robot stands in the open; the wall covers x = 2.0 to 2.3 m, and y = -1 to 1 m.
WORLD = """
resolution 0.02
ray_model "exact"
model( name "wall" pose [2.15 0 0 0] size [0.3 2 1] )
model( name "box" pose [-1.5 0.5 0 30] size [0.4 0.4 1] )
position( name "r" size [0.3 0.3 0.3] pose [0 0 0 0] drive "omni" localization "gps"
  ranger( sensor( range [0 4] fov 360 samples 721 ) ) )
"""
CELL = 0.05


class Watch:
    """A robot that looks about, and its map of obstacles."""

    def __init__(self, client: Client, world: Any, node: Any, costmap: Costmap) -> None:
        self._client, self._node, self._costmap, self.world = client, node, costmap, world

        def listen() -> bool:
            node.advance()
            client.spin(0.02)
            return costmap.time > 0

        client.until(listen)

    def look(self, scans: int = 3) -> np.ndarray:
        """Lets the map see some scans; returns it."""
        for _ in range(scans):
            self._node.advance()
            self._client.until(lambda: self._costmap.time == self._node.now * 1000)
        return self._costmap.obstacles.grid.cells.copy()

    def centers(self, cells: np.ndarray) -> np.ndarray:
        """The centers of the cells that are true, shape (n, 2)."""
        grid = self._costmap.obstacles.grid
        return grid.origin + (np.argwhere(cells)[:, ::-1] + 0.5) * grid.resolution


@contextmanager
def watched(client: Client, parameters: dict[str, Any] | None = None, text: str = WORLD, **node: Any) -> Iterator[Watch]:
    ranges = {"obstacle_max_range": 3.5, "raytrace_max_range": 4.0, "side": 10.0, "resolution": CELL}
    with st.World.from_text(text) as world, node_here(world, **node) as made:
        yield Watch(client, world, made, client.serve(Costmap(**{**ranges, **(parameters or {})})))


def box_distance(points: np.ndarray, pose: Any, size: tuple[float, float]) -> np.ndarray:
    """The distance of points from the outline of a rectangle, metres, shape (n,)."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    x, y = np.abs((points - pose[:2]) @ np.array([[c, -s], [s, c]])).T
    x, y = x - size[0] / 2, y - size[1] / 2
    return np.where((x > 0) | (y > 0), np.hypot(np.maximum(x, 0), np.maximum(y, 0)), np.minimum(-x, -y))


def test_marks_are_where_the_world_has_obstacles(client: Client) -> None:
    with watched(client) as watch:
        cells = watch.look()
        marks = watch.centers(cells == OCCUPIED)
        off = np.minimum(box_distance(marks, (2.15, 0, 0), (0.3, 2)),
                         box_distance(marks, (-1.5, 0.5, np.radians(30)), (0.4, 0.4)))
        assert off.max() <= CELL * np.sqrt(0.5)  # each mark is a cell through which an outline goes
        face = np.stack([np.full(40, 2.0), np.linspace(-0.98, 0.98, 40)], 1)
        assert np.hypot(*(face[:, None] - marks).transpose(2, 0, 1)).min(1).max() <= CELL
        # Rays leave the square around a circle of 4 m unknown, and see the rest but for the shadows.
        everything = watch.centers(np.ones_like(cells, bool)).reshape(*cells.shape, 2)
        away = np.hypot(*np.moveaxis(everything, -1, 0))
        assert (cells[away > 4 + CELL] == UNKNOWN).all()
        behind = np.abs(np.arctan2(everything[..., 1], everything[..., 0])) < np.arctan2(1, 2) + 0.03
        box = np.abs(np.arctan2(-everything[..., 1], -everything[..., 0]) + np.arctan2(0.5, 1.5)) < 0.25
        assert (cells[(away < 4 - CELL) & ~behind & ~box] == FREE).all()


@pytest.mark.parametrize("inf_is_valid", (True, False))
def test_what_goes_away_is_cleared_by_rays_without_a_hit(client: Client, inf_is_valid: bool) -> None:
    with watched(client, {"inf_is_valid": inf_is_valid}) as watch:
        watch.look()
        watch.world.model("box").pose = (20, 20, 0)
        marks = watch.centers(watch.look() == OCCUPIED)
        assert ((marks[:, 0] < 0).sum() == 0) == inf_is_valid
        assert (marks[:, 0] > 1.9).sum() >= 40


@pytest.mark.parametrize("inf_is_valid", (True, False))
def test_what_walks_past_leaves_no_trail(client: Client, inf_is_valid: bool) -> None:
    """While the box goes by at 1 m/s, all marks on its side are on it or in its shadow."""
    with watched(client, {"inf_is_valid": inf_is_valid}) as watch:
        outside = 0.0  # greatest bearing of a mark from the directions of the box, radians
        for y in np.linspace(-1.5, 1.5, 31):
            watch.world.model("box").pose = (-1.5, y, 0)
            marks = watch.centers(watch.look(1) == OCCUPIED)
            corners = np.array([[-1.5 + i, y + j] for i in (-0.2, 0.2) for j in (-0.2, 0.2)])
            box, bearings = (np.arctan2(-points[:, 1], -points[:, 0]) for points in (corners, marks[marks[:, 0] < 0]))
            assert len(bearings) > 5
            outside = max(outside, (box.min() - bearings).max(), (bearings - box.max()).max())
        assert (outside < CELL) == inf_is_valid
        watch.world.model("box").pose = (20, 20, 0)
        assert ((watch.centers(watch.look() == OCCUPIED)[:, 0] < 0).sum() == 0) == inf_is_valid


@pytest.mark.parametrize(("ranges", "furthest", "ring"), [
    ("rep117", 10.0, False), ("stage", 10.0, True), ("stage", 3.9, False)])
def test_a_greatest_range_published_as_a_number_leaves_a_ring(client: Client, ranges: str, furthest: float,
                                                             ring: bool) -> None:
    """With ranges:=stage, a ray without a hit ends at 4 m: an obstacle, unless obstacle_max_range is less."""
    with watched(client, {"obstacle_max_range": furthest}, ranges=ranges) as watch:
        cells = watch.look()
        marks = watch.centers(cells == OCCUPIED)
        away = np.hypot(*marks.T)
        assert (away > 3.9).any() == ring
        if ring:
            assert (np.abs(away[away > 3.9] - 4) < CELL).all() and (away > 3.9).sum() > 300
        # The number clears as +Inf does: what has gone away vanishes.
        watch.world.model("box").pose = (20, 20, 0)
        marks = watch.centers(watch.look() == OCCUPIED)
        assert not (np.hypot(*marks.T)[marks[:, 0] < 0] < 3.9).any()
