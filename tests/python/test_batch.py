# SPDX-License-Identifier: GPL-2.0-or-later
"""Batches: many worlds, each bit-equal to a single world."""

from __future__ import annotations

import gc
import pickle
import signal
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import stagesim as st


@pytest.mark.parametrize("file", st.shipped_worlds())
def test_each_world_of_a_batch_runs_as_it_would_alone(file: str) -> None:
    """Results do not depend on the numbers of worlds and threads."""
    alone = []
    for seed in range(4):
        world = st.World(file, seed=seed)
        world.step(25)
        alone.append(world.state_hash())
    for n, threads in ((1, 1), (4, 1), (4, 2), (3, 5)):
        batch = st.Batch(file, n, threads=threads)
        batch.step(n=5)
        for _ in range(4):
            batch.step(n=5)
        assert batch.state_hashes() == alone[:n]
        assert batch.failed == [None] * n


def test_commands_and_readings_equal_those_of_single_worlds() -> None:
    batch = st.Batch("arena.world", n=6, seeds=range(10, 16), threads=2)
    assert (len(batch), batch.n, batch.seeds) == (5, 6, list(range(10, 16)))
    assert batch.names == ("r0", "r1", "r2", "r3", "r4")
    random = np.random.default_rng(1)
    told = random.uniform(-0.5, 0.5, (20, 6, 5, 3))
    worlds = [st.World("arena.world", seed=seed) for seed in range(10, 16)]
    fleets = [world.fleet() for world in worlds]
    scans = [fleet.ranger().ranges for fleet in fleets]
    assert batch.ranges.shape == (6, 5, 32)
    for moment in told:
        batch.cmd[...] = moment
        batch.step(n=3)
        for i, (world, fleet) in enumerate(zip(worlds, fleets)):
            fleet.cmd[...] = moment[i]
            world.step(3)
            assert (batch.pose[i] == fleet.pose).all()
            assert np.array_equal(batch.ranges[i], scans[i], equal_nan=True)
            assert (batch.stalled[i] == fleet.stalled).all()
    assert batch.state_hashes() == [world.state_hash() for world in worlds]
    assert batch.time.tolist() == pytest.approx([6.0] * 6)


def test_steps_can_be_limited_to_some_worlds() -> None:
    batch = st.Batch("arena.world", n=5, threads=2)
    batch.step(4, ids=[0, 3])
    batch.step(ids=batch.time > 0.1)
    batch.step(ids=1)
    assert batch.time.tolist() == pytest.approx([0.5, 0.1, 0, 0.5, 0])
    batch.step(ids=[])
    batch.step(ids=np.zeros(5, bool))
    assert batch.time.tolist() == pytest.approx([0.5, 0.1, 0, 0.5, 0])
    for wrong in (5, [0, 0], [True, False], [-6]):
        with pytest.raises(IndexError):
            batch.step(ids=wrong)
    with pytest.raises(ValueError, match="steps"):
        batch.step(n=-1)


def test_reset() -> None:
    batch = st.Batch("simple.world", n=4, threads=2)
    pose, time = batch.pose, batch.time
    first = batch.state_hashes()
    batch.step(n=30)
    batch.reset([7, 8], ids=[1, 3])
    assert time.tolist() == pytest.approx([3, 0, 3, 0])
    batch.step(30, ids=[1, 3])
    for index, seed in enumerate((0, 7, 2, 8)):
        world = st.World("simple.world", seed=seed)
        world.step(30)
        assert batch.state_hash(index) == world.state_hash()
        assert (pose[index] == world.fleet().pose).all()
    assert len(set(batch.state_hashes())) == 4
    batch.reset(seeds=range(4))
    assert batch.state_hashes() == first
    batch.step(n=30)
    batch.reset(ids=time > 1)
    assert batch.state_hashes() == first
    batch.reset(seeds=5)
    assert batch.seeds == [5] * 4
    batch.step(n=20)
    assert len(set(batch.state_hashes())) == 1


def test_rollout_equals_single_steps() -> None:
    told = np.random.default_rng(2).uniform(-0.5, 0.5, (12, 4, 5, 3))
    batch, other = (st.Batch("arena.world", n=4, threads=t) for t in (2, 1))
    record = batch.rollout(told, n=2, record=("pose", "ranges", "stalled", "time"))
    assert record["pose"].shape == (12, 4, 5, 3)
    assert record["ranges"].shape == (12, 4, 5, 32)
    assert other.ranges.shape == (4, 5, 32)  # subscribes to the rangers of this batch, too
    for i, moment in enumerate(told):
        other.cmd[...] = moment
        other.step(n=2)
        assert (record["pose"][i] == other.pose).all()
        assert (record["ranges"][i] == other.ranges).all()
        assert (record["stalled"][i] == other.stalled).all()
        assert (record["time"][i] == other.time).all()
    assert batch.state_hashes() == other.state_hashes()
    same_for_all = batch.rollout(np.array([0.1, 0, 0]), moments=3)
    assert same_for_all["pose"].shape == (3, 4, 5, 3)
    assert (batch.cmd == [0.1, 0, 0]).all()
    assert (record["failed"] == np.zeros((12, 4), bool)).all()
    assert list(batch.rollout(moments=2, record=())) == ["failed"]
    for wrong in ({}, {"moments": -1}, {"moments": 1, "n": 0}, {"moments": 1, "record": ("poses",)}):
        with pytest.raises(ValueError, match="found"):
            batch.rollout(**wrong)  # type: ignore[arg-type]


def test_snapshots_and_forks() -> None:
    batch = st.Batch("cave.world", n=3, threads=2)
    batch.step(n=10)
    now = batch.snapshot(1)
    fork = batch.fork(1)
    batch.step(n=10)
    fork.step(10)
    assert fork.state_hash() == batch.state_hash(1)
    batch.restore(now, [0, 2])
    batch.step(10, ids=[0, 2])
    assert len(set(batch.state_hashes())) == 1
    assert batch.time.tolist() == pytest.approx([2, 2, 2])
    other = st.World("cave.world")
    other.restore(now)
    other.step(10)
    assert other.state_hash() == batch.state_hash(0)


def test_batch_of_a_world_from_a_text(room: str) -> None:
    world = st.World.from_text(room, seed=1)
    world.step(5)
    batch = st.Batch.of(world, 3, seeds=[4, 5, 6], robots="[ab]")
    assert batch.pose.shape == (3, 2, 3)
    world.close()
    batch.cmd[:, :, 0] = 0.2
    batch.step(n=10)
    assert batch.pose[:, 0, 0] == pytest.approx([0.2] * 3)
    batch.reset()
    assert batch.pose[:, 0, 0] == pytest.approx([0] * 3)


def test_teleport() -> None:
    batch = st.Batch("arena.world", n=3)
    x = np.linspace(-1, 1, 15).reshape(3, 5)
    batch.teleport(np.stack([x, 0 * x, 0 * x], axis=-1))
    assert batch.pose[..., 0] == pytest.approx(x)
    batch.teleport([3, 3, 0], np.arange(5) == 2)
    assert (batch.pose[:, 2] == [3, 3, 0]).all()
    assert batch.pose[:, 1, 0] == pytest.approx(x[:, 1])
    before, poses = batch.pose.copy(), np.full((3, 5, 3), np.nan)
    poses[1, 4] = [-3, 2, 1]
    batch.teleport(poses, np.isfinite(poses).all(-1))  # only poses of robots to move need be finite
    before[1, 4] = [-3, 2, 1]
    assert (batch.pose == before).all()
    for wrong in ([np.nan, 0, 0], poses):
        with pytest.raises(ValueError, match="not finite"):
            batch.teleport(wrong)


THROWER = """
#include <stdexcept>
#include "stage.hh"
namespace {
int Update(Stg::Model* model, void*) {
  if (model->GetWorld()->SimTimeNow() >= 500000 && model->GetWorld()->seed() % 2 == 1)
    throw std::runtime_error("an odd seed");
  if (model->GetWorld()->SimTimeNow() >= 800000 && model->GetWorld()->seed() == 4)
    model->GetWorld()->Quit();
  return 0;
}
}
extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  model->DeclareNoState("thrower");
  model->AddCallback(Stg::Model::CB_UPDATE, Update, nullptr);
  model->Subscribe();
  return 0;
}
"""


@pytest.fixture(scope="module")
def thrower(tmp_path_factory: pytest.TempPathFactory, plugin_of: Callable[[str, Path], Path]) -> Path:
    """A controller that throws in worlds with an odd seed, and quits in the world with seed 4."""
    folder = tmp_path_factory.mktemp("thrower")
    plugin_of(THROWER, folder / "thrower.so")
    (folder / "thrower.world").write_text(f'position( ctrl "{folder}/thrower.so" )\n')
    return folder / "thrower.world"


def test_failed_worlds_are_reported_and_left_out(thrower: Path) -> None:
    batch = st.Batch(thrower, n=5, threads=2)
    batch.step(n=20)
    assert [text is None for text in batch.failed] == [True, False, True, False, True]
    assert "an odd seed" in str(batch.failed[1])
    assert batch.ended.tolist() == [False, False, False, False, True]
    assert batch.time[[0, 2, 4]].tolist() == pytest.approx([2, 2, 0.8])
    record = batch.rollout(moments=3, record=("time",))["time"]
    assert record[:, 0].tolist() == pytest.approx([2.1, 2.2, 2.3])
    assert record[:, 4].tolist() == pytest.approx([0.8, 0.8, 0.8])
    assert batch.time[[1, 3]].tolist() == pytest.approx([0.5, 0.5])
    batch.reset([6, 8], ids=[1, 4])
    assert [text is None for text in batch.failed] == [True, True, True, False, True]
    batch.step(n=3)
    assert batch.time[[1, 4]].tolist() == pytest.approx([0.3, 0.3])
    batch.restore(batch.snapshot(0), [3])
    assert batch.failed == [None] * 5
    assert not batch.ended.any()


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("threads", [1, 2])
def test_rollout_marks_worlds_that_fail(thrower: Path, n: int, threads: int) -> None:
    """From the moment on at which a world fails, its floats are NaN, its truth values False, and "failed" is True."""
    names = ("pose", "velocity", "sensed_pose", "estimate", "energy", "time", "stalled", "ended")
    batch = st.Batch(thrower, n=5, threads=threads)
    expected = np.zeros((40, 5), bool)
    expected[4 // n:, [1, 3]] = True  # they fail in their fifth step
    for moments in (range(0, 20), range(20, 40)):
        record = batch.rollout(moments=20, n=n, record=names)
        assert set(record) == {*names, "failed"}
        failed = expected[moments]
        assert (record["failed"] == failed).all()
        for name in names:
            rows = record[name][failed]
            assert (np.isnan(rows) if rows.dtype.kind == "f" else ~rows).all(), name
            if name != "energy":  # the robots have no power pack
                assert not np.isnan(record[name][~failed].astype(float)).any(), name
        times = np.minimum((np.array(moments) + 1) * n * 0.1, np.inf)
        assert record["time"][:, 0] == pytest.approx(times)
        assert record["time"][:, 4] == pytest.approx(np.minimum(times, 0.8))  # it has ended, not failed
    assert batch.time[[1, 3]].tolist() == pytest.approx([0.5, 0.5])
    assert [text is None for text in batch.failed] == [True, False, True, False, True]
    batch.reset()
    assert not batch.rollout(moments=1)["failed"].any()


def test_rollout_goes_on_without_worlds_that_controllers_delete(tmp_path: Path,
                                                                plugin_of: Callable[[str, Path], Path]) -> None:
    deletes = THROWER.replace('throw std::runtime_error("an odd seed")', "delete model->GetWorld()")
    deletes = deletes.replace("delete model->GetWorld();", "{ delete model->GetWorld(); return 0; }")
    plugin_of(deletes, tmp_path / "deleter.so")
    (tmp_path / "deleter.world").write_text(f'position( ctrl "{tmp_path}/deleter.so" )\n')
    for _ in range(3):
        batch = st.Batch(tmp_path / "deleter.world", n=3, threads=2)
        batch.rollout(moments=1)  # the next one goes through several moments at once
        record = batch.rollout(moments=20, record=("pose", "time"))
        assert (record["failed"] == np.outer(np.arange(20) >= 3, [0, 1, 0])).all()
        assert (np.isnan(record["time"]) == record["failed"]).all()
        assert (np.isnan(record["pose"]).all((2, 3)) == record["failed"]).all()
        assert batch.failed == [None, "a controller has deleted the world", None]
        batch.reset()
        assert batch.failed == [None] * 3
        assert not batch.rollout(moments=2)["failed"].any()


def test_world_whose_controller_throws(thrower: Path) -> None:
    """After an exception of a controller, the world can go on."""
    world = st.World(thrower, seed=1)
    with pytest.raises(st.StageError, match="an odd seed"):
        world.step(20)
    assert world.time == pytest.approx(0.5)
    ending = st.World(thrower, seed=4)
    assert ending.step(20) == 8
    assert ending.ended
    assert ending.step() == 0
    ending.reset()
    assert not ending.ended


def test_interrupt_leaves_all_worlds_at_the_same_step() -> None:
    batch = st.Batch("cave.world", n=4, threads=2)
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        batch.step(n=10**9)
    timer.join()
    assert len(set(batch.time.tolist())) == 1
    batch.step(n=5)
    world = st.World("cave.world", seed=3)
    world.step(round(batch.time[3] * 10))
    assert world.state_hash() == batch.state_hash(3)


def test_views_outlive_the_batch() -> None:
    batch = st.Batch("arena.world", n=3)
    pose, scan = batch.pose, batch.ranger()
    ranges = scan.ranges
    batch.step()
    kept = pose.copy(), ranges.copy()
    del batch
    gc.collect()
    assert (pose == kept[0]).all()
    assert (ranges == kept[1]).all()
    with pytest.raises(st.GoneError):
        _ = scan.bearings


def test_arguments_are_checked() -> None:
    for arguments in ({"n": 0}, {"n": 2, "seeds": [1]}, {"n": 1, "threads": 0},
                      {"n": 1, "seeds": [-1]}):
        with pytest.raises(ValueError, match="found"):
            st.Batch("arena.world", **arguments)  # type: ignore[arg-type]
    with pytest.raises(st.WorldError):
        st.Batch("none.world", 2)
    with pytest.raises(st.GoneError):
        st.Batch("arena.world", 2, robots="z*")


def test_copies_of_a_world_that_has_grown_equal_it(tmp_path: Path) -> None:
    """A robot drives into a region that was empty at loading; all ways to reach a state are equivalent."""
    file = tmp_path / "leave.world"
    file.write_text("resolution 0.02\nposition( name \"r\" pose [19 1 0 0] size [.4 .4 .4] alwayson 1\n"
                    "  camera( alwayson 1 resolution [8 8] ) )\n")

    def leave(world: st.World) -> str:
        world.fleet().cmd[:, 0] = 1
        world.step(30)
        return world.state_hash()

    moved = st.World(file, seed=1)
    start = moved.snapshot()
    fresh = leave(moved)
    assert moved.fleet().pose[0, 0] == pytest.approx(22, abs=0.2)
    batch = st.Batch.of(moved, 3, seeds=[1, 1, 1])
    for _ in range(2):
        batch.cmd[..., 0] = 1
        batch.step(n=30)
        assert batch.state_hashes() == [fresh] * 3
        batch.reset()
    fork = moved.fork()
    for world in (moved, fork):
        for _ in range(2):
            world.restore(start)
            assert leave(world) == fresh
    moved.reset(1)
    assert leave(moved) == fresh


def test_explain_tells_what_keeps_worlds_from_fast_steps(tmp_path: Path) -> None:
    closed = tmp_path / "closed.world"
    closed.write_text("position( name \"r\" ranger( sensor( range [0 2] samples 3 ) ) )\n")
    batch = st.Batch(closed, 3)
    assert batch.ranges.shape == (3, 1, 3)
    batch.cmd[...] = 0.1
    batch.step(5)
    assert batch.explain() == [None] * 3
    with_radio = tmp_path / "radio.world"
    for radio in "wifi", "radio":
        with_radio.write_text(f"position( name \"r\" {radio}( alwayson 1 ) )\n")
        for reason in st.Batch(with_radio, 2).explain():
            assert reason is not None and f"is a {radio} with subscribers" in reason


#: Each model and sensor twice: robots with odometry errors and noise, several kinds of readings, a thing to push.
CLOSED = """
resolution 0.05
contacts "{contacts}"
ray_model "{rays}"
model( pose [2 0 0 0] size [0.2 6 0.5] )
model( pose [0.6 0.6 0 20] size [0.3 0.3 0.3] pushable 1 mass 0.5 )
position( name "a" pose [0 0 0 30] size [0.3 0.3 0.3] localization "odom" odom_noise [0.02 0.01 0.03 0.02]
  joules 5000 joules_capacity 6000 ranger( sensor( range [0 4] fov 200 samples 9 noise [0.01 0.02 0] ) ) )
position( name "b" pose [-1 1 0 -90] size [0.4 0.3 0.3] drive "omni"
  ranger( pose [0.1 0 0 0] sensor( range [0.1 3] samples 5 ) sensor( range [0 2] samples 4 pose [0 0.1 0 90] ) ) )
position( name "c" pose [-1 -1 0 60] size [0.4 0.3 0.3] drive "car" localization "odom" )
"""
ARRAYS = ("pose", "velocity", "actual_velocity", "estimate", "estimated_velocity", "estimate_covariance",
          "estimated_velocity_covariance", "sensed_pose", "sensed_time", "energy", "stalled")
READINGS = ("ranges", "intensities", "bearings", "origins", "time")


def test_arrays_of_rows_equal_those_of_worlds(tmp_path: Path) -> None:
    """All arrays, of worlds in rows and of the same worlds with an object per model, step by step."""
    for contacts, rays in (("cells", "cell"), ("outlines", "exact")):
        text = CLOSED.format(contacts=contacts, rays=rays)
        rows, objects = tmp_path / "rows.world", tmp_path / "objects.world"
        rows.write_text(text)
        # The radio keeps the worlds from being rows, and changes nothing else.
        objects.write_text(text + "model( pose [9 9 0 0] size [0.1 0.1 0.1] wifi( alwayson 1 ) )\n")
        both = [st.Batch(file, 6, threads=2) for file in (rows, objects)]
        got = [{name: getattr(batch, name) for name in ARRAYS}
               | {name: getattr(batch.ranger(0), name) for name in READINGS}
               | {"t": batch.time, "ended": batch.ended} for batch in both]
        assert both[0].explain() == [None] * 6 and None not in both[1].explain()
        random = np.random.default_rng(5)
        for moment in range(40):
            commands = random.uniform(-1, 1, both[0].cmd.shape)
            commands[random.random(commands.shape[:2]) < 0.2] = np.nan
            poses = random.uniform(-1, 1, both[0].pose.shape)
            for batch in both:
                batch.cmd[...] = commands
                if moment % 7 == 3:
                    batch.teleport(poses, poses[:, :, 0] > 0.5)
                if moment % 11 == 5:
                    batch.reset(moment, ids=[1, 4])
                if moment % 13 == 6:
                    batch.restore(batch.snapshot(2), [0, 3])
                batch.step(1 + moment % 3)
            for name in got[0]:
                np.testing.assert_array_equal(got[0][name], got[1][name], f"{name} at moment {moment}")
        assert both[0].explain() == [None] * 6
        assert got[0]["stalled"].any() or contacts == "outlines"
        assert np.nanmin(got[0]["ranges"]) < 1


def test_models_with_different_update_intervals_keep_a_world_closed() -> None:
    text = ("interval_sim 50\ndefine bot position( alwayson 1 size [.3 .3 .3]\n"
            " ranger( update_interval 250 sensor( range [0 3] fov 270 samples 9 noise [.01 .01 0] ) ) )\n"
            "bot( name \"a\" update_interval 150 ) bot( name \"b\" pose [1 0 0 90] )\n"
            "model( pose [0 1 0 20] size [2 .1 1] )\n")
    batch = st.Batch.of(st.World.from_text(text), 3)
    worlds = [st.World.from_text(text, seed=i) for i in range(3)]
    names = ["ranger.ranges", "ranger.time", "pose", "sensed_pose", "sensed_time"]
    arrays = [batch.array(name) for name in names]
    of_worlds = [[world.fleet().array(name) for name in names] for world in worlds]
    seen: set[tuple[float, ...]] = set()
    for step in range(30):
        for i, world in enumerate(worlds):
            world.fleet().cmd[:, :] = batch.cmd[i] = (.2, 0, .1 * i + .01 * step)
            world.step()
        batch.step()
        for i, world in enumerate(worlds):
            assert batch.state_hash(i) == world.state_hash()
            for array, of_world in zip(arrays, of_worlds[i]):
                np.testing.assert_array_equal(array[i], of_world)
        seen.add(tuple(np.nan_to_num(arrays[1][0])))
    assert len(seen) == 7, seen  # no readings yet, and six updates
    assert batch.explain() == [None] * 3


def test_things_are_at_other_places_in_each_world() -> None:
    text = ("define crate model( size [.3 .4 .5] )\n"
            "position( name \"a\" size [.3 .3 .3] ranger( sensor( range [0 5] fov 90 samples 9 ) ) )\n"
            "crate( name \"crate1\" pose [2 0 0 0] ) crate( name \"crate2\" pose [3 2 0 0] ) model( pose [0 4 0 0] )\n")
    for contacts in ("cells", "outlines"):
        world = st.World.from_text(f"contacts \"{contacts}\"\n" + text)
        batch = st.Batch.of(world, 4, placed="crate*", threads=2)
        assert batch.placed == ("crate1", "crate2")
        assert batch.placed_pose[:, 1].tolist() == [[3, 2, 0]] * 4
        near = batch.ranges
        worlds = [batch.fork(i) for i in range(4)]
        fleets = [w.fleet() for w in worlds]
        for moment in range(6):
            if moment % 3 == 0:
                poses = np.random.default_rng(moment).uniform((.6, -1, -3), (3, 1, 3), (4, 2, 3))
                poses[:, 0, 1] *= .2
                which = np.arange(8).reshape(4, 2) % 3 > 0
                batch.place(poses, which)
                for w, of_world, chosen in zip(worlds, poses, which):
                    for name, pose, moved in zip(batch.placed, of_world, chosen):
                        if moved:
                            w.model(name).pose = tuple(pose)
            batch.cmd[..., 0] = .8
            batch.step(5)
            for w, fleet in zip(worlds, fleets):
                fleet.cmd[:, 0] = .8
                w.step(5)
            assert batch.state_hashes() == [w.state_hash() for w in worlds]
            assert batch.placed_pose.tolist() == [[list(w.model(name).pose) for name in batch.placed] for w in worlds]
        assert len({tuple(readings) for readings in near[:, 0]}) > 2
        assert batch.stalled.any()
        assert batch.explain() == [None] * 4
        copied = pickle.loads(pickle.dumps(batch))
        copied.place((1, 1, 0))
        assert (copied.placed_pose == (1, 1, 0)).all() and not (batch.placed_pose == (1, 1, 0)).all(2).any()
        assert copied.explain() == [None] * 4
        copied.reset(ids=[1])
        assert copied.placed_pose[1, 1].tolist() == [3, 2, 0] and copied.placed_pose[0, 1].tolist() == [1, 1, 0]


def test_variants_have_other_things_and_bad_places_are_refused() -> None:
    empty, full = (st.World.from_text("position()" + crate) for crate in ("", "model( name \"crate\" pose [2 0 0 0] )"))
    batch = st.Batch.of([empty, full], 3, placed="crate")
    batch.place((3, 1, .5))
    assert np.isnan(batch.placed_pose[[0, 2]]).all() and batch.placed_pose[1, 0].tolist() == [3, 1, .5]
    with pytest.raises(ValueError, match="not finite"):
        batch.place((np.nan, 0, 0))
    with pytest.raises(ValueError):
        batch.place(np.zeros((2, 1, 3)))
    with pytest.raises(st.GoneError, match="like 'box'"):
        st.Batch.of(full, 3, placed="box")
    none = st.Batch.of(full, 3)
    none.place(np.zeros((3, 0, 3)))
    assert none.placed == () and none.placed_pose.shape == (3, 0, 3)
