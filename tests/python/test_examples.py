# SPDX-License-Identifier: GPL-2.0-or-later
"""The programs in examples/python work as documented."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import stagesim as st

NAMES = ("crowd", "evolution", "particle_filter", "ppo", "training")


def figures(root: Path, name: str, *arguments: str) -> dict[str, Any]:
    """The result of the program's main()."""
    spec = importlib.util.spec_from_file_location(name, root / "examples" / "python" / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.main(["--short", *arguments])


def test_every_example_is_tested(root: Path) -> None:
    assert sorted(path.stem for path in (root / "examples" / "python").glob("*.py")) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_help(root: Path, name: str) -> None:
    if name == "evolution":
        pytest.importorskip("cma")
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
    """Controllers improve, and threads and processes give the same results."""
    pytest.importorskip("cma")
    found = figures(root, "evolution", "--executor", "threads")
    assert found["tried"] == 64
    assert found["best"] > found["first"] + 2
    program = str(root / "examples" / "python" / "evolution.py")
    by_processes = subprocess.run([sys.executable, program, "--short", "--executor", "processes"],
                                  capture_output=True, text=True, check=True).stdout.splitlines()[-1]
    assert f"from {found['first']:.2f} m" in by_processes and f"to {found['best']:.2f} m" in by_processes


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
