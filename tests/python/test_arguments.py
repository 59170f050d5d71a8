# SPDX-License-Identifier: GPL-2.0-or-later
"""Invalid arguments are refused with messages that say what was found and what was expected."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim import env as stage_env

#: Values that are not integers and must not be truncated to integers.
NO_INTEGERS = (1.0, 2.5, np.float64(3), np.float32(1.5), "a", None, True, [1], 1j)
NO_NUMBERS = ("a", None, [1.0], 1j, {})


def refused(call: Callable[[], Any], name: str) -> None:
    """Expects a TypeError with a message of one line."""
    with pytest.raises(TypeError) as raised:
        call()
    text = str(raised.value)
    assert text.startswith("found ") and ", expected " in text and "\n" not in text, text
    assert name in text, text


@pytest.mark.parametrize("value", NO_INTEGERS)
def test_integers(room: str, value: Any) -> None:
    world, batch = st.World.from_text(room), st.Batch("arena.world", n=2, threads=1)
    refused(lambda: world.step(value), "steps")
    refused(lambda: batch.step(value), "steps")
    refused(lambda: world.render(value, 8), "width")
    refused(lambda: world.render(8, value), "height")
    refused(lambda: batch.rollout(moments=2, n=value), "steps")
    refused(lambda: st.Batch("arena.world", n=value), "worlds")
    refused(lambda: st.Batch("arena.world", 1, seeds=[value]), "seed")
    refused(lambda: setattr(world.model("a"), "fiducial_return", value), "fiducial_return")
    refused(lambda: setattr(world.model("a"), "fiducial_key", value), "fiducial_key")
    refused(lambda: world.create("ranger").add_sensor(5, 1, value), "samples")
    if value is not None:
        refused(lambda: st.World.from_text(room, seed=value), "seed")
        refused(lambda: st.World.from_text(room, threads=value), "threads")
        refused(lambda: st.Batch("arena.world", n=1, threads=value), "threads")
        refused(lambda: world.reset(value), "seed")
        refused(lambda: batch.rollout(moments=value), "moments")
    if value is not None and not isinstance(value, list):
        refused(lambda: batch.reset(value), "seed")
        refused(lambda: stage_env.StageVectorEnv(2, threads=1).reset(seed=value), "seed")


def test_integers_of_numpy(room: str) -> None:
    world, batch = st.World.from_text(room, seed=np.uint64(2**63)), st.Batch("arena.world", n=np.int64(2), threads=1)
    world.step(np.int32(2))
    batch.step(np.uint8(2), ids=np.int64(1))
    batch.reset(np.array([3, 4]))
    assert (world.seed, world.steps, batch.n, batch.seeds) == (2**63, 2, 2, [3, 4])


@pytest.mark.parametrize("value", NO_NUMBERS)
def test_numbers(room: str, value: Any) -> None:
    world = st.World.from_text(room)
    robot, ranger = world.model("a"), world.create("ranger")
    for name in ("z", "mass", "ranger_return"):
        refused(lambda: setattr(robot, name, value), name)
    for call, names in ((robot.drive, "x y a"), (robot.go_to, "x y a"),
                        (lambda *given: ranger.add_sensor(*given, 3), "range fov")):
        for place, name in enumerate(names.split()):
            given = [0.1] * len(names.split())
            call(*given)
            given[place] = value
            refused(lambda: call(*given), f" as {name}, expected a number")


@pytest.mark.parametrize("value", [(1, 2), (1, 2, 3, 4, 5), (1, 2, "a"), 1, None, "abc", ()])
def test_tuples(room: str, value: Any) -> None:
    world = st.World.from_text(room)
    robot = world.model("a")
    for name in ("pose", "global_pose", "size", "color"):
        refused(lambda: setattr(robot, name, value), name)
    refused(lambda: world.create(pose=value), "pose")
    assert len(world.models) == 7, "a model whose pose is refused is not made"
    refused(lambda: world.create("ranger").add_sensor(5, 1, 3, value), "pose")


def test_tuples_of_other_kinds(room: str) -> None:
    robot = st.World.from_text(room).model("a")
    robot.pose = [1, 2, 3]  # type: ignore[assignment]
    robot.pose = np.array([1, 2, 0.5])  # type: ignore[assignment]
    assert robot.pose == (1, 2, 0.5)


def test_texts_and_booleans(room: str) -> None:
    world = st.World.from_text(room)
    robot = world.model("a")
    for value in (1, None, b"a", ["a"]):
        refused(lambda: setattr(robot, "name", value), "name")
        refused(lambda: setattr(robot, "speech", value), "speech")
        refused(lambda: world.model(value), "name of a model")
        refused(lambda: st.World.from_text(room, settings=[value]), "setting")
        refused(lambda: world.create(value), "type")
    for value in ("a", 2, None):
        refused(lambda: setattr(robot, "obstacle_return", value), "obstacle_return")


def test_batches_take_steps_as_worlds_do() -> None:
    """The first argument of step() is the number of steps, that of reset() the seeds; `ids` selects worlds."""
    batch, world = st.Batch("arena.world", n=8, seeds=[7] * 8, threads=1), st.World("arena.world", seed=7)
    for one in (batch, world):
        one.step(5)
    assert batch.state_hashes() == [world.state_hash()] * 8
    for one in (batch, world):
        one.reset(5)
        one.step(2)
    assert batch.state_hashes() == [world.state_hash()] * 8
    for wrong in ([0, 3], np.ones(8, bool), (1,)):
        refused(lambda: batch.step(wrong), "ids=")
    refused(lambda: batch.reset(np.ones(8, bool)), "ids=")
    refused(lambda: batch.step(ids=[0.0, 1.0]), "numbers of worlds")
    refused(lambda: batch.snapshot(1.0), "the number of a world")
