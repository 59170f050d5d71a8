# SPDX-License-Identifier: GPL-2.0-or-later
"""The colcon package, tested without colcon, and the documentation."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest import mock

import pytest
from patience import PATIENCE
from stagesim.ros.names import SCHEMES
from stagesim.ros.parameters import PARAMETERS

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
PACKAGE = ROOT / "ros2" / "stage_ros2"


def run(*arguments: str, path: str = "") -> subprocess.CompletedProcess[str]:
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join([str(PACKAGE), path]))
    code = "import sys, stage_ros2; sys.argv[0] = 'stage_ros2'; stage_ros2.main()"
    return subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True,
                          check=False, env=environment, timeout=PATIENCE)


def test_the_executable_runs_the_node() -> None:
    done = run("simple.world", "--duration", "0.5", "--stats", path=os.environ.get("PYTHONPATH", ""))
    assert done.returncode == 0 and '"simulated": 0.5' in done.stdout, done.stderr


def test_the_error_without_stagesim_names_it() -> None:
    done = run()
    if "PYTHONPATH" not in os.environ:
        pytest.skip("stagesim is installed")
    assert done.returncode == 1
    assert done.stderr.startswith("stage_ros2: there is no Python module stagesim")


def test_launch_file_offers_only_known_parameters() -> None:
    names: dict[str, Any] = {}
    with mock.patch.dict(sys.modules, {name: mock.MagicMock(spec=ModuleType) for name in (
            "launch", "launch.actions", "launch.conditions", "launch.substitutions", "launch_ros",
            "launch_ros.actions", "launch_ros.parameter_descriptions")}):
        for module in list(sys.modules):
            if module.startswith("launch"):
                sys.modules[module] = mock.MagicMock()
        exec(compile((PACKAGE / "launch" / "stage.launch.py").read_text(), "stage.launch.py", "exec"), names)
    for name, (default, kind, _) in names["ARGUMENTS"].items():
        known = PARAMETERS[name]
        assert kind is type(known.default)
        assert default == (str(known.default).lower() if kind is bool else str(known.default)), name


def test_all_parameters_are_documented() -> None:
    text = (ROOT / "docs" / "ros.md").read_text()
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|]*?) \|", text, re.MULTILINE))
    for name, parameter in PARAMETERS.items():
        default = parameter.default
        shown = str(default).lower() if isinstance(default, bool) else str(default)
        assert rows.get(name) == (f"`{shown}`" if shown else "empty"), name
    for scheme in SCHEMES.values():
        assert f"`{scheme.ground_truth}`" in text


def test_packages_of_the_extra_are_pinned() -> None:
    tomllib = pytest.importorskip("tomllib")  # since Python 3.11
    project = tomllib.loads((ROOT / "python" / "pyproject.toml").read_text())["project"]
    pinned = (ROOT / "python" / "ros_requirements.txt").read_text()
    for name in project["optional-dependencies"]["ros"]:
        assert f"\n{name.split('>')[0]}==" in pinned, name
