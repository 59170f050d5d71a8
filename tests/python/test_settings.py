# SPDX-License-Identifier: GPL-2.0-or-later
"""Settings that override a world file, and metrics, for worlds, batches and environments."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st

METRICS = """
metric( name "driven" kind "distance" model "bot" )
metric( name "goal" kind "time_to_goal" goal [2 0] radius 0.3 first 1 )
"""


@pytest.mark.parametrize("settings", [
    ["bots=2", "a.pose=[1 2 0 90]", "world.resolution=0.05"],
    {"bots": 2, "a.pose": [1, 2, 0, 90], "world.resolution": np.float64(0.05)},
    iter(("bots=2", "a.pose=[1 2 0 90]", "world.resolution=0.05"))])
def test_settings(room: str, settings: Any) -> None:
    text = room + 'population( name "bots" model "bot" count 9 )\n'
    world = st.World.from_text(text, settings=settings)
    assert len(world.fleet()) == 5
    assert world.model("a").pose == pytest.approx((1, 2, math.pi / 2))
    first = world.state_hash()
    world.step(3)
    world.reset()
    assert world.state_hash() == first
    assert world.fork().state_hash() == first


def test_settings_accept_booleans(room: str) -> None:
    hash_of = {value: st.World.from_text(room, settings={"a.obstacle_return": value}).state_hash()
               for value in (True, False)}
    assert hash_of[True] == st.World.from_text(room).state_hash() != hash_of[False]


@pytest.mark.parametrize("settings, error, text", [
    ("bots=2", TypeError, "expected a list of texts or a mapping"),
    (["nothing=2"], st.WorldError, "found no population and no model of that name"),
    ({"world.resolution": -1}, st.WorldError, "resolution"),
    (["a.no_such_property=1"], st.WorldError, "no_such_property"),
])
def test_invalid_settings_are_refused(room: str, settings: Any, error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        st.World.from_text(room, settings=settings)


def test_batches_and_environments(tmp_path: Path, room: str) -> None:
    file = tmp_path / "room.world"
    file.write_text(room)
    settings = {"world.interval_sim": 200, "a.pose": (1, 0, 0, 0)}
    batch, world = st.Batch(file, 3, settings=settings), st.World(file, seed=2, settings=settings)
    batch.step()
    world.step()
    assert batch.time.tolist() == [0.2] * 3
    assert batch.state_hash(2) == world.state_hash()
    env = pytest.importorskip("stagesim.env", reason="Gymnasium is not installed")
    assert env.StageEnv(file, settings={"bot.color": "red"}).agents == ("a", "b", "c")


def test_metrics(room: str) -> None:
    world = st.World.from_text(room + METRICS)
    assert world.metrics == {"driven": 0, "goal": None}
    robot = world.fleet("a")
    robot.cmd[0, 0] = 0.5
    world.step(20)
    assert world.metrics["driven"] == pytest.approx(1 / 3, abs=0.02)
    world.step(20)
    assert world.metrics["goal"] == pytest.approx(3.4, abs=0.11)
    world.reset()
    assert world.metrics == {"driven": 0, "goal": None}
    assert st.World.from_text(room).metrics == {}


def test_own_metrics_hold_until_a_restore(room: str) -> None:
    world = st.World.from_text(room)
    world.set_metric("score", 3)
    world.set_metric("other", None)
    world.set_metric("score", 4.5)
    assert world.metrics == {"score": 4.5, "other": None}
    snapshot = world.snapshot()
    world.restore(snapshot)
    assert world.metrics == {}
    world.close()
    with pytest.raises(st.GoneError):
        world.metrics  # noqa: B018
