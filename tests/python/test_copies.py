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
from stagesim import env as stage_env

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
