# SPDX-License-Identifier: GPL-2.0-or-later
"""Batches whose worlds are stepped on a device: everything equals a batch on the host, to the bit."""

from __future__ import annotations

import copy
import itertools
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st

ARRAYS = ("pose", "velocity", "actual_velocity", "estimate", "sensed_pose", "sensed_time", "energy", "stalled", "time",
          "ended", "ranger.ranges", "ranger.intensities", "ranger.bearings", "ranger.origins", "ranger.time")
WALLS = """
resolution 0.02
contacts "cells"
model( pose [0 1.3 0 0] size [2.6 0.1 1] )
model( pose [0 -1.3 0 10] size [2.6 0.1 1] ranger_return 3 )
"""
KINDS = {
    "noisy robots with packs": WALLS + """
define bot position( size [0.3 0.3 0.3] localization "odom" odom_noise [0.02 0.01 0.03 0.02]
  ranger( pose [0 0 -0.1 0] sensor( range [0 2] fov 270 samples 12 noise [0.01 0.02 0.1] ) ) )
bot( pose [-0.5 -0.5 0 30] joules 40 joules_capacity 40 )
bot( pose [0.5 0.5 0 -100] )
""",
    "robots of several types": WALLS + """
define scanner ranger( pose [0 0 -0.1 0] sensor( range [0 1.5] fov 360 samples 16 ray_model "exact" ) )
define car position( drive "car" size [0.3 0.2 0.3] localization "gps" scanner() )
define cart position( drive "omni" size [0.2 0.2 0.3] scanner( sensor( range [0 1] samples 5 ) ) )
cart( pose [-0.5 -0.5 0 30] )
car( pose [0.5 0.5 0 -100] )
cart( pose [0.5 -0.5 0 60] )
position( pose [0 0 0 60] size [0.2 0.2 0.2] )
""",
    "outlines that touch": WALLS.replace("cells", "outlines") + """
define bot position( size [0.3 0.3 0.3] localization "odom" wheel_slip 0.3 friction 0.3
  ranger( pose [0 0 -0.1 0] sensor( range [0 2] fov 270 samples 12 ) ) )
bot( pose [-0.5 -0.5 0 30] )
bot( pose [0.5 0.5 0 -100] round 1 drive "omni" )
bot( pose [0.5 -0.5 0 90] pushable 1 )
model( pose [0 0 0 20] size [0.2 0.3 0.3] pushable 1 )
model( pose [-0.9 0 0 0] size [0.1 2.4 1] )
""",
    "a population": WALLS + """
define bot position( size [0.2 0.2 0.3] ranger( pose [0 0 -0.1 0] sensor( range [0 1] fov 180 samples 7 ) ) )
population( name "bots" model "bot" count 4 area [0 0 2 2] )
""",
}


@pytest.fixture(scope="module")
def device(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The device of the tests, which are skipped if there is no OpenCL."""
    file = tmp_path_factory.mktemp("device") / "w.world"
    file.write_text(WALLS)
    try:
        st.World(file, opencl=True)
    except st.StageError as error:
        if "OpenCL" not in str(error):
            raise
        pytest.skip(str(error))
    return "opencl"


def pair(text: str, folder: Path, n: int, device: str) -> tuple[st.Batch, st.Batch]:
    """Returns equal worlds on the host and on a device."""
    file = folder / "w.world"
    file.write_text(text)
    return st.Batch(file, n), st.Batch(file, n, device=device)


class Comparison:
    """Does the same with two batches, and compares their arrays and states."""

    def __init__(self, batches: tuple[st.Batch, st.Batch]) -> None:
        self.batches = batches
        self.arrays = [{name: batch.array(name) for name in ARRAYS} for batch in batches]

    def check(self, what: str) -> None:
        """Fails if the batches differ."""
        host, device = self.arrays
        for name in ARRAYS:
            of_device = np.asarray(device[name])
            assert host[name].dtype == of_device.dtype and host[name].shape == of_device.shape, name
            assert np.array_equal(host[name], of_device, equal_nan=host[name].dtype.kind == "f"), (what, name)
        assert self.batches[0].state_hashes() == self.batches[1].state_hashes(), what

    def do(self, method: str, *arguments: Any, **options: Any) -> None:
        """Calls a method of both."""
        for batch in self.batches:
            getattr(batch, method)(*arguments, **options)

    def act(self, random: np.random.Generator) -> str:
        """Does something at random."""
        n, robots = self.batches[0].n, len(self.batches[0])
        match random.integers(0, 6):
            case 0:
                mask = random.random(n) < 0.3
                self.do("reset", random.integers(0, 1000, mask.sum()), ids=mask)
                return "reset of some"
            case 1:
                self.do("reset")
                return "reset of all"
            case 2:
                self.do("teleport", random.uniform(-1, 1, (n, robots, 3)), random.random((n, robots)) < 0.3)
                return "teleport"
            case 3:
                source, target = random.integers(0, n, 2).tolist()
                for batch in self.batches:
                    batch.restore(batch.snapshot(source), target)
                return "restore"
        return "nothing"

    def step(self, random: np.random.Generator) -> None:
        """Gives commands, some of which are NaN, and steps all worlds or some."""
        n, robots = self.batches[0].n, len(self.batches[0])
        commands = random.uniform(-1, 1, (n, robots, 3))
        commands[random.random((n, robots)) < 0.2] = np.nan
        for batch in self.batches:
            batch.cmd[...] = commands
        self.do("step", int(random.integers(0, 4)), ids=None if random.random() < 0.5 else random.random(n) < 0.5)


@pytest.mark.parametrize("order", list(itertools.permutations(["cmd", "ranger.ranges", "estimate"])))
def test_states_do_not_depend_on_when_arrays_were_asked_for(order: tuple[str, ...], device: str, tmp_path: Path) -> None:
    host, other = pair(next(iter(KINDS.values())), tmp_path, 3, device)
    for batch in (host, other):
        for name in order:
            batch.array(name)
        batch.reset([5, 6, 7])
        batch.step()
        batch.reset([8], ids=[1])
        batch.cmd[...] = np.full(batch.cmd.shape, 0.3)
        batch.step(2)
    assert host.state_hashes() == other.state_hashes()


@pytest.mark.parametrize("n", [1, 33, 300])
@pytest.mark.parametrize("kind", KINDS)
def test_all_arrays_and_states_are_those_of_the_host(kind: str, n: int, device: str, tmp_path: Path) -> None:
    both = Comparison(pair(KINDS[kind], tmp_path, n, device))
    both.check("start")
    random = np.random.default_rng(n)
    stalls = hits = 0
    for moment in range(25):
        what = both.act(random)
        both.check(f"{moment}: {what}")
        both.step(random)
        both.check(f"{moment}: {what}, step")
        host = both.arrays[0]
        stalls += host["stalled"].sum()
        hits += np.nansum(host["ranger.intensities"] > 0)
    assert hits > 0 and (n == 1 or stalls > 0)


def test_cmd_of_reset_worlds_is_zero(device: str, tmp_path: Path) -> None:
    for batch in pair(KINDS["a population"], tmp_path, 5, device):
        batch.cmd[...] = 1
        batch.step(2)
        batch.reset(ids=[1, 3])
        assert np.asarray(batch.cmd).sum(axis=(1, 2)).tolist() == [12, 0, 12, 0, 12]


def test_rollouts_record_the_arrays_of_the_host(device: str, tmp_path: Path) -> None:
    host, other = pair(KINDS["noisy robots with packs"], tmp_path, 7, device)
    commands = np.random.default_rng(3).uniform(-1, 1, (6, 7, 2, 3))
    records = [batch.rollout(commands, n=3, record=["pose", "ranges", "stalled"]) for batch in (host, other)]
    for name, array in records[0].items():
        assert np.array_equal(array, records[1][name]), name


def test_copies_go_on_as_the_original(device: str, tmp_path: Path) -> None:
    batch = pair(KINDS["robots of several types"], tmp_path, 3, device)[1]
    batch.cmd[...] = 0.3
    batch.step(3)
    for copied in (copy.deepcopy(batch), pickle.loads(pickle.dumps(batch))):
        assert copied.device == batch.device
        copied.step(2)
        fork = batch.fork(1)
        fork.step(2)
        assert copied.state_hash(1) == fork.state_hash()


def test_worlds_that_a_device_cannot_step_are_refused_with_the_reason(device: str, tmp_path: Path) -> None:
    file = tmp_path / "w.world"
    walls = (f"model( pose [{x} 9 0 0] size [0.1 0.1 1] )\n" for x in range(1000))
    robots = (f"position( pose [{x} 0 0 0] size [0.1 0.1 1] )\n" for x in range(250))
    file.write_text("".join((*walls, *robots)))
    with pytest.raises(st.WorldError, match="can't step world 0, because contacts .*256 MB.*without device="):
        st.Batch(file, 2, device=device)


def test_arrays_that_a_device_lacks_are_refused(device: str, tmp_path: Path) -> None:
    batch = pair(KINDS["a population"], tmp_path, 2, device)[1]
    with pytest.raises(st.StageError, match="no array called estimate_covariance.*without device="):
        batch.estimate_covariance
    with pytest.raises(st.GoneError, match="no robot has a ranger number 1"):
        batch.ranger(1)


def test_a_sensor_must_be_asked_for_before_the_first_step(device: str, tmp_path: Path) -> None:
    batch = pair(KINDS["a population"], tmp_path, 2, device)[1]
    batch.step(1)
    with pytest.raises(st.StageError, match="before the first step, or after a reset of all worlds"):
        batch.ranges
    batch.reset()
    assert batch.ranges.shape == (2, 4, 7)


def test_unknown_devices_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "w.world"
    file.write_text(KINDS["a population"])
    with pytest.raises(ValueError, match="found the device 'cuda', expected None, \"opencl\""):
        st.Batch(file, 2, device="cuda")
    with pytest.raises(st.StageError, match="no OpenCL device"):
        st.Batch(file, 2, device="opencl:no such device")


def test_commands_that_controllers_replace_are_given_before_each_step(tmp_path: Path, device: str) -> None:
    text = WALLS + """
define bot position( size [0.2 0.2 0.3] ranger( pose [0 0 -0.1 0] sensor( range [0 1] fov 270 samples 12 ) ) )
bot( pose [-0.5 -0.5 0 30] ctrl "stage/wander" )
bot( pose [0.5 0.5 0 -100] ctrl "stage/pedestrian x=-1 y=0" )
bot( pose [0.5 -0.5 0 -100] )
"""
    batches = pair(text, tmp_path, 20, device)
    random = np.random.default_rng(4)
    for moment in range(30):
        commands = random.uniform(-1, 1, batches[0].cmd.shape)
        commands[:, 0, 0] = np.where(random.random(20) < 0.5, np.nan, commands[:, 0, 0])
        for batch in batches:
            batch.cmd[...] = commands
            batch.step(1 + moment % 4)
        assert batches[0].state_hashes() == batches[1].state_hashes(), moment


def test_futures_on_a_device_equal_those_on_the_host(device: str) -> None:
    for kind, text in KINDS.items():
        world = st.World.from_text(text)
        fleet = world.fleet()
        readings = fleet.ranger().ranges
        here, there = (st.Futures(world, 3, device=where) for where in (None, device))
        for seeds in (None, [1, 2, 2]):
            fleet.cmd[:, 0] = .3
            world.step(4)
            told = np.random.default_rng(1).uniform((0, 0, -1), (.5, 0, 1), (3, 2, len(fleet), 3))
            record = ("pose", "ranges", "stalled")
            found, expected = (of.predict(told, n=3, record=record, seeds=seeds) for of in (there, here))
            assert there.device is not None and there.explain() is None
            for name, array in expected.items():
                np.testing.assert_array_equal(found[name], array, err_msg=f"{kind}: {name}")
        assert np.isfinite(readings).any()


@pytest.mark.parametrize("name", ["Navigate8", "PushT", "own space"])
def test_environments_on_a_device_equal_those_on_the_host(name: str, device: str) -> None:
    """A task whose space doesn't ask for its sensors is one of them: they must run before the first step of a device."""
    pytest.importorskip("gymnasium")
    from gymnasium.spaces import Box
    from stagesim import env as stage_env

    class OwnSpace(stage_env.Navigate8):
        def observation_space(self, scene: stage_env.Scene) -> Box:
            return Box(-1, 1, (37,), np.float32)

    task = OwnSpace(limit=6) if name == "own space" else stage_env.TASKS[name](limit=6)
    host, other = (stage_env.StageArrayEnv(3, task=task, device=on, arrays="numpy") for on in (None, device))
    first, second = host.reset(4), other.reset(4)
    random = np.random.default_rng(1)
    for _ in range(15):
        assert first.tobytes() == second.tobytes() and host.batch.state_hashes() == other.batch.state_hashes()
        actions = random.uniform(-1, 1, (3, len(host.agents), 2))
        mine, their = host.step(actions), other.step(actions)
        assert mine.rewards.tobytes() == their.rewards.tobytes() and np.array_equal(mine.over, their.over)
        first, second = mine.observations, their.observations
    assert host.statistics.count >= 6
