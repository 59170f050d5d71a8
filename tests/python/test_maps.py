# SPDX-License-Identifier: GPL-2.0-or-later
"""Worlds from maps and drawings: `stage import`."""

from __future__ import annotations

import importlib
import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim.maps import MapScene, read_map, robot_of
from stagesim.maps.__main__ import main
from test_scene_maps import GREYS, expected, pgm, png

PI = math.pi
SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 10 8">{}</svg>'


def run(*words: Any) -> None:
    assert main(["import", *map(str, words)]) == 0


def check_walls(world: st.World, walls: np.ndarray, resolution: float, origin: tuple[float, float, float]) -> None:
    """Checks that rays from each free cell in four directions end where the walls begin; row 0 is the lowest."""
    x, y, heading = origin
    rows, columns = np.nonzero(~walls)
    c, s = math.cos(heading), math.sin(heading)
    across, up = (columns + 0.5) * resolution, (rows + 0.5) * resolution
    poses = np.column_stack([x + across * c - up * s, y + across * s + up * c, np.full(len(rows), heading)])
    far = 2.0 * max(walls.shape) * resolution
    ranges = world.cast(poses, np.array([0, PI / 2, PI, -PI / 2]), far, ray_model="exact")
    padded = np.pad(walls, 1)
    for row, column, found in zip(rows + 1, columns + 1, ranges):
        ways = (padded[row, column:], padded[row:, column], padded[row, column::-1], padded[row::-1, column])
        for way, distance in zip(ways, found):
            wanted = (np.argmax(way) - 0.5) * resolution if way.any() else far
            assert distance == pytest.approx(wanted, abs=1e-6), (row - 1, column - 1)


@pytest.mark.parametrize("heading", [0.0, 0.7, -PI / 2])
@pytest.mark.parametrize("negate", [False, True])
@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
def test_walls_are_where_map_server_has_them(tmp_path: Path, mode: str, negate: bool, heading: float) -> None:
    samples = np.random.default_rng(7).choice(GREYS, (13, 17, 2))
    (tmp_path / "room.png").write_bytes(png(samples))
    (tmp_path / "room.yaml").write_text(f"image: room.png\nmode: {mode}\nresolution: 0.05\norigin: [-1.25, 2, {heading}]\n"
                                        f"negate: {int(negate)}\noccupied_thresh: 0.65\nfree_thresh: 0.25\n")
    run(tmp_path / "room.yaml", "-o", tmp_path / "made.world")
    cells = np.array([[expected(tuple(map(int, pixel)), mode, 0.65, 0.25, negate) for pixel in row] for row in samples])
    limit = 65 if mode == "raw" else 100
    check_walls(st.World(tmp_path / "made.world"), cells[::-1] >= limit, 0.05, (-1.25, 2, heading))


def test_unknown_cells_can_be_walls(tmp_path: Path) -> None:
    rows = np.random.default_rng(3).choice([0, 205, 254], (9, 8), p=[.2, .2, .6])
    (tmp_path / "a.pgm").write_bytes(pgm(rows))
    run(tmp_path / "a.pgm", "--unknown", "occupied", "--resolution", 0.1, "--origin", "1,-2,90")
    check_walls(st.World(tmp_path / "a.world"), rows[::-1] < 254, 0.1, (1, -2, PI / 2))
    run(tmp_path / "a.pgm", "--negate", "--resolution", 0.1)
    check_walls(st.World(tmp_path / "a.world"), rows[::-1] > 0, 0.1, (0, 0, 0))


@pytest.mark.parametrize("kind", [bool, np.int8])
def test_arrays(tmp_path: Path, kind: type) -> None:
    walls = np.random.default_rng(5).random((11, 6)) < 0.3
    np.save(tmp_path / "a.npy", walls if kind is bool else np.where(walls, 100, 0).astype(np.int8))
    run(tmp_path / "a.npy", "--resolution", 0.25, "--height", 0.3)
    world = st.World(tmp_path / "a.world")
    check_walls(world, walls, 0.25, (0, 0, 0))
    free = np.argwhere(~walls)[0]
    assert (world.cast([(free[1] + .5) * .25, (free[0] + .5) * .25, 0], [0, 1, 2, 3], 9, z=0.31) == 9).all()


def test_robots_are_macros_at_places(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.eye(40, dtype=bool))
    run(tmp_path / "a.npy", "-o", tmp_path / "b.world", "--robot", "turtlebot3_burger:1.5,0.25,90", "--robot", "epuck")
    world = st.World(tmp_path / "b.world")
    assert world.fleet().names == ("r0", "r1")
    assert world.fleet().pose == pytest.approx(np.array([[1.5, 0.25, PI / 2], [0, 0, 0]]))
    assert world.model("r0").size[0] == pytest.approx(0.138)


def test_scenes_equal_the_worlds_that_they_save(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.eye(40, dtype=bool))
    scene = MapScene.of(read_map(tmp_path / "a.npy", origin=(1, 2, 0.3)), [robot_of("turtlebot4:1,2.5,30")])
    world, saved = st.World.of(scene), st.World(scene.save(tmp_path / "saved"))
    world.step(20)
    saved.step(20)
    assert world.state_hash() == saved.state_hash()


@pytest.mark.parametrize("text", ["lathe:1,2", "epuck:1", "epuck:1,2,x", "epuck:1,2,nan", "epuck:1,2,3,4", ""])
def test_mistakes_of_robots_are_told(text: str) -> None:
    with pytest.raises(ValueError, match="expected .*epuck|such as turtlebot3_burger") as caught:
        robot_of(text)
    assert "\n" not in str(caught.value)


def bearing_to(world: st.World, x: float, y: float, bearing: float) -> float:
    return float(world.cast([x, y, 0], bearing, 50, ray_model="exact")[0])


def check_plan(world: st.World) -> None:
    """Checks the walls of a room of 10 by 8 m with a pillar and a disc."""
    assert bearing_to(world, 5, 4, 0) == pytest.approx(4.95)  # a wall of 0.1 m at x = 10
    assert bearing_to(world, 5, 4, -PI / 2) == pytest.approx(3.95)
    assert bearing_to(world, 1, 5.5, 0) == pytest.approx(1, abs=0.06)  # the pillar from (2, 5) to (3, 6)
    assert bearing_to(world, 7.5, 2, 0) == pytest.approx(0.5, abs=0.06)  # the disc around (9, 2) with the radius 1


def test_svg(tmp_path: Path) -> None:
    pytest.importorskip("svgelements")
    (tmp_path / "plan.svg").write_text(SVG.format(
        "<style>.wall, .other { stroke: black; fill: none }</style>"
        '<rect class="wall" width="10" height="8"/><rect fill="white" width="9" height="7"/>'
        '<g transform="translate(2 2)" stroke="#ffffff"><path d="M0,0 h1 v1 h-1 z"/></g>'
        '<defs><circle id="disc" r="0.5"/></defs><use href="#disc" transform="translate(9 6) scale(2)"/>'
        '<line x1="4" x2="4" y1="0" y2="8"/><g display="none"><circle cx="5" cy="4" r="2"/></g>'))
    run(tmp_path / "plan.svg", "--thickness", 0.1)
    check_plan(st.World(tmp_path / "plan.world"))
    run(tmp_path / "plan.svg", "--scale", 2, "--thickness", 0.1, "--origin", "5,0,90")
    world = st.World(tmp_path / "plan.world")
    assert bearing_to(world, 5 - 8, 10, PI / 2) == pytest.approx(9.95)
    assert bearing_to(world, 5 - 8, 10, PI) == pytest.approx(7.95)


@pytest.mark.parametrize("shape", ['<polygon points="1,1 3,1 3,3 1,3"/>', '<polyline points="1 1 3 1 3 3 1 3"/>',
                                   '<path d="M1 1H3V3H1Z"/>', '<ellipse cx="2" cy="2" rx="1" ry="1"/>',
                                   '<path d="M2 1 C2.5523 1 3 1.4477 3 2 S2.5523 3 2 3 A1 1 0 0 1 2 1"/>'])
def test_areas_of_svg(tmp_path: Path, shape: str) -> None:
    pytest.importorskip("svgelements")
    (tmp_path / "a.svg").write_text(SVG.format(shape))
    run(tmp_path / "a.svg")
    world = st.World(tmp_path / "a.world")
    for x, y, bearing in ((0, 6, 0), (4, 6, PI), (2, 4, PI / 2), (2, 8, -PI / 2)):
        assert bearing_to(world, x, y, bearing) == pytest.approx(1, abs=0.006)


def test_dxf(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.new()
    document.units = ezdxf.units.MM
    space, block = document.modelspace(), document.blocks.new("pillar")
    space.add_line((0, 0), (10_000, 0))
    space.add_polyline2d([(0, 0), (0, 8000), (10_000, 8000)])
    space.add_lwpolyline([(10_000, 8000), (10_000, 0)])
    block.add_lwpolyline([(0, 0), (1000, 0), (1000, 1000), (0, 1000)], close=True)
    space.add_blockref("pillar", (3000, 5000), dxfattribs={"rotation": 90})
    space.add_circle((9000, 2000), 950)
    space.add_arc((5000, 4000), 2000, 100, 170)
    document.saveas(tmp_path / "plan.dxf")
    run(tmp_path / "plan.dxf", "--thickness", 0.1)
    world = st.World(tmp_path / "plan.world")
    check_plan(world)
    assert bearing_to(world, 5, 4, 3 * PI / 4) == pytest.approx(1.95, abs=0.01)
    assert read_map(tmp_path / "plan.dxf", scale=1e-2).bounds == pytest.approx((-.01, -.01, 100.01, 80.01))  # type: ignore


LOUD = "<!DOCTYPE svg [<!ENTITY a 'aaaaaaaa'><!ENTITY b '&a;&a;&a;&a;&a;&a;&a;&a;'>]>" + SVG.format("<text>&b;</text>")
BOMB = SVG.format("".join(f'<g id="g{i}">{f"""<use href="#g{i + 1}"/>""" * 10}</g>' for i in range(12)))
MISTAKES = [
    ("a.svg", LOUD, "found a declaration of entities, expected none"),
    ("a.svg", '<?xml version="1.0" encoding="utf-16"?>' + LOUD, "found a declaration of entities, expected none"),
    ("a.svg", BOMB, "found more than 100000 elements, or 100 in each other"),
    ("a.svg", SVG.format('<g id="a"><use href="#a"/></g>'), "found more than 100000 elements, or 100 in each other"),
    ("a.svg", SVG.format(""), "found no lines and areas, expected walls"),
    ("a.svg", SVG.format('<path d="M0 0 L1e99 1 L 2 5"/>'), "found a corner further than 1e+06 m from the origin"),
    ("a.svg", SVG.format('<path d="M0 0 C 1 2"/>'), "found the path 'M0 0 C 1 2', expected one as in SVG"),
    ("a.svg", "<svg", "not an SVG: unclosed token"), ("a.svg", "", "not an SVG: no"),
    ("a.svg", "<html/>", "found the element 'html', expected svg"),
    ("a.dxf", "0\nSECTION\n", "not a DXF file that can be read: "), ("a.dxf", "", "not a DXF file that can be read: "),
    ("a.dxf", "  0\nSECTION\n  2\nENTITIES\n  0\nLINE\n 10\nabc\n", "not a DXF file that can be read: "),
    ("a.npy", "none", "not an array of NumPy: "), ("a.pgm", "P5 2 2", ""), ("a.bmp", "", "expected a name that ends with .yaml"),
]


@pytest.mark.parametrize(("name", "content", "message"), MISTAKES)
def test_mistakes_are_told_in_one_line(tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str, content: str,
                                       message: str) -> None:
    for package in {"a.svg": ["svgelements"], "a.dxf": ["ezdxf"]}.get(name, []):
        pytest.importorskip(package)
    (tmp_path / name).write_text(content, encoding="utf-16" if content.startswith("<?") else None)
    assert main(["import", str(tmp_path / name)]) == 1
    told = capfd.readouterr().err
    assert told.startswith(f"stage import: {'' if name == 'a.bmp' else tmp_path / name}") and told.count("\n") == 1
    assert message in told and not (tmp_path / "a.world").exists()


def test_missing_packages_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str, *_: Any, **__: Any) -> None:
        raise ImportError(name)

    for ending, package in (("svg", "svgelements"), ("dxf", "ezdxf")):
        (tmp_path / f"a.{ending}").write_text("")
        importlib.import_module(f"stagesim.maps.{ending}")
        with monkeypatch.context() as changed:
            changed.setattr("builtins.__import__", missing)
            with pytest.raises(ModuleNotFoundError, match=f"pip install {package}"):
                importlib.sys.modules[f"stagesim.maps.{ending}"]._library()  # type: ignore[attr-defined]


def test_options_of_other_files_are_told(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text("")
    with pytest.raises(ValueError, match=r"found the option resolution, which files \.yaml don't have"):
        read_map(tmp_path / "map.yaml", resolution=0.1)


def test_other_files_are_not_replaced(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    np.save(tmp_path / "a.npy", np.eye(4, dtype=bool))
    (tmp_path / "a.world").write_text("mine")
    assert main(["import", str(tmp_path / "a.npy")]) == 1
    assert "found another file, expected a new name or an earlier world of stage import" in capfd.readouterr().err
    assert (tmp_path / "a.world").read_text() == "mine"


def test_the_program_has_the_command(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.eye(4, dtype=bool))
    done = subprocess.run([st._paths.PROGRAM, "import", str(tmp_path / "a.npy")], capture_output=True, text=True, check=True)
    assert done.stdout == f"{tmp_path}/a.world: 4 x 4 cells of 0.05 m, 4 of them walls; robots: 0\n"
    wrong = subprocess.run([st._paths.PROGRAM, "import"], capture_output=True, text=True, check=False)
    assert wrong.returncode == 2 and "usage: stage import" in wrong.stderr
