# SPDX-License-Identifier: GPL-2.0-or-later
"""Copies of worlds, batches and environments, in this process or another one, continue as the original does."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import stagesim as st
from gymnasium.vector import AutoresetMode
from stagesim import env as stage_env
from stagesim import scenes

WORLDS = ("cave.world", "simple.world", "arena.world", "forage.world")


def pickled(original: Any) -> Any:
    return pickle.loads(pickle.dumps(original))


COPIES: tuple[Callable[[Any], Any], ...] = (copy.deepcopy, pickled)


@pytest.mark.parametrize("copied", COPIES)
@pytest.mark.parametrize("file", WORLDS)
def test_world(copied: Callable[[Any], Any], file: str) -> None:
    world = st.World(file, seed=9, controllers=False, settings={"world.resolution": 0.05})
    world.step(3)
    world.create(pose=(1, 1, 0), size=(0.2, 0.2, 0.2), name="box")
    for model in world.models:
        if model.type == "position":
            model.drive(0.3, a=0.5)
    world.step()
    again = copied(world)
    before = world.state_hash()
    assert again is not world and again.state_hash() == before
    assert (again.seed, again.time) == (9, world.time)
    pose = world.fleet().pose.copy()
    world.step(5)
    assert again.state_hash() == before != world.state_hash()
    assert (again.fleet().pose == pose).all() and (world.fleet().pose != pose).any(), "the robots drive"
    again.step(5)
    assert again.state_hash() == world.state_hash()
    for one in (world, again):
        one.reset(4)
        one.step(2)
    assert again.state_hash() == world.state_hash()


def test_world_from_a_text(room: str) -> None:
    world = st.World.from_text(room, seed=3)
    world.fleet().cmd[:, 0] = 0.1
    world.step(4)
    before = world.state_hash()
    copies = [copied(world) for copied in (pickled, copy.copy, copy.deepcopy)]
    world.step()
    assert before != world.state_hash()
    assert [one.state_hash() for one in copies] == [before] * 3


def test_world_that_can_not_be_pickled(room: str, tmp_path: Path) -> None:
    file = tmp_path / "room.world"
    file.write_text(room)
    world = st.World(file)
    state = pickle.dumps(world)
    file.write_text(room.replace("resolution 0.02", "resolution 0.05"))
    with pytest.raises(st.WorldError, match="found another world file"):
        pickle.loads(state)
    file.unlink()
    with pytest.raises(st.WorldError, match="room.world"):
        pickle.loads(state)
    assert copy.deepcopy(world).state_hash() == world.state_hash()
    world.close()
    with pytest.raises(st.GoneError):
        pickle.dumps(world)


@pytest.mark.parametrize("copied", COPIES)
def test_batch(copied: Callable[[Any], Any]) -> None:
    batch = st.Batch("arena.world", n=3, seeds=[5, 6, 7], threads=2)
    _ = batch.ranges
    batch.cmd[..., 0] = 0.2
    batch.step(4, ids=[0, 2])
    again = copied(batch)
    assert (again.seeds, again.n, again.names, again.threads) == (batch.seeds, 3, batch.names, 2)
    assert (again.pose == batch.pose).all()
    assert (again.time == batch.time).all()
    for one in (batch, again):
        one.step(3)
    assert again.state_hashes() == batch.state_hashes()
    again.cmd[...] = 0
    assert (batch.cmd[..., 0] == 0.2).all()
    again.reset()
    assert again.state_hash(1) == st.Batch("arena.world", n=1, seeds=[6]).state_hash(0)


def run(env: Any, actions: np.ndarray) -> list[Any]:
    """The results of the actions."""
    return [tuple(np.asarray(part).tolist() for part in env.step(action)[:4]) for action in actions]


ENVIRONMENTS = {
    "single": lambda: stage_env.StageEnv(task="Navigate"),
    "made": lambda: gymnasium.make("Stage/Forage-v0"),
    "vector": lambda: stage_env.StageVectorEnv(3, task="Disperse", threads=2),
    "of a world": lambda: stage_env.StageEnv(st.World("arena.world"), task="Navigate"),
}


@pytest.mark.parametrize("copied", COPIES)
@pytest.mark.parametrize("kind", ENVIRONMENTS)
def test_environment(copied: Callable[[Any], Any], kind: str) -> None:
    """Environments can be copied in the middle of an episode."""
    original = ENVIRONMENTS[kind]()
    original.reset(seed=3)
    random = np.random.default_rng(1)
    actions = random.uniform(-1, 1, (10, *original.action_space.shape))
    run(original, actions[:4])
    again = copied(original)
    assert run(again, actions[4:]) == run(original, actions[4:])
    first, second = original.reset()[0], again.reset()[0]
    assert (first == second).all()


@pytest.mark.parametrize("copied", COPIES)
def test_parallel_environment(copied: Callable[[Any], Any]) -> None:
    original = stage_env.parallel_env(task="Disperse")
    original.reset(seed=2)
    moves = {agent: np.ones(2) for agent in original.agents}
    original.step(moves)
    again = copied(original)
    outcomes = []
    for env in (original, again):
        steps = [env.step(moves) for _ in range(5)]
        outcomes.append([({agent: seen.tolist() for agent, seen in observed.items()}, *rest[:3])
                         for observed, *rest in steps])
    assert outcomes[0] == outcomes[1]
    assert outcomes[0][0] != outcomes[0][-1], "the robots move"


def cluttered(random: np.random.Generator) -> scenes.Scene:
    """A room with random obstacles and a robot, for each episode."""
    walls = scenes.clutter(6, 6, seed=int(random.integers(2**31)))
    [[x, y, a]] = scenes.free_places(walls, 1, 0.3, seed=int(random.integers(2**31)))
    lidar = scenes.Ranger(range=(0, 4), fov=2 * np.pi, samples=16)
    return scenes.Scene(walls, [scenes.Robot(name="r", pose=(x, y, a), size=(0.3, 0.3, 0.3), sensors=[lidar])])


def plain(value: Any) -> Any:
    """Results without arrays, to be compared."""
    if isinstance(value, dict):
        return {name: plain(part) for name, part in value.items()}
    if isinstance(value, np.ndarray):
        return [plain(part) for part in value] if value.dtype == object else value.tolist()
    return [plain(part) for part in value] if isinstance(value, (list, tuple)) else value


def outcome(env: stage_env.StageVectorEnv, action: np.ndarray) -> list[Any]:
    """All results of a step, and of the reset of ended worlds that follows in the mode DISABLED."""
    results = env.step(action)
    ended = results[2] | results[3]
    if env.autoreset_mode is AutoresetMode.DISABLED and ended.any():
        return plain([*results, env.reset(options={"reset_mask": ended})])
    return plain(results)


@pytest.mark.parametrize("copied,options", [
    (copy.deepcopy, {}), (pickled, {}), (pickled, {"maps": cluttered}), (copy.deepcopy, {"vary": True})],
    ids=["deepcopy", "pickle", "maps", "vary"])
@pytest.mark.parametrize("mode", AutoresetMode)
def test_vector_environment_after_each_step(copied: Callable[[Any], Any], options: dict[str, Any],
                                            mode: AutoresetMode) -> None:
    """Copies go on as the original, also those of environments some of whose episodes have just ended."""
    task = stage_env.Navigate(limit=5, goal_radius=1.5, steps=10)
    world = cluttered(np.random.default_rng(0)) if "maps" in options else None
    env = stage_env.StageVectorEnv(4, world, task, autoreset_mode=mode, episode_info=True, maps=options.get("maps"))
    if "vary" in options:
        env.vary("ranger.noise[0]", np.linspace(0, 0.2, 4))
    env.reset(seed=8)
    env.step(np.zeros((4, 2)))
    env.reset(options={"reset_mask": np.array([True, False, True, False])})
    random = np.random.default_rng(1)
    actions = random.uniform(-1, 1, (11, 4, 2))
    actions[..., 0] = np.abs(actions[..., 0])
    results, copies = [], []
    for action in actions:
        copies.append(copied(env))
        results.append(outcome(env, action))
    ends = np.array([np.array(result[2]) | np.array(result[3]) for result in results])
    assert ends.sum() > 4 and len({tuple(column) for column in ends.T.tolist()}) > 1, "episodes end at different times"
    for begin, copy_of_env in enumerate(copies):
        assert [outcome(copy_of_env, action) for action in actions[begin:begin + 2]] == results[begin:begin + 2]


@pytest.mark.parametrize("copied", COPIES)
def test_copies_that_begin_with_a_reset(copied: Callable[[Any], Any]) -> None:
    """Sensors of a copy measure from its first step on."""
    env = stage_env.StageVectorEnv(3)
    before = copied(env)
    seen, _ = env.reset(seed=1)
    for one in (before, copied(env)):
        assert (one.reset(seed=1)[0] == seen).all()


@pytest.mark.parametrize("copied", COPIES)
def test_array_environment(copied: Callable[[Any], Any]) -> None:
    """Copies go on as the original, also while some robots of a world have ended and others have not."""
    env = stage_env.StageArrayEnv(3, "arena.world", stage_env.Navigate(limit=6, goal_radius=1.5, steps=10))
    env.reset(seed=4)
    actions = np.random.default_rng(2).uniform(0, 1, (8, 3, len(env.agents), 2))
    copies, results = [], []
    for action in actions:
        copies.append(copied(env))
        results.append(plain(list(env.step(action))))
    for begin, copy_of_env in enumerate(copies):
        assert [plain(list(copy_of_env.step(action))) for action in actions[begin:]] == results[begin:]


def state_after(given: tuple[st.World, Any]) -> tuple[str, list[float]]:
    """Called in a separate process: the state after some steps."""
    world, env = given
    world.step(5)
    return world.state_hash(), env.step(np.zeros(env.action_space.shape))[0].tolist()


def test_processes() -> None:
    """Copies work in spawned processes, which start with empty memory."""
    world, env = st.World("cave.world", seed=2, controllers=False), ENVIRONMENTS["single"]()
    world.step(3)
    env.reset(seed=5)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        [there] = pool.map(state_after, [(world, env)])
    assert there == state_after((world, env))
