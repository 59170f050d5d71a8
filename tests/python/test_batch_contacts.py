# SPDX-License-Identifier: GPL-2.0-or-later
"""Contacts, bumpers and fiducial finders of the worlds of a batch are those of worlds of their own."""

from __future__ import annotations

import numpy as np
import pytest
import stagesim as st

CROWD = """
resolution 0.05
contacts "outlines"
define bot position( size [0.4 0.4 0.4] bumper( bcount 2 bpose[0] [0.21 0 0 0] blength 0.3 bpose[1] [-0.21 0 0 180] ) fiducial( range_max 5 fov 300 ) fiducial_return 3 )
model( name "wall" pose [1.5 0 0 0] size [1 10 1] )
model( name "crate" pose [0.5 1.2 0 0] size [0.4 0.4 0.4] pushable 1 mass 2 )
bot( name "a" pose [0 0 0 0] ) bot( name "b" pose [0 1.2 0 0] ) bot( name "c" pose [-1 0 0 0] )
bot( name "d" pose [-3 -3 0 0] )
"""


def crowd(n: int = 6, threads: int = 2) -> st.Batch:
    """Worlds in which robots drive to the wall, a robot and a crate, and one turns."""
    batch = st.Batch.of(st.World.from_text(CROWD), n, threads=threads)
    _ = batch.bumper(), batch.fiducials().id
    batch.cmd[:, :3, 0] = np.linspace(0.2, 0.5, n)[:, None]
    batch.cmd[:, 3, 2] = 0.5
    return batch


def test_contacts_equal_those_of_worlds() -> None:
    batch = crowd()
    assert (batch.contacts().models == -1).all()
    seen = set()
    for _ in range(8):
        batch.step(10)
        found = batch.contacts(most=20)
        for i in range(batch.n):
            alone = batch.fork(i).contacts()
            count = len(alone.gaps)
            assert count < 20
            assert (found.models[i, :count] == alone.models).all()
            assert (found.points[i, :count] == alone.points).all()
            assert (found.normals[i, :count] == alone.normals).all()
            assert (found.gaps[i, :count] == alone.gaps).all()
            assert (found.models[i, count:] == -1).all() and (found.robots[i, count:] == -1).all()
            assert np.isnan(found.points[i, count:]).all() and np.isnan(found.gaps[i, count:]).all()
        by_id = {model.id: model.name for model in batch.fork(0).models}
        for pair, robots in zip(found.models.reshape(-1, 2).tolist(), found.robots.reshape(-1, 2).tolist()):
            for model, robot in zip(pair, robots):
                if model >= 0:
                    name = by_id[model]
                    assert robot == (batch.names.index(name) if name in batch.names else -1)
            if min(pair) >= 0:
                seen.add(frozenset(by_id[model] for model in pair))
    assert {frozenset(("a", "wall")), frozenset(("b", "crate")), frozenset(("a", "c"))} <= seen
    assert batch._core.count_objects() == 0  # noqa: SLF001


def test_fewer_contacts_and_fewer_worlds_can_be_asked_for() -> None:
    batch = crowd()
    batch.step(80)
    hashes, all_ = batch.state_hashes(), batch.contacts()
    first = batch.contacts(1, ids=[4, 1])
    assert first.models.shape == (2, 1, 2) and first.gaps.shape == (2, 1)
    assert (first.models == all_.models[[4, 1], :1]).all() and (first.normals == all_.normals[[4, 1], :1]).all()
    assert batch.contacts(0).models.shape == (6, 0, 2)
    assert batch.state_hashes() == hashes
    with pytest.raises(ValueError, match="found -1 as most"):
        batch.contacts(-1)
    cells = st.Batch.of(st.World.from_text(CROWD.replace("outlines", "cells")), 2, threads=1)
    cells.cmd[..., 0] = 0.5
    cells.step(40)
    assert (cells.contacts().models == -1).all()


def test_bumpers_and_fiducials_of_rows_equal_those_of_worlds() -> None:
    batch = crowd()
    worlds = [st.World.from_text(CROWD, seed=seed) for seed in batch.seeds]
    fleets = [world.fleet() for world in worlds]
    for i, fleet in enumerate(fleets):
        _ = fleet.bumper(), fleet.fiducials().id
        fleet.cmd[...] = batch.cmd[i]
    hits = seen = 0
    for _ in range(20):
        batch.step(4)
        for i, (world, fleet) in enumerate(zip(worlds, fleets)):
            world.step(4)
            assert (batch.bumper()[i] == fleet.bumper()).all()
            assert (batch.fiducials().id[i] == fleet.fiducials().id).all()
            assert np.array_equal(batch.fiducials().range[i], fleet.fiducials().range, equal_nan=True)
        hits += int(batch.bumper().any())
        seen += int((batch.fiducials().id == 3).any())
    assert batch._core.count_objects() == 0  # noqa: SLF001
    assert hits > 5 and seen > 5
