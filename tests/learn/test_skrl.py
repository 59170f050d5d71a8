# SPDX-License-Identifier: GPL-2.0-or-later
"""skrl's own wrappers take Stage's environments."""

from __future__ import annotations

import numpy as np
from learning import WORLDS, assert_both_ends, library, some_actions, vector
from stagesim.env import StageParallelEnv

library("skrl", "skrl")
import torch  # noqa: E402
from skrl.envs.wrappers.torch import wrap_env  # noqa: E402


def test_it_gets_what_the_vector_environment_returns() -> None:
    env, plain = wrap_env(vector("SameStep"), verbose=False), vector("SameStep")
    env._seed = 5  # noqa: SLF001: skrl takes it from its configuration
    assert env.num_envs == WORLDS and env.observation_space == plain.single_observation_space
    seen, expected = env.reset()[0], plain.reset(seed=5)[0]
    assert np.array_equal(seen.numpy(), expected)
    ends: tuple[list, list] = ([], [])
    for action in some_actions():
        outcome, wanted = env.step(torch.from_numpy(action)), plain.step(action)
        assert np.array_equal(outcome[0].numpy(), wanted[0])
        assert np.array_equal(outcome[1][:, 0].numpy(), wanted[1].astype(np.float32))
        for i in (2, 3):
            assert np.array_equal(outcome[i][:, 0].numpy(), wanted[i])
            ends[i - 2].append(wanted[i])
    assert_both_ends(*ends)


def test_robots_as_agents() -> None:
    env, plain = wrap_env(StageParallelEnv(task="Disperse"), verbose=False), StageParallelEnv(task="Disperse")
    env._seed = 5  # noqa: SLF001
    seen, expected = env.reset()[0], plain.reset(seed=5)[0]
    assert seen.keys() == expected.keys()
    for action in some_actions((1, 2), 10):
        outcome = env.step({agent: torch.from_numpy(action) for agent in env.possible_agents})
        wanted = plain.step({agent: action[0] for agent in plain.agents})
        assert all(np.array_equal(outcome[0][agent][0].numpy(), wanted[0][agent]) for agent in wanted[0])
        assert all(outcome[1][agent].item() == np.float32(wanted[1][agent]) for agent in wanted[1])
