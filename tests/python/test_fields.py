# SPDX-License-Identifier: GPL-2.0-or-later
"""Fields as arrays, and the readings and deposits of ground sensors."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import stagesim as st
from snippets import executed

TEXT = """
field( name "a" size [4 3 0] field_resolution 0.5 pose [1 2 0 0] )
field( name "b" size [1 1 0] initial 5 evaporation 1 )
position( name "r" alwayson 1 groundsensor( name "g" field "b" points 2 point[1] [9 0] ) )
"""


@pytest.fixture
def world() -> st.World:
    return st.World.from_text(TEXT)


def test_example_of_the_page(root: Path) -> None:
    page = root / "docs" / "fields.md"
    if not page.exists():
        pytest.skip("there is no docs/fields.md")
    ((code, expected),) = re.findall(r"```python\n(.*?)```\n\n```\n(.*?)```", page.read_text(), re.S)
    assert executed(code, {}, str(page)) == expected


def test_world_of_the_page(root: Path) -> None:
    page = root / "docs" / "fields.md"
    if not page.exists():
        pytest.skip("there is no docs/fields.md")
    text = re.search(r"^    field\(.*?\n\n", page.read_text(), re.S | re.M)
    assert text
    world = st.World.from_text(text[0])
    world.model("ant").drive(0.5)
    world.step(100)
    trail = world.fields["trail"]
    assert trail.read([-0.1, 0])[()] > 0 and trail.read([4, 0])[()] > 0 and trail.read([0, 2])[()] < 1e-20


def test_shape_and_values(world: st.World) -> None:
    assert list(world.fields) == ["a", "b"]
    field = world.fields["a"]
    assert field.shape == (6, 8) and field.cell_size == (0.5, 0.5) and field.model.type == "field"
    assert not field.values.any()
    values = np.arange(48.0).reshape(6, 8)
    field.values = values
    assert np.array_equal(field.values, values)
    assert field.integral == pytest.approx(values.sum() / 4)
    assert field.read([[-0.9, 0.6], [2.9, 3.4], [-0.9, 3.4]], "nearest").tolist() == [0, 47, 40], "row 0 is the southern one"
    assert field.read([[[-0.5, 0.75, 7]]]).tolist() == [[0.5]], "poses are places; linear in between"
    assert field.read([3.1, 2])[()] == 0
    field.values = 2
    assert (field.values == 2).all()
    copy = field.values
    copy[:] = 9
    assert (field.values == 2).all(), "values are copies"
    assert "'a'" in repr(field)


def test_deposits(world: st.World) -> None:
    field = world.fields["a"]
    done = field.deposit([[0, 1], [0, 1], [99, 0], [1, 2]], [1, 2, 3, np.nan])
    assert done.tolist() == [True, True, False, False]
    assert field.integral == pytest.approx(3)
    assert field.read([0.1, 1.1], "nearest")[()] == pytest.approx(12)
    assert field.deposit([0, 1], 1).shape == ()


def test_rates(world: st.World) -> None:
    field = world.fields["b"]
    assert (field.diffusion, field.evaporation) == (0, 1)
    field.diffusion = 0.001
    field.evaporation = 0.5
    assert (field.diffusion, field.evaporation) == (0.001, 0.5)
    world.step(10)
    assert field.values[3, 4] == pytest.approx(5 * np.exp(-0.5))


def test_fleets_read_the_sensed_instant(world: st.World) -> None:
    sensor = world.fleet().sensor("groundsensor")
    assert np.isnan(sensor.value).all() and sensor.value.shape == (1, 2)
    world.step()
    assert sensor.value.tolist() == [[5, 0]]
    world.step()
    assert sensor.value[0, 0] == pytest.approx(5 * np.exp(-0.1))
    assert sensor.time.tolist() == [0.2]


def test_deposit_rate(world: st.World) -> None:
    sensor, field = world.model("r.g"), world.fields["b"]
    field.evaporation = 0
    assert sensor.deposit_rate == 0
    sensor.deposit_rate = 3
    world.step(10)
    assert field.integral == pytest.approx(5 + 3)
    with pytest.raises(ValueError, match="not finite"):
        sensor.deposit_rate = np.inf
    with pytest.raises(TypeError, match="groundsensor"):
        world.model("r").deposit_rate  # noqa: B018


def test_mistakes_have_a_message(world: st.World) -> None:
    field = world.fields["a"]
    with pytest.raises(ValueError, match=r"found values of shape \(3,\), expected \(6, 8\)"):
        field.values = [1, 2, 3]
    with pytest.raises(ValueError, match="not finite"):
        field.values = np.full((6, 8), np.nan)
    with pytest.raises(ValueError, match="found places of shape"):
        field.read([1, 2, 3, 4])
    with pytest.raises(ValueError, match="found the interpolation 'cubic'"):
        field.read([1, 2], "cubic")
    with pytest.raises(ValueError, match="found amounts of shape"):
        field.deposit([[1, 2], [3, 4]], [1, 2, 3])
    with pytest.raises(ValueError, match="negative"):
        field.diffusion = -1
    field.model.delete()
    with pytest.raises(st.GoneError):
        field.values  # noqa: B018


def test_copies_and_snapshots_have_the_values(world: st.World) -> None:
    field = world.fields["a"]
    field.values = np.random.default_rng(1).random((6, 8))
    field.diffusion = 0.01
    world.model("r").drive(0.3, 0, 0.2)
    world.step(5)
    snapshot, copy = world.snapshot(), world.fork()
    world.step(5)
    copy.step(5)
    assert np.array_equal(copy.fields["a"].values, field.values)
    later = field.values
    world.restore(snapshot)
    assert not np.array_equal(field.values, later)
    world.step(5)
    assert np.array_equal(field.values, later)


def test_batches_say_why_they_need_objects(tmp_path: Path) -> None:
    file = tmp_path / "fields.world"
    file.write_text(TEXT)
    batch = st.Batch(file, 3)
    batch.step(2)
    assert "is a field" in str(batch.explain())
    assert batch.fork(2).fields["b"].values[0, 0] == pytest.approx(5 * np.exp(-0.2))
