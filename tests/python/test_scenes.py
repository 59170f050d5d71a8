# SPDX-License-Identifier: GPL-2.0-or-later
"""Worlds from data: scenes, maps as arrays, and the world files that they stand for."""

from __future__ import annotations

import copy
import logging
import math
import pickle
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim.scenes import (Blobfinder, Box, Bumper, Fiducial, GridMap, Model, Polygon, Ranger, Robot, Scene, Sensor)

RAYS = [0, math.pi / 2, math.pi, -math.pi / 2]  # to the columns and rows above and below
STEPS = [(0, 1), (1, 0), (0, -1), (-1, 0)]


def random_cells(shape: tuple[int, int], seed: int, share: float = 0.2) -> np.ndarray:
    return np.random.default_rng(seed).random(shape) < share


def distance(occupied: np.ndarray, cell: tuple[int, int], step: tuple[int, int]) -> float:
    """Cells from the centre of a cell to the next wall in a direction; infinite without one."""
    row, column = cell[0] + step[0], cell[1] + step[1]
    gone = 0.5
    while 0 <= row < occupied.shape[0] and 0 <= column < occupied.shape[1]:
        if occupied[row, column]:
            return gone
        row, column, gone = row + step[0], column + step[1], gone + 1
    return math.inf


def check_walls(world: st.World, walls: GridMap, ray_model: str, tolerance: float) -> None:
    """Rays from all free cells along rows and columns end at the first occupied cell."""
    free = np.argwhere(~walls.occupied)
    places = walls.centers(free)
    poses = np.column_stack([places, np.full(len(places), walls.origin[3])])
    far = 4 * max(walls.shape) * walls.resolution
    ranges = world.cast(poses, RAYS, far, ray_model=ray_model)
    for (row, column), found in zip(free.tolist(), ranges):
        for step, reached in zip(STEPS, found):
            expected = min(distance(walls.occupied, (row, column), step) * walls.resolution, far)
            assert reached == pytest.approx(expected, abs=tolerance), (row, column, step)


@pytest.mark.parametrize("ray_model", ["cell", "exact"])
@pytest.mark.parametrize("origin", [(0, 0, 0), (-3.2, -7.7, 0), (12, -5, 0.5), (-1, 2, -2.5), (0.5, 0.5, math.pi / 2)])
@pytest.mark.parametrize(("shape", "resolution"), [((12, 12), 0.1), ((5, 31), 0.05), ((33, 4), 0.25), ((9, 7), 1.0),
                                                   ((1, 9), 0.5)])
def test_walls_are_where_the_array_has_them(shape: tuple[int, int], resolution: float, origin: tuple[float, ...],
                                            ray_model: str) -> None:
    array = random_cells(shape, 1)
    array[0, 0] = True
    walls = GridMap(array, resolution, origin)
    # A ray of the cell model ends at the edge of a cell of the world.
    world = st.World.of(Scene(walls, resolution=resolution / 10))
    check_walls(world, walls, ray_model, 1e-6 if ray_model == "exact" else 0.29 * resolution)


def test_row_0_is_the_lowest() -> None:
    array = np.zeros((4, 3), bool)
    array[0, 2] = True  # at x from 2 to 3 and y from 0 to 1
    world = st.World.from_grid(array, 1)
    assert world.cast([0, .5, 0], 0, 9, ray_model="exact")[0] == pytest.approx(2)
    assert world.cast([2.5, 4, -math.pi / 2], 0, 9, ray_model="exact")[0] == pytest.approx(3)
    assert world.cast([0, 3.5, 0], 0, 9)[0] == 9


@pytest.mark.parametrize("dtype", [np.int8, np.int16, np.int64])
def test_whole_numbers_are_percentages(dtype: type) -> None:
    array = np.array([[-1, 0, 64, 65, 100]], dtype)
    assert GridMap(array, 1).occupied.tolist() == [[False, False, False, True, True]]
    assert GridMap(array, 1, threshold=64).occupied.tolist() == [[False, False, True, True, True]]
    assert GridMap(array, 1, unknown="occupied").occupied.tolist() == [[True, False, False, True, True]]
    assert st.World.from_grid(array, 1, threshold=100).cast([-1, .5, 0], 0, 9, ray_model="exact")[0] == pytest.approx(5)


def test_truth_values_are_walls() -> None:
    array = np.array([[0, 1, 0]], bool)
    assert (GridMap(array, 1).occupied == array).all()
    assert (GridMap(array.tolist(), 1).occupied == array).all()
    assert (GridMap(np.asfortranarray(array.astype(np.uint8)), 1, threshold=1).occupied == array).all()


@pytest.mark.parametrize("shape", [(1, 1), (1, 70), (70, 1), (3, 3)])
def test_a_full_map_is_a_block(shape: tuple[int, int]) -> None:
    world = st.World.from_grid(np.ones(shape, bool), 0.5, (2, 0, 0))
    assert world.cast([0, .25, 0], 0, 99, ray_model="exact")[0] == pytest.approx(2)
    assert world.cast([99, .25, math.pi], 0, 99, ray_model="exact")[0] == pytest.approx(97 - shape[1] / 2)


def test_an_empty_map_has_no_walls_and_no_warning(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO):
        world = st.World.from_grid(np.zeros((7, 9), bool), 0.1, robots=[Robot()])
    assert not caplog.records
    assert [model.name for model in world.models] == ["map", "r0"]
    assert (world.cast([.3, .3, 0], np.linspace(0, 6, 30), 5) == 5).all()


def rich_scene(seed: int = 3) -> Scene:
    """A scene with everything, and numbers with many digits."""
    random = np.random.default_rng(seed)
    ranger = Ranger(pose=(0.1, 0, 0.1, 0.2), range=(0, math.inf), fov=math.tau / 3, samples=13, noise=(1e-4, .01, .001))
    several = Ranger(sensor=[Sensor(pose=(0, 0, a), range=(0, 3 + a), samples=1) for a in (-1 / 3, 1 / 3)])
    robots = [Robot(pose=(*random.random(2), random.random()), size=(.3, .2, .3), drive=drive, sensors=sensors,
                    odom_noise=(.01, .02, .03, .04), localization="odom", odom_error=(.1, .1, 0, .2),
                    velocity=(.3, 0, 0, .7), velocity_bounds=(-1, 1, -1, 1, 0, 0, -2, 2))
              for drive, sensors in (("diff", [ranger]), ("omni", [several, Fiducial(range_max=9, fov=math.pi)]),
                                     ("car", [Bumper(bpose=[(.1, 0, 0), (0, .1, 1)], blength=.2),
                                              Blobfinder(image=(30, 20), colors=["red", "blue"], range=4)]))]
    things = [Box(name="crate", pose=(2, 2, 1 / 3), size=(.4, .4, .5), pushable=True, mass=3, color="red"),
              Box(pose=(3, 1, 0), size=(.4, .4, .5), round=True, color_rgba=(0, 0, 1, 1), fiducial_return=7),
              Polygon(random.random((5, 2)), pose=(4, 4, 1), height=.7),
              Model(model="model", pose=(5, 5, 0), models=[Box(size=(.1, .1, .1))], properties={"map_resolution": .3})]
    return Scene(GridMap(random_cells((30, 40), seed, .05), 0.2, (-1.1, -2.3, 0.1)), robots + things, resolution=0.025,
                 interval_sim=50, ray_model="exact", properties={"speedup": 2})


def run(world: st.World, steps: int = 25) -> str:
    world.fleet().cmd[...] = [.3, 0, .2]
    for name in ("r0", "r1"):
        _ = world.fleet(name).ranger(0).ranges
    world.step(steps)
    return world.state_hash()


@pytest.mark.parametrize("threads", [1, 4])
@pytest.mark.parametrize("seed", range(12))
def test_files_of_a_scene_run_the_same(tmp_path: Path, seed: int, threads: int) -> None:
    scene = rich_scene(seed)
    file = scene.save(tmp_path / "made", "rich")
    assert Path(file) == tmp_path / "made" / "rich.world" and Path(file).read_text() == scene.text()
    assert run(st.World(file, seed=4, threads=threads)) == run(st.World.of(scene, seed=4, threads=threads))


def test_the_program_runs_the_files_of_a_scene(tmp_path: Path) -> None:
    file = rich_scene().save(tmp_path)
    ran = subprocess.run([sys.executable, "-m", "stagesim", "-g", "--seed", "8", "--duration", "2", "--state-hash", file],
                         capture_output=True, text=True, check=True)
    world = st.World.of(rich_scene(), seed=8)
    world.run(2)
    assert ran.stdout == f"state-hash {world.state_hash()}\n"


def test_scenes_in_one_folder_keep_their_maps(tmp_path: Path) -> None:
    scenes = [rich_scene(seed) for seed in range(3)]
    files = [scene.save(tmp_path, f"s{i}") for i, scene in enumerate(scenes)]
    assert len({run(st.World(file)) for file in files}) == 3
    assert [run(st.World(file)) for file in files] == [run(st.World.of(scene)) for scene in scenes]


def test_numbers_survive() -> None:
    values = [1 / 3, 5e-324, 1e300, -0.1, 123456789.123456789]
    text = Scene(None, [Box(pose=(value, 0, 0)) for value in values]).text()
    assert [float(found) for found in re.findall(r"pose \[(\S+) ", text)] == values
    world = st.World.of(Scene(None, [Box(name=f"b{i}", pose=(value, 0, .3)) for i, value in enumerate(values[3:])]))
    assert [world.model(f"b{i}").pose for i in range(2)] == [(value, 0, .3) for value in values[3:]]


def test_polygons_are_where_their_points_are() -> None:
    world = st.World.of(Scene(None, [Polygon(np.array([[1, -1], [3, -1], [3, 1], [1, 1]]), pose=(10, 0, 0))]))
    assert world.cast([0, 0, 0], 0, 99, ray_model="exact")[0] == pytest.approx(11)
    assert world.cast([20, 0, math.pi], 0, 99, ray_model="exact")[0] == pytest.approx(7)


def test_robots_without_names_are_numbered() -> None:
    scene = Scene(None, [Robot(pose=(i, 0, 0), name=name) for i, name in enumerate([None, "r1", None, None])])
    assert st.World.of(scene).fleet().names == ("r0", "r1", "r2", "r3")


def test_robots_may_be_outside_of_the_map() -> None:
    world = st.World.from_grid(np.ones((2, 2), bool), 1, robots=[Robot(pose=(-9, 50, 1))])
    world.step(3)
    assert world.fleet().pose[0].tolist() == [-9, 50, 1]


def test_copies_keep_the_scene() -> None:
    world = st.World.of(rich_scene(), seed=2)
    state_hash = run(world)
    for other in (copy.deepcopy(world), pickle.loads(pickle.dumps(world)), world.fork()):
        assert other.state_hash() == state_hash
    world.reset()
    assert run(world) == state_hash


@pytest.mark.parametrize("threads", [1, 4])
def test_batches_of_scenes_equal_worlds(threads: int) -> None:
    scenes = [rich_scene(seed) for seed in range(3)]
    batch = st.Batch.of(scenes, 7, seeds=range(7), threads=threads)
    batch.step(20)
    for i, state_hash in enumerate(batch.state_hashes()):
        world = st.World.of(scenes[i % 3], seed=i)
        world.step(20)
        assert world.state_hash() == state_hash
    assert st.Batch.of(scenes[0], 2).names == ("r0", "r1", "r2")


def test_scenes_never_change() -> None:
    array = np.zeros((3, 3), bool)
    walls = GridMap(array, 1)
    array[0, 0] = True
    assert not walls.occupied.any() and walls == GridMap(np.zeros((3, 3), np.int8), 1) != GridMap(array, 1)
    with pytest.raises(ValueError, match="read-only"):
        walls.occupied[0, 0] = True
    scene = Scene(walls)
    assert replace(scene, resolution=.1).resolution == .1 and scene.resolution is None
    assert len({walls, GridMap(np.zeros((3, 3)).astype(int), 1)}) == 1


MISTAKES: list[tuple[Any, type, str]] = [
    (lambda: GridMap(np.zeros(4, bool), 1), ValueError,
     "GridMap.array: found the shape (4,), expected an array of rows and columns, of the type bool or int8 with a cell or "
     "more"),
    (lambda: GridMap(np.zeros((0, 4), bool), 1), ValueError, "GridMap.array: found the shape (0, 4), expected"),
    (lambda: GridMap(np.zeros((2, 2, 2), bool), 1), ValueError, "GridMap.array: found the shape (2, 2, 2), expected"),
    (lambda: GridMap(np.zeros((1, 40000), bool), 1), ValueError,
     "GridMap.array: found 1 x 40000 cells, expected at most 32768 in each direction and 100000000 in all"),
    (lambda: GridMap(np.zeros((2, 2)), 1), TypeError,
     "GridMap.array: found the type float64, expected bool (True is occupied), or int8 from -1 to 100"),
    (lambda: GridMap(np.full((2, 2), 255, np.uint8), 1), ValueError,
     "GridMap.array: found numbers from 255 to 255, expected -1 (unknown) to 100; for a picture of 0 to 255, compare it "
     "with a threshold"),
    (lambda: GridMap(np.full((2, 2), -2), 1), ValueError, "GridMap.array: found numbers from -2 to -2, expected"),
    (lambda: GridMap("walls", 1), ValueError, "GridMap.array: found the shape (), expected"),  # type: ignore[arg-type]
    (lambda: GridMap([[1, 2], [3]], 1), ValueError, "GridMap.array: found [[1, 2], [3]], expected"),
    (lambda: GridMap(np.ones((2, 2), bool), math.nan), ValueError,
     "GridMap.resolution: found nan, expected metres above 0"),
    (lambda: GridMap(np.ones((2, 2), bool), 0), ValueError, "GridMap.resolution: found 0, expected metres above 0"),
    (lambda: GridMap(np.ones((2, 2), bool), "1"), TypeError, "GridMap.resolution: found '1', expected metres above 0"),
    (lambda: GridMap(np.ones((2, 2), bool), None), TypeError, "GridMap.resolution: found None, expected a value"),
    (lambda: GridMap(np.ones((2, 2), bool), 1, (0, 0)), ValueError,
     "GridMap.origin: found (0, 0), expected three or four numbers: x, y, heading, or x, y, z, heading, in metres and "
     "radians"),
    (lambda: GridMap(np.ones((2, 2), bool), 1, (0, 0, math.inf)), ValueError, "GridMap.origin: found (0, 0, inf), expected"),
    (lambda: GridMap(np.ones((2, 2), bool), 1, threshold=101), ValueError,
     "GridMap.threshold: found 101, expected a percentage from 0 to 100, more than 0"),
    (lambda: GridMap(np.ones((2, 2), bool), 1, unknown="maybe"), ValueError,
     "GridMap.unknown: found 'maybe', expected 'free' or 'occupied'"),
    (lambda: Robot(size=(.3, -.3, .3)), ValueError,
     "Robot.size: found (0.3, -0.3, 0.3), expected three numbers: metres along x, y and z, 0 or more"),
    (lambda: Robot(pose=5), TypeError, "Robot.pose: found 5, expected three or four numbers"),
    (lambda: Robot(pose=(0, 0, math.nan)), ValueError, "Robot.pose: found (0, 0, nan), expected three or four numbers"),
    (lambda: Robot(drive="tracks"), ValueError, "Robot.drive: found 'tracks', expected 'diff' or 'omni' or 'car'"),
    (lambda: Robot(name='a"b'), ValueError,
     "Robot.name: found 'a\"b', expected a text of one line without quotation marks, up to 1000 bytes"),
    (lambda: Robot(name="a\nb"), ValueError, "Robot.name: found 'a\\nb', expected a text of one line"),
    (lambda: Robot(velocity_bounds=(1, 2)), ValueError, "Robot.velocity_bounds: found (1, 2), expected eight numbers"),
    (lambda: Robot(sensors=["laser"]), TypeError,
     "Robot.sensors[0]: found 'laser', expected models of stagesim.scenes, such as Ranger()"),
    (lambda: Robot(sensors=Ranger()), TypeError, "Robot.sensors: found Ranger("),  # type: ignore[arg-type]
    (lambda: Robot(wheel_slip=2), ValueError, "Robot.wheel_slip: found 2, expected a fraction from 0 to 1"),
    (lambda: Robot(pushable=1), TypeError, "Robot.pushable: found 1, expected True or False"),
    (lambda: Robot(update_interval=1.5), TypeError,
     "Robot.update_interval: found 1.5, expected milliseconds, a whole number, 0 or more"),
    (lambda: Ranger(samples=-1), ValueError, "Ranger.samples: found -1, expected a whole number, 0 to 1 000 000"),
    (lambda: Ranger(range=(5, 1)), ValueError,
     "Ranger.range: found (5, 1), expected two numbers: the least and the largest range in metres, from 0 on and in order"),
    (lambda: Ranger(range=(math.nan, 1)), ValueError, "Ranger.range: found (nan, 1), expected two numbers"),
    (lambda: Ranger(fov=1, sensor=[Sensor()]), ValueError,
     "Ranger.sensor: found several sensors and properties of a single one, expected either"),
    (lambda: Sensor(noise=(1, 2)), ValueError, "Sensor.noise: found (1, 2), expected three numbers, 0 or more"),
    (lambda: Bumper(bpose=[(0, 0, 0)], blength=(1, 2)), ValueError,
     "Bumper.blength: found 2 lengths, expected one, or one for each of 1 lines"),
    (lambda: Bumper(bpose=[(0, 0)]), ValueError, "Bumper.bpose[0]: found (0, 0), expected three or four numbers"),
    (lambda: Fiducial(range_max=-1), ValueError, "Fiducial.range_max: found -1, expected metres, 0 or more"),
    (lambda: Blobfinder(image=(0, 5)), ValueError,
     "Blobfinder.image: found (0, 5), expected two numbers: width and height in pixels"),
    (lambda: Polygon([[0, 0], [1, 1]]), ValueError,
     "Polygon.points: found the shape (2, 2), expected an array of shape (n, 2) with n from 3 to 100 000"),
    (lambda: Polygon([[0, 0], [1, 0], [2, 0]]), ValueError,
     "Polygon.points: found an extent of 2.0 by 0.0 m, expected one above 0 in both directions"),
    (lambda: Polygon([[0, 0], [1, 0], [math.nan, 1]]), ValueError,
     "Polygon.points: found a number that is not finite, expected metres"),
    (lambda: Polygon("square"), TypeError, "Polygon.points: found 'square', expected an array of shape (n, 2)"),
    (lambda: Polygon([[0, 0], [1, 0], [1, 1]], size=(1, 1, 1)), ValueError,
     "Polygon: found size or origin, expected only points, which decide both"),
    (lambda: Polygon([[0, 0], [1, 0], [1, 1]], height=0), ValueError, "Polygon.height: found 0, expected metres above 0"),
    (lambda: Model(model="a b"), ValueError, "Model.model: found 'a b', expected the name of a type of models"),
    (lambda: Box(properties={"a b": 1}), ValueError,
     "Box.properties: found the name 'a b', expected that of a property"),
    (lambda: Box(properties={"watts": object}), TypeError, "Box.properties['watts']: found <class 'object'>, expected"),
    (lambda: Box(properties=3), TypeError, "Box.properties: found 3, expected a mapping of names to values"),
    (lambda: Scene(np.zeros((2, 2))), TypeError, "Scene.map: found array([[0., 0.],"),
    (lambda: Scene(None, ["robot"]), TypeError, "Scene.models[0]: found 'robot', expected models of stagesim.scenes"),
    (lambda: Scene(resolution=0), ValueError, "Scene.resolution: found 0, expected metres from 1e-6 to 1e6"),
    (lambda: Scene(interval_sim=0), ValueError, "Scene.interval_sim: found 0, expected milliseconds, 0.001 or more"),
    (lambda: Scene(ray_model="fast"), ValueError, "Scene.ray_model: found 'fast', expected 'cell' or 'exact'"),
    (lambda: Scene().save(".", "a/b"), ValueError, "found the name 'a/b', expected that of a file without a folder"),
    (lambda: st.World.of("cave.world"), TypeError,
     "found 'cave.world', expected a scene: stagesim.scenes.Scene()"),  # type: ignore[arg-type]
    (lambda: st.World.from_grid(np.zeros((2, 2)), 1), TypeError, "GridMap.array: found the type float64, expected bool"),
    (lambda: st.World.from_grid(np.ones((2, 2), bool), 1, threds=2), TypeError, "found the argument 'threds', expected"),
]


@pytest.mark.parametrize(("make", "kind", "message"), MISTAKES)
def test_mistakes_are_told_in_one_line(make: Any, kind: type[Exception], message: str) -> None:
    with pytest.raises(kind) as caught:
        make()
    told = str(caught.value)
    assert type(caught.value) is kind and told.startswith(message) and "\n" not in told.replace("\\n", "")


def test_speckle_is_refused() -> None:
    with pytest.raises(st.WorldError, match="with more than 500000 corners, expected a floor plan"):
        st.World.from_grid(np.indices((800, 800)).sum(0) % 2 == 0, .05)


def test_errors_of_rangers_are_those_of_world_files() -> None:
    def ranges(**errors: Any) -> Any:
        wall = Box(pose=(3, 0, 0), size=(0.2, 8, 1))
        robot = Robot(sensors=[Ranger(range=(0.5, 5), fov=2.0, samples=101, ray_model="exact", **errors)])
        with st.World.of(Scene(models=[wall, robot])) as world:
            ranger = world.fleet().ranger()
            world.run(1)
            return ranger.ranges[0].copy()

    exact, bearings = ranges(), np.abs(np.linspace(-1, 1, 101))
    assert (ranges(loss=1) == 5).all() and (ranges(range_step=0.25) % 0.25 == 0).all()
    steep = ranges(steepest=0.7)
    assert (steep[bearings > 0.72] == 5).all() and (steep[bearings < 0.68] == exact[bearings < 0.68]).all()
    with pytest.raises(ValueError, match="loss"):
        Ranger(loss=1.5)
