# SPDX-License-Identifier: GPL-2.0-or-later
"""A reset gives the state after loading with the seed, at the cost of a restore."""

from __future__ import annotations

import logging
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import stagesim as st
from stagesim import _core, _options, _paths

ODD = """
resolution 0.02
ray_model "exact"
metric( kind "distance" )
define bot position( size [0.4 0.4 0.4] localization "odom"
  ranger( sensor( range [0 5] fov 90 samples 5 noise [0.01 0.02 0] ) ) )
model( name "wall" pose [3 0 0 0] size [0.1 8 1] )
bot( name "drawn" pose [0 0 0 0] )
bot( name "given" pose [0 2 0 90] odom_error [0.02 0.01 0 0.1] )
bot( name "powered" pose [0 -2 0 180] joules 500 watts 10 )
model( name "box" pose [1 1 0 0] size [0.2 0.2 0.2] model( name "lid" size [0.1 0.1 0.1] ) )
"""


def live_through(world: st.World) -> None:
    """Changes a world by all means of Python."""
    fleet = world.fleet()
    _ = fleet.ranger().ranges, fleet.stalled, fleet.energy
    fleet.cmd[:, 0], fleet.cmd[:, 2] = 0.4, 0.3
    world.step(7)
    first = world.models[1]
    first.pose, first.size, first.color, first.mass = (3, 1, 0.2), (0.3, 5, 0.5), (1, 0, 0, 1), 12
    first.ranger_return, first.fiducial_return, first.obstacle_return, first.speech = -1, 5, False, "moved"
    first.name = "another"
    made = world.create("position", pose=(2, 2, 0), name="new")
    made.drive(0.2)
    world.set_metric("mine", 3)
    world.cast([[0, 0, 0]], np.linspace(-3, 3, 9), 8)
    world.step(3)
    world.models[-2].delete()


@pytest.mark.parametrize("file", st.shipped_worlds())
def test_reset_is_loading(file: str) -> None:
    """A reset equals loading, for all shipped worlds, including those with controllers and populations."""
    for controllers in (True, False):
        world = st.World(file, seed=1, controllers=controllers)
        for seed in (2, 3, 3):
            world.step(6)
            fresh = st.World(file, seed=seed, controllers=controllers)
            assert world.state_hash() != fresh.state_hash()
            world.reset(seed)
            assert world.state_hash() == fresh.state_hash()
            for one in (world, fresh):
                one.step(4)
            assert world.state_hash() == fresh.state_hash()


def test_reset_forgets_everything() -> None:
    world = st.World.from_text(ODD, seed=1)
    for seed in (5, 6, 7, 2**64 - 1):
        live_through(world)
        fresh = st.World.from_text(ODD, seed=seed)
        assert world.metrics["distance"] > 0 and "mine" in world.metrics
        names = [model.name for model in fresh.models]
        assert [model.name for model in world.models] != names
        assert world.state_hash() != fresh.state_hash()
        world.reset(seed)
        assert world.metrics == fresh.metrics and "mine" not in world.metrics
        assert [model.name for model in world.models] == names
        assert (world.seed, world.time, world.steps) == (seed, 0, 0)
        for one in (world, fresh):
            _ = one.fleet().ranger().ranges
            one.step(5)
        assert world.state_hash() == fresh.state_hash()
        assert world.steps == 5


def test_batches() -> None:
    batch = st.Batch.of(st.World.from_text(ODD), 4, threads=2)
    _ = batch.ranges
    for seeds in ([1, 2, 3, 4], [7, 7, 8, 9]):
        batch.cmd[...] = 0.3
        batch.step(5)
        batch.reset(seeds)
        batch.step(5)
        assert len(set(batch.state_hashes())) == len(set(seeds)), "different seeds must give different noise"
        for i, seed in enumerate(seeds):
            world = st.World.from_text(ODD, seed=seed)
            fleet = world.fleet()
            _ = fleet.ranger().ranges, fleet.cmd
            world.step(5)
            assert batch.state_hash(i) == world.state_hash()


def seconds_of(call: Callable[[], object]) -> float:
    """The minimum duration of many calls."""
    least = np.inf
    for _ in range(200):
        start = time.perf_counter()
        call()
        least = min(least, time.perf_counter() - start)
    return least


@pytest.mark.parametrize("type_", ["u8", ">i8", "i4", "u1"])
def test_seeds_of_arrays_take_no_python_object_each(type_: str, monkeypatch: pytest.MonkeyPatch) -> None:
    batch, other = (st.Batch("arena.world", n=4, threads=2) for _ in range(2))
    seeds = np.array([7, 1, 200 if type_ == "u1" else 2**31 - 1, 9, 0, 0, 0, 0], type_)
    with monkeypatch.context() as patched:
        patched.delattr(_options, "checked")
        batch.reset(seeds[:4])
        batch.reset(seeds[:6:3], ids=np.array([True, False, False, True]))
    other.reset(seeds[:4].tolist())
    other.reset(seeds[:6:3].tolist(), ids=[0, 3])
    assert batch.seeds == other.seeds == [7, 1, int(seeds[2]), 9]
    assert batch.state_hashes() == other.state_hashes()


def test_wrong_seeds_of_arrays_are_refused() -> None:
    batch = st.Batch("arena.world", n=2, threads=1)
    batch.reset(np.array([2**64 - 1, 0], np.uint64))
    with pytest.raises(ValueError, match=r"found -3 as seed, expected a whole number, 0 to"):
        batch.reset(np.array([1, -3]))
    with pytest.raises(ValueError, match="found 3 seeds, expected 2"):
        batch.reset(np.arange(3))
    for wrong in (np.ones((2, 1), int), np.ones(2)):
        with pytest.raises(TypeError, match="as seed, expected a whole number"):
            batch.reset(wrong)
    assert batch.seeds == [2**64 - 1, 0]


@pytest.mark.parametrize("file", ["arena.world", "navigate.world", "disperse.world", "forage.world"])
def test_a_reset_costs_a_restore(file: str) -> None:
    """A reset takes about as long as a restore; loading takes some eight times as long."""
    batch = st.Batch(file, n=1, threads=1)
    world = st.World(file)
    for one, restored in ((batch, batch.snapshot(0)), (world, world.snapshot())):
        one.reset(3)
        one.reset(4)
        one.step()
        assert seconds_of(lambda: one.reset(5)) < 3 * seconds_of(lambda: one.restore(restored))


def test_controllers_left_out_are_told_once(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "stagesim"):
        batch = st.Batch("cave.world", n=5, controllers=False)
        batch.reset(seeds=range(7, 12))
        batch.reset()
        st.Batch.of(batch.fork(0), 2)
    assert len([record for record in caplog.records if "ignored as requested" in record.message]) == 1


def log_of_a_run(folder: Path, reset: bool, steps: int) -> bytes:
    """Logs three steps of driving robots, resets the world if `reset`, and logs `steps` more steps."""
    world = st.World.from_text(ODD)
    world.reset(2)
    folder.mkdir()
    (folder / "w.world").write_text(ODD)
    subprocess.run([_paths.PROGRAM, "sweep", folder / "w.world", "--plan-only", "--log", "--log-compression=none",
                    "--duration=1", "-o", folder / "out"], check=True)
    log = _core.Sweep(str(folder / "out")).start_log(0, world._core)
    cmd = world.fleet().cmd
    cmd[:, 0] = 0.4
    world.step(3)
    if reset:
        world.reset(3)
    cmd[:, 0] = 0.4
    world.step(steps)
    log.finish()
    file = folder / "out/runs/000/000000.mcap"
    assert len(_core.places_in_log(str(file))) > 0
    return file.read_bytes()


def test_log_ends_with_a_reset(tmp_path: Path) -> None:
    """A reset ends a log, even if the world is reset in place: the log has only the steps before."""
    until_then = log_of_a_run(tmp_path / "a", False, 0)
    assert log_of_a_run(tmp_path / "b", False, 3) != until_then
    assert log_of_a_run(tmp_path / "c", True, 0) == until_then
    assert log_of_a_run(tmp_path / "d", True, 3) == until_then
