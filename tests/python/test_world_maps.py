# SPDX-License-Identifier: GPL-2.0-or-later
"""Maps of worlds: `stage export map`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim.maps import MapScene, map_of, read_map, write_map
from stagesim.maps.__main__ import main
from stagesim.scenes import GridMap, Polygon, Scene


def world_of(text: str) -> st.World:
    return st.World.from_text(text)


def occupied(map: GridMap) -> list[tuple[int, int]]:
    return [(int(row), int(column)) for row, column in np.argwhere(map.occupied)]


@pytest.mark.parametrize("seed", range(6))
def test_maps_of_worlds_of_maps_are_those_maps(tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)
    resolution = float(random.choice([0.05, 0.1, 1 / 3, 0.0123]))
    origin = (*random.uniform(-50, 50, 2).tolist(), [0.0, 0.0, 1.0, -2.5, math.pi / 2, math.pi][seed])
    walls = random.random(random.integers(1, 60, 2)) < random.uniform(0.1, 0.9)
    walls[0, 0] = True
    given = GridMap(walls, resolution, origin)
    world = st.World.of(MapScene(given))
    assert (map_of(world, like=given).occupied == walls).all()
    if origin[2] == 0:
        made = map_of(world, resolution)
        assert (made.occupied == walls).all() and made.origin[:2] == pytest.approx(origin[:2])
    write_map(map_of(world, like=given), tmp_path / "a.yaml")
    read = GridMap.from_file(tmp_path / "a.yaml")
    assert (read.occupied == walls).all() and read.origin == given.origin and read.resolution == resolution


@pytest.mark.parametrize("name", [name for name in st.shipped_worlds()])
def test_maps_of_shipped_worlds_come_back(tmp_path: Path, name: str) -> None:
    world = st.World(name, controllers=False)
    try:
        made = map_of(world, 0.1)
    except ValueError as error:
        assert "found nothing that stands still" in str(error)
        return
    write_map(made, tmp_path / "a.yaml")
    again = st.World.of(MapScene(read_map(tmp_path / "a.yaml")))  # type: ignore[arg-type]
    assert made.occupied.any() and (map_of(again, like=made).occupied == made.occupied).all()


def contains(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Whether a polygon contains points, by the number of edges to the right of each."""
    inside = np.zeros(points.shape[:-1], bool)
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0)):
        if ay != by:
            crosses = (ay <= points[..., 1]) != (by <= points[..., 1])
            inside ^= crosses & (points[..., 0] < ax + (points[..., 1] - ay) / (by - ay) * (bx - ax))
    return inside


@pytest.mark.parametrize("seed", range(4))
def test_cells_are_occupied_where_a_body_overlaps_them(seed: int) -> None:
    random = np.random.default_rng(seed)
    angles = np.sort(random.uniform(0, 2 * math.pi, 9))
    corners = np.column_stack([np.cos(angles), np.sin(angles)]) * random.uniform(0.2, 1, (9, 1))
    world = st.World.of(Scene(models=[Polygon(points=corners)]))
    cells = 40
    found = map_of(world, 2.2 / cells, area=(-1.1, -1.1, 1.1, 1.1)).occupied
    assert found.shape == (cells, cells)
    places = np.arange(cells)[:, None, None, None] + 0.0
    for part, is_found in ((np.linspace(0.02, 0.98, 50), found), (np.linspace(-0.02, 1.02, 50), ~found)):
        x = (np.swapaxes(places, 0, 1) + part[None, None, None, :]) * (2.2 / cells) - 1.1
        y = (places + part[None, None, :, None]) * (2.2 / cells) - 1.1
        overlaps = contains(corners, np.stack(np.broadcast_arrays(x, y), -1)).any(axis=(2, 3))
        wrong = overlaps & ~is_found if part[0] > 0 else ~overlaps & ~is_found
        assert not wrong.any(), np.argwhere(wrong)


def test_rays_end_in_occupied_cells() -> None:
    world = st.World("cave.world", controllers=False)
    made = map_of(world, 0.05)
    random = np.random.default_rng(1)
    free = made.centers(np.argwhere(~made.occupied)[random.integers(0, (~made.occupied).sum(), 300)])
    bearings = random.uniform(-math.pi, math.pi, 8)
    ranges = world.cast(np.column_stack([free, np.zeros(len(free))]), bearings, 30, ray_model="exact")
    reached = ranges < 30
    assert reached.sum() > 1000
    for (x, y), row in zip(free, ranges):
        for bearing, distance in zip(bearings, row):
            cells = [made.cell_at(x + d * math.cos(bearing), y + d * math.sin(bearing)) for d in distance + np.array([-1e-4, 1e-4])]
            assert distance == 30 or any(cell and made.occupied[cell] for cell in cells), (x, y, bearing)


MODELS = """
model( name "wall" pose [0.5 0.5 0 0] size [1 1 1] )
model( name "low" pose [2.5 0.5 0 0] size [1 1 0.2] )
model( name "shelf" pose [4.5 0.5 0.6 0] size [1 1 0.2] )
model( name "glass" pose [6.5 0.5 0 0] size [1 1 1] ranger_return -1 )
model( name "ghost" pose [8.5 0.5 0 0] size [1 1 1] ranger_return -1 obstacle_return 0 )
model( name "crate" pose [10.5 0.5 0 0] size [1 1 1] pushable 1 )
model( name "puck" pose [12.5 0.5 0 0] size [1 1 1] gripper_return 1 )
position( name "robot" pose [14.5 0.5 0 0] size [1 1 1] ranger() )
"""


@pytest.mark.parametrize(("height", "columns"), [(None, [0, 2, 4, 6]), (0.1, [0, 2]), (0.7, [0, 4]), (0.4, [0])])
def test_what_a_lidar_at_a_height_sees(height: float | None, columns: list[int]) -> None:
    assert occupied(map_of(world_of(MODELS), 1, height=height)) == [(0, column) for column in columns]


@pytest.mark.parametrize(("text", "cells"), [
    # A body that touches a cell only by rounding, and one that overlaps it.
    ("model( pose [1.5000001 0.5 0 0] size [1 1 1] )", {(0, 1)}),
    ("model( pose [1.51 0.5 0 0] size [1 1 1] )", {(0, 1), (0, 2)}),
    # Thin ones inside of a cell, and between cells.
    ("model( pose [1.5 0.5 0 0] size [0.001 0.4 1] )", {(0, 1)}),
    ("model( pose [2 1 0 0] size [0 1 1] )", {(0, 2), (1, 2)}),
    # Overlapping blocks.
    ("model( size [3 3 1] pose [1.5 1.5 0 0] block( points 4 point[0] [0 0] point[1] [2 0] point[2] [2 2] point[3] [0 2] ) "
     "block( points 4 point[0] [1 1] point[1] [1 3] point[2] [3 3] point[3] [3 1] ) )",
     {(0, 0), (0, 1), (1, 0), (1, 1), (1, 2), (2, 1), (2, 2)}),
    # A fence around a robot, and a solid box beside it.
    ("model( pose [2 2 0 0] size [3 3 1] ) position( pose [2 2 0 0] size [.1 .1 .1] )",
     {(r, c) for r in range(4) for c in range(4) if 0 in (r, c) or 3 in (r, c)}),
    ("model( pose [2 2 0 0] size [3 3 1] )", {(r, c) for r in range(4) for c in range(4)}),
])
def test_cells_of_bodies(text: str, cells: set[tuple[int, int]]) -> None:
    assert set(occupied(map_of(world_of(text), 1, area=(0, 0, 4, 4)))) == cells


def test_the_command(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.world").write_text(MODELS)
    out = tmp_path / "a.yaml"

    def run(*words: Any) -> None:
        assert main(["export", "map", str(tmp_path / "a.world"), "-o", str(out), *map(str, words)]) == 0

    run()
    assert GridMap.from_file(out).shape == (20, 140) and GridMap.from_file(out).occupied.sum() == 4 * 400
    assert capfd.readouterr().out == f"{out}: 140 x 20 cells of 0.05 m, 1600 of them occupied\n"
    run("--resolution", 0.5, "--height", 0.1, "--area", "-1,0,3,1")
    assert GridMap.from_file(out).shape == (2, 8) and GridMap.from_file(out).occupied.sum() == 8
    write_map(GridMap(np.zeros((3, 5), bool), 1.0, (0, 0, 0.5)), tmp_path / "like.yaml")
    run("--like", tmp_path / "like.yaml", "--set", "wall.pose=[2 2 0 0]")
    assert GridMap.from_file(out).shape == (3, 5) and GridMap.from_file(out).origin[3] == 0.5
    assert GridMap.from_file(out).cell_at(2, 2) in occupied(GridMap.from_file(out))


MISTAKES = [
    (["absent.world", "-o", "a.yaml"], "absent.world"), (["a.world", "-o", "a.pgm"], "expected a name that ends with .yaml"),
    (["a.world", "-o", "mine.yaml"], "mine.yaml: found another file, expected a new name or an earlier map of stage export"),
    (["a.world", "-o", "a.yaml", "--height", "30"], "found nothing at the height of 30 m that stands still"),
    (["a.world", "-o", "a.yaml", "--resolution", "1e-4"], "expected at most 32768 in each direction"),
    (["a.world", "-o", "a.yaml", "--like", "a.yaml"], "a.yaml"), (["a.world", "-o", "no/a.yaml"], "No such file or directory"),
]


@pytest.mark.parametrize(("words", "message"), MISTAKES)
def test_mistakes_are_told_in_one_line(tmp_path: Path, capfd: pytest.CaptureFixture[str], words: list[str], message: str,
                                       monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.world").write_text(MODELS)
    Path("mine.yaml").write_text("mine")
    assert main(["export", "map", *words]) == 1
    told = capfd.readouterr().err
    assert told.startswith("stage export: ") and message in told and told.count("\n") == 1
    assert not Path("a.yaml").exists()
