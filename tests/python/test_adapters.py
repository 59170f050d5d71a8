# SPDX-License-Identifier: GPL-2.0-or-later
"""Environments by name and adapters to libraries for learning, without these libraries: tests/learn has the others."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from stagesim.env import TASKS


def python(code: str) -> str:
    """The output of Python code in a new process."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


def test_a_name_with_the_module_needs_no_import() -> None:
    """Gymnasium itself imports nothing of Stage; the name of an environment begins with what it has to import."""
    code = ("import sys, gymnasium\n"
            "print(any(name.startswith('stagesim') for name in sys.modules))\n"
            "print(type(gymnasium.make('stagesim.env:Stage/Navigate-v0').unwrapped).__name__)\n"
            "print(type(gymnasium.make_vec('stagesim.env:Stage/Disperse-v0', num_envs=2)).__name__)\n")
    assert python(code).split() == ["False", "StageEnv", "StageVectorEnv"]


def test_the_page_makes_environments_and_measures_success(root: Path) -> None:
    """The code of docs/learning_libraries.md that needs no library; tests/learn runs the rest."""
    page = root / "docs" / "learning_libraries.md"
    if not page.exists():
        pytest.skip("there is no docs/learning_libraries.md")
    measuring, making, *trainings = re.findall(r"```python\n(.*?)```", page.read_text(), re.S)
    names: dict[str, Any] = {}
    exec(compile(measuring + making, str(page), "exec"), names)  # noqa: S102
    assert names["envs"].num_envs == 32 and len(trainings) == 6
    straight = np.array([1, 0], np.float32)
    assert 0 <= names["success"](lambda seen: np.tile(straight, (len(seen), 1)), worlds=8) < 0.5


def test_every_task_has_a_name() -> None:
    assert {name for name in gymnasium.registry if name.startswith("Stage/")} == {f"Stage/{name}-v0" for name in TASKS}


def test_environments_import_no_library() -> None:
    found = set(python("import sys, stagesim.env; print(*sys.modules)").split())
    assert not {"torch", "stable_baselines3", "torchrl", "jax", "ray", "supersuit", "skrl"} & found


def test_a_missing_library_is_named() -> None:
    code = ("import sys\n"
            "from stagesim.env import StageVectorEnv\n"
            "env = StageVectorEnv(1)\n"
            "for module in ('stable_baselines3', 'torchrl', 'jax'): sys.modules[module] = None\n"
            "for method in (env.to_sb3, env.to_torchrl, env.to_jax):\n"
            "    try: method()\n"
            "    except ImportError as error: print(error)\n")
    expected = [("sb3", "Stable-Baselines3"), ("torchrl", "TorchRL"), ("jax", "JAX")]
    for line, (extra, library) in zip(python(code).splitlines(), expected, strict=True):
        assert line.startswith(f"to_{extra}() needs {library} (")
        assert line.endswith(f'): pip install "stagesim[{extra}]"')


def test_the_extras_of_adapters(root: Path) -> None:
    """Each library of the page has an extra, and tools/setup --learn installs what the extras need."""
    file = root / "python" / "pyproject.toml"
    if not file.exists():
        pytest.skip("there is no python/pyproject.toml")
    extras = pytest.importorskip("tomllib").loads(file.read_text())["project"]["optional-dependencies"]
    wanted = {line for line in (root / "python" / "learn_requirements.txt").read_text().splitlines()
              if line and line[0] != "#"}
    names = ("sb3", "supersuit", "torchrl", "rllib", "skrl", "jax")
    assert {need for name in names for need in extras[name]} == {"stagesim[env]", *wanted}
