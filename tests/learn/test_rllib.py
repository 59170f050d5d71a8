# SPDX-License-Identifier: GPL-2.0-or-later
"""RLlib makes a StageVectorEnv by the name of the environment, and its episodes have what that returns."""

from __future__ import annotations

from typing import Any, Iterator

import numpy as np
import pytest
from learning import library
from stagesim.env import StageParallelEnv, StageVectorEnv

library("ray.rllib", "RLlib")
import ray  # noqa: E402
from ray.rllib.algorithms.ppo import PPOConfig  # noqa: E402
from ray.rllib.env.single_agent_env_runner import SingleAgentEnvRunner  # noqa: E402
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv  # noqa: E402
from ray.rllib.utils.pre_checks.env import check_multiagent_environments  # noqa: E402


@pytest.fixture
def runner() -> Iterator[SingleAgentEnvRunner]:
    config = (PPOConfig().environment("stagesim.env:Stage/Navigate-v0")
              .env_runners(num_env_runners=0, num_envs_per_env_runner=4, gym_env_vectorize_mode="vector_entry_point")
              .debugging(seed=3))
    algorithm = config.build_algo()
    yield algorithm.env_runner
    algorithm.stop()
    ray.shutdown()


def test_episodes_have_what_the_vector_environment_returns(runner: SingleAgentEnvRunner,
                                                           monkeypatch: pytest.MonkeyPatch) -> None:
    env = runner.env.unwrapped
    assert type(env) is StageVectorEnv and env.num_envs == 4
    env.task.limit, env.task.goal_radius = 12, 1.5
    transitions: set[Any] = set()
    over = np.zeros(4, bool)
    step = env.step

    def recorded(actions: Any) -> Any:
        """Records the transitions of all worlds that the step does not begin anew."""
        nonlocal over
        outcome = step(actions)
        transitions.update((outcome[0][i].tobytes(), float(outcome[1][i])) for i in np.flatnonzero(~over))
        over = outcome[2] | outcome[3]
        return outcome

    monkeypatch.setattr(env, "step", recorded)
    found = set()
    ends = [0, 0]
    for episode in runner.sample(num_timesteps=160, random_actions=True):
        seen, rewards = np.asarray(episode.get_observations()), np.asarray(episode.get_rewards())
        assert len(seen) == len(rewards) + 1
        found |= {(row.astype(np.float32).tobytes(), float(reward)) for row, reward in zip(seen[1:], rewards)}
        ends[0] += episode.is_terminated
        ends[1] += episode.is_truncated
    assert found == transitions and len(found) >= 150
    assert ends[1] >= 3


def test_robots_as_agents() -> None:
    """RLlib's checks of environments with several agents pass."""
    env = ParallelPettingZooEnv(StageParallelEnv(task="Disperse"))
    check_multiagent_environments(env)
    seen, _ = env.reset(seed=1)
    assert len(seen) == 6
    outcome = env.step({agent: np.zeros(2, np.float32) for agent in seen})
    assert outcome[2].keys() >= {"__all__"}
