# SPDX-License-Identifier: GPL-2.0-or-later
"""The programs in examples/python work as documented."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import stagesim as st

NAMES = ("crowd", "evolution", "mppi", "particle_filter", "ppo", "training", "tree_search")


def example(root: Path, name: str) -> Any:
    """The program as a module."""
    spec = importlib.util.spec_from_file_location(name, root / "examples" / "python" / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def figures(root: Path, name: str, *arguments: str) -> dict[str, Any]:
    """The result of the program's main()."""
    return example(root, name).main(["--short", *arguments])


def test_every_example_is_tested(root: Path) -> None:
    assert sorted(path.stem for path in (root / "examples" / "python").glob("*.py")) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_help(root: Path, name: str) -> None:
    if name == "ppo":
        pytest.importorskip("torch")
    said = subprocess.run([sys.executable, str(root / "examples" / "python" / f"{name}.py"), "--help"],
                          capture_output=True, text=True, check=True).stdout
    assert "--short" in said and len(said) > 300


def test_crowd(root: Path, tmp_path: Path) -> None:
    """Most robots drive, few get stuck."""
    pytest.importorskip("PIL.Image")
    found = figures(root, "crowd", "--film", str(tmp_path / "crowd.gif"))
    assert found["robots"] == 100
    assert found["metres"] > 3  # out of at most 5
    assert found["stalled"] < 0.05
    assert (tmp_path / "crowd.gif").read_bytes().startswith(b"GIF89a")


def test_particle_filter(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The error decreases."""
    found = figures(root, "particle_filter")
    assert found["first"] > 1.5
    assert found["last"] < 0.3
    assert "the error fell from" in capsys.readouterr().out.splitlines()[-1]


def test_evolution(root: Path) -> None:
    """Controllers improve, and one batch, threads and processes give the same results."""
    found = figures(root, "evolution")
    assert found["tried"] == 128
    assert found["best"] >= found["last"] > found["first"] + 2
    assert figures(root, "evolution", "--executor", "threads", "--workers", "3") == found
    program = str(root / "examples" / "python" / "evolution.py")
    by_processes = subprocess.run([sys.executable, program, "--short", "--executor", "processes"],
                                  capture_output=True, text=True, check=True).stdout.splitlines()[-1]
    assert "from {first:.2f} m to {last:.2f} m, best {best:.2f} m".format(**found) in by_processes


def worth_alone(evolution: Any, genome: npt.NDArray[np.float64], trial: Any) -> float:
    """The fitness of a genome, in a World for each repeat."""
    worlds = [st.World("arena.world", threads=1) for _ in range(trial.repeats)]
    values = []
    for world, start in zip(worlds, evolution.starts(worlds[0].fleet().pose, trial)):
        fleet = world.fleet()
        fleet.teleport(start)
        ranges = fleet.ranger(0).ranges
        world.step()
        metres, stalled = np.zeros(len(fleet)), np.zeros(len(fleet), int)
        for _ in range(round(trial.seconds / world.dt)):
            fleet.cmd[:, 0], fleet.cmd[:, 2] = evolution.speeds(genome, ranges)
            world.step()
            metres += world.dt * fleet.actual_velocity[:, 0]
            stalled += fleet.stalled
        values.append(metres - 0.05 * stalled)
    return float(np.concatenate(values).mean())


def test_the_fitness_of_the_example_evolution_is_that_of_single_worlds(root: Path) -> None:
    evolution = example(root, "evolution")
    genomes = np.random.default_rng(2).normal(0, 1, (7, evolution.WEIGHTS))
    trial = evolution.Trial(repeats=3, seconds=10.0, seed=4)
    batch = st.Batch(evolution.WORLD, 21, threads=2)
    evolution.worths(batch, genomes[::-1], trial)  # leaves other states, which must not matter
    alone = [worth_alone(evolution, genome, trial) for genome in genomes]
    assert len(set(alone)) == 7
    assert evolution.worths(batch, genomes, trial).tolist() == alone


def test_training(root: Path) -> None:
    """The reward rises above that of driving straight ahead."""
    found = figures(root, "training")
    assert found["after"] > found["before"] + 2
    assert found["after"] > found["straight"] + 1
    assert found["steps"] == 16 * 20 * 20 * 5


def test_ppo(root: Path) -> None:
    """Robots reach more goals, and the worlds' device changes nothing."""
    pytest.importorskip("torch")
    found = figures(root, "ppo")
    assert found["last"] > found["first"] + 0.2
    try:
        on_device = figures(root, "ppo", "--worlds-on", "opencl")
    except st.StageError as error:
        if "OpenCL" not in str(error):
            raise
        pytest.skip(str(error))
    assert on_device == found


def test_mppi(root: Path) -> None:
    """The robot reaches its goal on a way that is hardly longer than the shortest one, and touches nothing."""
    found = figures(root, "mppi")
    assert found["distance"] < 0.3
    assert found["hits"] == 0
    assert 11 < found["seconds"] < 20  # the straight line is 11.3 m long, at most 1 m/s


def test_tree_search(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The robot leaves the dead end, first by going away from its goal."""
    found = figures(root, "tree_search")
    assert found["distance"] < 0.3
    assert found["actions"] < 16
    assert "right" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["mppi", "tree_search"])
def test_planners_are_short(root: Path, name: str) -> None:
    assert len((root / "examples" / "python" / f"{name}.py").read_text().splitlines()) <= 60
