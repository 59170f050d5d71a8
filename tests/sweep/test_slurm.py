# SPDX-License-Identifier: GPL-2.0-or-later
"""The script for Slurm: by Slurm itself where it runs, and by what it puts into the environment."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from stagesim.sweep import Experiment, Results, program, run
from test_run import merged


@pytest.fixture
def script(root: Path) -> Path:
    return root / "examples" / "sweeps" / "slurm_array.sh"


@pytest.fixture
def planned(experiment: Experiment, tmp_path: Path) -> Path:
    """A sweep of which nothing is done yet."""
    program.make_plan(experiment, tmp_path / "out")
    return tmp_path / "out"


@pytest.mark.parametrize("first", [0, 1])
def test_tasks_of_an_array(script: Path, planned: Path, experiment: Experiment, tmp_path: Path, first: int) -> None:
    """One after the other; each does its part, and again what is missing of it."""
    done = []
    for task in range(first, first + 3):
        environment = {**os.environ, "STAGE": program._paths.PROGRAM, "SLURM_ARRAY_TASK_ID": str(task),
                       "SLURM_ARRAY_TASK_MIN": str(first), "SLURM_ARRAY_TASK_COUNT": "3", "SLURM_CPUS_PER_TASK": "2"}
        subprocess.run(["bash", str(script), str(planned)], check=True, env=environment, stdout=subprocess.DEVNULL)
        done.append(len(Results(planned)))
    assert done == [7, 14, 20]
    assert merged(Results(planned)) == merged(run(experiment, out=tmp_path / "alone", jobs=2))


def test_by_slurm(script: Path, planned: Path, experiment: Experiment, tmp_path: Path) -> None:
    if not shutil.which("sbatch") or subprocess.run(["sinfo"], capture_output=True, check=False).returncode != 0:
        pytest.skip("Slurm is not running here; try tests/sweep/one_node_slurm")
    words = ["sbatch", "--wait", "--array=1-3", "--cpus-per-task=1", f"--output={tmp_path}/%a.txt",
             f"--export=ALL,STAGE={program._paths.PROGRAM}", str(script), str(planned)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=120)
    outputs = "".join(file.read_text() for file in tmp_path.glob("*.txt"))
    assert done.returncode == 0, done.stderr + outputs
    assert merged(Results(planned)) == merged(run(experiment, out=tmp_path / "alone", jobs=2))
