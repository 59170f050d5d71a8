# SPDX-License-Identifier: GPL-2.0-or-later
"""Names in world files may contain any bytes; those that are not UTF-8 are kept like in file names."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import pytest
import stagesim as st

LATIN = b"Stra\xdfe"
NAME = os.fsdecode(LATIN)
WORLD = b"""
name "%s"
metric( kind "distance" name "%s" )
position( name "%s" pose [0 0 0 0] say "%s" )
""" % ((LATIN,) * 4)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / NAME).mkdir()
    file = tmp_path / NAME / f"{NAME}.world"
    file.write_bytes(WORLD)
    return file


def test_names(file: Path) -> None:
    world = st.World(file)
    robot = world.model(NAME)
    assert (robot.name, robot.speech) == (NAME, NAME)
    assert world.fleet().names == (NAME,)
    assert world.fleet(f"*{NAME[-1]}").names == (NAME,)
    assert list(world.metrics) == [NAME]
    assert "Stra" in repr(world)
    robot.name = NAME + "\udce9"
    assert world.model(NAME + "\udce9") == robot
    world.set_metric("\udcff", 2)
    assert world.metrics["\udcff"] == 2
    batch = st.Batch(file, n=2)
    assert (batch.names, list(batch.metrics)) == ((NAME,), [NAME])
    assert pickle.loads(pickle.dumps(world)).state_hash() == world.state_hash()
    assert [thing.name for thing in world._core.things()] == [NAME + "\udce9"]


def test_text_and_path_of_bytes(file: Path) -> None:
    text = WORLD.decode(errors="surrogateescape")
    assert st.World.from_text(text).model(NAME).exists
    assert st.World(os.fsencode(file)).model(NAME).exists  # type: ignore[arg-type]


def test_messages(file: Path) -> None:
    file.write_bytes(WORLD + b"\nnonsense_%s( )" % LATIN)
    with pytest.raises(st.WorldError) as raised:
        st.World(file)
    assert raised.value.line == WORLD.count(b"\n") + 2
    assert "Stra\\xdfe.world:6:" in str(raised.value) and "found byte 0xdf" in str(raised.value)
    with pytest.raises(st.GoneError):
        st.World.from_text("").model(NAME)


def test_surrogates_that_encode_no_byte_are_refused() -> None:
    world = st.World.from_text("model( )")
    with pytest.raises(TypeError, match="found .* expected a text"):
        world.models[0].name = "\ud800"
