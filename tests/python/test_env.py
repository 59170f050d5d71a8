# SPDX-License-Identifier: GPL-2.0-or-later
"""Environments: the checkers of Gymnasium and PettingZoo, seeds, and many worlds compared with single ones."""

from __future__ import annotations

import itertools
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest
import stagesim as st

gym = pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")
from gymnasium.error import ResetNeeded  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode, SyncVectorEnv  # noqa: E402
from pettingzoo.test import parallel_api_test, parallel_seed_test  # noqa: E402
from stagesim import env as stage_env  # noqa: E402

pytestmark = pytest.mark.filterwarnings("error")
TASKS = sorted(stage_env.TASKS)
OWN_WORLDS = ("Measured", "PushT")  # tasks whose world must have metrics, or a block


def assert_same(found: Any, expected: Any) -> None:
    """Expects bit-equal values of the same types."""
    assert type(found) is type(expected)
    if isinstance(found, dict):
        assert sorted(found) == sorted(expected)
        for key in found:
            assert_same(found[key], expected[key])
    elif isinstance(found, tuple) or (isinstance(found, np.ndarray) and found.dtype == object):
        assert len(found) == len(expected)
        for one, other in zip(found, expected):
            assert_same(one, other)
    elif isinstance(found, np.ndarray):
        assert (found.dtype, found.shape) == (expected.dtype, expected.shape)
        assert found.tobytes() == expected.tobytes()
    else:
        assert found == expected


def arrays_in(data: Any) -> list[np.ndarray[Any, Any]]:
    if isinstance(data, np.ndarray):
        return [data] + [inner for item in data if data.dtype == object for inner in arrays_in(item)]
    if isinstance(data, dict):
        data = tuple(data.values())
    return [array for item in data for array in arrays_in(item)] if isinstance(data, tuple) else []


def flat(seen: Any) -> Any:
    """The numbers of an observation, which may be a dictionary."""
    return np.concatenate([values.reshape(-1) for values in seen.values()]) if isinstance(seen, dict) else seen


# ---- the checkers -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TASKS)
def test_gymnasium_check_env(name: str) -> None:
    check_env(gym.make(f"Stage/{name}-v0").unwrapped)


@pytest.mark.parametrize("name", TASKS)
def test_pettingzoo_api(name: str) -> None:
    parallel_api_test(st.env.parallel_env(task=name), num_cycles=1000 if name == "Navigate" else 100)
    short = stage_env.TASKS[name](limit=7)
    parallel_api_test(st.env.parallel_env("arena.world" if name == "Navigate" else None, short), num_cycles=50)


@pytest.mark.parametrize("name", TASKS)
def test_pettingzoo_seeds(name: str) -> None:
    """PettingZoo's own test makes only one step, so a whole episode is compared here."""
    parallel_seed_test(lambda: st.env.parallel_env(task=name))
    records = []
    for _ in range(2):
        env = st.env.parallel_env("arena.world" if name == "Navigate" else None, stage_env.TASKS[name](limit=60))
        record = [env.reset(seed=3)]
        random = np.random.default_rng(1)
        while env.agents:
            record.append(env.step({agent: random.uniform(-1, 1, 2) for agent in env.agents}))
        records.append(tuple(record))
    assert len(records[0]) > 20
    assert_same(*records)


# ---- many worlds compared with single ones ------------------------------------------------------

CASES: dict[str, Callable[[], tuple[str | None, Any]]] = {
    "Navigate": lambda: (None, stage_env.Navigate(goal_radius=0.65, limit=41)),
    "Navigate by five": lambda: ("arena.world", stage_env.Navigate(goal_radius=0.65, limit=40)),
    "Disperse": lambda: (None, stage_env.Disperse(spread=0.7, limit=19)),
    "Forage": lambda: (None, stage_env.Forage(limit=31, zone_radius=2)),
    "Measured": lambda: (None, stage_env.Measured(limit=37, end="driven", end_at=1.8)),
    "Navigate8": lambda: (None, stage_env.Navigate8(goal_radius=0.65, limit=40)),
    "Swap": lambda: (None, stage_env.Swap(limit=39)),
    "Cover": lambda: (None, stage_env.Cover(limit=31, enough=0.12)),
    "Pursue": lambda: (None, stage_env.Pursue(limit=37, catch=3.2)),
    "PushT": lambda: (None, stage_env.PushT(limit=40, enough=0.3)),
}


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("case", CASES)
def test_vector_environment_equals_single_ones(case: str, mode: AutoresetMode) -> None:
    """Every step is bit-equal to Gymnasium's SyncVectorEnv."""
    n = 7
    world, task = CASES[case]()
    ours = stage_env.StageVectorEnv(n, world, task, threads=2, autoreset_mode=mode)
    theirs = SyncVectorEnv([lambda: stage_env.StageEnv(world, task)] * n, autoreset_mode=mode)
    assert ours.single_action_space == theirs.single_action_space
    assert ours.observation_space == theirs.observation_space
    found: Any = ours.reset(seed=11)
    assert_same(found, theirs.reset(seed=11))
    random = np.random.default_rng(5)
    over = np.zeros(n, bool)
    ends = {"terminated": 0, "truncated": 0}
    for moment in range(110):
        if mode is AutoresetMode.DISABLED and over.any():
            seeds = [moment + i if i % 2 else None for i in range(n)]
            assert_same(ours.reset(seed=seeds, options={"reset_mask": over}),
                        theirs.reset(seed=seeds, options={"reset_mask": over}))
        actions = random.uniform(-1, 1, ours.action_space.shape).astype(np.float32)
        if case == "Navigate":
            actions = drive_to_goal(found[0]).astype(np.float32)
        found, expected = ours.step(actions), theirs.step(actions)
        assert_same(found, expected)
        over = found[2] | found[3]
        ends["terminated"] += int(found[2].sum())
        ends["truncated"] += int(found[3].sum())
    assert ends["truncated"] > 0
    assert ends["terminated"] > 0 or case in ("Forage", "Navigate by five", "Navigate8", "Swap")
    assert_same(ours.reset(), theirs.reset())
    assert_same(ours.reset(seed=[1, 2, 3, 4, 5, 6, 7]), theirs.reset(seed=[1, 2, 3, 4, 5, 6, 7]))


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_values_vary_between_worlds_from_their_next_episodes_on(mode: AutoresetMode) -> None:
    n, sizes = 3, np.array([[.2, .2, .2], [.3, .25, .2], [.35, .4, .2]])

    def settings(i: int) -> dict[str, Any]:
        return {"position.size": sizes[i].tolist(), "sensor.range": [0, 1 + i]}

    for begun in (False, True):
        many = stage_env.StageVectorEnv(n, task=stage_env.Navigate(limit=9), autoreset_mode=mode)
        if begun:
            many.reset(seed=3)
        many.vary("position.size", sizes[:, None])
        many.vary("ranger.range", np.array([[[0, 1 + i]] for i in range(n)]))
        assert list(many.varied) == ["position.size", "ranger.range"]
        singles = [lambda i=i: stage_env.StageEnv(task=stage_env.Navigate(limit=9), settings=settings(i))  # type: ignore[misc]
                   for i in range(n)]
        theirs = SyncVectorEnv(singles, autoreset_mode=mode)
        assert np.array_equal(many.reset(seed=5)[0], theirs.reset(seed=5)[0])
        many.action_space.seed(1)
        for _ in range(25):
            actions = many.action_space.sample()
            for mine, other in zip(many.step(actions)[:4], theirs.step(actions)[:4]):
                assert np.array_equal(mine, other)


def test_results_do_not_depend_on_the_numbers_of_worlds_and_threads() -> None:
    """Results must not depend on NumPy's vectorized loops."""
    many = stage_env.StageVectorEnv(33, task="Disperse", threads=3)
    few = stage_env.StageVectorEnv(4, task="Disperse", threads=1)
    assert_same(many.reset(seed=1)[0][:4].copy(), few.reset(seed=1)[0])
    actions = np.random.default_rng(1).uniform(-1, 1, (30, *many.action_space.shape))
    for action in actions:
        found, expected = many.step(action), few.step(action[:4])
        for one, other in zip(found[:4], expected[:4]):
            assert_same(one[:4].copy(), other)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_make_vec(mode: AutoresetMode) -> None:
    env = gym.make_vec("Stage/Navigate-v0", num_envs=3, autoreset_mode=mode,
                       task=stage_env.Navigate(limit=4))
    assert isinstance(env, stage_env.StageVectorEnv)
    assert env.metadata["autoreset_mode"] is mode
    sync = gym.make_vec("Stage/Navigate-v0", num_envs=3, vectorization_mode="sync",
                        vector_kwargs={"autoreset_mode": mode}, task=stage_env.Navigate(limit=4))
    assert sync.metadata["autoreset_mode"] is mode
    assert_same(env.reset(seed=2)[0], sync.reset(seed=2)[0])
    for _ in range(4):
        found, expected = env.step(np.ones((3, 2))), sync.step(np.ones((3, 2)))
        for one, other in zip(found[:4], expected[:4]):
            assert_same(one, other)
    assert found[3].all()
    if mode is AutoresetMode.DISABLED:
        with pytest.raises(ResetNeeded, match="over"):
            env.step(np.ones((3, 2)))
    env.close()
    sync.close()
    with pytest.raises(ResetNeeded, match="closed"):
        env.reset()


def test_make_vec_with_other_arguments() -> None:
    env = gym.make_vec("Stage/Navigate-v0", num_envs=2, world="arena.world", robots="r[01]",
                       autoreset_mode="SameStep", threads=1)
    assert env.agents == ("r0", "r1")
    assert env.action_space.shape == (2, 4)
    asynchronous = gym.make_vec("Stage/Navigate-v0", num_envs=2, vectorization_mode="async")
    ours = gym.make_vec("Stage/Navigate-v0", num_envs=2)
    assert_same(asynchronous.reset(seed=4)[0], ours.reset(seed=4)[0])
    asynchronous.close()


# ---- seeds --------------------------------------------------------------------------------------


def episode(env: Any, **seed: int) -> tuple[Any, ...]:
    """The initial observation of an episode, and the results of fixed actions."""
    record = [env.reset(**seed)[0]]
    random = np.random.default_rng(9)
    for _ in range(12):
        record.append(env.step(random.uniform(-1, 1, env.action_space.shape))[0])
    return tuple(record)


@pytest.mark.parametrize("name", TASKS)
def test_seeds(name: str) -> None:
    env, other = (stage_env.StageEnv(task=name) for _ in range(2))
    first = episode(env, seed=1)
    following = episode(env)
    assert_same(episode(other, seed=1), first)
    assert_same(episode(other), following)
    assert_same(episode(env, seed=1), first)
    all_of_them = [first, following, *(episode(env, seed=seed) for seed in range(2, 8)), episode(env)]
    for one, another in itertools.combinations(all_of_them, 2):
        assert not np.array_equal(flat(one[0]), flat(another[0]))
        assert not np.array_equal(flat(one[-1]), flat(another[-1]))
    fresh = [flat(stage_env.StageEnv(task=name).reset()[0]) for _ in range(2)]
    assert not np.array_equal(*fresh)


def test_seeds_of_a_vector() -> None:
    env = stage_env.StageVectorEnv(4, threads=1)
    first, _ = env.reset(seed=20)
    assert env.np_random_seed == (20, 21, 22, 23)
    assert len({row.tobytes() for row in first}) == 4
    following, _ = env.reset()
    assert not (first == following).all(1).any()
    kept, _ = env.reset(seed=20)
    assert_same(kept, first)
    mask = np.array([False, True, False, False])
    some, _ = env.reset(options={"reset_mask": mask})
    assert ((some == first).all(1) == ~mask).all()
    for wrong in ([True] * 4, np.zeros(4)):
        with pytest.raises(TypeError, match="reset_mask"):
            env.reset(options={"reset_mask": wrong})
    for wrong in (np.zeros(4, bool), np.ones(3, bool)):
        with pytest.raises(ValueError, match="reset_mask"):
            env.reset(options={"reset_mask": wrong})
    with pytest.raises(ValueError, match="3 seeds"):
        env.reset(seed=[1, 2, 3])


def test_worlds_have_seeds_of_their_own() -> None:
    """Noise and controllers also differ between episodes."""
    env = stage_env.StageVectorEnv(3, threads=1)
    env.reset(seed=1)
    seeds = env._episodes.batch.seeds  # noqa: SLF001
    env.reset(seed=2)
    assert len({*seeds, *env._episodes.batch.seeds}) == 4  # noqa: SLF001  (two are as before)


# ---- returned arrays ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", TASKS)
def test_returned_arrays_share_no_memory(name: str) -> None:
    """Returned arrays share no memory with other calls or with the worlds."""
    task = stage_env.TASKS[name](limit=3)
    single = stage_env.StageEnv(task=task)
    vector = stage_env.StageVectorEnv(2, task=task, threads=1, autoreset_mode="SameStep")
    parallel = st.env.parallel_env(task=task)
    for env, actions in ((single, np.zeros(single.action_space.shape)),
                         (vector, np.zeros(vector.action_space.shape)), (parallel, None)):
        batch = env._episodes.batch  # noqa: SLF001
        kept = arrays_in(env.reset(seed=1))
        for _ in range(3):
            told = actions if actions is not None else {agent: np.zeros(2) for agent in parallel.agents}
            kept += arrays_in(env.step(told))
        notes = env._episodes.scene.notes  # noqa: SLF001
        live = [batch.pose, batch.velocity, batch.stalled, *notes.values()]
        if name != "PushT":  # whose robots have no ranger
            live.append(batch.ranges)
        if env is not single:
            live += arrays_in((env._last,))  # noqa: SLF001
        assert len(kept) >= 4
        for one, other in itertools.combinations([*kept, *live], 2):
            assert not np.shares_memory(one, other) or (one is not other and one.dtype == object)


class Countdown(st.env.Task):
    """A task that terminates robot i after i + 1 actions, with a reward of i + 1 per action."""

    limit = 4
    steps = 1
    bounds = (0.0, 10.0)

    def size(self, scene: st.env.Scene) -> int:
        return 1

    def observe(self, scene: st.env.Scene) -> Any:
        return np.broadcast_to(scene.actions[:, None, None], (scene.n, scene.robots, 1))

    def judge(self, scene: st.env.Scene) -> st.env.Outcome:
        number = np.broadcast_to(np.arange(1, scene.robots + 1), (scene.n, scene.robots))
        return st.env.Outcome(number.astype(float), scene.actions[:, None] >= number, {"number": number})


def test_agents_can_end_at_different_times() -> None:
    env = st.env.parallel_env("arena.world", Countdown())
    with pytest.raises(ResetNeeded):
        env.step({})
    env.reset(seed=1)
    poses = env._episodes.batch.pose  # noqa: SLF001
    names = ["r0", "r1", "r2", "r3", "r4"]
    for moment in range(4):
        assert env.agents == names[moment:]
        before = poses.copy()
        observations, rewards, terminated, truncated, infos = env.step(
            {agent: np.array([1, 0]) for agent in env.agents})
        for found in (observations, rewards, terminated, truncated, infos):
            assert list(found) == names[moment:]
        assert [agent for agent in terminated if terminated[agent]] == [names[moment]]
        assert [agent for agent in truncated if truncated[agent]] == (["r4"] if moment == 3 else [])
        assert rewards == {agent: 1.0 + names.index(agent) for agent in names[moment:]}
        assert infos["r4"] == {"number": 5} and type(infos["r4"]["number"]) is int
        assert observations["r4"].tolist() == [moment + 1]
        assert ((poses != before).any(2)[0] == (np.arange(5) >= moment)).all()
    assert env.agents == []
    assert env.step({}) == ({}, {}, {}, {}, {})
    assert env.state().tolist() == [4] * 5
    env.reset()
    assert env.agents == names


def test_a_team_ends_when_all_its_agents_have_ended() -> None:
    single = stage_env.StageEnv("arena.world", Countdown())
    single.reset(seed=1)
    record = [single.step(np.zeros(10)) for _ in range(3)]
    batch = single._episodes.batch  # noqa: SLF001
    record.append(single.step(np.ones(10)))
    assert batch.cmd.any(2).tolist() == [[False, False, False, True, True]]
    assert [step[1] for step in record] == [15, 14, 12, 9]
    assert [(step[2], step[3]) for step in record] == [(False, False)] * 3 + [(False, True)]
    assert record[1][4]["rewards"].tolist() == [0, 2, 3, 4, 5]
    with pytest.raises(ResetNeeded):
        single.step(np.zeros(10))
    two = stage_env.StageEnv("arena.world", Countdown(), robots="r[01]")
    two.reset()
    assert [two.step(np.zeros(4))[2:4] for _ in range(2)] == [(False, False), (True, False)]


def test_arguments_are_checked() -> None:
    env = stage_env.StageEnv()
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(2))
    env.reset(seed=1)
    for wrong, text in ((np.zeros(3), "shape"), (np.array([np.nan, 0]), "found the action nan of r0 in world 0")):
        with pytest.raises(ValueError, match=text):
            env.step(wrong)
    env.close()
    env.close()
    with pytest.raises(ResetNeeded, match="closed"):
        env.step(np.zeros(2))
    agents = st.env.parallel_env("arena.world", "Disperse")
    agents.reset(seed=1)
    for actions in ({}, {"r0": np.zeros(2)}, {agent: np.zeros(1) for agent in agents.agents}):
        with pytest.raises(ValueError, match="expected"):
            agents.step(actions)
    with pytest.raises(ValueError, match="Swim"):
        stage_env.StageEnv(task="Swim")
    with pytest.raises(ValueError, match="one robot"):
        stage_env.StageEnv("navigate.world", "Disperse")
    with pytest.raises(st.GoneError):
        stage_env.StageEnv("arena.world", "Forage")
    with pytest.raises(st.WorldError):
        stage_env.StageEnv("none.world")
    with pytest.raises(TypeError):
        stage_env.StageEnv(colour="red")
    with pytest.raises(ValueError, match="worlds"):
        stage_env.StageVectorEnv(0)
    with pytest.raises(ValueError):
        stage_env.StageVectorEnv(2, autoreset_mode="Never")
    with pytest.raises(ValueError, match="loaded"):
        stage_env.StageEnv(st.World("arena.world"), controllers=False)


def test_actions_outside_their_space_are_errors_unless_they_shall_be_clipped() -> None:
    env = stage_env.StageEnv(st.World("arena.world"), "Navigate", robots="r0")
    env.reset(seed=1)
    assert env.observation_space.shape == (37,)
    with pytest.raises(ValueError, match="found the action 7 of r0 in world 0, expected -1 to 1; clip it, or make the"):
        env.step(np.array([7, -0.5]))
    clipping = stage_env.StageEnv(st.World("arena.world"), "Navigate", robots="r0", clip_actions=True)
    clipping.reset(seed=1)
    clipping.step(np.array([7, -0.5]))
    assert clipping._episodes.batch.cmd[0].tolist() == [[0.5, 0, -0.75]]  # noqa: SLF001
    assert clipping._episodes.batch.velocity[0].tolist() == [[0.5, 0, -0.75]]  # noqa: SLF001
    assert clipping.clipped == 1
    with pytest.raises(ValueError, match="nan"):
        clipping.step(np.array([np.nan, -0.5]))


class Decimated(st.env.Scene):
    """A scene in which the second robot seems to be deleted."""

    @property
    def pose(self) -> Any:
        pose = self.batch.pose.copy()
        pose[:, 1] = np.nan
        return pose


@pytest.mark.parametrize("name", TASKS)
def test_deleted_robots_end_their_episode(name: str) -> None:
    """The observations of deleted robots are in the observation space."""
    env = st.env.parallel_env(None if name in OWN_WORLDS else "forage.world", name)
    env.reset(seed=2)
    env._episodes.scene.__class__ = Decimated  # noqa: SLF001
    observations, rewards, terminated, _, _ = env.step({agent: np.zeros(2) for agent in env.agents})
    assert terminated == {agent: agent == "r1" for agent in env.possible_agents}
    assert all(observations[agent] in env.observation_space(agent) for agent in observations)
    assert np.isfinite(list(rewards.values())).all()
    assert env.agents == [agent for agent in env.possible_agents if agent != "r1"]
    for found in env.step({agent: np.zeros(2) for agent in env.agents}):
        assert list(found) == env.agents


def test_worlds_that_quit_or_fail() -> None:
    """A controller that quits truncates the episode; a failed world raises errors until reset()."""
    class Batch:
        """A stand-in for a batch whose worlds fail or quit."""
        class _core:  # noqa: N801
            @staticmethod
            def failures() -> dict[int, str]:
                return {1: "somebody threw"}

        def __getattr__(self, name: str) -> Any:
            return getattr(batch, name)

    env = stage_env.StageVectorEnv(2, threads=1)
    env.reset(seed=1)
    episodes = env._episodes  # noqa: SLF001
    batch = episodes.batch
    episodes._ended = np.array([False, True])  # noqa: SLF001
    assert env.step(np.zeros((2, 2)))[3].tolist() == [False, True]
    episodes._ended = np.zeros(2, bool)  # noqa: SLF001
    env.reset()
    episodes.batch = Batch()
    with pytest.raises(st.StageError, match="world number 1 has failed: somebody threw"):
        env.step(np.zeros((2, 2)))
    episodes.batch = batch
    env.reset()
    assert not env.step(np.zeros((2, 2)))[3].any()


# ---- tasks --------------------------------------------------------------------------------------


BEARINGS = np.radians(np.linspace(-174.375, 174.375, 32))


def drive_to_goal(observations: Any) -> Any:
    """A policy: drive in a free direction near that of the goal, and back away from near obstacles."""
    goal, ranges = observations[..., -36:-34], 4 * observations[..., -32:]
    around = np.stack([np.roll(ranges, shift, -1) for shift in range(-2, 3)])
    likes = np.cos(BEARINGS - np.arctan2(goal[..., 1:], goal[..., :1])) + 2 * np.minimum(around.min(0), 0.8)
    turn = BEARINGS[likes.argmax(-1)]
    blocked = ranges[..., np.abs(BEARINGS) < 1].min(-1) < 0.35
    speed = np.where(blocked, -0.6, np.where(np.abs(turn) < 0.6, 1, 0))
    return np.stack([speed, np.where(blocked, 0, np.clip(2 * turn, -1, 1))], -1)


def play(name: str, policy: Callable[[Any], Any]) -> tuple[float, dict[str, Any]]:
    """The mean reward of forty episodes, and their final infos."""
    env = stage_env.StageVectorEnv(40, task=name, autoreset_mode="Disabled")
    observations, _ = env.reset(seed=50)
    total, over = np.zeros(40), np.zeros(40, bool)
    ends: list[dict[str, Any]] = [{} for _ in range(40)]
    while not over.all():
        seen = observations.reshape(40, len(env.agents), -1)
        moment = env._episodes.step(policy(seen), ~over)  # noqa: SLF001  (some are over before others)
        observations = moment.observations
        total += moment.ends.rewards.sum(1)
        ended = moment.ends.over & ~over
        for i in np.flatnonzero(ended):
            ends[i] = {key: values[i].copy() for key, values in moment.info.items()}
        over |= ended
    return float(total.mean()), {key: np.array([end[key] for end in ends]) for key in ends[0]}


def test_tasks_can_be_done() -> None:
    """A simple policy is much better than random actions."""
    def chance(seen: Any) -> Any:
        return random.uniform(-1, 1, (*seen.shape[:2], 2))

    def flee(seen: Any) -> Any:
        moves = drive_to_goal(np.concatenate([seen[..., :1], -seen[..., 1:3], seen[..., 3:]], -1))
        return np.where(seen[..., :1] >= 1, 0, moves)

    random = np.random.default_rng(1)
    reward, info = play("Navigate", drive_to_goal)
    assert info["is_success"].mean() >= 0.6
    assert reward > play("Navigate", chance)[0] + 1
    reward, info = play("Disperse", flee)
    assert info["is_success"].mean() >= 0.5
    assert reward > play("Disperse", chance)[0] + 1
    reward, info = play("Forage", drive_to_goal)
    assert info["brought"].sum(1).mean() >= 4
    assert reward > play("Forage", chance)[0] + 4


def test_rewards_are_increments_of_metrics() -> None:
    task = stage_env.Measured({"covered": 2.0, "collisions": -0.5}, limit=50)
    env = stage_env.StageVectorEnv(5, task=task, threads=2, autoreset_mode=AutoresetMode.DISABLED)
    env.reset(seed=3)
    assert env._episodes
    start = env._episodes.batch.metrics
    random, total = np.random.default_rng(1), np.zeros(5)
    for _ in range(50):
        total += env.step(random.uniform(-1, 1, env.action_space.shape).astype(np.float32))[1]
    now = env._episodes.batch.metrics
    gained = 2 * (now["covered"] - start["covered"]) - 0.5 * (now["collisions"] - start["collisions"])
    assert total == pytest.approx(4 * gained, rel=1e-5) and (now["covered"] > start["covered"]).all()
    with pytest.raises(ValueError, match="found the metric 'laps', expected one of the world file: collisions"):
        stage_env.StageEnv(task=stage_env.Measured({"laps": 1}))
    with pytest.raises(ValueError, match="it has none"):
        stage_env.StageEnv("navigate.world", task=stage_env.Measured())


PLUGIN = """
#include "stage.hh"

/// How far east the robot is, in metres.
class East : public Stg::Metric {
 public:
  void Start(Stg::World& world) override { Step(world); }
  void Step(Stg::World& world) override { x_ = world.GetModel("r")->GetPose().x; }
  double Value() const override { return x_; }

 private:
  double x_ = 0;
};

std::unique_ptr<Stg::Metric> MakeEast(const Stg::MetricOrder&) {
  return std::unique_ptr<Stg::Metric>(new East);
}

static const bool registered = Stg::RegisterMetric("east", MakeEast);

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  model->DeclareNoState("east");
  return 0;
}
"""


def test_plugins_compute_rewards_and_ends_of_episodes(tmp_path: Path, plugin_of: Callable[[str, Path], Path]) -> None:
    plugin = plugin_of(PLUGIN, tmp_path / "east.so")
    room = (Path(st.__file__).parent / "worlds" / "explore.world").read_text()
    file = tmp_path / "east.world"
    file.write_text(room[:room.index('robot( name "r0"')] + f'robot( name "r" ctrl "{plugin}" )\n'
                    'metric( name "progress" kind "east" )\n')
    task = stage_env.Measured({"progress": 10}, end="progress", end_at=3, limit=200)
    env = stage_env.StageEnv(str(file), task)
    env.reset(seed=1)
    scene, total = env._episodes.scene, 0.0
    start = scene.pose[0, 0, 0]
    while True:
        turn = np.clip(-2 * scene.pose[0, 0, 2], -1, 1)
        _, reward, terminated, truncated, _ = env.step(np.array([1, turn], np.float32))
        total += float(reward)
        if terminated or truncated:
            break
    assert terminated and scene.pose[0, 0, 0] >= 3
    assert total == pytest.approx(10 * (scene.pose[0, 0, 0] - start), rel=1e-5)


def test_rewards_of_navigate_are_metres() -> None:
    env = stage_env.StageEnv()
    env.reset(seed=5)
    scene = env._episodes.scene  # noqa: SLF001
    start = np.linalg.norm(scene.pose[0, 0, :2] - scene.notes["goal"][0, 0])
    assert start >= 0.7
    total, stalls = 0.0, 0
    for _ in range(20):
        _, reward, terminated, _, info = env.step(np.array([0.6, 0.2]))
        assert not terminated
        total += reward
        stalls += int(scene.stalled[0, 0])
    assert total == pytest.approx(start - info["distance"] - 0.05 * stalls)


def test_forage_rewards_fetching_and_bringing() -> None:
    env = st.env.parallel_env(task="Forage")
    env.reset(seed=3)
    scene = env._episodes.scene  # noqa: SLF001
    still = {agent: np.zeros(2) for agent in env.agents}
    rewards = []
    for x in (-4, 4, 4, -4, 4):
        scene.batch.teleport([x, 0, 0], np.arange(4) == 2)
        observations, reward, _, _, infos = env.step(still)
        rewards.append(round(reward["r2"]))
    assert [observations[agent][0] for agent in env.agents] == [-1] * 4
    assert [info["brought"] for info in infos.values()] == [0, 0, 2, 0]
    assert (np.array(rewards) >= 1).tolist() == [True, True, False, True, True]


def test_places(room: str) -> None:
    """Reachable places are neither behind walls nor inside of hollow bodies."""
    places = st.env.reachable_places(st.World("navigate.world"), [0, 0])
    assert places[0].tolist() == [0, 0]
    assert np.abs(places).max() <= 3.7
    assert len({tuple(place) for place in places}) == len(places) > 500
    assert ((places - [2, 2]) ** 2).sum(1).min() > 0.5**2
    closed = room + 'model( name "cell" pose [0 0 0 0] size [1.8 1.8 1] )'
    inside = st.env.reachable_places(st.World.from_text(closed), [0, 0])
    assert 0 < len(inside) and np.abs(inside).max() <= 0.6
    outside = st.env.reachable_places(st.World.from_text(closed), [0, 2], most=300)
    assert len(outside) == 300
    assert np.abs(outside).max(1).min() > 0.9
    env = stage_env.StageEnv(st.World.from_text(closed))
    with pytest.raises(st.StageError, match="room for"):
        env.reset()


def test_seen_from() -> None:
    pose = np.array([[1, 1, np.pi / 2], [0, 0, 0], [2, 2, 1]])
    distance, bearing = st.env.seen_from(pose, np.array([[1, 3], [0, -2], [2, 2.0]]))
    assert distance.tolist() == [2, 2, 0]
    assert bearing == pytest.approx(np.array([[1, 0], [0, -1], [1, 0]]), abs=1e-15)


# ---- the package --------------------------------------------------------------------------------


def test_import_error_names_the_package_to_install() -> None:
    code = ("import sys; sys.modules['pettingzoo'] = None\n"
            "try: import stagesim.env\n"
            "except ImportError as error: print(error.name, error)")
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed.startswith("pettingzoo ")
    assert 'pip install "stagesim[env]"' in printed


def test_everything_has_a_docstring() -> None:
    for name in set(st.env.__all__) - {"TASKS"}:
        assert getattr(st.env, name).__doc__, name


def test_pictures() -> None:
    single = stage_env.StageEnv(render_mode="rgb_array", render_size=(160, 120))
    single.reset(seed=1)
    first = single.render()
    assert first is not None and first.shape == (120, 160, 3) and first.dtype == np.uint8
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 2, "a picture of something"
    for _ in range(5):
        single.step(np.ones(single.action_space.shape))
    assert (single.render() != first).any()
    vector = gym.make_vec("Stage/Disperse-v0", num_envs=2, render_mode="rgb_array")
    vector.reset(seed=1)
    pictures = vector.render()
    assert pictures is not None and len(pictures) == 2 and (pictures[0] != pictures[1]).any()
    assert gym.make("Stage/Navigate-v0", render_mode="rgb_array").metadata["render_fps"] == 5
    parallel = stage_env.parallel_env(render_mode="rgb_array")
    parallel.reset(seed=1)
    assert parallel.render() is not None and parallel.render_mode in parallel.metadata["render_modes"]
    assert stage_env.StageEnv().render() is None
    with pytest.raises(ValueError, match="found the render_mode 'ansi', expected"):
        stage_env.StageEnv(render_mode="ansi")


def test_window(monkeypatch: pytest.MonkeyPatch) -> None:
    pygame = pytest.importorskip("pygame", reason="pygame is not installed: try tools/setup --python")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = stage_env.StageEnv(render_mode="human", render_size=(96, 64))
    env.reset(seed=1)
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).copy()
    assert shown.shape == (96, 64, 3) and shown.any()
    env.step(np.ones(env.action_space.shape))
    assert (pygame.surfarray.array3d(pygame.display.get_surface()) != shown).any()
    assert env.render() is None
    env.close()
    assert pygame.display.get_surface() is None


@pytest.mark.parametrize("name", TASKS)
def test_observations_are_within_their_spaces(name: str) -> None:
    env = stage_env.StageVectorEnv(8, task=name)
    env.reset(seed=1)
    for _ in range(40):
        seen = env.step(env.action_space.sample())[0]
        assert seen in env.observation_space
