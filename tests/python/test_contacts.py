# SPDX-License-Identifier: GPL-2.0-or-later
"""World.contacts(), and the properties of models in contacts."""

from __future__ import annotations

import numpy as np
import pytest
import stagesim as st

WORLD = """
contacts "outlines"
model( name "wall" pose [1.5 0 0 0] size [1 10 1] )
model( name "box" pose [0.5 3 0 0] size [0.4 0.4 0.4] mass 2 pushable 1 friction 0.25 )
position( name "r" alwayson 1 size [0.4 0.4 0.4] round 1 pose [0 0 0 0] )
position( name "p" alwayson 1 size [0.4 0.4 0.4] round 1 pose [0 3 0 0] )
"""


def test_contacts_tell_models_places_and_normals() -> None:
    world = st.World.from_text(WORLD)
    fleet = world.fleet()
    fleet.cmd[:, 0] = 0.3
    assert len(world.contacts().gaps) == 0
    world.step(60)
    contacts = world.contacts()
    names = {model.id: model.name for model in world.models}
    pairs = [(names[a], names[b]) for a, b in contacts.models.tolist()]
    assert ("r", "wall") in pairs
    at = pairs.index(("r", "wall"))
    np.testing.assert_allclose(contacts.normals[at], [1, 0], atol=1e-9)
    np.testing.assert_allclose(contacts.points[at], [0.9998, 0], atol=1e-5)
    assert contacts.gaps[at] == pytest.approx(0.0004, abs=1e-6)
    assert {"box", "p"} in [set(pair) for pair in pairs]
    assert world.model("box").pose[0] == pytest.approx(0.8, abs=0.002)  # pushed to the wall


def test_cells_have_no_contacts() -> None:
    world = st.World.from_text(WORLD, contacts="cells")
    fleet = world.fleet()
    fleet.cmd[:, 0] = 0.3
    world.step(60)
    assert len(world.contacts().models) == 0
    assert world.model("box").pose[0] == 0.5


def test_properties_can_be_set() -> None:
    world = st.World.from_text(WORLD)
    box = world.model("box")
    assert box.pushable and box.friction == 0.25 and box.floor_friction == 0.5
    assert world.model("r").floor_friction == 0.8
    box.pushable = False
    box.floor_friction = 0.1
    box.friction = 0
    assert not box.pushable and box.friction == 0 and box.floor_friction == 0.1
    with pytest.raises(st.StageError, match="refused the friction"):
        box.friction = -1
    fleet = world.fleet()
    fleet.cmd[:, 0] = 0.3
    world.step(30)
    assert box.pose[0] == 0.5
