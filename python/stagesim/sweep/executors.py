# SPDX-License-Identifier: GPL-2.0-or-later
"""Sweeps on the workers of an executor, such as Dask, MPI or processes on this machine.

A task is a range of runs, which a subprocess of the worker does. The result of a task is ignored: only the
records in the folder count. This is because executors differ when a worker is killed: some lose all pending
tasks, some repeat finished ones, and some cannot be used afterwards.
"""

from __future__ import annotations

import queue
import time
from concurrent.futures import BrokenExecutor
from typing import Any, Callable, Sequence

from .. import _core
from . import program
from .plan import Plan, SweepError, missing
from .progress import Progress

#: Max number of successive rounds without a finished run.
MAX_IDLE_ROUNDS = 3
PAUSE = 0.25  # seconds after the first idle round; n times as long after the n-th
LARGEST_CHUNK = 1000
TASKS_PER_JOB = 4


class BadUsage(SweepError):
    """The program refuses its arguments, so another attempt is useless."""


def run_chunk(job: program.Job, first: int, last: int) -> str:
    """The task of a worker: does the runs in [first, last) that have no record yet.

    Returns:
        The last line that the program wrote, which explains why runs are still missing.
    """
    status, said = job.resume([f"--only={first}:{last}", "--jobs=1", "--no-progress"])
    if status == program.BAD_USAGE:
        raise BadUsage(said)
    return said


def shortened(indices: Sequence[int]) -> str:
    """Formats the first few numbers for a message."""
    shown = ", ".join(map(str, indices[:5]))
    return shown if len(indices) <= 5 else f"{shown}, ..."


class Round:
    """Submits the tasks of one pass over the missing runs, with at most `most` pending at a time."""

    def __init__(self, executor: Any, job: program.Job, most: int) -> None:
        self._executor = executor
        self._job = job
        self._most = most
        self._done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._pending: dict[Any, int] = {}  # number of runs by future
        self.said = ""  #: the last message of a task
        self.broken = False  #: the executor accepts no more tasks

    def run(self, parts: Sequence[Sequence[int]], after_each: Callable[[int], None]) -> None:
        """Submits a task per part until the executor breaks; calls after_each(runs) after each finished task."""
        try:
            for part in parts:
                if self.broken or not self._submit(part):
                    break
                while len(self._pending) >= self._most:
                    after_each(self._collect())
            while self._pending:
                after_each(self._collect())
        finally:
            for future in self._pending:
                future.cancel()

    def _submit(self, part: Sequence[int]) -> bool:
        try:
            future = self._executor.submit(run_chunk, self._job, part[0], part[-1] + 1)
        except (BrokenExecutor, RuntimeError) as error:  # RuntimeError: the executor was shut down
            self.broken, self.said = True, str(error)
            return False
        self._pending[future] = len(part)
        future.add_done_callback(self._done.put)
        return True

    def _collect(self) -> int:
        """Waits for a task; returns its number of runs."""
        future = self._done.get()
        runs = self._pending.pop(future)
        error = None if future.cancelled() else future.exception()
        if isinstance(error, BadUsage):
            raise error
        if isinstance(error, BrokenExecutor):
            self.broken = True
        if error is not None:
            self.said = str(error) or type(error).__name__
        elif not future.cancelled():
            self.said = future.result()
        return runs


class Count:
    """Counts the finished runs and reports the progress after each task."""

    def __init__(self, done: int, total: int, progress: Progress) -> None:
        self._done, self._total, self._progress = done, total, progress
        progress(done, total)

    def add(self, runs: int) -> None:
        """Adds finished runs and reports the progress."""
        self._done += runs
        self._progress(self._done, self._total)


def run_with(executor: Any, job: program.Job, plan: Plan, jobs: int | None, chunk: int | None,
             progress: Progress) -> None:
    """Does the missing runs of a sweep on the workers of an executor.

    Args:
        executor: an object whose submit() returns futures as concurrent.futures does, or a function that makes
            one and is called again after it broke.
        jobs: number of workers; None: number of available processors. Up to twice as many tasks are pending.
        chunk: runs per task; None: a quarter of the mean runs per worker, at most 1000.

    Raises:
        SweepError: runs are still missing after MAX_IDLE_ROUNDS rounds without a finished run, or the
            executor broke.
    """
    makes = None if hasattr(executor, "submit") else executor
    jobs = jobs or _core.count_processors()
    left, idle = missing(job.folder, plan), 0
    while left:
        size = chunk or min(LARGEST_CHUNK, -(-len(left) // (TASKS_PER_JOB * jobs)))
        current = makes() if makes else executor
        work = Round(current, job, 2 * jobs)
        count = Count(plan.count - len(left), plan.count, progress)
        try:
            work.run([left[at:at + size] for at in range(0, len(left), size)], count.add)
        finally:
            if makes:
                current.shutdown(wait=not work.broken)
        before, left = len(left), missing(job.folder, plan)
        idle = idle + 1 if len(left) == before else 0
        time.sleep(PAUSE * idle)  # gives processes of killed workers time to end
        if left and (idle == MAX_IDLE_ROUNDS or (work.broken and not makes)):
            raise SweepError(
                f"{job.folder}: {len(left)} of {plan.count} runs are missing: {shortened(left)}; the last that was "
                f"said: {work.said!r}. What is there is kept: call run() again, with a new executor if this one is "
                "broken")
