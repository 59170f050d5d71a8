# SPDX-License-Identifier: GPL-2.0-or-later
"""Worlds of a batch get other maps and scenes: each equals a world made from its scene alone."""

from __future__ import annotations

import copy
import pickle
import resource
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim import _scene_variants
from stagesim.scenes import Box, Fiducial, GridMap, Polygon, Ranger, Robot, Scene

LASER = Ranger(range=(0, 6), fov=6.0, samples=12, noise=(1e-4, 0, 0))


def cells(seed: int, shape: tuple[int, int] = (20, 30)) -> np.ndarray:
    walls = np.random.default_rng(seed).random(shape) < 0.1
    walls[[0, -1]] = walls[:, [0, -1]] = True
    walls[2:6, 2:12] = False
    return walls


def scene(seed: int, robots: int = 3, **properties: Any) -> Scene:
    things = [Box(name="crate", pose=(2, 2.2, .1 * seed), size=(.3, .3, .4), pushable=True, mass=2),
              Polygon([[0, 0], [.4, 0], [0, .4]], pose=(3, 3, seed))][:seed % 3]
    made = [Robot(pose=(.4 + .3 * i, .4 + .01 * seed, .3 * i), size=(.2, .2, .2), sensors=[LASER]) for i in range(robots)]
    return Scene(GridMap(cells(seed), 0.1, (0, 0, 0.02 * seed)), made + things, **properties)


def drive(of: Any, steps: int = 15) -> None:
    _ = of.ranger(0).ranges
    of.cmd[...] = [.3, 0, .4]


def alone(of: Scene, seed: int, steps: int = 15) -> tuple[str, np.ndarray]:
    """The state hash and the poses of a world of the scene."""
    world = st.World.of(of, seed=seed)
    fleet = world.fleet()
    drive(fleet)
    world.step(steps)
    return world.state_hash(), fleet.pose


def check(batch: st.Batch, scenes: list[Scene], steps: int = 15) -> None:
    drive(batch)
    batch.step(steps)
    hashes = batch.state_hashes()
    for i, of in enumerate(scenes):
        state_hash, pose = alone(of, batch.seeds[i], steps)
        assert hashes[i] == state_hash, i
        assert np.array_equal(batch.pose[i, :len(pose)], pose) and np.isnan(batch.pose[i, len(pose):]).all()


@pytest.mark.parametrize("threads", [1, 4])
@pytest.mark.parametrize("ray_model", ["cell", "exact"])
@pytest.mark.parametrize("contacts", ["outlines", "cells"])
def test_each_world_equals_that_of_its_scene(threads: int, ray_model: str, contacts: str) -> None:
    made = [scene(i, robots=1 + i % 3, ray_model=ray_model, contacts=contacts) for i in range(9)]
    batch = st.Batch.of(scene(0, ray_model=ray_model, contacts=contacts), 6, threads=threads)
    check(batch, [scene(0, ray_model=ray_model, contacts=contacts)] * 6)
    random = np.random.default_rng(threads)
    present = [scene(0, ray_model=ray_model, contacts=contacts)] * 6
    for episode in range(8):
        ids = random.permutation(6)[:random.integers(1, 7)]
        following = [made[k] for k in random.integers(0, len(made), len(ids))]
        batch.set_map(ids, following)
        before = batch.state_hashes()
        batch.step(0)
        assert batch.state_hashes() == before, "the maps are in force at the next reset"
        for i, of in zip(ids, following):
            present[i] = of
        batch.reset(np.arange(6) + 10 * episode)
        check(batch, present)
        assert batch.failed == [None] * 6 and set(batch.explain()) == {None}


def test_maps_wait_for_the_reset_of_their_world() -> None:
    batch = st.Batch.of(scene(0), 3)
    batch.set_map([0, 1], scene(1))
    batch.set_map(1, scene(2))
    batch.reset(5, ids=[1, 2])
    check(batch, [scene(0), scene(2), scene(0)])
    batch.reset(6)
    check(batch, [scene(1), scene(2), scene(0)])
    batch.set_map(0, scene(4))
    batch.reset(variant=0)
    batch.reset(7)
    check(batch, [scene(0)] * 3)


def test_arrays_keep_resolution_and_origin() -> None:
    batch = st.Batch.of(scene(4), 4, seeds=[9] * 4)
    base = scene(4)
    assert base.map is not None
    one, two = cells(50), cells(51)
    batch.set_map([0], one)
    batch.set_map([1, 2], np.stack([two, one]))
    batch.set_map(3, base.map.with_array(two))
    batch.reset()
    expected = [base.with_map(base.map.with_array(array)) for array in (one, two, one, two)]
    check(batch, expected)
    assert len(set(batch.variant.tolist())) == 2, "equal maps are one variant"
    batch.set_map(slice_of(4), [one, two, GridMap(one, .2), scene(3)])
    batch.reset()
    check(batch, [expected[0], expected[1], base.with_map(GridMap(one, .2)), scene(3)])
    batch.set_map(3, two)  # as the map of scene 3
    batch.reset()
    third = scene(3)
    assert third.map is not None
    check(batch, [expected[0], expected[1], base.with_map(GridMap(one, .2)), third.with_map(third.map.with_array(two))])


def slice_of(n: int) -> np.ndarray:
    return np.ones(n, bool)


@pytest.mark.parametrize("n", [1, 40, 300])
def test_many_worlds_with_a_map_each(n: int) -> None:
    batch = st.Batch.of(scene(0), n, seeds=[3] * n)
    for episode in range(2):
        maps = [cells(1000 * episode + i) for i in range(n)]
        batch.set_map(None, maps)
        batch.reset()
        assert len(set(batch.variant.tolist())) == n
        drive(batch)
        batch.step(5)
        base = scene(0)
        assert base.map is not None
        hashes = batch.state_hashes()
        for i in range(0, n, 37):
            assert hashes[i] == alone(base.with_map(base.map.with_array(maps[i])), 3, 5)[0]


def test_a_map_is_found_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_scene_variants, "KEPT", 3)
    batch = st.Batch.of(scene(0), 2)
    numbers = []
    for seed in (1, 2, 3, 1, 4, 5, 1, 2):
        batch.set_map(0, scene(seed))
        batch.reset()
        numbers.append(int(batch.variant[0]))
        check(batch, [scene(seed), scene(0)])
    assert numbers[0] == numbers[3] == numbers[6] and max(numbers) <= 4
    assert len(batch._recipes) == max(numbers) + 1


def test_new_maps_in_each_episode_need_no_more_memory() -> None:
    batch = st.Batch.of(scene(0, robots=1), 2)
    base = scene(0, robots=1)
    used = []
    for episode in range(400):
        batch.set_map([0, 1], [cells(2 * episode), cells(2 * episode + 1)])
        batch.reset()
        _ = batch.ranger(0).ranges
        batch.step(2)
        used.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    assert used[-1] - used[199] < 20_000, "kB"
    assert base.map is not None
    batch.reset(4)
    drive(batch)
    batch.step(5)
    assert batch.state_hash(1) == alone(base.with_map(base.map.with_array(cells(799))), 4, 5)[0]


def test_worlds_with_objects_get_maps() -> None:
    """Worlds that are not closed, because of a gripper, do as well."""
    from stagesim.scenes import Model

    def open_scene(seed: int) -> Scene:
        robot = Robot(pose=(.5, .4, 0), size=(.2, .2, .2), sensors=[LASER, Model(model="gripper")])
        return Scene(GridMap(cells(seed), .1), [robot])

    batch = st.Batch.of(open_scene(0), 3)
    for episode in range(3):
        made = [open_scene(episode), scene(episode, robots=1), open_scene(episode + 1)]
        batch.set_map(None, made)
        batch.reset(episode)
        check(batch, made)


def test_copies_have_the_maps_and_those_to_come() -> None:
    batch = st.Batch.of(scene(0), 3)
    batch.set_map([0, 1], scene(1))
    batch.reset(ids=0)
    batch.step(4)
    for other in (copy.deepcopy(batch), pickle.loads(pickle.dumps(batch))):
        assert other.state_hashes() == batch.state_hashes()
        other.set_map(2, scene(5))
        other.reset(8)
        check(other, [scene(1), scene(1), scene(5)])
        fork = other.fork(2)
        assert fork.state_hash() == other.state_hash(2) == pickle.loads(pickle.dumps(fork)).state_hash()
    batch.reset(9)
    check(batch, [scene(1), scene(1), scene(0)])


def test_copies_replace_maps_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_scene_variants, "KEPT", 2)
    batch = st.Batch.of(scene(0), 1)
    for seed in range(1, 9):
        batch = pickle.loads(pickle.dumps(batch)) if seed % 2 else copy.deepcopy(batch)
        batch.set_map(0, scene(seed))
        batch.reset()
        check(batch, [scene(seed)])
    assert len(batch._recipes) <= 4


def test_things_are_placed_in_new_scenes() -> None:
    def with_crate(y: float) -> Scene:
        return Scene(GridMap(cells(0), .1), [Robot(pose=(.5, .4, 0), size=(.2, .2, .2), sensors=[LASER]),
                                             Box(name="crate", pose=(1.2, y, 0), size=(.2, .2, .3))])

    batch = st.Batch.of(with_crate(1), 2, placed="crate")
    batch.set_map(1, with_crate(1.5))
    batch.reset()
    assert batch.placed_pose[:, 0, 1].tolist() == [1, 1.5]
    batch.place([1, .42, 0])
    ranges = batch.ranges
    batch.step()
    assert ranges[:, 0].min(1).max() < .4 and set(batch.explain()) == {None}
    batch.set_map(0, scene(0, robots=1))
    batch.reset()
    assert np.isnan(batch.placed_pose[0]).all() and batch.placed_pose[1, 0, 1] == 1.5
    one = with_crate(1.2)
    batch.set_map(0, Scene(one.map, [*one.models, Box(name="crate", pose=(2, 1.5, 0)), Box(name="crate2")]))
    batch.reset()
    assert batch.placed_pose[:, 0, 1].tolist() == [1.2, 1.5]


def test_a_batch_of_files_takes_scenes() -> None:
    batch = st.Batch("arena.world", 2)
    with pytest.raises(ValueError, match="^found array.* for world 1, which was made from a file, expected a scene: "):
        batch.set_map(1, cells(1))
    robot = Robot(name=batch.names[0], pose=(.5, .4, 0), size=(.2, .2, .2), sensors=[LASER])
    made = Scene(GridMap(cells(1), .1), [robot])
    batch.set_map(1, made)
    batch.reset(3)
    world = st.World.of(made, seed=3)
    batch.step(9)
    world.step(9)
    assert batch.state_hash(1) == world.state_hash()


def test_options_of_the_batch_stay() -> None:
    settings = {"world.resolution": 0.05}
    batch = st.Batch.of(st.World.of(scene(0), settings=settings, ray_model="exact"), 1, seeds=[3])
    batch.set_map(0, scene(1))
    batch.reset()
    world = st.World.of(scene(1), settings=settings, ray_model="exact", seed=3)
    for of in (batch, world.fleet()):
        drive(of)
    batch.step(9)
    world.step(9)
    assert batch.state_hash(0) == world.state_hash() != alone(scene(1), 3, 9)[0]


def test_mistakes_are_told() -> None:
    batch = st.Batch.of(scene(0, robots=2), 3)
    _ = batch.ranges
    before = batch.state_hashes()
    base = scene(1)
    assert base.map is not None
    wide = Robot(name="r0", sensors=[Ranger(samples=13)])
    mistakes: list[tuple[Any, Any, type[Exception], str]] = [
        (None, [cells(1)] * 2, ValueError, "found 2 maps, expected one, or one for each of 3 worlds"),
        ([0, 1], np.zeros((3, 4, 4), bool), ValueError, "found 3 maps, expected one, or one for each of 2 worlds"),
        (0, np.zeros((4, 4)), TypeError, "GridMap.array: found the type float64, expected bool"),
        (0, "map", ValueError, "GridMap.array: found the shape (), expected"),
        (5, cells(1), IndexError, ""),
        (0, scene(0, robots=3), ValueError,
         "found a robot 'r2' more than the batch has, expected only 2 robots with the names of Batch.names; make the batch "
         "from the scene with all robots"),
        (0, Scene(base.map, [wide]), st.StageError,
         "the scene doesn't fit into this batch, because the ranges of its ranger need 13 places, and the array has 12"),
    ]
    for ids, given, kind, message in mistakes:
        with pytest.raises(kind) as caught:
            batch.set_map(ids, given)
        assert str(caught.value).startswith(message) and "\n" not in str(caught.value)
    batch.reset()
    assert batch.state_hashes() == before and batch.variant.tolist() == [0] * 3
    empty = st.Batch.of(Scene(None, [Robot()]), 1)
    with pytest.raises(ValueError, match="^found an array for world 0, whose scene has no map, expected GridMap"):
        empty.set_map(0, cells(1))
    empty.set_map(0, GridMap(cells(1), .1))
    empty.reset()
    assert empty.fork(0).model("map")


def test_sensors_of_other_types_fit_or_are_refused() -> None:
    def finding(targets: int) -> Scene:
        return Scene(None, [Robot(sensors=[Fiducial(range_max=9)]),
                            *(Box(pose=(1 + i, 0, 0), size=(.1, .1, .1), fiducial_return=i + 1) for i in range(targets))])

    batch = st.Batch.of(finding(1), 2)
    count = batch.fiducials(0).count
    batch.set_map(1, finding(3))
    batch.reset()
    batch.step(2)
    assert count[:, 0].tolist() == [1, 1]


def test_worlds_on_a_device_get_maps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_scene_variants, "KEPT", 1)

    def flat(seed: int) -> Scene:
        return scene(3 * seed, robots=1, contacts="cells")

    try:
        st.Batch.of(flat(0), 1, device="opencl")
    except st.StageError as error:
        pytest.skip(str(error))
    there = st.Batch.of([flat(0), flat(1)], 4, device="opencl")
    for episode in range(6):
        made = [flat(2 * episode + i) for i in range(4)]
        there.set_map(None, made)
        there.reset(episode)
        check(there, made)
    alone = st.Batch.of(flat(0), 4, device="opencl")
    with pytest.raises(st.StageError, match="on a device and of one variant, so they keep their map; make it from two"):
        alone.set_map(0, flat(1))
