# SPDX-License-Identifier: GPL-2.0-or-later
"""Sweeps: runs of a world with many settings and seeds, on this machine or on the workers of an executor.

`run()` does an experiment and returns its `Results`. The program `stage sweep` does the runs and stores each
finished one in a folder, so that a sweep that was killed continues with the same call.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from .. import _core
from . import program
from .executors import run_with
from .experiment import Experiment
from .plan import Axis, Plan, SweepError, make_folder, record_file
from .progress import Progress, shown
from .results import Results

__all__ = ["Axis", "Experiment", "Plan", "Results", "SweepError", "run"]


def run(experiment: Experiment, executor: Any = None, *, out: str | os.PathLike[str], jobs: int | None = None,
        chunk: int | None = None, retry_failed: bool = False, progress: bool | Progress = False) -> Results:
    """Does all runs of an experiment that are not finished yet.

    A call with the same experiment and folder continues a sweep that was interrupted. A run that fails three
    times raises no error; it has a record, see `Results.failed`.

    Args:
        experiment: the experiment.
        executor: an object with the submit() of concurrent.futures, or a function that makes one, which is
            called again if a killed worker breaks the executor. All workers need this package and access to
            the same folder. None: processes on this machine.
        out: the folder of the sweep; it is created.
        jobs: number of simultaneous runs; with an executor, its number of workers. None: one per available
            processor.
        chunk: with an executor, runs per task; None: a quarter of the mean runs per worker, at most 1000.
        retry_failed: True: try failed runs again.
        progress: True: show the progress; with an executor, also a function of the numbers of finished and of
            all runs.

    Raises:
        SweepError: the experiment is invalid, the folder holds another experiment or something else, or runs
            are still missing after several attempts.
    """
    make_folder(Path(out))
    folder = Path(out).resolve()
    plan = program.make_plan(experiment, folder)
    job, results = program.Job.of(experiment, folder), Results(folder)
    for record in results.failed if retry_failed else ():
        record_file(folder, record["index"]).unlink()
    if executor is not None:
        with shown(progress) as show:
            run_with(executor, job, plan, jobs, chunk, show)
        return results
    words = [f"--jobs={jobs or _core.count_processors()}", "--progress" if progress else "--no-progress"]
    status, said = job.resume(words, bool(progress))
    if results.missing:
        raise SweepError(f"{folder}: {len(results.missing)} of {plan.count} runs are missing: {said} "
                         f"(status {status}). What is there is kept: call run() again")
    return results
