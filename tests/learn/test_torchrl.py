# SPDX-License-Identifier: GPL-2.0-or-later
"""TorchRL's checks pass, and its tensordicts have what a StageVectorEnv returns."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from learning import WORLDS, Several, assert_both_ends, library, same, some_actions, vector
from stagesim.env import StageParallelEnv, StageVectorEnv, to_torchrl

library("torchrl", "TorchRL")
import torch  # noqa: E402
from torchrl.envs import EnvBase, RewardSum, StepCounter, TransformedEnv  # noqa: E402
from torchrl.envs.libs.pettingzoo import PettingZooWrapper  # noqa: E402
from torchrl.envs.utils import check_env_specs  # noqa: E402


def torchrl(**options: Any) -> Any:
    return vector("Disabled", **options).to_torchrl()


@pytest.mark.parametrize("task", ["Navigate", "Disperse", "Measured"])
def test_specifications(task: str) -> None:
    env = StageVectorEnv(3, task=task, autoreset_mode="Disabled").to_torchrl()
    assert isinstance(env, EnvBase)
    check_env_specs(env, seed=1)
    env.close()


def test_a_rollout_has_what_the_vector_environment_returns() -> None:
    """Worlds whose episodes are over are reset by TorchRL, in the middle of the episodes of others."""
    env, plain = torchrl(), vector("Disabled")
    env.set_seed(4)
    moves = some_actions()
    policy = iter(moves)
    data = env.rollout(len(moves), lambda observation: torch.from_numpy(next(policy)),
                       break_when_any_done=False)
    seen, _ = plain.reset(seed=4)
    for step, move in enumerate(moves):
        assert np.array_equal(data["observation"][:, step].numpy(), seen)
        seen, rewards, terminated, truncated, _ = plain.step(move)
        after = data["next"][:, step]
        assert np.array_equal(after["observation"].numpy(), seen)
        assert np.array_equal(after["reward"][:, 0].numpy(), rewards.astype(np.float32))
        assert np.array_equal(after["terminated"][:, 0].numpy(), terminated)
        assert np.array_equal(after["truncated"][:, 0].numpy(), truncated)
        assert np.array_equal(after["done"][:, 0].numpy(), terminated | truncated)
        if (over := terminated | truncated).any():
            seen, _ = plain.reset(options={"reset_mask": over})
    assert_both_ends(data["next", "terminated"], data["next", "truncated"])


@pytest.mark.parametrize("world", ["navigate.world", "arena.world"])
def test_dictionaries_and_discrete_actions(world: str) -> None:
    """One robot has one choice, several robots of a team have one each."""
    env, plain = (StageVectorEnv(3, world, Several(), autoreset_mode="Disabled") for _ in range(2))
    adapted = env.to_torchrl()
    check_env_specs(adapted)
    adapted.set_seed(2)
    data = adapted.rollout(30, break_when_any_done=False)
    assert same({name: data[name][:, 0] for name in ("goal", "picture")}, plain.reset(seed=2)[0])
    ends = 0
    for step in range(30):
        seen, rewards, terminated, truncated, _ = plain.step(data["action"][:, step].numpy())
        after = data["next"][:, step]
        assert same({name: after[name] for name in ("goal", "picture")}, seen)
        assert same(after["reward"][:, 0], rewards.astype(np.float32))
        assert same(after["terminated"][:, 0], terminated) and same(after["truncated"][:, 0], truncated)
        if (over := terminated | truncated).any():
            ends += over.sum()
            plain.reset(options={"reset_mask": over})
    assert ends > 3


def test_seeds() -> None:
    env = torchrl()
    env.set_seed(1)
    first, second = env.reset()["observation"], env.reset()["observation"]
    assert (first != second).any(), "without a new seed another episode follows"
    env.set_seed(1)
    assert torch.equal(env.reset()["observation"], first)


def test_transforms() -> None:
    env = TransformedEnv(torchrl())
    env.append_transform(StepCounter())
    env.append_transform(RewardSum())
    data = env.rollout(40, break_when_any_done=False)
    assert data["next", "step_count"].max() <= 12 and data["next", "episode_reward"].shape == (WORLDS, 40, 1)


def test_tensors_of_pytorch() -> None:
    """With tensors in the environment, nothing is converted to NumPy; the results are the same."""
    given = []
    for options in ({}, {"arrays": "torch"}):
        env = torchrl(**options)
        env.set_seed(4)
        policy = iter(some_actions())
        given.append(env.rollout(30, lambda observation: torch.from_numpy(next(policy)),
                                 break_when_any_done=False))
    assert torch.allclose(given[0]["next", "observation"], given[1]["next", "observation"], atol=1e-6)
    assert torch.equal(given[0]["next", "done"], given[1]["next", "done"])


def test_pettingzoo() -> None:
    """TorchRL's own wrapper takes the parallel environment."""
    env = PettingZooWrapper(StageParallelEnv(task="Disperse"))
    check_env_specs(env)
    assert {"r0", "r5"} <= set(env.rollout(5).keys())


def test_other_autoreset_modes_are_refused() -> None:
    with pytest.raises(ValueError, match='found autoreset_mode="SameStep", expected "Disabled", which to_torchrl'):
        to_torchrl(vector("SameStep"))
