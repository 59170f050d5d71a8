# SPDX-License-Identifier: GPL-2.0-or-later
"""The experiments in examples/experiments: their controllers in C++ and Python, their effects, tables and figures."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st

FOLDER = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2]) / "examples" / "experiments"
if not FOLDER.is_dir():
    pytest.skip("there are no examples", allow_module_level=True)
sys.path.insert(0, str(FOLDER))
experiment: Any = import_module("experiment")

NAMES = experiment.names()
SEEDS = (1, 2, 3)


@pytest.fixture(params=NAMES)
def study(request: pytest.FixtureRequest) -> Any:
    """Each experiment."""
    return experiment.find(request.param)


def test_every_experiment_has_its_parts(root: Path) -> None:
    """Each world has a module with that name, a controller in C++, a section and a figure."""
    page = (root / "docs" / "experiments.md").read_text()
    assert NAMES
    for world in FOLDER.glob("*.world"):
        name = world.stem
        assert name in NAMES
        assert (root / "examples" / "ctrl" / f"{name}.cc").exists()
        assert f"pictures/experiments/{name}.png" in page
        assert experiment.find(name).name == name


def test_plugins_do_not_depend_on_threads(study: Any) -> None:
    hashes = set()
    for threads in (1, 2):
        world, _ = experiment.begin(study, 5, study.effect.shown, True, threads)
        world.run(5)
        hashes.add(world.state_hash())
    assert len(hashes) == 1


@pytest.mark.parametrize("plugin", [True, False], ids=["plugin", "python"])
def test_the_mechanism_has_its_effect(study: Any, plugin: bool) -> None:
    """A few seeds show the effect with the mechanism, and none does without it."""
    effect = study.effect
    with_it, without = ([experiment.measure_run(study, seed, settings, effect.seconds, plugin)[effect.metric]
                         for seed in SEEDS] for settings in (effect.shown, effect.hidden))
    assert min(with_it) > effect.least > max(without), (with_it, without)


def test_both_controllers_make_the_same_run(study: Any) -> None:
    effect = study.effect
    if effect.tolerance is None:
        pytest.skip("the controllers draw random numbers")
    ends = []
    for plugin in (True, False):
        world, controller = experiment.begin(study, 4, effect.shown, plugin)
        begin = world.fleet().pose.copy()
        for _ in experiment.steps(world, controller, effect.seconds):
            pass
        ends.append(world.fleet().pose.copy())
    assert not np.array_equal(begin, ends[0])
    assert np.abs(ends[0] - ends[1]).max() <= effect.tolerance


@pytest.mark.parametrize(("text", "message"), [
    ('position( ctrl "NAME nonsense=1" )', 'found the argument "nonsense=1", expected '),
    ('position( ctrl "NAME" )', "found no "),
    ('model( ctrl "NAME" )', "found a model of type model, expected a position"),
])
def test_mistakes_are_told_in_one_line(study: Any, text: str, message: str) -> None:
    with pytest.raises(st.WorldError) as error:
        st.World.from_text(text.replace("NAME", study.name))
    assert f"{study.name}: " in str(error.value)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_the_command_makes_tables_and_figures(study: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    short = experiment.dataclasses.replace(study.sweep, duration=1)
    monkeypatch.setattr(import_module(study.name), "STUDY", experiment.dataclasses.replace(study, sweep=short))
    import_module("run").main([study.name, "--runs", "2", "--jobs", "2", "--out", str(tmp_path)])
    lines = (tmp_path / f"{study.name}.md").read_text().splitlines()
    assert len({line.count("|") for line in lines}) == 1
    sets = np.prod([len(values) for values in study.sweep.set.values()])
    assert len(lines) == 2 + sets
    assert len((tmp_path / f"{study.name}.csv").read_text().splitlines()) == 1 + 2 * sets
    assert (tmp_path / f"{study.name}.png").read_bytes().startswith(b"\x89PNG")
    assert lines[0] in capsys.readouterr().out


def test_modules_are_programs(study: Any, capsys: pytest.CaptureFixture[str]) -> None:
    experiment.main(study, ["--seed", "3", "--seconds", "1"])
    printed = dict(line.split() for line in capsys.readouterr().out.splitlines())
    assert study.effect.metric in printed
    assert list(printed) == list(experiment.measure_run(study, 3, {}, 1, plugin=False))
