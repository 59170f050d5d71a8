# SPDX-License-Identifier: GPL-2.0-or-later
"""Futures: what happens if robots get other commands."""

from __future__ import annotations

import numpy as np
import pytest
import stagesim as st

TEXT = """
define bot position( size [.3 .3 .4] localization "odom" odom_noise [.1 .1 .1 .1]
  ranger( pose [0 0 -.1 0] {rate} sensor( range [0 4] fov 270 samples 24 noise [.01 .01 0] ) ) )
bot( name "a" pose [-1 0 0 0] ) bot( name "b" pose [1 0 0 180] ) bot( name "c" pose [0 1.5 0 -90] )
model( pose [0 -1 0 20] size [2 .1 1] )
"""


@pytest.mark.parametrize("rate", ["", "update_interval 300"])
@pytest.mark.parametrize("contacts", ["cells", "outlines"])
@pytest.mark.parametrize("extra", ["", "position( pose [3 3 0 0] gripper( alwayson 1 ) )\n"])
def test_a_future_is_what_the_world_does_with_these_commands(contacts: str, extra: str, rate: str) -> None:
    """Also from a later moment, and in worlds that need an object each."""
    world = st.World.from_text(f"contacts \"{contacts}\"\n" + TEXT.format(rate=rate) + extra)
    fleet, random = world.fleet("[abc]"), np.random.default_rng(3)
    ranges = fleet.ranger().ranges
    futures = st.Futures(world, 5, threads=2, robots="[abc]")
    assert (futures.n, futures.names) == (5, ("a", "b", "c"))
    assert (futures.explain() is None) == (not extra)
    for _ in range(3):
        told = random.uniform((-.2, 0, -1), (.8, 0, 1), (5, 4, 3, 3))
        before = world.state_hash()
        found = futures.predict(told, n=3, record=("pose", "ranges", "stalled"))
        assert world.state_hash() == before
        assert not found["failed"].any() and found["failed"].shape == (5, 4)
        for i in range(5):
            fork = world.fork()
            other = fork.fleet("[abc]")
            scan = other.ranger().ranges
            for moment in range(4):
                other.cmd[...] = told[i, moment]
                fork.step(3)
                np.testing.assert_array_equal(found["pose"][i, moment], other.pose)
                np.testing.assert_array_equal(found["ranges"][i, moment], scan)
                np.testing.assert_array_equal(found["stalled"][i, moment], other.stalled)
        fleet.cmd[...] = told[0, 0]
        world.step(7)
    assert np.isfinite(ranges).all()


def test_futures_share_the_noise_unless_they_have_seeds() -> None:
    world = st.World.from_text(TEXT.format(rate=""))
    world.fleet().cmd[:, 0] = .2
    world.step(3)
    futures = st.Futures(world, 3)
    same = futures.predict((.2, 0, 0) * np.ones((1, 1, 1)), n=5, record=("ranges", "estimate"))
    assert (same["ranges"] == same["ranges"][0]).all()
    other = futures.predict(moments=1, n=5, record=("ranges", "estimate"), seeds=[1, 2, 1])
    assert (other["ranges"][0] == other["ranges"][2]).all() and (other["estimate"][0] == other["estimate"][2]).all()
    assert (other["ranges"][0] != other["ranges"][1]).any() and (other["estimate"][0] != other["estimate"][1]).any()
    assert (futures.predict(moments=1, n=5, record=("ranges",), seeds=1)["ranges"] == other["ranges"][0]).all()


def test_robots_keep_their_commands_without_others() -> None:
    world = st.World.from_text("position( velocity [.5 0 0 0] ) model( pose [3 0 0 0] )", contacts="cells")
    world.fleet().cmd[:, 0] = .4
    world.step()
    found = st.Futures(world, 2).predict(moments=3, n=10, record=("pose", "stalled"))
    np.testing.assert_allclose(found["pose"][:, :, 0, 0] - world.fleet().pose[0, 0], [[.4, .8, 1.2]] * 2)


def test_models_that_were_created_later_are_in_the_futures() -> None:
    world = st.World.from_text("position( name \"r\" )")
    futures = st.Futures(world, 2)
    told = np.array([[[[.5, 0, 0]]]])
    assert not futures.predict(told, n=20, record=("stalled",))["stalled"].any()
    world.create(pose=(1.2, 0, 0), size=(.5, .5, .5), name="box")
    assert futures.predict(told, n=20, record=("stalled",))["stalled"].all()
    world.model("box").delete()
    assert not futures.predict(told, n=20, record=("stalled",))["stalled"].any()


def test_mistakes_are_reported() -> None:
    world = st.World.from_text("position( name \"r\" )")
    futures = st.Futures(world, 2)
    with pytest.raises(ValueError, match="found commands of shape"):
        futures.predict(np.zeros(3))
    with pytest.raises(ValueError):
        futures.predict(np.zeros((3, 1, 1, 3)))
    with pytest.raises(ValueError, match="neither commands nor moments"):
        futures.predict()
    with pytest.raises(ValueError):
        futures.predict(moments=1, seeds=[1])
    assert repr(futures).startswith("<2 futures of <World")
