# SPDX-License-Identifier: GPL-2.0-or-later
"""The experiments in examples/experiments: their controllers in C++ and Python, their effects, tables and figures."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st

FOLDER = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2]) / "examples" / "experiments"
NAMES = sorted(path.stem for path in FOLDER.glob("*.world"))
SEEDS = (1, 2, 3)


@pytest.fixture(scope="module")
def code() -> Iterator[Any]:
    """The module that experiments share. Its folder is searched for modules meanwhile."""
    sys.path.insert(0, str(FOLDER))
    yield import_module("experiment")
    sys.path.remove(str(FOLDER))
    for name, module in list(sys.modules.items()):
        if Path(getattr(module, "__file__", None) or "/").parent == FOLDER:
            del sys.modules[name]


@pytest.fixture(params=NAMES)
def study(request: pytest.FixtureRequest, code: Any) -> Any:
    """Each experiment."""
    return code.find(request.param)


@pytest.mark.skipif(not NAMES, reason="there are no examples")
def test_every_experiment_has_its_parts(root: Path, code: Any) -> None:
    """Each world has a module with that name, a controller in C++, a section and a figure."""
    page = (root / "docs" / "experiments.md").read_text()
    assert code.names() == NAMES
    for name in NAMES:
        study = code.find(name)
        assert study.name == name
        assert bool(study.built_in) != (root / "examples" / "ctrl" / f"{name}.cc").exists()
        assert f"pictures/experiments/{name}.png" in page


def test_plugins_do_not_depend_on_threads(study: Any, code: Any) -> None:
    hashes = set()
    for threads in (1, 2):
        world, _ = code.begin(study, 5, study.effect.shown, True, threads)
        world.run(5)
        hashes.add(world.state_hash())
    assert len(hashes) == 1


def test_plugins_are_saved_and_restored(study: Any, code: Any) -> None:
    """A world goes on in the same way after it is restored, also one that has just been loaded."""
    world, _ = code.begin(study, 5, study.effect.shown, True)
    world.run(3)
    snapshot = world.snapshot()
    world.run(3)
    expected = world.state_hash(), world.fleet().pose.tolist()
    other, _ = code.begin(study, 6, study.effect.shown, True)
    for each in (world, other):
        each.restore(snapshot)
        each.run(3)
        assert (each.state_hash(), each.fleet().pose.tolist()) == expected


@pytest.mark.parametrize("plugin", [True, False], ids=["plugin", "python"])
def test_the_mechanism_has_its_effect(study: Any, code: Any, plugin: bool) -> None:
    """A few seeds show the effect with the mechanism, and none does without it."""
    effect = study.effect
    with_it, without = ([code.measure_run(study, seed, settings, effect.seconds, plugin)[effect.metric]
                         for seed in SEEDS] for settings in (effect.shown, effect.hidden))
    assert min(with_it) > effect.least > max(without), (with_it, without)


def test_both_controllers_make_the_same_run(study: Any, code: Any) -> None:
    effect = study.effect
    if effect.tolerance is None:
        pytest.skip("the controllers draw random numbers, or contacts magnify the last bits")
    ends = []
    for plugin in (True, False):
        world, controller = code.begin(study, 4, effect.shown, plugin)
        begin = world.fleet().pose.copy()
        for _ in code.steps(world, controller, effect.seconds):
            pass
        ends.append(world.fleet().pose.copy())
    assert not np.array_equal(begin, ends[0])
    assert np.abs(ends[0] - ends[1]).max() <= effect.tolerance


@pytest.mark.parametrize(("text", "message"), [
    ('position( ctrl "NAME nonsense=1" )', 'found the argument "nonsense=1", expected '),
    ('position( ctrl "NAME" )', "found no "),
    ('model( ctrl "NAME" )', "expected a position"),
])
def test_mistakes_are_told_in_one_line(study: Any, text: str, message: str) -> None:
    name = study.built_in or study.name
    with pytest.raises(st.WorldError) as error:
        st.World.from_text(text.replace("NAME", name))
    assert name in str(error.value)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(("text", "message"), [
    ('position( ranger() ctrl "aggregation" )', "aggregation: position:0: found a ranger without sensors, expected one ray"),
    ('position( light() ctrl "firefly" )', "firefly: position:0: found no lightsensor, expected one on the robot"),
    ('position( lightsensor() ctrl "firefly" )', "firefly: position:0: found no light, expected one on the robot"),
    ('position( lightsensor() ctrl "phototaxis" )', "found no lightsensor:0 with two directions, expected one"),
])
def test_missing_devices_are_named(text: str, message: str) -> None:
    with pytest.raises(st.WorldError) as error:
        st.World.from_text(text)
    assert message in str(error.value)


def test_the_command_makes_tables_and_figures(study: Any, code: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    short = code.dataclasses.replace(study.sweep, duration=0.5)
    monkeypatch.setattr(import_module(study.name), "STUDY", code.dataclasses.replace(study, sweep=short))
    import_module("run").main([study.name, "--runs", "1", "--jobs", "1", "--out", str(tmp_path)])
    lines = (tmp_path / f"{study.name}.md").read_text().splitlines()
    assert len({line.count("|") for line in lines}) == 1
    sets = np.prod([len(values) for values in study.sweep.set.values()])
    assert len(lines) == 2 + sets
    assert len((tmp_path / f"{study.name}.csv").read_text().splitlines()) == 1 + sets
    assert (tmp_path / f"{study.name}.png").read_bytes().startswith(b"\x89PNG")
    assert lines[0] in capsys.readouterr().out


def test_modules_are_programs(study: Any, code: Any, capsys: pytest.CaptureFixture[str]) -> None:
    code.main(study, ["--seed", "3", "--seconds", "1"])
    printed = dict(line.split() for line in capsys.readouterr().out.splitlines())
    assert study.effect.metric in printed
    assert list(printed) == list(code.measure_run(study, 3, {}, 1, plugin=False))


@pytest.mark.parametrize(("words", "message"), [
    (["--set", "bots"], "found the setting 'bots', expected NAME=VALUE"),
    (["--set", "bots=many"], "many"),
    (["--set", "nobody.pose=1"], "nobody"),
    (["--set", "bot.ctrl=NAME nonsense=1"], "found the argument 'nonsense', expected any of "),
    (["--set", "bot.ctrl=NAME nonsense"], "found the argument 'nonsense', expected NAME=NUMBER"),
])
def test_mistakes_of_users_are_told(study: Any, code: Any, words: list[str], message: str,
                                    capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        code.main(study, ["--seconds", "1", *(word.replace("NAME", study.name) for word in words)])
    assert message in capsys.readouterr().err.splitlines()[-1]
