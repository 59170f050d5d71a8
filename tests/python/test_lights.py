# SPDX-License-Identifier: GPL-2.0-or-later
"""Lights and light sensors: arrays of readings, switching, and the example of docs/lights.md."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import stagesim as st

WORLD = """
light( name "lamp" pose [2 0 0 0] intensity 8 color_rgba [1 0.5 0 1] )
position( name "a" lightsensor( directions [0 60] ) )
position( name "b" pose [0 -5 0 0] lightsensor( ) )
blinkenlight( name "blinker" pose [50 0 0 0] )
"""


def test_readings_are_arrays_over_a_fleet() -> None:
    world = st.World.from_text(WORLD)
    eyes = world.fleet().sensor("lightsensor")
    assert eyes.intensity.shape == (2, 2) and np.isnan(eyes.intensity).all()
    world.step()
    assert eyes.intensity[0] == pytest.approx([2, 1])
    assert eyes.color[0] == pytest.approx(np.array([[2, 1, 0], [1, 0.5, 0]]))
    assert eyes.direction[0] == pytest.approx([0, np.pi / 3])
    assert np.isnan(eyes.intensity[1, 1])
    assert eyes.intensity[1, 0] == pytest.approx(8 / 29 * 2 / np.sqrt(29))


def test_lights_are_switched() -> None:
    world = st.World.from_text(WORLD)
    eyes = world.fleet().sensor("lightsensor")
    lamp = world.model("lamp")
    assert lamp.on and lamp.intensity == 8
    lamp.on = False
    world.step()
    assert (eyes.intensity[0] == 0).all()
    lamp.on, lamp.intensity = True, 4
    world.step()
    assert eyes.intensity[0] == pytest.approx([1, 0.5])
    assert world.model("blinker").on


FLEET = """
define robot position( size [0.1 0.1 0.1] )
robot( name "a" light( on 0 ) lightsensor( directions [90] ) )
robot( name "b" pose [0 1 0 0] model( light( intensity 3 ) ) lightindicator( intensity 2 ) )
robot( name "c" pose [0 2 0 0] blinkenlight() )
"""


def test_lights_of_a_fleet_are_switched_together() -> None:
    world = st.World.from_text(FLEET)
    fleet = world.fleet()
    seen = fleet.sensor("lightsensor").intensity
    assert fleet.lights().tolist() == [False, True, False]
    assert fleet.lights(1).tolist() == [False, False, False]
    world.step()
    assert seen[0, 0] == pytest.approx(3)
    fleet.switch_lights([True, False, True])
    fleet.switch_lights(True, index=1)
    assert fleet.lights().tolist() == [True, False, False]
    assert world.model("a.light:0").on
    assert fleet.lights(1).tolist() == [False, True, False]
    world.step()
    assert seen[0, 0] == pytest.approx(2)
    fleet.switch_lights(False, [1], index=1)
    fleet.switch_lights([True, False], np.array([False, True, True]))
    assert (fleet.lights().tolist(), fleet.lights(1).tolist()) == ([True, True, False], [False] * 3)


def test_intensities_and_colors_of_a_fleet_are_arrays() -> None:
    world = st.World.from_text(FLEET)
    fleet = world.fleet()
    eye = fleet.sensor("lightsensor")
    assert fleet.light_intensity()[1] == 3 and np.isnan(fleet.light_intensity()[2])
    assert fleet.light_intensity(1).tolist()[1] == 2 and np.isnan(fleet.light_intensity(1)[0])
    fleet.set_light_intensity(5)
    fleet.set_light_intensity([7], which=[1])
    assert fleet.light_intensity().tolist()[:2] == [5, 7]
    colors = [[1, 0, 0, 1], [0, 0.25, 1, 1], [0, 0, 0, 1]]
    fleet.set_light_color(colors)
    assert fleet.light_color()[:2].tolist() == colors[:2] and np.isnan(fleet.light_color()[2]).all()
    assert world.model("a.light:0").color == (1, 0, 0, 1)
    world.step()
    assert eye.intensity[0, 0] == pytest.approx(7) and eye.color[0, 0] == pytest.approx([0, 7 / 4, 7])
    fleet.set_light_color([0, 1, 0, 1], np.array([False, True, False]))
    assert fleet.light_color()[:2].tolist() == [[1, 0, 0, 1], [0, 1, 0, 1]]


def test_wrong_intensities_and_colors_of_a_fleet_change_nothing() -> None:
    fleet = st.World.from_text(FLEET).fleet()
    for wrong in (-1, np.nan, np.inf):
        with pytest.raises(ValueError, match="found an intensity that is negative or not finite, expected 0 or more"):
            fleet.set_light_intensity([1, 1, wrong])
    with pytest.raises(ValueError, match="found a part of a color outside of 0 to 1"):
        fleet.set_light_color([0, 0, 2, 1])
    for values in ([1, 1, 1], np.ones((2, 4))):
        with pytest.raises(ValueError, match="expected one for each of 3 robots"):
            fleet.set_light_color(values)
    with pytest.raises(TypeError, match="of the type lightindicator, expected a light"):
        fleet.set_light_intensity(1, index=1)
    for call in (fleet.light_color, fleet.light_intensity):
        with pytest.raises(st.GoneError, match="no robot has a light number 2"):
            call(2)
    assert fleet.light_intensity()[1] == 3 and fleet.light_intensity(1)[1] == 2


def test_mistakes_about_lights_of_a_fleet_are_refused() -> None:
    world = st.World.from_text(FLEET)
    fleet = world.fleet()
    for call in (lambda: fleet.lights(2), lambda: fleet.switch_lights(True, index=2)):
        with pytest.raises(st.GoneError, match="no robot has a light number 2"):
            call()
    with pytest.raises(ValueError, match=r"found values of shape \(2,\), expected one for each of 3 robots"):
        fleet.switch_lights([True, False])
    world.model("b").delete()
    fleet.switch_lights(True)
    assert fleet.lights().tolist() == [True, False, False]
    with pytest.raises(st.GoneError):
        fleet.lights(1)


def test_errors_are_one_line() -> None:
    world = st.World.from_text(WORLD)
    with pytest.raises(st.StageError, match="refused the intensity -1"):
        world.model("lamp").intensity = -1
    for change in ("a", "blinker"):
        with pytest.raises(TypeError, match="of the type (position|blinkenlight), expected a light or lightindicator"):
            world.model(change).on = True
    with pytest.raises(TypeError, match="of the type position, expected a light"):
        _ = world.model("a").intensity


@pytest.mark.parametrize(("words", "message"), [
    ("bright", 'found "bright", expected an irradiance in W/m2, as in "phototaxis 4"'),
    ("4 5", 'found the argument "5", expected speed=NUMBER, gain=NUMBER, search=NUMBER'),
    ("gain=200", "expected a number from -100"),
])
def test_mistakes_in_the_arguments_of_phototaxis(words: str, message: str) -> None:
    with pytest.raises(st.WorldError) as error:
        st.World.from_text(f'position( lightsensor( directions [40 -40] ) ctrl "phototaxis {words}" )')
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_batch_says_why_its_worlds_are_not_closed(tmp_path: Path) -> None:
    file = tmp_path / "lights.world"
    file.write_text(WORLD)
    batch = st.Batch(file, n=2)
    readings = batch.sensor("lightsensor").intensity
    batch.step()
    assert readings[:, 0] == pytest.approx(np.array([[2, 1], [2, 1]]))
    assert "is a lightsensor with subscribers" in str(batch.explain())


def test_example_of_the_page(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The controllers in C++ and in Python make the same run, and all robots reach the lamp."""
    page = root / "docs" / "lights.md"
    if not page.exists():
        pytest.skip("there is no docs/lights.md")
    (text,) = re.findall(r"```\n(resolution.*?)```", page.read_text(), re.S)
    (code,) = re.findall(r"```python\n(.*?)```", page.read_text(), re.S)
    (tmp_path / "phototaxis.world").write_text(text)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(compile(code, str(page), "exec"), names)  # noqa: S102
    driven = names["robots"]
    assert isinstance(driven, st.Fleet)
    distances = np.hypot(*(driven.pose[:, :2] - (3, 1)).T)
    assert (distances < 1).all() and (driven.velocity == 0).all()

    world = st.World("phototaxis.world")
    robots = world.fleet()
    while world.time < 40:
        world.step()
    assert np.array_equal(robots.pose, driven.pose)
