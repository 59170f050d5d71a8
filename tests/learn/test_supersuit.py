# SPDX-License-Identifier: GPL-2.0-or-later
"""SuperSuit's wrappers and its vectorization take the parallel environment."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from learning import library, short, some_actions
from stagesim.env import StageParallelEnv

supersuit = library("supersuit", "SuperSuit")
from pettingzoo.test import parallel_api_test, parallel_seed_test  # noqa: E402


def robots() -> StageParallelEnv:
    """Five robots; some are at their goals before the others."""
    return StageParallelEnv("arena.world", short())


def test_vectorization_shows_each_robot() -> None:
    """Each agent has a row, which is zero after its end, and episodes begin anew when all have ended."""
    vectorized = supersuit.pettingzoo_env_to_vec_env_v1(supersuit.black_death_v3(robots()))
    plain = robots()
    agents = plain.possible_agents
    seen, expected = vectorized.reset(seed=3)[0], plain.reset(seed=3)[0]
    assert np.array_equal(seen, np.stack([expected[agent] for agent in agents]))
    ended_before_others = 0
    for action in some_actions((len(agents), 2), 12):
        seen, rewards, terminated, truncated, _ = vectorized.step(action)
        alive = set(plain.agents)
        expected, gains, _, _, _ = plain.step({agent: action[agents.index(agent)] for agent in alive})
        for row, agent in enumerate(agents):
            assert np.array_equal(seen[row], expected.get(agent, np.zeros_like(seen[row])))
            assert np.float32(rewards[row]) == np.float32(gains.get(agent, 0))
        assert not (terminated | truncated).any()
        ended_before_others += len(agents) - len(plain.agents)
    assert ended_before_others > 0
    assert not plain.agents, "SuperSuit tells of the end one step later"
    seen, _, terminated, truncated, _ = vectorized.step(some_actions((len(agents), 2))[0])
    assert (terminated | truncated).all() and seen.any(1).all(), "the next episode has begun"


def test_concatenated_environments_for_sb3() -> None:
    library("stable_baselines3", "Stable-Baselines3")
    vectorized = supersuit.pettingzoo_env_to_vec_env_v1(supersuit.black_death_v3(robots()))
    env = supersuit.concat_vec_envs_v1(vectorized, 3, base_class="stable_baselines3")
    assert env.reset().shape == (15, 37)
    for action in some_actions((15, 2)):
        seen, rewards, dones, infos = env.step(action)
        assert seen.shape == (15, 37) and rewards.shape == dones.shape == (15,) and len(infos) == 15


@pytest.mark.parametrize("wrapped", [
    lambda env: supersuit.black_death_v3(env),
    lambda env: supersuit.frame_stack_v1(env, 3),
    lambda env: supersuit.dtype_v0(env, np.float64),
    lambda env: supersuit.clip_reward_v0(env, -1, 1),
    lambda env: supersuit.agent_indicator_v0(env),
    lambda env: supersuit.normalize_obs_v0(env),
    lambda env: supersuit.delay_observations_v0(env, 2),
], ids=["black_death", "frame_stack", "dtype", "clip_reward", "agent_indicator", "normalize_obs", "delay_observations"])
def test_wrappers(wrapped: Any) -> None:
    """PettingZoo's own checks pass behind each wrapper."""
    parallel_api_test(wrapped(robots()), 40)
    parallel_seed_test(lambda: wrapped(robots()), 20)
