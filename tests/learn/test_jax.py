# SPDX-License-Identifier: GPL-2.0-or-later
"""Arrays go to JAX and back by DLPack, unchanged."""

from __future__ import annotations

import numpy as np
import pytest
from learning import WORLDS, Several, assert_both_ends, library, same, some_actions, vector
from stagesim.env import StageVectorEnv

jax = library("jax", "JAX")
import jax.numpy as jnp  # noqa: E402


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_it_returns_what_the_vector_environment_returns(mode: str) -> None:
    env, plain = vector(mode).to_jax(), vector(mode)
    assert env.num_envs == WORLDS and env.single_observation_space == plain.single_observation_space
    seen, expected = env.reset(seed=5)[0], plain.reset(seed=5)[0]
    assert isinstance(seen, jax.Array) and np.array_equal(seen, expected)
    ends = [[], []]
    for action in some_actions():
        outcome, wanted = env.step(jnp.asarray(action)), plain.step(action)
        assert all(isinstance(array, jax.Array) for array in outcome[:4])
        assert np.array_equal(outcome[0], wanted[0])
        assert outcome[1].dtype == jnp.float32 and np.array_equal(outcome[1], wanted[1].astype(np.float32))
        assert np.array_equal(outcome[2], wanted[2]) and np.array_equal(outcome[3], wanted[3])
        assert outcome[4].keys() == wanted[4].keys()
        ends[0].append(wanted[2]), ends[1].append(wanted[3])
        over = wanted[2] | wanted[3]
        if mode == "Disabled" and over.any():
            options = {"reset_mask": over}
            assert np.array_equal(env.reset(options=options)[0], plain.reset(options=options)[0])
    assert_both_ends(*ends)


def test_dictionaries_and_discrete_actions() -> None:
    env, plain = StageVectorEnv(3, task=Several()).to_jax(), StageVectorEnv(3, task=Several())
    assert same(env.reset(seed=2)[0], plain.reset(seed=2)[0])
    for step in range(20):
        actions = np.array([0, step, step // 2]) % 3
        seen, expected = env.step(jnp.asarray(actions))[0], plain.step(actions)[0]
        assert same(seen, expected) and isinstance(seen["picture"], jax.Array)


def test_what_jax_keeps_stays_as_it_is() -> None:
    """Later steps don't write into memory that JAX has been given."""
    env = vector("NextStep").to_jax()
    seen, _ = env.reset(seed=5)
    kept = [(seen, np.array(seen))]
    act = jax.jit(lambda given: jnp.tanh(given[:, :2]))
    for _ in range(20):
        seen, *_ = env.step(act(seen))
        kept.append((seen, np.array(seen)))
    assert all(np.array_equal(array, copy) for array, copy in kept)
    assert (kept[0][1] != kept[1][1]).any()


def test_actions_are_not_copied() -> None:
    action = jnp.ones((64, 2))
    assert np.from_dlpack(action).ctypes.data == action.unsafe_buffer_pointer()


def test_tensors_of_pytorch() -> None:
    library("torch", "PyTorch")
    env, plain = vector("NextStep", arrays="torch").to_jax(), vector("NextStep")
    assert np.allclose(env.reset(seed=5)[0], plain.reset(seed=5)[0], atol=1e-6)
    for action in some_actions():
        outcome, wanted = env.step(jnp.asarray(action)), plain.step(action)
        assert all(np.allclose(left, right, atol=1e-6) for left, right in zip(outcome[:4], wanted[:4]))


def test_numbers_of_64_bits() -> None:
    env, plain = vector("NextStep").to_jax(), vector("NextStep")
    jax.config.update("jax_enable_x64", True)
    try:
        env.reset(seed=5), plain.reset(seed=5)
        rewards = env.step(jnp.ones((WORLDS, 2)))[1]
        assert rewards.dtype == jnp.float64 and np.array_equal(rewards, plain.step(np.ones((WORLDS, 2)))[1])
    finally:
        jax.config.update("jax_enable_x64", False)
