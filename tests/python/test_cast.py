# SPDX-License-Identifier: GPL-2.0-or-later
"""World.cast(): rays from arbitrary poses."""

from __future__ import annotations

import math

import numpy as np
import pytest
import stagesim as st


@pytest.mark.parametrize(("file", "index"), [("hospital.world", 0), ("cave.world", 1)])
@pytest.mark.parametrize("ray_model", ["cell", "exact"])
def test_rangers_read_the_same(file: str, index: int, ray_model: str) -> None:
    """Compares rays that hit no robot, from the robots' poses before their last move."""
    world = st.World(file, seed=3, ray_model=ray_model)
    fleet = world.fleet()
    scan = fleet.ranger(index)
    world.step(10)
    before = fleet.pose.copy()
    world.step()
    ahead = scan.origins[0, 0, 0]
    assert (scan.origins == [ahead, 0]).all()
    before[:, 0] += ahead * np.cos(before[:, 2])
    before[:, 1] += ahead * np.sin(before[:, 2])
    robot = world.model(fleet.names[0])
    height = robot.size[2] + robot.children[index].z + 0.01
    cast = world.cast(before, scan.bearings[0], scan.ranges.max(), z=height)
    seen = scan.ranges
    # Results are bit-equal unless the origin was rounded differently.
    same = cast == seen if ahead == 0 else np.isclose(cast, seen, rtol=0, atol=1e-9)
    assert same.mean() > 0.9
    # Other rays differ because a robot is in front.
    assert (seen[~same] < cast[~same]).all()
    assert same.all(axis=1).sum() >= 10


def test_devices_and_threads_read_the_same() -> None:
    random = np.random.default_rng(4)
    poses = random.uniform([-8, -8, -4], [8, 8, 4], (20000, 3))
    bearings = random.uniform(-3, 3, 16)
    plain = st.World("cave.world").cast(poses, bearings, 8)
    for options in ({"threads": 2}, {"opencl": True, "opencl_always": True}):
        world = st.World("cave.world", **options)  # type: ignore[arg-type]
        world.step()
        assert (world.cast(poses, bearings, 8) == plain).all(), (options, world.device)


def test_shapes() -> None:
    world = st.World.from_text("resolution 0.02\nmodel( pose [3 0 0 0] size [0.2 9 1] )")
    assert world.cast([0, 0, 0], 0, 8).shape == (1,)
    assert world.cast([0, 0, 0], 0, 8)[0] == pytest.approx(2.9, abs=0.02)
    assert world.cast(np.zeros((4, 5, 3)), [0, 1, math.pi], 8).shape == (4, 5, 3)
    assert world.cast([0, 0, math.pi], [math.pi, 0], 8) == pytest.approx([2.9, 8], abs=0.02)
    assert world.cast(np.zeros((0, 3)), [0, 1], 8).shape == (0, 2)
    assert world.cast([0, 0, 0], [], 8).shape == (0,)
    assert world.cast([0, 0, math.pi], 0, math.inf)[0] == math.inf
    assert world.cast([np.nan, 0, 0], 0, 8)[0] == 8
    out = np.empty((2, 1))
    assert world.cast(np.zeros((2, 3)), 0, 8, out=out) is out
    assert out == pytest.approx(2.9, abs=0.02)
    for wrong in (([0, 0], 0, 8), ([0, 0, 0], [[0]], 8), ([0, 0, 0], 0, 0), (0, 0, 8),
                  ([0, 0, 0], 0, math.nan)):
        with pytest.raises(ValueError, match="found"):
            world.cast(*wrong)
    for other in (np.empty((3, 1)), np.empty((2, 1), np.float32), np.empty((2, 2))[:, :1]):
        with pytest.raises(ValueError, match="expected"):
            world.cast(np.zeros((2, 3)), 0, 8, out=other)
    with pytest.raises(ValueError, match="thick"):
        world.cast([0, 0, 0], 0, 8, ray_model="thick")


def test_rays_hit_robots_only_if_asked(room: str) -> None:
    world = st.World.from_text(room)
    robot = world.model("a")
    robot.pose = (1, 0, 0)
    assert world.cast([0, 0, 0], 0, 8)[0] == pytest.approx(2.95, abs=0.02)
    assert world.cast([0, 0, 0], 0, 8, robots=True)[0] == pytest.approx(0.8, abs=0.02)
    assert world.cast([0, 0, 0], 0, 8, robots=True, ignore=robot)[0] == pytest.approx(2.95, abs=0.02)
    assert world.cast([0, 0, 0], 0, 8, z=2)[0] == 8
    with pytest.raises(st.GoneError):
        world.cast([0, 0, 0], 0, 8, ignore=st.World.from_text(room).model("a"))


def test_casting_changes_nothing() -> None:
    world, other = st.World("foraging.world"), st.World("foraging.world")
    for _ in range(5):
        world.cast(np.random.default_rng(1).uniform(-5, 5, (100, 3)), [0, 1], 5)
        world.step(5)
        other.step(5)
    assert world.state_hash() == other.state_hash()


def test_many_rays_in_one_call() -> None:
    world = st.World("hospital.world", threads=2)
    poses = np.random.default_rng(2).uniform([-260, -105, -3], [260, 105, 3], (70000, 3))
    bearings = np.linspace(-3, 3, 20)
    ranges = world.cast(poses, bearings, 10)
    assert ranges.shape == (70000, 20)
    some = [0, 40000, 69999]
    assert (world.cast(poses[some], bearings, 10) == ranges[some]).all()
