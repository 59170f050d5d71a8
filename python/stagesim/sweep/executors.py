# SPDX-License-Identifier: GPL-2.0-or-later
"""Sweeps by the workers of an executor: Dask's, MPI's, or processes of this machine.

A task is a range of runs, which a subprocess of the worker does. Whatever becomes of it, what counts is
which records there are in the folder. Executors differ in what they do when a worker is killed: some lose
all that was pending, some repeat what was finished, some are of no use afterwards.
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

#: Rounds through what is left that may come to nothing.
MOST_IDLE_ROUNDS = 3
PAUSE = 0.25  # seconds, after the first of them; longer after others
LARGEST_CHUNK = 1000
TASKS_PER_JOB = 4


class BadUsage(SweepError):
    """The program doesn't take its words, and won't in another try."""


def run_chunk(job: program.Job, first: int, last: int) -> str:
    """The task of a worker: the runs from `first` to before `last` that have no record yet.

    Returns:
        What the program said last; of interest only if there are still some that have none.
    """
    status, said = job.resume([f"--only={first}:{last}", "--jobs=1", "--no-progress"])
    if status == program.BAD_USAGE:
        raise BadUsage(said)
    return said


def shortened(indices: Sequence[int]) -> str:
    """The first few of the numbers, for a message."""
    shown = ", ".join(map(str, indices[:5]))
    return shown if len(indices) <= 5 else f"{shown}, ..."


class Round:
    """Submits tasks, a few at a time, and forgets each when it is done."""

    def __init__(self, executor: Any, job: program.Job, most: int) -> None:
        self._executor = executor
        self._job = job
        self._most = most
        self._done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._pending: dict[Any, int] = {}  # how many runs each has
        self.said = ""  #: by the last task
        self.broken = False  #: the executor takes nothing any more

    def run(self, parts: Sequence[Sequence[int]], after_each: Callable[[int], None]) -> None:
        """A task for each part of the runs, as long as the executor takes any; tells how many runs each had."""
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
        except (BrokenExecutor, RuntimeError) as error:  # the latter: it was shut down
            self.broken, self.said = True, str(error)
            return False
        self._pending[future] = len(part)
        future.add_done_callback(self._done.put)
        return True

    def _collect(self) -> int:
        """Waits for a task; returns how many runs it had."""
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
    """How many runs are finished, told after each task."""

    def __init__(self, done: int, total: int, progress: Progress) -> None:
        self._done, self._total, self._progress = done, total, progress
        progress(done, total)

    def add(self, runs: int) -> None:
        """So many more."""
        self._done += runs
        self._progress(self._done, self._total)


def run_with(executor: Any, job: program.Job, plan: Plan, jobs: int | None, chunk: int | None,
             progress: Progress) -> None:
    """Lets the executor's workers do what the sweep lacks.

    Args:
        executor: has submit(), whose futures have those of concurrent.futures; or a function that makes one,
            and then makes another one when the first is broken.
        jobs: how many workers there are; None: as many as this machine has processors. Twice as many tasks
            are pending at a time.
        chunk: runs of a task; None: a quarter of each worker's share, 1000 at most.

    Raises:
        SweepError: some runs are still missing, and nobody gets on with them.
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
        time.sleep(PAUSE * idle)  # what a killed worker has started may not have noticed yet
        if left and (idle == MOST_IDLE_ROUNDS or (work.broken and not makes)):
            raise SweepError(
                f"{job.folder}: {len(left)} of {plan.count} runs are missing: {shortened(left)}; the last that was "
                f"said: {work.said!r}. What is there is kept: call run() again, with a new executor if this one is "
                "broken")
