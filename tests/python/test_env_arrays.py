# SPDX-License-Identifier: GPL-2.0-or-later
"""Environments as arrays: random numbers, spaces, maps of each episode, statistics, pictures, and tensors of PyTorch."""

from __future__ import annotations

import copy
import pickle
import resource
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim import scenes

pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")
from gymnasium import spaces  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import SyncVectorEnv  # noqa: E402
from gymnasium.wrappers.vector import RecordEpisodeStatistics  # noqa: E402
from stagesim import env as stage_env  # noqa: E402
from stagesim.env.randoms import keys_of  # noqa: E402

TASKS = sorted(stage_env.TASKS)
OWN_WORLDS = ("Measured", "PushT")  # tasks whose world must have metrics, or a block


def parts_of(seen: Any) -> list[Any]:
    """The arrays of observations, which may be a dictionary."""
    return list(seen.values()) if isinstance(seen, dict) else [seen]


def bytes_of(seen: Any, place: tuple[int, ...] = ()) -> list[bytes]:
    """The bits of observations, or of those at a place of the array."""
    return [np.asarray(values[place]).tobytes() for values in parts_of(seen)]


# ---- random numbers -----------------------------------------------------------------------------


def randoms(seeds: Any, begun: int = 0) -> stage_env.Randoms:
    numbers = np.asarray(seeds, np.uint64)
    return stage_env.Randoms(keys_of(numbers, np.full(len(numbers), begun, np.uint64)))


def test_random_numbers_of_a_world_depend_on_its_seed_episode_and_calls_only() -> None:
    many, one = randoms(np.arange(50)), randoms([7])
    for draw in (lambda r: r.uniform((2, 3)), lambda r: r.integers(9, 4), lambda r: r.normal(5), lambda r: r.headings(2),
                 lambda r: r.split().uniform()):
        assert draw(many)[7].tobytes() == draw(one)[0].tobytes()
    assert many.part(np.array([3, 7])).uniform(4)[1].tobytes() == one.uniform(4)[0].tobytes()
    first = [randoms([7]).uniform(6), randoms([7], 1).uniform(6), randoms([8]).uniform(6), one.uniform(6)]
    assert len({values.tobytes() for values in first}) == 4


def test_random_numbers_have_their_distributions() -> None:
    """Means and variances are within five standard errors, and no bit and no pair of neighbours has a preference."""
    r = randoms(np.arange(1000))
    unit = r.uniform(200).reshape(-1)
    n = len(unit)
    assert 0 <= unit.min() and unit.max() < 1
    assert abs(unit.mean() - 1 / 2) < 5 / np.sqrt(12 * n) and abs(unit.var() - 1 / 12) < 5 * np.sqrt(1 / 180 / n)
    wide = r.uniform(300, -2, 4)
    assert -2 <= wide.min() < -1.9 and 3.9 < wide.max() < 4
    normal = r.normal(200).reshape(-1)
    assert abs(normal.mean()) < 5 / np.sqrt(n) and abs(normal.var() - 1) < 5 * np.sqrt(2 / n)
    counts = np.bincount(r.integers(7, 200).reshape(-1), minlength=7)
    assert len(counts) == 7 and ((counts - n / 7) ** 2 / (n / 7)).sum() < 30
    bits = r.bits(100).reshape(-1)
    for bit in range(64):
        assert abs(((bits >> np.uint64(bit)) & np.uint64(1)).mean() - 0.5) < 5 * 0.5 / np.sqrt(len(bits))
    for first, second in ((unit[:-1], unit[1:]), (r.uniform(1)[:-1, 0], r.uniform(1)[1:, 0])):
        assert abs(np.corrcoef(first, second)[0, 1]) < 5 / np.sqrt(len(first))


def test_places_keep_their_distance_also_where_there_is_hardly_any_room() -> None:
    env = stage_env.StageArrayEnv(40, "arena.world")
    scene = env._episodes.scene
    grid = np.stack(np.meshgrid(np.arange(4.0), np.arange(3.0)), -1).reshape(-1, 2)
    for count, gap, choice in ((10, 0.7, None), (12, 1.0, grid), (2, 2.9, np.array([[0.0, 0], [1, 0], [3, 0]]))):
        places = scene.scatter(randoms(np.arange(40)), count, gap, choice)
        away = np.sqrt(((places[:, :, None] - places[:, None]) ** 2).sum(-1))
        away[:, np.arange(count), np.arange(count)] = np.inf
        assert away.min() >= gap
        alone = scene.part(np.array([23])).scatter(randoms([23]), count, gap, choice)
        assert alone[0].tobytes() == places[23].tobytes()
        assert len({found.tobytes() for found in places}) > 1
    with pytest.raises(st.StageError, match="found room for 3 robots or goals 1 m apart, expected 4"):
        scene.scatter(randoms(np.arange(40)), 4, 1, np.array([[0.0, 0], [1, 0], [2, 0]]))


# ---- spaces -------------------------------------------------------------------------------------


class Several(stage_env.Navigate):
    """Navigate with discrete actions, and with observations of three kinds."""

    choices = ((0.5, 0, 0), (0, 0, 1.5), (0, 0, -1.5))

    def observation_space(self, scene: stage_env.Scene) -> spaces.Dict:
        return spaces.Dict({"goal": spaces.Box(-1, 1, (3,), np.float32), "picture": spaces.Box(0, 255, (4, 8, 1), np.uint8),
                            "speed": spaces.Box(np.array([-0.5, -1.5], np.float32), np.array([0.5, 1.5], np.float32))})

    def observe(self, scene: stage_env.Scene) -> Any:
        free = stage_env.free_space(scene, self.reach)
        return {"goal": stage_env.towards(scene, scene.notes["goal"], self.far),
                "picture": (255 * free).reshape(scene.n, scene.robots, 4, 8, 1).astype(np.uint8),
                "speed": scene.velocity[..., ::2]}


@pytest.mark.parametrize("world", [None, "arena.world"])
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_dictionaries_images_and_discrete_actions_equal_those_of_single_environments(world: str | None, mode: str) -> None:
    n, task = 4, Several(limit=9)
    ours = stage_env.StageVectorEnv(n, world, task, autoreset_mode=mode, threads=2)
    theirs = SyncVectorEnv([lambda: stage_env.StageEnv(world, task)] * n, autoreset_mode=ours.autoreset_mode)
    assert ours.observation_space == theirs.observation_space and ours.action_space == theirs.action_space
    ours.action_space.seed(1)
    found, expected = ours.reset(seed=2)[0], theirs.reset(seed=2)[0]
    for _ in range(25):
        assert found.keys() == expected.keys() == {"goal", "picture", "speed"}
        assert found in ours.observation_space
        for name in found:
            assert found[name].dtype == expected[name].dtype and found[name].tobytes() == expected[name].tobytes()
        actions = ours.action_space.sample()
        mine, other = ours.step(actions), theirs.step(actions)
        found, expected = mine[0], other[0]
        assert all(np.array_equal(mine[i], other[i]) for i in (1, 2, 3))
        if "final_obs" in mine[4]:
            for one, another in zip(mine[4]["final_obs"], other[4]["final_obs"]):
                assert all(np.array_equal(one[name], another[name]) for name in one or {})
    assert found["picture"].std() > 0


def test_sensors_that_only_observe_asks_for_have_readings_in_the_first_episode() -> None:
    """The first episode of an environment is the same as later ones with the same seed."""
    class Counted(Several):
        begun = 0

        def began(self, scene: stage_env.Scene) -> None:
            Counted.begun += 1

    env = stage_env.StageVectorEnv(3, task=Counted())
    first = env.reset(seed=4)[0]
    assert Counted.begun == 2, "episodes begin again once the sensor measures"
    again = env.reset(seed=4)[0]
    assert Counted.begun == 3
    assert first["picture"].min() < 255 and first["picture"].tobytes() == again["picture"].tobytes()
    again_here = copy.deepcopy(env)
    assert again_here.reset(seed=4)[0]["picture"].tobytes() == first["picture"].tobytes() and Counted.begun == 4


def test_single_environment_of_several_spaces() -> None:
    check_env(stage_env.StageEnv(task=Several()))
    env = stage_env.StageEnv(task=Several())
    env.reset(seed=1)
    for wrong, error, text in ((3, ValueError, "found the action 3 of r0 in world 0, expected 0 to 2"),
                               (0.0, TypeError, "expected whole numbers")):
        with pytest.raises(error, match=text):
            env.step(wrong)
    agents = stage_env.parallel_env("arena.world", Several())
    agents.reset(seed=1)
    seen = agents.step({agent: 1 for agent in agents.agents})[0]
    assert all(seen[agent] in agents.observation_space(agent) for agent in seen)
    assert agents.state().ndim == 1


def test_observations_outside_their_space_are_errors() -> None:
    class Far(stage_env.Navigate):
        def observe(self, scene: stage_env.Scene) -> Any:
            seen = super().observe(scene)
            seen[1:, ..., 2] = 3
            return seen

    stage_env.StageEnv(task=Far()).reset(seed=1)
    with pytest.raises(ValueError, match="found 3 as number 2 of what r0 observes in world 1, expected -1 to 1: scale it, or"):
        stage_env.StageVectorEnv(3, task=Far()).reset(seed=1)
    Far.bounds = (-3, 3)
    stage_env.StageVectorEnv(3, task=Far()).reset(seed=1)

    class Old(stage_env.Navigate):
        def begin(self, scene: Any, index: int, random: Any) -> Any:  # type: ignore[override]
            return None

    with pytest.raises(TypeError, match=r"found Old.begin\(scene: 'Any', index.*expected begin\(scene, randoms\)"):
        stage_env.StageEnv(task=Old())


# ---- arrays of robots ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", TASKS)
def test_array_environment_equals_parallel_environments(name: str) -> None:
    n, task = 3, stage_env.TASKS[name](limit=12)
    world = None if name in OWN_WORLDS else "forage.world"
    arrays = stage_env.StageArrayEnv(n, world, task, threads=2)
    alone = [stage_env.parallel_env(world, task) for _ in range(n)]
    seen = arrays.reset(seed=5)
    for i, env in enumerate(alone):
        for row, found in enumerate(env.reset(seed=5 + i)[0].values()):
            assert bytes_of(found) == bytes_of(seen, (i, row))
    random = np.random.default_rng(1)
    for _ in range(40):
        actions = random.uniform(-1, 1, (n, len(arrays.agents), 2))
        step = arrays.step(actions)
        for i, env in enumerate(alone):
            rows = {agent: arrays.agents.index(agent) for agent in env.agents}
            assert step.took_part[i].tolist() == [agent in rows for agent in arrays.agents]
            observations, rewards, terminated, truncated, _ = env.step({agent: actions[i, row] for agent, row in rows.items()})
            for agent, row in rows.items():
                assert bytes_of(observations[agent]) == bytes_of(step.final_observations, (i, row))
                assert rewards[agent] == step.rewards[i, row]
                assert (terminated[agent], truncated[agent]) == (step.terminated[i, row], step.truncated[i, row])
            assert step.over[i] == (not env.agents)
            if step.over[i]:
                for row, found in enumerate(env.reset()[0].values()):
                    assert bytes_of(found) == bytes_of(step.observations, (i, row))
    assert arrays.statistics.count >= n


# ---- maps ---------------------------------------------------------------------------------------


def room(random: np.random.Generator) -> scenes.Scene:
    walls = scenes.clutter(6, 6, seed=int(random.integers(2**31)))
    [[x, y, a]] = scenes.free_places(walls, 1, 0.3, seed=int(random.integers(2**31)))
    lidar = scenes.Ranger(range=(0, 4), fov=2 * np.pi, samples=16)
    return scenes.Scene(walls, [scenes.Robot(name="r", pose=(x, y, a), size=(0.3, 0.3, 0.3), sensors=[lidar])])


def test_maps_that_are_made_anew_equal_those_of_single_environments() -> None:
    n, task = 3, stage_env.Navigate(limit=6)
    first = room(np.random.default_rng(0))
    many = stage_env.StageVectorEnv(n, first, task, maps=room, autoreset_mode="SameStep")
    alone = SyncVectorEnv([lambda: stage_env.StageEnv(first, task, maps=room)] * n, autoreset_mode=many.autoreset_mode)
    assert np.array_equal(many.reset(seed=1)[0], alone.reset(seed=1)[0])
    seen = set()
    many.action_space.seed(3)
    for _ in range(20):
        actions = many.action_space.sample()
        for mine, other in zip(many.step(actions)[:4], alone.step(actions)[:4]):
            assert np.array_equal(mine, other)
        seen |= {many._episodes.batch._recipes[v].text for v in many._episodes.batch.variant}  # type: ignore[union-attr]
    assert len(seen) >= 3 * n


# ---- statistics and pictures --------------------------------------------------------------------


def test_statistics_equal_those_of_a_wrapper() -> None:
    def make(**options: Any) -> stage_env.StageVectorEnv:
        return stage_env.StageVectorEnv(5, task=stage_env.Navigate(limit=8, goal_radius=1), autoreset_mode="SameStep", **options)

    ours, theirs = make(episode_info=True), RecordEpisodeStatistics(make())
    ours.reset(seed=3)
    theirs.reset(seed=3)
    ends, successes = [], []
    for _ in range(40):
        actions = np.tile([1.0, 0.3], (5, 1))
        mine, other = ours.step(actions)[4], theirs.step(actions)[4]
        assert ("episode" in mine) == ("episode" in other)
        if "episode" in mine:
            over = mine["_episode"]
            assert np.array_equal(over, other["_episode"])
            assert mine["episode"]["r"] == pytest.approx(other["episode"]["r"])
            assert np.array_equal(mine["episode"]["l"], other["episode"]["l"])
            assert mine["episode"]["t"] == pytest.approx(mine["episode"]["l"] * 0.2)
            ends += mine["episode"]["r"][over].tolist()
            successes += mine["final_info"]["is_success"][over].tolist()
    assert ours.statistics.count == len(ends) >= 20
    assert ours.statistics.last()["returns"].tolist() == ends
    assert ours.statistics.mean(7)["is_success"] == pytest.approx(np.mean(successes[-7:]))
    assert 0 < np.mean(successes) < 1
    assert "20" in repr(stage_env.Statistics(5)) or "0 episodes" in repr(stage_env.Statistics(5))


def test_statistics_keep_a_window() -> None:
    kept = stage_env.Statistics(window=4)
    assert kept.mean() == {}
    kept.add(returns=[1, 2, 3], lengths=[1, 1, 1])
    kept.add(returns=[4, 5], lengths=[2, 2])
    assert kept.last()["returns"].tolist() == [2, 3, 4, 5]
    assert kept.last(2)["lengths"].tolist() == [2, 2]
    kept.add(returns=np.arange(9), lengths=np.arange(9))
    assert kept.last()["returns"].tolist() == [5, 6, 7, 8] and kept.count == 14


def test_pictures_of_several_worlds() -> None:
    env = stage_env.StageVectorEnv(5, render_mode="rgb_array", render_size=(90, 60))
    env.reset(seed=1)
    pictures = env.render()
    assert pictures is not None and [picture.shape for picture in pictures] == [(60, 90, 3)] * 5
    mosaic = env.mosaic()
    assert mosaic.shape == (60, 90, 3)
    tiles = [mosaic[:30, :30], mosaic[:30, 30:60], mosaic[30:, :30]]
    assert all(tile.std() > 0 for tile in tiles) and mosaic[30:, 60:].max() == 0
    assert not np.array_equal(tiles[0], tiles[1])


# ---- many resets, and tensors -------------------------------------------------------------------


def test_memory_does_not_grow_with_resets() -> None:
    env = stage_env.StageArrayEnv(512, task=stage_env.Navigate(limit=1))
    env.reset(seed=1)
    actions = np.zeros((512, 1, 2))
    for _ in range(20):
        env.step(actions)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(100):
        env.step(actions)
    assert env.statistics.count == 120 * 512
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 4000  # kB


@pytest.mark.parametrize("name", TASKS)
def test_tasks_compute_the_same_with_pytorch(name: str) -> None:
    torch = pytest.importorskip("torch")
    task = stage_env.TASKS[name](limit=25)
    with_numpy, with_torch = (stage_env.StageArrayEnv(5, task=task, arrays=arrays) for arrays in ("numpy", "torch"))
    pairs = zip(parts_of(with_numpy.reset(3)), parts_of(with_torch.reset(3)))
    assert all(np.abs(mine - other.numpy()).max() < 1e-6 for mine, other in pairs)
    random = np.random.default_rng(1)
    for _ in range(60):
        actions = random.uniform(-1, 1, (5, len(with_numpy.agents), 2))
        mine, other = with_numpy.step(actions), with_torch.step(torch.as_tensor(actions))
        for ours, theirs in zip(parts_of(mine.observations), parts_of(other.observations)):
            assert np.abs(ours - theirs.numpy()).max() < 1e-6
        assert np.abs(mine.rewards - other.rewards.numpy()).max() < 1e-12
        assert np.array_equal(mine.over, other.over) and np.array_equal(mine.took_part, other.took_part.numpy())
    assert with_numpy.batch.state_hashes() == with_torch.batch.state_hashes()


# ---- features -----------------------------------------------------------------------------------


class Still:
    """Arrays of robots for features, without worlds."""

    def __init__(self, pose: Any, velocity: Any, ranges: Any) -> None:
        self.pose, self.velocity, self.ranges = (np.asarray(values, float) for values in (pose, velocity, ranges))


def test_features_are_what_they_say() -> None:
    random = np.random.default_rng(3)
    pose = random.uniform(-5, 5, (40, 3, 3))
    scene: Any = Still(pose, random.uniform(-1, 1, (40, 3, 3)), random.uniform(0, 9, (40, 3, 7)))
    scene.ranges[3, 1, 2], scene.ranges[4, 0, 0], scene.ranges[5, 0, 0] = np.nan, np.inf, 0
    points = random.uniform(-5, 5, (40, 1, 2))
    found = stage_env.towards(scene, points, 6)
    distance, bearing = stage_env.seen_from(pose, points)
    assert found.dtype == np.float32 and np.allclose(found[..., 0], np.minimum(distance / 6, 1), atol=1e-7)
    assert np.allclose(found[..., 1:], bearing, atol=1e-7) and (found[..., 0] == 1).any()
    assert np.allclose(stage_env.distance_to(pose, points), distance, rtol=1e-15)
    scene.pose[0, 0, :2] = points[0, 0]
    scene.pose[1, 1] = np.nan
    found = stage_env.towards(scene, points, 6)
    assert found[0, 0].tolist() == [0, 1, 0] and np.isnan(found[1, 1]).all()
    free = stage_env.free_space(scene, 4)
    expected = np.where(scene.ranges < 4, scene.ranges / 4, 1)
    assert free.dtype == np.float32 and np.allclose(free, expected, atol=1e-7)
    assert free[3, 1, 2] == free[4, 0, 0] == 1 and free[5, 0, 0] == 0
    fast = stage_env.speeds(scene, (0.5, 0, 2))
    assert np.allclose(fast, scene.velocity[..., ::2] / [0.5, 2], atol=1e-6)
    whole = stage_env.joined(found, distance, free)
    assert whole.shape == (40, 3, 11) and np.array_equal(whole[..., 3], distance.astype(np.float32))
    with pytest.raises(ValueError):
        st._core.find_towards(pose, points, 6, np.empty((40, 3, 3), np.float32))


def test_memory_of_observations_is_used_again_only_if_nobody_refers_to_it() -> None:
    from stagesim.env.recycled import MOST, empty

    shape = (300, 7, 11)
    held = [empty(shape, np.float32) for _ in range(2 * MOST)]
    assert len({array.ctypes.data for array in held}) == 2 * MOST
    view = held[0][3:5, 1]
    address = held[0].ctypes.data
    held.clear()
    again = [empty(shape, np.float32) for _ in range(MOST)]
    assert address not in {array.ctypes.data for array in again}
    del view, again
    assert address in {array.ctypes.data for array in [empty(shape, np.float32) for _ in range(MOST)]}
    assert empty((3,), np.float32) is not empty((3,), np.float32)


@pytest.mark.parametrize("robots", [1, 5])
def test_ends_of_episodes_are_the_same_in_both_forms(robots: int) -> None:
    """NumPy's form is compiled, and that for tensors also works with NumPy."""
    ends = []
    for form in ("_settle", "_settle_on_card"):
        env = stage_env.StageArrayEnv(50, "arena.world", robots="r*" if robots > 1 else "r0")
        env.reset(seed=1)
        episodes, random = env._episodes, np.random.default_rng(2)
        ends.append([])
        for _ in range(6):
            episodes.scene._actions[:] = random.integers(0, 2, 50) * 300
            shape = (50, robots)
            outcome = stage_env.Outcome(np.where(random.random(shape) < 0.2, np.nan, random.normal(size=shape)),
                                        np.broadcast_to(random.random((50, 1)) < 0.3, shape))
            found = getattr(episodes, form)(outcome, random.random(50) < 0.8)
            ends[-1] += [*vars(found).values(), episodes.scene.live.copy()]
    assert sum(bool(array.any()) and not array.all() for array in ends[0]) > 15
    for one, other in zip(*ends):
        assert one.dtype == other.dtype and one.tobytes() == other.tobytes()


# ---- mistakes in tasks --------------------------------------------------------------------------


class Wrong(stage_env.Navigate):
    """Navigate with one mistake."""

    def __init__(self, mistake: str) -> None:
        super().__init__(limit=3)
        self.mistake = mistake

    def begin(self, scene: stage_env.Scene, randoms: stage_env.Randoms) -> Any:
        starts = super().begin(scene, randoms)
        if self.mistake == "note":
            scene.notes["goal"] = np.zeros((scene.n + 3, 5, 2))
        return starts[..., :2] if self.mistake == "starts" else starts

    def observe(self, scene: stage_env.Scene) -> Any:
        return super().observe(scene)[..., :-1] if self.mistake == "seen" else super().observe(scene)

    def judge(self, scene: stage_env.Scene) -> Any:
        outcome = super().judge(scene)
        if self.mistake == "missing note":
            return scene.notes["gaol"]
        return {"tuple": lambda: (outcome.reward, outcome.terminated),
                "reward": lambda: stage_env.Outcome(outcome.reward[:, 0], outcome.terminated),
                "info": lambda: stage_env.Outcome(outcome.reward, outcome.terminated, {"hit": outcome.terminated[:, 0]}),
                "type": lambda: stage_env.Outcome(outcome.reward, 1.0 * outcome.terminated),
                }.get(self.mistake, lambda: outcome)()


MISTAKES = {
    "note": r"found the note 'goal' of shape \(5, 5, 2\), expected \(2, 5, 2\): its first axis is the worlds of the scene",
    "starts": r"found poses of shape \(2, 5, 2\) from Wrong.begin\(\), expected \(2, 5, 3\): x, y and heading of each robot",
    "seen": r"found observations of shape \(2, 5, 36\) from Wrong.observe\(\), expected \(2, 5, 37\)",
    "tuple": r"found tuple from Wrong.judge\(\), expected Outcome\(reward, terminated\)",
    "reward": r"found 'reward' of shape \(2,\) from Wrong.judge\(\), expected \(2, 5\): a value for each robot of each world",
    "info": r"found 'hit' of shape \(2,\) from Wrong.judge\(\), expected \(2, 5\)",
    "type": r"found 'terminated' of the type float64 from Wrong.judge\(\), expected bools",
    "missing note": r"there is no note 'gaol': set scene.notes\['gaol'\] in begin\(\) or prepare\(\)",
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_in_tasks_are_named(mistake: str) -> None:
    env = stage_env.StageArrayEnv(2, "arena.world", Wrong(mistake))
    with pytest.raises((TypeError, ValueError, KeyError), match=MISTAKES[mistake]):
        env.reset(1)
        env.step(np.zeros((2, 5, 2)))


def test_mistakes_in_arguments_are_named() -> None:
    for make, error, text in (
            (lambda: stage_env.StageArrayEnv(2, stage_env.Navigate()), TypeError, "found the task .*: give it by task="),
            (lambda: stage_env.StageArrayEnv(2, task=5), TypeError, "found 5 as task"),
            (lambda: stage_env.StageArrayEnv(2, maps=lambda random: None).reset(), TypeError, r"found None from maps\(\)"),
            (lambda: stage_env.Task().size(None), NotImplementedError, r"Task lacks size\(\)"),
            (lambda: scenes.GridMap(np.eye(3).astype(int), 1), ValueError, "found only the numbers 0 and 1")):
        with pytest.raises(error, match=text):
            make()
    env = stage_env.StageArrayEnv(2, "arena.world")
    env.reset()
    with pytest.raises(ValueError, match=r"found actions of shape \(5, 2, 2\), expected \(2, 5, 2\), or those of a world"):
        env.step(np.zeros((5, 2, 2)))


def test_info_of_an_episode_that_is_over_is_not_that_of_the_next_one() -> None:
    """A task may return live arrays of the batch as info."""
    class Turning(stage_env.Navigate):
        def judge(self, scene: stage_env.Scene) -> Any:
            outcome = super().judge(scene)
            return stage_env.Outcome(outcome.reward, outcome.terminated, {"speed": scene.velocity[..., 2]})

    env = stage_env.StageArrayEnv(3, task=Turning(limit=2))
    env.reset(1)
    for _ in range(4):
        step = env.step(np.ones((3, 1, 2)))
        assert (step.info["speed"] == 1.5).all()
    assert step.over.all()


# ---- latency ------------------------------------------------------------------------------------


def test_robots_obey_actions_after_the_delay_of_their_world() -> None:
    """Each world equals one without latency that is given zeros first, also when episodes begin in between."""
    delays, task = np.array([0, 3, 1, 12]), stage_env.Navigate(limit=7)
    late, plain = (stage_env.StageArrayEnv(4, "arena.world", task) for _ in range(2))
    late.vary("action.delay", delays)
    assert late.varied["action.delay"].tolist() == delays.tolist()
    assert np.array_equal(late.reset(1), plain.reset(1))
    random, given, first = np.random.default_rng(2), [], 0
    for moment in range(30):
        given.append(random.uniform(-1, 1, (4, 5, 2)))
        shifted = np.stack([given[moment - delay][i] if moment - delay >= first else np.zeros((5, 2))
                            for i, delay in enumerate(delays)])
        if moment == 11:
            late = pickle.loads(pickle.dumps(late))
        mine, other = late.step(given[-1]), plain.step(shifted)
        assert np.array_equal(mine.observations, other.observations) and np.array_equal(mine.rewards, other.rewards)
        assert np.array_equal(mine.over, other.over) and mine.over.all() in (False, True)
        first = moment + 1 if mine.over.all() else first
    assert first == 28
    assert late.batch.state_hashes() == plain.batch.state_hashes()


def test_latency_of_a_vector_equals_that_of_single_environments() -> None:
    task = stage_env.Navigate(limit=6)
    ours = stage_env.StageVectorEnv(3, task=task, action_delay=2)
    theirs = SyncVectorEnv([lambda: stage_env.StageEnv(task=task, action_delay=2)] * 3)
    assert np.array_equal(ours.reset(seed=1)[0], theirs.reset(seed=1)[0])
    ours.action_space.seed(4)
    for _ in range(20):
        actions = ours.action_space.sample()
        assert all(np.array_equal(one, other) for one, other in zip(ours.step(actions)[:4], theirs.step(actions)[:4]))
    ours.vary("action.delay", np.array([5, 0, 1]))
    ours.vary("action.delay", None)
    assert ours.varied == {}


@pytest.mark.parametrize(("values", "text"), [
    (np.zeros((2, 2), int), r"found the shape \(2, 2\), expected \(2,\): a delay for each world"),
    (np.array([0.5, 1]), "expected whole numbers of actions from 0 to 1000"),
    (np.array([-1, 1]), "expected whole numbers"), (np.array([0, 1001]), "expected whole numbers")])
def test_wrong_delays_are_refused(values: Any, text: str) -> None:
    with pytest.raises(ValueError, match=text):
        stage_env.StageArrayEnv(2).vary("action.delay", values)


def test_pictures_mark_the_goals() -> None:
    env = stage_env.StageEnv(render_mode="rgb_array", render_size=(300, 300))
    before = env.render()
    env.reset(seed=1)
    scene, pixels = env._episodes.scene, env.render()
    x, y, scale = scene.batch._core.fit(0, 300, 300)
    goal = scene.notes["goal"][0, 0]
    row, column = round(150 - (goal[1] - y) * scale), round(150 + (goal[0] - x) * scale)
    assert tuple(pixels[row, column]) == (200, 30, 30)
    red = (pixels == (200, 30, 30)).all(2)
    rows, columns = np.nonzero(red)
    assert 10 < red.sum() < 60 and abs(rows.mean() - row) < 1 and abs(columns.mean() - column) < 1
    assert not (before == (200, 30, 30)).all(2).any()
