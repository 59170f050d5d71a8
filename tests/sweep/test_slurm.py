# SPDX-License-Identifier: GPL-2.0-or-later
"""The script for Slurm, with Slurm's environment variables; test_slurm_cluster.py uses Slurm itself."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from stagesim.sweep import Experiment, Results, program, run
from test_run import merged


@pytest.mark.parametrize("first", [0, 1])
def test_tasks_of_an_array(root: Path, experiment: Experiment, tmp_path: Path, first: int) -> None:
    """The tasks of a job array, run in sequence, each do their part."""
    out, done = tmp_path / "out", []
    program.make_plan(experiment, out)
    for task in range(first, first + 3):
        environment = {**os.environ, "STAGE": program._paths.PROGRAM, "SLURM_ARRAY_TASK_ID": str(task),
                       "SLURM_ARRAY_TASK_MIN": str(first), "SLURM_ARRAY_TASK_COUNT": "3", "SLURM_CPUS_PER_TASK": "2"}
        subprocess.run(["bash", str(root / "examples/sweeps/slurm_array.sh"), str(out)], check=True, env=environment,
                       stdout=subprocess.DEVNULL)
        done.append(len(Results(out)))
    assert done == [7, 14, 20]
    assert merged(Results(out)) == merged(run(experiment, out=tmp_path / "alone", jobs=2))
