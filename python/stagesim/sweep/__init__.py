# SPDX-License-Identifier: GPL-2.0-or-later
"""Sweeps: a world with many settings and seeds, on one machine or by the workers of an executor.

`run()` does an experiment and gives its `Results`. The runs themselves are done by the program `stage sweep`;
what is finished is in a folder, so that whatever is killed goes on with the same call.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from .. import _core
from . import program
from .executors import run_with
from .experiment import Experiment
from .plan import Axis, Plan, SweepError, check_place, record_file
from .progress import Progress, shown
from .results import Results

__all__ = ["Axis", "Experiment", "Plan", "Results", "SweepError", "run"]


def run(experiment: Experiment, executor: Any = None, *, out: str | os.PathLike[str], jobs: int | None = None,
        chunk: int | None = None, retry_failed: bool = False, progress: bool | Progress = False) -> Results:
    """Does all runs of an experiment that are not finished yet.

    Called again with the same experiment and folder, it goes on where it was, wherever it was killed. Runs
    that fail three times have a record that says so, see `Results.failed`; they raise nothing.

    Args:
        experiment: what is to be tried.
        executor: whose workers do it: anything with the submit() of concurrent.futures, or a function that
            makes one, which is called again when a killed worker has broken the first. All workers need this
            package and the same folder. None: processes of this machine.
        out: the folder of the sweep; it is made.
        jobs: how many runs at a time; None: one for each processor that the process may use. With an executor: how
            many workers it has.
        chunk: with an executor, how many runs a task has; None: a quarter of each worker's share, 1000 at most.
        retry_failed: runs that have failed are tried again.
        progress: whether it is shown; with an executor, also a function of how many runs are finished and
            how many there are.

    Raises:
        SweepError: the experiment can't be begun, the folder has another one's runs, or runs are still
            missing and nobody gets on with them.
    """
    check_place(Path(out))
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
