# SPDX-License-Identifier: GPL-2.0-or-later
"""Stable-Baselines3 sees the worlds of a StageVectorEnv as its own environments would show them."""

from __future__ import annotations

import pickle
import warnings
from typing import Any

import numpy as np
import pytest
from learning import WORLDS, Several, assert_both_ends, library, same, short, some_actions, vector
from stagesim.env import StageEnv, StageVectorEnv, to_sb3

library("stable_baselines3", "Stable-Baselines3")
from stable_baselines3 import PPO  # noqa: E402
from stable_baselines3.common.evaluation import evaluate_policy  # noqa: E402
from stable_baselines3.common.monitor import Monitor  # noqa: E402
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecFrameStack, VecNormalize  # noqa: E402


def sb3(**options: Any) -> Any:
    return vector("SameStep", **options).to_sb3()


def test_it_shows_what_sb3_shows_of_single_environments() -> None:
    """Observations, rewards, ends and infos are those of SB3's own DummyVecEnv with a Monitor, to the bit."""
    ours = sb3()
    theirs = DummyVecEnv([lambda: Monitor(StageEnv(task=short())) for _ in range(WORLDS)])
    assert ours.seed(7) == theirs.seed(7)
    assert ours.observation_space == theirs.observation_space and ours.action_space == theirs.action_space
    assert np.array_equal(ours.reset(), theirs.reset())
    terminated, truncated = [], []
    for action in some_actions():
        mine, other = ours.step(action), theirs.step(action)
        for left, right in zip(mine[:3], other[:3]):
            assert np.array_equal(left, right) and left.dtype == right.dtype and left.shape == right.shape
        for i in np.flatnonzero(mine[2]):
            info, expected = dict(mine[3][i]), dict(other[3][i])
            assert np.array_equal(info.pop("terminal_observation"), expected.pop("terminal_observation"))
            episode, monitored = info.pop("episode"), expected.pop("episode")
            assert episode["r"] == pytest.approx(monitored["r"], abs=1e-6) and episode["l"] == monitored["l"]
            assert info == expected
            truncated.append(info["TimeLimit.truncated"])
            terminated.append(info["is_success"])
    assert_both_ends(terminated, truncated)


def test_the_values_of_all_worlds_are_arrays() -> None:
    env = sb3()
    env.seed(7)
    env.reset()
    *_, dones, infos = env.step(some_actions()[0])
    assert env.step_infos["distance"].shape == (WORLDS,)
    going = [info for info, done in zip(infos, dones) if not done]
    assert len(going) >= 2 and not any(going) and going[0] is not going[1]


def test_what_sb3_asks_of_an_environment() -> None:
    env = sb3(render_mode="rgb_array", render_size=(64, 48))
    assert isinstance(env, VecEnv) and env.num_envs == WORLDS and env.render_mode == "rgb_array"
    env.reset()
    assert env.get_attr("agents") == [env.env.agents] * WORLDS
    assert env.get_attr("render_mode", [1, 2]) == ["rgb_array"] * 2
    assert env.has_attr("task") and not env.has_attr("wheels")
    env.set_attr("note", 3)
    assert env.get_attr("note", 0) == [3]
    assert env.env_is_wrapped(Monitor) == [True] * WORLDS and env.env_is_wrapped(DummyVecEnv, 1) == [False]
    assert len(env.env_method("render", indices=[1])) == 1
    assert env.env_method("vary", "ranger.noise[0]", np.linspace(0, 0.1, WORLDS)) == [None] * WORLDS
    message = r"found the worlds \[1\], expected None or all 5"
    with pytest.raises(ValueError, match=message):
        env.set_attr("note", 3, [1])
    with pytest.raises(ValueError, match=message):
        env.env_method("vary", "ranger.noise[0]", None, indices=1)
    assert env.get_images()[0].shape == (48, 64, 3)
    mosaic = env.render()
    assert mosaic.dtype == np.uint8 and mosaic.shape == (48 * 3, 64 * 2, 3)
    env.close()


def test_dictionaries_and_discrete_actions() -> None:
    """Observations are those of SB3's DummyVecEnv, also the last ones of episodes."""
    ours = StageVectorEnv(WORLDS, task=Several(), autoreset_mode="SameStep").to_sb3()
    theirs = DummyVecEnv([lambda: StageEnv(task=Several())] * WORLDS)
    assert ours.observation_space == theirs.observation_space and ours.action_space == theirs.action_space
    ours.seed(1), theirs.seed(1)
    assert same(ours.reset(), theirs.reset())
    random, ends = np.random.default_rng(2), 0
    for _ in range(30):
        actions = random.integers(0, 3, WORLDS)
        mine, other = ours.step(actions), theirs.step(actions)
        assert same(mine[0], other[0]) and same(mine[1], other[1]) and same(mine[2], other[2])
        for i in np.flatnonzero(mine[2]):
            ends += 1
            assert same(mine[3][i]["terminal_observation"], other[3][i]["terminal_observation"])
    assert ends > WORLDS


def test_copies_go_on_as_the_original() -> None:
    env = sb3()
    env.seed(2)
    env.reset()
    for action in some_actions(steps=5):
        env.step(action)
    again = pickle.loads(pickle.dumps(env))
    for action in some_actions():
        for left, right in zip(env.step(action)[:3], again.step(action)[:3]):
            assert np.array_equal(left, right)


def test_wrappers_of_sb3() -> None:
    env = VecFrameStack(VecNormalize(sb3()), 2)
    assert env.reset().shape == (WORLDS, 2 * 37)
    model = PPO("MlpPolicy", env, n_steps=16, batch_size=16, seed=1, device="cpu")
    model.learn(200)
    assert len(model.ep_info_buffer) > 5 and len(model.ep_success_buffer) > 5


def test_evaluation_needs_no_monitor() -> None:
    env = sb3()
    model = PPO("MlpPolicy", env, n_steps=16, batch_size=16, seed=1, device="cpu")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        returns, lengths = evaluate_policy(model, env, 10, return_episode_rewards=True)
    assert len(returns) == 10 and max(lengths) <= 12


def test_tensors_of_pytorch() -> None:
    """An environment whose arrays are tensors gives the same to SB3, which takes NumPy's."""
    numbers, tensors = sb3(), sb3(arrays="torch")
    for env in (numbers, tensors):
        env.seed(7)
    assert np.array_equal(numbers.reset(), tensors.reset())
    for action in some_actions():
        mine, other = numbers.step(action), tensors.step(action)
        assert all(np.allclose(left, right, atol=1e-6) for left, right in zip(mine[:3], other[:3]))
        for info, expected in zip(mine[3], other[3]):
            assert info.keys() == expected.keys()
            if info:
                assert np.allclose(info["terminal_observation"], expected["terminal_observation"], atol=1e-6)


def test_other_autoreset_modes_are_refused() -> None:
    with pytest.raises(ValueError, match='found autoreset_mode="NextStep", expected "SameStep", which to_sb3'):
        to_sb3(StageVectorEnv(2))
