# SPDX-License-Identifier: GPL-2.0-or-later
"""States of the worlds of a batch as rows of an array."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import stagesim as st
from patience import PATIENCE

#: Robots with every kind of sensor and of random numbers, update intervals, and a box that can be pushed.
ODD = """
resolution 0.05
{contacts}
model( size [6 0.2 1] pose [0 3 0 0] ) model( size [6 0.2 1] pose [0 -3 0 0] )
model( size [0.2 6 1] pose [3 0 0 0] color "blue" ) model( size [0.2 6 1] pose [-3 0 0 0] color "red" )
define bot position( size [0.3 0.3 0.4] localization "odom" odom_noise [0.05 0.01 0.02 0.01] joules 1000 watts 5
  ranger( update_interval 200 sensor( range [0 5] fov 270 samples 9 noise [0.02 0.01 0] ) )
  fiducial( fiducial_return 4 range_max 4 fov 300 ) bumper( bcount 3 ) blobfinder( update_interval 300 range 5 ) )
bot( name "a" pose [1 1 0 45] ) bot( name "b" pose [-1 1 0 135] fiducial_return 7 ) bot( name "c" pose [-1 -1 0 -135] )
model( name "box" pose [1 -1 0 0] size [0.3 0.3 0.3] pushable 1 mass 2 )
"""


def odd_batch(n: int, contacts: str = 'contacts "outlines"', threads: int = 2) -> st.Batch:
    """Closed worlds with different random numbers whose robots drive into each other and against walls."""
    batch = st.Batch.of(st.World.from_text(ODD.format(contacts=contacts)), n, threads=threads)
    _ = (batch.ranges, batch.fiducials().id, batch.bumper(), batch.blobs().color, batch.estimate, batch.energy,
         batch.stalled)
    batch.cmd[..., 0], batch.cmd[..., 2] = 0.7, np.linspace(-1, 1, n)[:, None]
    assert batch.explain() == [None] * n
    return batch


def arrays_of(batch: st.Batch) -> dict[str, np.ndarray]:
    """Copies of all arrays."""
    return {"pose": batch.pose.copy(), "ranges": batch.ranges.copy(), "id": batch.fiducials().id.copy(),
            "hit": batch.bumper().copy(), "color": batch.blobs().color.copy(), "estimate": batch.estimate.copy(),
            "energy": batch.energy.copy(), "stalled": batch.stalled.copy(), "time": batch.time.copy()}


def same(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> bool:
    """True if all arrays have equal bits, or NaN."""
    return all(np.array_equal(one[name], other[name], equal_nan=one[name].dtype.kind == "f") for name in one)


@pytest.mark.parametrize("contacts", ['contacts "outlines"', 'contacts "cells"'])
@pytest.mark.parametrize("steps", [0, 1, 2, 17])
def test_worlds_go_on_from_a_state_to_the_bit(contacts: str, steps: int) -> None:
    batch = odd_batch(6, contacts)
    batch.step(steps)
    state, hashes, before = batch.state(), batch.state_hashes(), arrays_of(batch)
    batch.step(13)
    later, after = batch.state_hashes(), arrays_of(batch)
    assert not same(before, after)
    batch.load(state)
    assert batch.state_hashes() == hashes
    assert same(arrays_of(batch), before)
    assert (batch.state() == state).all()
    batch.step(13)
    assert batch.state_hashes() == later
    assert same(arrays_of(batch), after)


def test_equal_histories_have_equal_rows() -> None:
    one, other = odd_batch(4, threads=1), odd_batch(4, threads=2)
    other.step(5)
    other.reset()
    for batch in (one, other):
        batch.cmd[...] = [0.7, 0, 0.5]
        batch.step(9)
    assert one.state().tobytes() == other.state().tobytes()
    assert len({row.tobytes() for row in one.state()}) == 4
    other.load(one.state([3, 2, 1, 0]))
    assert (one.state() == other.state()[::-1]).all()


def test_many_worlds_become_forks_of_a_few() -> None:
    batch = odd_batch(50)
    batch.step(4)
    state, hashes = batch.state(), batch.state_hashes()
    batch.load(batch.state(3))
    assert batch.state_hashes() == [hashes[3]] * 50
    batch.load(state[[7] * 20 + [8] * 20], np.arange(50) < 40)
    assert batch.state_hashes() == [hashes[7]] * 20 + [hashes[8]] * 20 + [hashes[3]] * 10
    batch.load(state[9], 49)
    batch.load(state[:0], [])
    assert batch.state_hash(49) == hashes[9]
    fork = batch.fork(49)
    fork.step(3)
    batch.cmd[...] = np.nan  # commands stay as they are
    batch.step(3)
    assert batch.state_hash(49) == fork.state_hash()


def test_states_outlive_the_process(tmp_path: Path) -> None:
    """A new process, in which the file has another path and other arrays are in use, loads what this one saved."""
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / f"{name}.world").write_text(ODD.format(contacts=""))
    batch = st.Batch(tmp_path / "one/one.world", n=3, threads=1, settings={"a.mass": 3})
    _ = batch.ranges
    batch.cmd[..., 0] = 0.5
    batch.step(6)
    np.save(tmp_path / "states.npy", batch.state())
    batch.step(6)
    program = f"""
import numpy as np, stagesim as st
batch = st.Batch({str(tmp_path / "two/two.world")!r}, n=5, seeds=[9] * 5, threads=2, settings={{"a.mass": 3}})
batch.load(np.load({str(tmp_path / "states.npy")!r}), [4, 1, 2])
batch.step(6)
print(*(batch.state_hash(i) for i in (4, 1, 2)))
"""
    made = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    assert made.stdout.split() == batch.state_hashes()


@pytest.mark.parametrize("file", ["arena.world", "cave.world", "hospital.world", "disperse.world"])
def test_shipped_worlds(file: str) -> None:
    """Also worlds of populations, and worlds that have not been stepped yet."""
    batch = st.Batch(file, 4, controllers=False, threads=2)
    _ = batch.cmd, batch.pose
    start, first = batch.state(), batch.state_hashes()
    batch.cmd[...] = [0.3, 0, 0.2]
    batch.step(20)
    later, state = batch.state_hashes(), batch.state()
    batch.load(start[::-1].copy())
    assert batch.state_hashes() == first[::-1]
    batch.load(start)
    batch.step(20)
    assert batch.state_hashes() == later
    assert (batch.state() == state).all()


def test_reseeded_worlds_keep_their_random_numbers() -> None:
    batch = odd_batch(4)
    batch.step(3)
    batch._core.reseed([5, 6, 7, 8])
    batch.step(2)
    state = batch.state()
    batch.step(9)
    later = batch.state_hashes()
    plain = odd_batch(4)
    plain.step(5)
    assert plain.state().shape[1] < state.shape[1]
    both = plain.state(0), plain.state_hash(0)
    plain.load(state)
    plain.step(9)
    assert plain.state_hashes() == later
    plain.load(both[0])
    assert plain.state_hashes() == [both[1]] * 4


def test_worlds_take_the_variants_of_their_states() -> None:
    batch = st.Batch("arena.world", n=6, variants=[{}, {"world.resolution": 0.04}], threads=2)
    other = st.Batch("arena.world", n=2, variants=[{"world.resolution": 0.04}, {}, {}], threads=1)
    for each in (batch, other):
        each.cmd[...] = [0.4, 0, 0.3]
        _ = each.ranges
        each.step(7)
    state, hashes = batch.state(), batch.state_hashes()
    batch.load(state[[0, 0, 1, 1, 2, 3]])
    assert batch.variant.tolist() == [0, 0, 1, 1, 0, 1]
    assert batch.state_hashes() == [hashes[i] for i in (0, 0, 1, 1, 2, 3)]
    batch.load(state)
    assert batch.variant.tolist() == [0, 1] * 3
    batch.step(5)
    later = batch.state_hashes()
    batch.load(state)
    batch.step(5)
    assert batch.state_hashes() == later
    other.load(state[[1, 0]])
    assert other.variant.tolist() == [0, 1]
    other.reset(variant=[2, 0])
    other.load(state[0], 0)
    assert other.variant.tolist() == [2, 0]  # of equal variants, a world keeps its own


def test_values_of_vary_belong_to_the_scene() -> None:
    batch, other = st.Batch("arena.world", n=3, threads=1), st.Batch("arena.world", n=3, threads=1)
    batch.vary("r*.mass", [1, 2, 3])
    batch.reset()
    batch.step(4)
    state, hashes = batch.state(), batch.state_hashes()
    batch.load(state[[2, 0, 1]])
    assert batch.state_hashes() == [hashes[i] for i in (2, 0, 1)]
    with pytest.raises(st.StageError, match="state 0 doesn't fit, because it is of another scene"):
        other.load(state)


def test_worlds_keep_the_values_of_their_states_until_a_reset() -> None:
    batch = odd_batch(3)
    batch.vary("bot.mass", [1, 5, 50])
    batch.vary("bot.ranger.noise[0]", [0.1, 0.2, 0.3])
    batch.vary("box.mass", [1, 5, 50])
    batch.reset()
    start = batch.state_hashes()
    batch.cmd[...] = [0.7, 0, 0.2]
    batch.step(9)
    state, hashes = batch.state(), batch.state_hashes()
    batch.step(9)
    later = batch.state_hashes()
    batch.load(state[[2, 0, 0]])
    assert batch.state_hashes() == [hashes[i] for i in (2, 0, 0)]
    forks = [batch.fork(i) for i in range(3)]
    batch.step(9)
    assert batch.state_hashes() == [later[i] for i in (2, 0, 0)]
    for fork in forks:
        fork.fleet().cmd[...] = [0.7, 0, 0.2]
        fork.step(9)
    assert [fork.state_hash() for fork in forks] == [later[i] for i in (2, 0, 0)]
    batch.reset()
    assert batch.state_hashes() == start


def test_states_that_do_not_fit_change_nothing(tmp_path: Path) -> None:
    batch, room = odd_batch(3, threads=1), st.Batch("arena.world", n=3, threads=1)
    batch.step(3)
    room.step(3)
    state, hashes = batch.state(), batch.state_hashes()
    for word in (0, 1, 2, 3, 4, 5, 40, -1):
        wrong = state.copy()
        wrong[2, word] ^= np.uint64(1 << 40)
        with pytest.raises(st.StageError, match="state 2 doesn't fit, because it was changed or cut off, or is none"):
            batch.load(wrong)
    for wrong in (state[:, :-1], np.zeros((3, 2), np.uint64), np.zeros((3, 0), np.uint64)):
        with pytest.raises(st.StageError, match="state 0 doesn't fit, because it was changed or cut off, or is none"):
            batch.load(wrong)
    with pytest.raises(st.StageError, match="state 0 doesn't fit, because it is of another scene: no variant of this "
                                            "batch has its world file, options and values of vary"):
        batch.load(room.state())
    for array in (state[:2], state[None]):
        with pytest.raises(ValueError, match=r"found states of shape .*, expected \(3, words\), or one for all"):
            batch.load(array)
    with pytest.raises(ValueError, match="found states of the type float64, expected uint64"):
        batch.load(state.astype(float))
    with pytest.raises(IndexError):
        batch.load(state[:1], [5])
    assert batch.state_hashes() == hashes
    batch.load(np.hstack([state, np.zeros((3, 5), np.uint64)]))  # as rows of a batch with longer states
    assert batch.state_hashes() == hashes


def test_open_and_failed_worlds_have_no_states() -> None:
    batch = st.Batch("simple.world", n=2, threads=1)
    reason = batch.explain()[0]
    assert reason
    with pytest.raises(st.StageError) as raised:
        batch.state()
    assert f"world 0 has no state as an array, because {reason}; use snapshot()" in str(raised.value)
    failing = odd_batch(3)
    state = failing.state()
    failing._core.set_failures({1: "for a test"})
    with pytest.raises(st.StageError, match="world 1 has failed: for a test"):
        failing.state()
    assert failing.state([0, 2]).shape[0] == 2
    failing.load(state)
    assert failing.failed == [None] * 3


def test_device_and_host_share_states() -> None:
    world = st.World.from_text(ODD.format(contacts='contacts "outlines"').replace("update_interval", "range_unused"))
    try:
        device = st.Batch.of(world, 5, device="opencl")
    except st.StageError as error:
        if "OpenCL" not in str(error):
            raise
        pytest.skip("there is no OpenCL device")
    host = st.Batch.of(world, 5, threads=1)
    for batch in (host, device):
        _ = batch.ranges
        batch.cmd[...] = np.array([0.5, 0, 0.4])
        batch.step(5)
    assert (host.state() == device.state()).all()
    state, ranges = host.state(), host.ranges.copy()
    for batch in (host, device):
        batch.step(4)
        batch.load(state[[4, 3, 2, 1, 0]])
        assert (np.asarray(batch.ranges) == ranges[[4, 3, 2, 1, 0]]).all()
        batch.step(6)
    assert host.state_hashes() == device.state_hashes()


def test_states_are_made_without_objects() -> None:
    batch = odd_batch(40)
    batch.step(2)
    batch.load(batch.state(1))
    assert batch._core.count_objects() == 0


def test_threads_that_share_a_batch() -> None:
    """Each call works or is refused, and the worlds stay those of the states."""
    batch = odd_batch(30)
    batch.step(3)
    state, hash_ = batch.state(4), batch.state_hash(4)
    calls = (lambda: batch.load(state), batch.state, lambda: batch.step(2, ids=range(10)))
    counts, wrong, end = [0] * len(calls), [], time.monotonic() + PATIENCE

    def work(i: int) -> None:
        while min(counts) < 20 and not wrong and time.monotonic() < end:
            try:
                calls[i]()
                counts[i] += 1
            except Exception as error:
                if "in use by another thread" not in str(error):
                    wrong.append(error)
            time.sleep(0)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []
    assert min(counts) >= 20
    batch.load(state)
    assert batch.state_hashes() == [hash_] * 30
