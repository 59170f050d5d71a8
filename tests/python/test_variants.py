# SPDX-License-Identifier: GPL-2.0-or-later
"""Worlds of one batch that differ: variants."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest
import stagesim as st

BOT = ("define bot position( size [0.3 0.3 0.3] ranger( pose [0 0 -0.2 0] sensor( range [0 4] fov 360 samples {} ) ) )\n"
       "model( size [9 0.1 1] pose [0 {} 0 0] )\n")
TEXTS = [BOT.format(12, 2) + 'bot( name "a" )\nbot( name "b" pose [1 0 0 0] )\n',
         BOT.format(20, 1) + 'bot( name "c" )\nbot( name "b" pose [1 0 0 0] )\n',
         BOT.format(8, 1) + 'bot( name "a" )\nposition( name "d" pose [-2 0 0 0] gripper() )\n']  # not closed
ROBOTS = ["ab", "cb", "ad"]
VARIANTS = [0, 1, 2, 0, 1, 2, 2]


def worlds() -> list[st.World]:
    return [st.World.from_text(text) for text in TEXTS]


def drive(batch: st.Batch, steps: int = 20) -> None:
    _ = batch.ranges  # so that rangers run
    batch.cmd[...] = [.5, 0, .3]
    batch.step(steps)


def alone(variant: int, seed: int, steps: int = 20) -> tuple[str, st.Fleet]:
    """The state hash and the robots of a world of the variant by itself."""
    world = st.World.from_text(TEXTS[variant], seed=seed)
    fleet = world.fleet()
    fleet.cmd[...] = [.5, 0, .3]
    _ = fleet.ranger(0).ranges
    world.step(steps)
    return world.state_hash(), fleet


def check(batch: st.Batch) -> None:
    """Each world has the state and the readings of the same world alone; robots that it lacks have none."""
    ranges = np.array(batch.ranges)
    hashes = batch.state_hashes()
    for i, variant in enumerate(batch.variant.tolist()):
        state_hash, fleet = alone(variant, batch.seeds[i])
        assert hashes[i] == state_hash
        for k, name in enumerate(batch.names):
            if name not in ROBOTS[variant]:
                assert np.isnan(batch.pose[i, k]).all() and np.isnan(ranges[i, k]).all() and not batch.stalled[i, k]
                continue
            own = fleet.names.index(name)
            assert (batch.pose[i, k] == fleet.pose[own]).all()
            expected = fleet.ranger(0).ranges[own]
            assert np.array_equal(ranges[i, k, :len(expected)], expected, equal_nan=True)
            assert np.isnan(ranges[i, k, len(expected):]).all()


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_worlds_equal_those_alone(threads: int) -> None:
    batch = st.Batch.of(worlds(), len(VARIANTS), variant=VARIANTS, seeds=range(5, 12), threads=threads)
    assert batch.names == ("a", "c", "b", "d") and batch.variant.tolist() == VARIANTS
    assert [reason is None for reason in batch.explain()] == [variant != 2 for variant in VARIANTS]
    assert batch.ranges.shape == (7, 4, 20) and batch.stalled.dtype == bool
    drive(batch)
    check(batch)


def test_resets_change_variants() -> None:
    batch = st.Batch.of(worlds(), 7)
    assert batch.variant.tolist() == [0, 1, 2, 0, 1, 2, 0]
    drive(batch)
    for ids, variant in (([0, 1, 5], [1, 2, 0]), (None, 2), (None, VARIANTS), ([6], 0)):
        batch.reset(3, ids=ids, variant=variant)
        chosen = slice(None) if ids is None else ids
        assert (batch.variant[chosen] == variant).all()
        assert (batch.time[chosen] == 0).all()
        batch.reset(4)  # which keeps the variants
        assert (batch.variant[chosen] == variant).all()
        drive(batch)
        check(batch)


def test_arrays_fit_variants_that_no_world_has_yet() -> None:
    batch = st.Batch.of(worlds(), 3, variant=0)
    assert batch.ranges.shape == (3, 4, 20)
    batch.reset(variant=[2, 1, 1])
    drive(batch)
    check(batch)


def test_many_variants() -> None:
    texts = [BOT.format(12, 1 + i) + "bot()\n" for i in range(100)]
    batch = st.Batch.of([st.World.from_text(text) for text in texts], 1000, seeds=[1] * 1000)
    drive(batch)
    hashes = batch.state_hashes()
    for i in range(100):
        assert len(set(hashes[i::100])) == 1
    assert len(set(hashes)) == 100
    up = batch.ranges[:, 0].max(1)
    batch.reset(variant=np.roll(batch.variant, 1))
    drive(batch)
    assert np.array_equal(batch.ranges[:, 0].max(1), np.roll(up, 1), equal_nan=True)


def test_settings_of_variants(tmp_path: Path) -> None:
    file = tmp_path / "swarm.world"
    file.write_text("define bot position( size [0.2 0.2 0.3] )\n"
                    'population( name "robots" model "bot" count 2 area [0 0 4 4] )\n')
    batch = st.Batch(file, 4, variants=[{"robots": 3}, {"robots": 5}], settings=["world.resolution=0.05"])
    assert (~np.isnan(batch.pose[:, :, 0])).sum(1).tolist() == [3, 5, 3, 5]
    assert st.Batch(file, 2, variants=[{}]).pose.shape == (2, 2, 3)


def test_copies() -> None:
    batch = st.Batch.of(worlds(), 7, variant=VARIANTS)
    drive(batch)
    batch.reset(9, ids=[0, 1], variant=[1, 0])
    drive(batch)
    for other in (copy.deepcopy(batch), pickle.loads(pickle.dumps(batch))):
        assert other.state_hashes() == batch.state_hashes()
        assert other.variant.tolist() == batch.variant.tolist() and other.names == batch.names
    for i in range(7):
        fork = batch.fork(i)
        assert fork.state_hash() == batch.state_hash(i)
        assert pickle.loads(pickle.dumps(fork)).state_hash() == batch.state_hash(i)


def test_snapshots_fit_worlds_of_the_same_variant() -> None:
    batch = st.Batch.of(worlds(), 7, variant=VARIANTS)
    drive(batch)
    state, hash_then = batch.snapshot(0), batch.state_hash(0)
    drive(batch)
    batch.restore(state, [0, 3, 2])
    assert batch.state_hash(0) == batch.state_hash(3) == hash_then
    assert batch.failed[0] is None and batch.failed[2] is not None
    batch.reset(ids=[2])
    assert batch.failed[2] is None


def test_absent_robots_ignore_commands_and_poses() -> None:
    batch = st.Batch.of(worlds(), 3)
    batch.teleport([9, 9, 0])
    assert np.isnan(batch.pose[0, [1, 3]]).all() and (batch.pose[0, [0, 2], 0] == 9).all()


def test_mistakes_are_told() -> None:
    made = worlds()
    batch = st.Batch.of(made, 3)
    with pytest.raises(ValueError, match=r"^found a variant outside of 0 to 2$"):
        batch.reset(variant=3)
    with pytest.raises(ValueError, match=r"^found variants of shape \(2,\), expected \(3,\)$"):
        batch.reset(variant=[0, 1])
    with pytest.raises(TypeError, match=r"^found variants of the type float64, expected whole numbers$"):
        batch.reset(variant=1.5)
    with pytest.raises(ValueError, match="^found no variants, expected one or more$"):
        st.Batch.of([], 3)
    with pytest.raises(st.GoneError):
        st.Batch.of(made, 3, robots="nobody")
    assert st.Batch.of(made, 3, robots="c").names == ("c",)


def test_a_device_steps_the_variants_that_it_can() -> None:
    texts = ['contacts "cells"\n' + text for text in TEXTS]
    made = [st.World.from_text(text) for text in texts]
    seeds = range(10, 10 + len(VARIANTS))
    try:
        there = st.Batch.of(made, len(VARIANTS), variant=VARIANTS, seeds=seeds, device="opencl")
    except st.StageError as error:
        pytest.skip(str(error))
    here = st.Batch.of(made, len(VARIANTS), variant=VARIANTS, seeds=seeds)
    for batch in (here, there):
        drive(batch)
        batch.reset(ids=[0, 3], variant=[1, 1])
        batch.step(5)
        batch.cmd[1] = [.1, 0, -.4]
        batch.step(7, ids=[0, 1, 2])
    assert there.state_hashes() == here.state_hashes()
    for name in ("pose", "ranger.ranges", "stalled"):
        assert np.array_equal(there.array(name), here.array(name), equal_nan=name != "stalled")
    recorded = [batch.rollout(moments=3, n=4) for batch in (here, there)]
    assert np.array_equal(recorded[0]["pose"], recorded[1]["pose"], equal_nan=True)
