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
from stagesim.ros.parameters import PARAMETERS, Parameter
from stagesim.ros.what_if.parameters import PARAMETERS as WHAT_IF

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
PACKAGE = ROOT / "ros2" / "stage_ros2"


RUN = "import sys, stage_ros2; sys.argv[0] = 'stage_ros2'; stage_ros2.main()"


def run(*arguments: str, path: str = "", code: str = RUN) -> subprocess.CompletedProcess[str]:
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join([str(PACKAGE), path]))
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


def test_the_second_executable_runs_the_node_that_decides() -> None:
    code = "import sys, stage_ros2; sys.argv[0] = 'what_if'; stage_ros2.what_if()"
    done = run("missing.world", code=code, path=os.environ.get("PYTHONPATH", ""))
    assert done.returncode == 1 and "stagesim.ros.what_if: " in done.stderr and "missing.world" in done.stderr


@pytest.mark.parametrize(("file", "parameters"), [("stage", PARAMETERS), ("what_if", WHAT_IF)])
def test_launch_files_offer_only_known_parameters(file: str, parameters: dict[str, Parameter]) -> None:
    names: dict[str, Any] = {"__file__": str(PACKAGE / "launch" / "a.launch.py")}
    with mock.patch.dict(sys.modules, {name: mock.MagicMock(spec=ModuleType) for name in (
            "launch", "launch.actions", "launch.conditions", "launch.substitutions", "launch_ros",
            "launch_ros.actions", "launch_ros.parameter_descriptions")}):
        for module in list(sys.modules):
            if module.startswith("launch"):
                sys.modules[module] = mock.MagicMock()
        name = f"{file}.launch.py"
        exec(compile((PACKAGE / "launch" / name).read_text(), name, "exec"), names)
        names["generate_launch_description"]()
        if file == "stage":
            names["start_node"](mock.MagicMock())
            assert names["words_of"]("a.world", "", "") == ["a.world"]
            assert names["words_of"]("", "m.yaml", "a:0,0,0 b:1,2,90") == ["--map", "m.yaml", "--robot", "a:0,0,0", "--robot",
                                                                           "b:1,2,90"]
            assert set(names["ARGUMENTS"]) == set(parameters) - {"world_file"}  # which is the argument "world"
    for name, (default, kind, _) in names["ARGUMENTS"].items():
        known = parameters[name]
        assert kind is type(known.default)
        assert default == (str(known.default).lower() if kind is bool else str(known.default)), name


@pytest.mark.parametrize(("part", "parameters"), [(0, PARAMETERS), (1, WHAT_IF)])
def test_all_parameters_are_documented(part: int, parameters: dict[str, Parameter]) -> None:
    text = (ROOT / "docs" / "ros.md").read_text()
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|]*?) \|", text.split("\n## A robot that decides\n")[part], re.MULTILINE))
    for name, parameter in parameters.items():
        default = parameter.default
        shown = str(default).lower() if isinstance(default, bool) else str(default)
        assert rows.get(name) == (f"`{shown}`" if default not in ("", []) else "empty"), name


def test_names_of_both_schemes_are_documented() -> None:
    text = (ROOT / "docs" / "ros.md").read_text()
    for scheme in SCHEMES.values():
        assert f"`{scheme.ground_truth}`" in text


def test_packages_of_the_extra_are_pinned() -> None:
    tomllib = pytest.importorskip("tomllib")  # since Python 3.11
    project = tomllib.loads((ROOT / "python" / "pyproject.toml").read_text())["project"]
    pinned = (ROOT / "python" / "ros_requirements.txt").read_text()
    for name in project["optional-dependencies"]["ros"]:
        assert f"\n{name.split('>')[0]}==" in pinned, name
