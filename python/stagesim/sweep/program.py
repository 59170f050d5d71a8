# SPDX-License-Identifier: GPL-2.0-or-later
"""Calls the program `stage sweep`, which does the runs."""

from __future__ import annotations

import ctypes
import os
import shlex
import signal
import site
import subprocess
import sys
import tempfile
from collections import deque
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Sequence

from .. import _paths
from .experiment import Experiment, folder_of
from .plan import Plan, SweepError, make_folder, plan_file

PACKAGES = str(Path(_paths.FOLDER).parent)
BAD_USAGE = 2  # the program's exit status for invalid arguments
PR_SET_PDEATHSIG = 1
LIBC = ctypes.CDLL(None)


def worker_words(metrics: str | None) -> list[str]:
    """The option that makes a Python worker do the runs if there are metrics. It is stored in the plan."""
    if metrics is None:
        return []
    return [f"--worker={shlex.join(['python3', '-m', 'stagesim.sweep.worker', '--metrics', metrics])}"]


def environment(folders: Sequence[str]) -> dict[str, str]:
    """The program's environment: it uses this Python, which finds this package and modules in `folders`."""
    own = [] if PACKAGES in site.getsitepackages() else [PACKAGES]
    paths = [*own, *folders, *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]
    programs = [os.path.dirname(sys.executable), os.environ.get("PATH", os.defpath)]
    return {**os.environ, "STAGE_PYTHON": sys.executable, "PATH": os.pathsep.join(programs),
            "PYTHONPATH": os.pathsep.join(dict.fromkeys(paths))}


def end_with_parent(parent: int) -> None:
    """Makes the child end with its parent, so that a killed worker's runs don't go on while others repeat them."""
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:
        os._exit(1)  # the parent ended before prctl()


def call(words: Sequence[str], folders: Sequence[str] = (), shown: bool = False) -> tuple[int, str]:
    """Runs `stage`; returns its exit status and the last line of its standard error.

    Args:
        words: the arguments of the program.
        folders: additional folders of Python modules.
        shown: True: its standard error, which has the progress, is shown instead of kept.
    """
    with tempfile.TemporaryFile() as errors, subprocess.Popen(
            [_paths.PROGRAM, *words], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=None if shown else errors, env=environment(folders),
            preexec_fn=partial(end_with_parent, os.getpid())) as child:
        try:
            status = child.wait()
        except BaseException:
            child.terminate()
            child.wait()
            raise
        errors.seek(0)
        lines = deque((line for line in errors if line.strip()), maxlen=1)
    return status, lines[0].decode(errors="replace").strip() if lines else f"stage ended with status {status}"


def make_plan(experiment: Experiment, folder: Path) -> Plan:
    """Creates the plan of an experiment in a folder, or checks that the folder's plan is equal to it.

    Raises:
        SweepError: the folder has another sweep, or the experiment is invalid.
    """
    make_folder(folder)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".plan-") as place:
        new = os.path.join(place, "new")
        words = [*worker_words(experiment.metrics), "--plan-only", "-o", new]
        status, said = call(["sweep", *experiment.arguments(), *words], metric_folders(experiment))
        if status != 0:
            raise SweepError(said)
        plan = Plan.read(new)
        if plan_file(folder).exists():
            if Plan.read(folder).text != plan.text:
                raise SweepError(f"{folder}: found the runs of another experiment, or of an earlier state of the "
                                 "world file; expected a new folder, or the same experiment")
        else:
            os.rename(plan_file(new), plan_file(folder))
    return plan


@dataclass(frozen=True)
class Job:
    """Everything that a worker on any machine needs to do runs of a sweep.

    Attributes:
        folder: the folder of the sweep.
        folders: the folders of the modules with its metrics.
        words: options of the program.
    """

    folder: str
    folders: tuple[str, ...] = ()
    words: tuple[str, ...] = ()

    @classmethod
    def of(cls, experiment: Experiment, folder: Path) -> Job:
        """The job of an experiment."""
        return cls(str(folder), tuple(metric_folders(experiment)), tuple(experiment.effort()))

    def resume(self, words: Sequence[str], shown: bool = False) -> tuple[int, str]:
        """Does missing runs of the sweep, as the arguments say; returns what call() does."""
        return call(["sweep", "--resume", self.folder, *self.words, *words], self.folders, shown)


def metric_folders(experiment: Experiment) -> list[str]:
    """The folders of the modules with the experiment's metrics."""
    return [] if experiment.metrics is None else [folder_of(experiment.metrics)]
