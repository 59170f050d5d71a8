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


#: Robots that carry models of several heights, a box that can be pushed, and what rays pass.
CROWD = """
resolution 0.05
{options}
model( size [6 0.2 1] pose [0 3 0 0] ) model( size [6 0.2 0.3] pose [0 -3 0 0] )
model( size [0.2 6 1] pose [3 0 0 0] ) model( name "glass" size [0.2 6 1] pose [-3 0 0 0] ranger_return -1 )
define bot position( size [0.5 0.3 0.3] ranger( pose [0 0 -0.2 0] sensor( range [0 4] samples 90 fov 350 ) )
  model( size [0.1 0.1 0.2] pose [0.1 0 0.1 0] ) model( size [0.6 0.05 0.1] ranger_return -1 ) )
bot( name "a" pose [1 1 0 45] ) bot( name "b" pose [-1 1 0 135] ) bot( name "c" pose [-1 -1 0 -135] )
model( name "box" pose [1 -1 0 0] size [0.3 0.4 0.3] pushable 1 mass 2 )
"""


def crowded_batch(n: int, options: str = "", threads: int = 2) -> st.Batch:
    """Worlds whose robots have driven to other places."""
    batch = st.Batch.of(st.World.from_text(CROWD.format(options=options)), n, threads=threads)
    batch.cmd[..., 0], batch.cmd[..., 2] = 0.5, np.linspace(-1, 1, n)[:, None]
    batch.step(12)
    return batch


@pytest.mark.parametrize("options", ["", 'contacts "outlines"', 'ray_model "exact"', "resolution 0.4"])
@pytest.mark.parametrize("robots", [False, True])
@pytest.mark.parametrize("z", [None, 0.05, 0.25, 0.45, 0.9])
def test_worlds_of_batches_cast_as_worlds_do(options: str, robots: bool, z: float | None) -> None:
    random = np.random.default_rng(5)
    batch = crowded_batch(5, options)
    bearings = random.uniform(-4, 4, 37)
    poses = random.uniform([-3.5, -3.5, -4], [3.5, 3.5, 4], (5, 12, 3))
    poses[:, :3] = batch.pose  # these start inside of the robots
    poses[2, 7] = np.nan
    before = batch.state_hashes()
    for max_range in (0.7, 5, 1e5, math.inf):
        cast = batch.cast(poses, bearings, max_range, robots=robots, z=z)
        assert cast.shape == (5, 12, 37)
        for i in range(5):
            assert (cast[i] == batch.fork(i).cast(poses[i], bearings, max_range, robots=robots, z=z)).all()
    some = batch.cast(poses[[3, 0]], bearings, 5, robots=robots, z=z, ids=[3, 0])
    assert (some == batch.cast(poses, bearings, 5, robots=robots, z=z)[[3, 0]]).all()
    assert (batch.cast(poses[1], 0.5, 5)[2] == batch.fork(2).cast(poses[1], 0.5, 5)).all()
    assert batch._core.count_objects() == 0
    assert batch.state_hashes() == before


@pytest.mark.parametrize("ray_model", ["cell", "exact"])
def test_rays_pass_the_robot_that_they_start_from(ray_model: str) -> None:
    batch, bearings = crowded_batch(4), np.linspace(-3, 3, 50)
    own = batch.cast(batch.pose, bearings, 6, robots=True, ignore=True, ray_model=ray_model)
    others = batch.cast(batch.pose[:, [2, 0]], bearings, 6, robots=True, ignore=[2, -1], ray_model=ray_model)
    first = batch.cast(batch.pose, bearings, 6, robots=True, ignore=0, ray_model=ray_model)
    for i in range(4):
        world = batch.fork(i)
        for k, name in enumerate(batch.names):
            expected = world.cast(batch.pose[i, k], bearings, 6, robots=True, ignore=world.model(name),
                                  ray_model=ray_model)
            assert (own[i, k] == expected).all()
        assert (others[i, 0] == own[i, 2]).all()
        assert (others[i, 1] == world.cast(batch.pose[i, 0], bearings, 6, robots=True, ray_model=ray_model)).all()
        assert (first[i] == world.cast(batch.pose[i], bearings, 6, robots=True, ignore=world.model("a"),
                                       ray_model=ray_model)).all()
    assert (own.min(-1) > 0.2).mean() > 0.5
    assert (first[:, 1:].max(-1) < 0.5).all()  # these rays hit the robots that they start from


@pytest.mark.parametrize("options", ["", 'ray_model "exact"'])
def test_rays_from_robots_are_those_of_their_rangers(options: str) -> None:
    batch = crowded_batch(6, options)
    bearings = batch.ranger().bearings[0, 0]
    batch.cmd[...] = 0
    batch.step(3)
    height = 0.12  # of the rangers, which are inside of their robots
    world = batch.fork(0)
    assert (batch.cast(batch.pose, bearings, 4, robots=True, ignore=True, z=height) == batch.ranges).all()
    for k, name in enumerate(batch.names):
        cast = world.cast(batch.pose[0, k], bearings, 4, robots=True, ignore=world.model(name), z=height)
        assert (cast == batch.ranges[0, k]).all()
    assert (batch.ranges < 4).mean() > 0.5


@pytest.mark.parametrize("file", ["simple.world", "cave.world", "arena.world"])
def test_open_worlds_and_new_worlds_cast_too(file: str) -> None:
    batch = st.Batch(file, 3, threads=2)
    poses = np.random.default_rng(6).uniform([-5, -5, -4], [5, 5, 4], (3, 20, 3))
    for _ in range(2):
        cast = batch.cast(poses, np.linspace(-3, 3, 16), 8, robots=True)
        for i in range(3):
            assert (cast[i] == batch.fork(i).cast(poses[i], np.linspace(-3, 3, 16), 8, robots=True)).all()
        batch.step(3)


def test_arguments_of_batches() -> None:
    batch = crowded_batch(2, threads=1)
    poses = np.zeros((2, 3, 3))
    out = np.empty((2, 3, 1))
    assert batch.cast(poses, 0, 8, out=out) is out
    assert batch.cast(poses[:, :0], [0, 1], 8).shape == (2, 0, 2)
    assert batch.cast(poses[0], [], 8).shape == (2, 3, 0)
    assert batch.cast(poses[:1], 0, 8, ids=np.array([False, True])).shape == (1, 3, 1)
    assert batch.cast(np.zeros((0, 3, 3)), 0, 8, ids=[]).shape == (0, 3, 1)
    for wrong in (np.zeros((3, 3, 3)), np.zeros(3), np.zeros((2, 3, 2)), np.zeros((1, 2, 3, 3))):
        with pytest.raises(ValueError, match="found poses of shape"):
            batch.cast(wrong, 0, 8)
    for ignore, text in (([0, 1], "2 ignored robots, expected one for each of 3 poses"), ([0.0] * 3, "type float64"),
                         (3, "outside of -1 to 2"), ([0, -2, 1], "outside of -1 to 2")):
        with pytest.raises(ValueError, match=text):
            batch.cast(poses, 0, 8, ignore=ignore)
    with pytest.raises(ValueError, match="1 poses|3 ignored"):
        batch.cast(poses[:, :1], 0, 8, ignore=True)
    for other in ((poses, [[0]], 8), (poses, 0, 0), (poses, 0, math.nan)):
        with pytest.raises(ValueError, match="found"):
            batch.cast(*other)
    with pytest.raises(ValueError, match="expected"):
        batch.cast(poses, 0, 8, out=np.empty((2, 3, 2)))
    with pytest.raises(ValueError, match="thick"):
        batch.cast(poses, 0, 8, ray_model="thick")
