# SPDX-License-Identifier: GPL-2.0-or-later
"""Models of macros, made in worlds that have been loaded."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import stagesim as st

WORLD = """
model( name "wall" pose [3 0 0 0] size [0.1 8 1] )
define eye ranger( size [0.1 0.1 0.1] sensor( range [0 5] fov 90 samples 5 ) )
define bot position( size [0.4 0.4 0.4] drive "omni" eye( pose [0.1 0 0 0] ) )
define fast bot( velocity_bounds [-9 9 -9 9 0 0 -90 90] )
define broken bot( model( watts -1 ) )
bot( name "a" )
"""
LATE = 'bot( name "b" pose [0 2 0 0] )\n'


def test_a_model_of_a_macro_equals_one_of_the_world_file() -> None:
    """Its readings and moves are those of a robot that the file has as its last one."""
    with st.World.from_text(WORLD) as world, st.World.from_text(WORLD + LATE) as expected:
        made = world.create("bot", name="b", pose=(0, 2, 0))
        assert made.type == "position" and [child.type for child in made.children] == ["ranger"]
        fleets = world.fleet(), expected.fleet()
        for fleet in fleets:
            fleet.cmd[:] = (0.3, 0.1, 0.2), (0.4, 0.0, 0.3)
            fleet.ranger()
        for each in (world, expected):
            each.step(20)
        for name in ("pose", "ranger.ranges", "stalled"):
            assert np.array_equal(fleets[0].array(name), fleets[1].array(name)), name
        assert np.ptp(fleets[0].ranger().ranges[1]) > 0
        world.create("fast", name="c")
        assert world._core.macros("position") == ["bot", "fast", "broken"]


def test_a_reset_removes_it_and_snapshots_and_forks_have_it() -> None:
    with st.World.from_text(WORLD) as world:
        first = world.state_hash()
        with world.fork() as before:
            made = world.create("bot", name="b", pose=(0, 2, 1))
            made.drive(0.2)
            world.step(5)
            snapshot, later = world.snapshot(), world.state_hash()
            with world.fork() as copy:
                assert copy.state_hash() == later
                for each in (copy, world):
                    each.step(5)
                assert copy.state_hash() == world.state_hash()
                copy.reset()
                assert copy.state_hash() == first
            made.delete()
            world.restore(snapshot)
            assert world.state_hash() == later and world.model("b").children[0].type == "ranger"
            world.reset()
            assert world.state_hash() == first and len(world.models) == 3
            assert before.state_hash() == first
            world.create("fast", name="b")  # another entity has the number of the first one now
            assert world.model("b").children
            world.reset()
            expected = st.Batch.of(world, 1, threads=1).state_hash(0)
            world.create("bot", name="c")  # copies are in the state after loading
            assert st.Batch.of(world, 1, threads=1).state_hash(0) == expected


def test_definitions_can_be_read_later(tmp_path: Path) -> None:
    with st.World.from_text(WORLD) as world:
        with pytest.raises(st.StageError, match="turtlebot3_burger"):
            world.create("turtlebot3_burger")
        for _ in range(2):
            world.include("robots/turtlebot3_burger.inc")
        for i in range(3):
            world.create("turtlebot3_burger", name=f"t{i}", pose=(0, 2 + i, 0))
        assert world.fleet("t*").ranger().ranges.shape == (3, 360)
        bad = tmp_path / "bad.inc"
        for text, message in (('define x position( size [1 1 1] )\nmodel()', "expected 'define'"), ("define x (", "define"),
                              ('name "other"', "expected 'define'")):
            bad.write_text(text)
            with pytest.raises(st.StageError, match=message):
                world.include(str(bad))
        for name in ("nowhere.inc", 'a"b.inc', "", "a\nb"):
            with pytest.raises(st.StageError, match="found|unable"):
                world.include(name)
        with pytest.raises(TypeError):
            world.include(1)  # type: ignore[arg-type]
        assert world.step(3) == 3


@pytest.mark.parametrize(("type_", "message"), [("broken", "watts|negative"), ("nobody", "no model of the type nobody")])
def test_a_macro_with_an_error_leaves_nothing_behind(type_: str, message: str) -> None:
    with st.World.from_text(WORLD) as world:
        count = len(world.models)
        for _ in range(2):
            with pytest.raises(st.StageError, match=message):
                world.create(type_)
        assert len(world.models) == count
        world.create("bot")
        assert world.step(3) == 3
