# SPDX-License-Identifier: GPL-2.0-or-later
"""Values that differ between worlds on a device: everything equals worlds on the host, to the bit."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import stagesim as st
from test_device_batch import Comparison, device
from test_vary import Columns, alone, check, drive, kind, made

__all__ = ["device"]


def pair(n: int, device: str, **properties: Any) -> tuple[st.Batch, st.Batch]:
    """Returns equal worlds on the host and on a device."""
    of = made(kind, **properties)
    return st.Batch.of(of, n), st.Batch.of(of, n, device=device)


@pytest.mark.parametrize("n", [1, 33, 200])
@pytest.mark.parametrize("contacts", ["outlines", "cells"])
def test_all_columns_and_states_are_those_of_the_host(contacts: str, n: int, device: str) -> None:
    batches = pair(n, device, contacts=contacts, ray_model="exact" if n == 33 else "cell")
    both = Comparison(batches)
    random = np.random.default_rng(n)
    stalls = moves = 0
    for moment in range(17):
        if moment % 8 == 0:
            columns = Columns(n, moment + n)
            for batch in batches:
                columns.vary(batch)
            both.check("values that wait")
            both.do("reset", random.integers(0, 99, n), ids=random.permutation(n))
        what = both.act(random)
        both.check(f"{moment}: {what}")
        if moment % 8 == 5:  # some worlds get other values, the others keep theirs
            both.do("vary", "ranger.noise[0]", random.uniform(0, 1e-3, n))
            both.do("vary", "r*.mass", random.uniform(1, 30, (n, 3)))
            both.do("reset", ids=random.random(n) < .5)
        both.step(random)
        both.check(f"{moment}: {what}, step")
        stalls += np.asarray(both.arrays[1]["stalled"]).sum()
        moves += (np.asarray(both.arrays[1]["velocity"]) != 0).sum()
    assert batches[1].failed == [None] * n and len(set(batches[1].variant)) == 1
    assert moves > 20 and (n == 1 or stalls > 0)


def test_worlds_equal_those_of_their_values_alone(device: str) -> None:
    batch = pair(3, device, contacts="cells")[1]
    for episode in range(2):
        columns = Columns(3, episode)
        columns.vary(batch)
        batch.reset(np.arange(3) + 10 * episode)
        check(batch, [columns.scene(i, contacts="cells") for i in range(3)], 15)
    for name in batch.varied:
        batch.vary(name, None)
    batch.reset(6)
    check(batch, [made(kind, contacts="cells")] * 3, 9)
    assert batch.variant.tolist() == [0] * 3


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda batch: pickle.loads(pickle.dumps(batch))])
def test_copies_forks_states_and_later_resets_keep_the_values(duplicate: Callable[[st.Batch], st.Batch], device: str) -> None:
    columns = Columns(4, 3)
    batch = pair(4, device)[1]
    columns.vary(batch)
    batch.reset(5)
    drive(batch)
    batch.step(6)
    states, hashes, kept, fork = batch.state(), batch.state_hashes(), batch.snapshot(1), batch.fork(1)
    copied = duplicate(batch)
    assert isinstance(batch.cmd, type(copied.cmd)) and copied.device == batch.device
    assert copied.varied.keys() == batch.varied.keys()
    batch.step(5)
    copied.step(5)
    fork.step(5)
    assert copied.state_hashes() == batch.state_hashes() and fork.state_hash() == batch.state_hash(1)
    batch.load(states[[1, 2, 3, 0]])
    assert batch.state_hashes() == [hashes[i] for i in (1, 2, 3, 0)]
    batch.restore(kept, [0, 3])
    batch.step(5)
    assert batch.state_hash(0) == batch.state_hash(3) == fork.state_hash()
    for each in (batch, copied):
        each.reset(7, ids=[0, 2])
        drive(each)
        each.step(9)
        for i in (0, 2):
            assert each.state_hash(i) == alone(columns.scene(i), 7, 9), i


def test_controllers_and_random_odometry_go_on(device: str) -> None:
    def wandering(noise: float, mass: float) -> Any:
        return made(lambda k: {"localization": "odom", "odom_noise": [noise] * 4, "mass": mass, "ctrl": "stage/wander"})

    batch = st.Batch.of(wandering(.1, 3), 3, device=device)
    batch.vary("r*.odom_noise", np.array([0, .1, 0]).reshape(3, 1, 1) * np.ones(4))
    batch.vary("r*.mass", [1., 2, 3])
    batch.reset(4)
    batch.step(60)
    worlds = [wandering(noise, mass) for noise, mass in ((0, 1.), (.1, 2.), (0, 3.))]
    assert batch.state_hashes() == [alone(of, 4, 60, False) for of in worlds]


def test_variants_on_a_device_have_columns(device: str) -> None:
    """Arrays of batches of several variants are on the host."""
    of = made(kind), made(kind, seed=3)
    batch = st.Batch.of(of, 4, device=device)
    columns = Columns(4, 9)
    columns.vary(batch)
    batch.reset(3)
    assert len(set(batch.variant)) == 2
    check(batch, [columns.scene(i, 3 * (i % 2)) for i in range(4)], 12)


def test_mistakes_are_told(device: str) -> None:
    batch = pair(3, device)[1]
    before = batch.state_hashes()
    with pytest.raises(st.StageError, match=r"^vary\('r\*.size'\): the worlds of this batch are on a device and share a scene, "
                       "in which 'size' can't differ; make the batch from two scenes or more$"):
        batch.vary("r*.size", np.full((3, 1, 3), .2))
    assert batch.varied == {}
    assert batch.state_hashes() == before


@pytest.mark.parametrize("action_delay", [0, 2])
def test_environments_vary_on_a_device(action_delay: int, device: str) -> None:
    pytest.importorskip("gymnasium")
    from stagesim import env as stage_env

    host, other = (stage_env.StageVectorEnv(5, task=stage_env.Navigate(limit=6), device=on, arrays="numpy",
                                            action_delay=action_delay) for on in (None, device))
    random = np.random.default_rng(1)
    for episode in range(3):
        noise, mass = random.uniform(0, .01, 5), random.uniform(5, 15, 5)
        for each in (host, other):
            each.vary("ranger.noise[0]", noise)
            each.vary("position.mass" if episode < 2 else "position.wheel_slip", mass / (1 if episode < 2 else 15))
        if episode == 0:
            first, second = host.reset(seed=4)[0], other.reset(seed=4)[0]
        for _ in range(15):
            assert first.tobytes() == second.tobytes()
            actions = random.uniform(-1, 1, host.action_space.shape).astype(np.float32)
            mine, their = host.step(actions), other.step(actions)
            assert mine[1].tobytes() == their[1].tobytes()
            first, second = mine[0], their[0]


def test_states_that_would_need_several_scenes_are_refused_before_any_change(device: str) -> None:
    batch = pair(3, device)[1]
    plain = batch.state()
    assert batch.ranges.shape == (3, 3, 9)
    batch.step()
    with_rangers, hashes, ranges = batch.state(), batch.state_hashes(), np.array(batch.ranges)
    batch.vary("r*.mass", [1., 2, 3])
    batch.reset(5)
    drive(batch)
    batch.step(2)
    before = batch.state_hashes()
    for states in (plain, with_rangers):
        with pytest.raises(st.StageError, match="^worlds on a device have the same sensors in use and the same properties that"):
            batch.load(states[[1, 2]], [2, 0])
        assert batch.state_hashes() == before
    batch.step(2)
    batch.load(with_rangers[::-1], [2, 1, 0])
    assert batch.state_hashes() == hashes and np.array_equal(batch.ranges, ranges) and np.isfinite(ranges).all()
    batch.load(plain)
    assert batch.variant.tolist() == [0] * 3 and np.isnan(batch.ranges).all()
    batch.reset(8)
    check(batch, [made(lambda k, mass=mass: {**kind(k), "mass": mass}) for mass in (1., 2., 3.)], 6)
    assert np.isfinite(batch.ranges).all()


@pytest.mark.parametrize("n", [2, 33])
def test_properties_begin_and_cease_to_vary_in_some_worlds_while_others_go_on(n: int, device: str) -> None:
    batches = pair(n, device)
    both = Comparison(batches)
    random, noisy = np.random.default_rng(n), False
    columns = Columns(n, 1)
    given = {**{f"r*.{name}": values for name, values in columns.robots.items()}, "ranger.noise": columns.noise,
             **{f"r2.{name}": values for name, values in columns.cars.items()}, "crate.mass": columns.crate[:, 0]}
    both.do("vary", "r*.odom_noise", np.full((n, 3, 4), .05))
    for moment in range(18):
        for name in random.choice(list(given), 2, replace=False):
            is_over = name in batches[0].varied and random.random() < .4
            both.do("vary", name, None if is_over else given[name])
        ids = random.random(n) < .5
        ids[-1] = moment == 0  # the last world is never reset again
        both.do("reset", *([moment] if moment % 3 else []), ids=ids)
        both.check(f"{moment}: reset")
        both.step(random)
        both.step(random)
        both.check(f"{moment}: step")
        if moment % 8 == 5:
            batches = batches[0], pickle.loads(pickle.dumps(batches[1]))
            both = Comparison(batches)
        if moment % 4 == 1:
            forks = [batch.fork(n - 1) for batch in batches]
            for fork in forks:
                fork.step(3)
            assert forks[0].state_hash() == forks[1].state_hash()
            mine, their = (fork.fleet().estimate_covariance for fork in forks)
            assert np.array_equal(mine, their, equal_nan=True)
            noisy = noisy or bool((mine > 0).any())
    assert noisy
    assert batches[1].failed == [None] * n and len(set(batches[1].variant)) == 1 < len(set(batches[0].variant))
