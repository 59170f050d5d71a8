# SPDX-License-Identifier: GPL-2.0-or-later
"""`python -m stagesim.sweep.worker FOLDER`: does runs of a sweep with metrics in Python.

`stage sweep --worker` starts it and sends commands as lines, `check INDEX` or `run INDEX ATTEMPT`, on one file
descriptor; replies are lines on another. The worker ends at the end of the commands. An error in a run, such
as an exception of a metric, ends the worker like a crash: `stage sweep` tries the run again and records the
worker's output.
"""

from __future__ import annotations

import argparse
import ctypes
import importlib
import inspect
import math
import os
import time
from typing import Any, Callable, Mapping

from .. import _core
from ..errors import StageError, WorldError
from ..world import World
from .plan import SweepError

#: File descriptors of commands and replies.
COMMANDS, REPLIES = 3, 4
LIBC = ctypes.CDLL(None)

#: A function or a class, see Experiment.metrics.
Metrics = Callable[[World], Any]


def load_metrics(name: str) -> Metrics:
    """Imports the metrics called "module:name".

    Raises:
        SweepError: there is no such function or class.
    """
    module, _, path = name.partition(":")
    try:
        found: Any = importlib.import_module(module)
        for part in path.split("."):
            found = getattr(found, part)
    except (ImportError, AttributeError, ValueError) as error:
        raise SweepError(f"found the metrics {name!r} ({error}), expected \"module:name\" of a function or a "
                         "class") from None
    if not callable(found):
        raise SweepError(f"found the metrics {name!r}, a {type(found).__name__}, expected a function or a class")
    metrics: Metrics = found
    return metrics


def measured(metrics: Metrics | None, world: World, go: Callable[[int], int], steps: int) -> Mapping[str, Any]:
    """Makes `steps` steps by calling go(n); returns the values of the metrics at the end."""
    if metrics is None or not inspect.isclass(metrics):
        go(steps)
        return metrics(world) if metrics else {}
    kind: Any = metrics
    meter = kind(world)
    for _ in range(steps):
        if go(1) == 0:
            break
        meter.step()
    result: Mapping[str, Any] = meter.result()
    return result


def number(name: str, value: Any) -> float | None:
    """Converts a metric's value; None: not finite. Raises TypeError if it is no number."""
    if value is None:
        return None
    try:
        found = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"found {value!r} as the metric {name!r}, expected a number or None") from None
    return found if math.isfinite(found) else None


class BadRun(Exception):
    """A run can't be done, and another attempt is useless."""


class Worker:
    """Does runs of a sweep one after the other. Successive runs with equal settings reuse the world."""

    def __init__(self, folder: str, metrics: Metrics | None) -> None:
        try:
            self._sweep = _core.Sweep(folder)
        except StageError as error:
            raise SweepError(str(error)) from None
        self._metrics = metrics
        self._world: World | None = None
        self._settings: list[str] = []
        _core.set_controller_arguments(self._sweep.controller_arguments)

    def obey(self, line: str) -> str:
        """Executes a command; returns the reply."""
        command, index, *attempt = line.split()
        try:
            if command == "check":
                self._load(int(index))
                return "ok"
            self._run(int(index), int(attempt[0]))
            return f"done {index}"
        except BadRun as error:
            return f"error {error}"

    def _load(self, index: int) -> tuple[World, float]:
        """The world of run `index`, and the duration of the run in simulated seconds."""
        options = self._sweep.options(index)
        # Seed the C library's generators, which libstage does not use, for old controllers that do.
        LIBC.srand48(ctypes.c_long(options["seed"]))
        LIBC.srandom(ctypes.c_uint(options["seed"] & 0xffffffff))
        try:
            if self._world is None or options["settings"] != self._settings:
                self._world = None
                self._world = World(self._sweep.world, **options)
                self._settings = options["settings"]
            else:
                self._world.reset(options["seed"])
        except WorldError as error:
            self._world = None
            raise BadRun(str(error)) from None
        seconds = self._sweep.duration if self._sweep.duration is not None else self._world.quit_time
        if seconds is None:
            raise BadRun("found a world without a quit_time, expected a --duration, or runs never end")
        return self._world, seconds

    def _run(self, index: int, attempt: int) -> None:
        world, seconds = self._load(index)
        log = self._sweep.start_log(index, world._core)
        begun = time.monotonic()
        own = measured(self._metrics, world, world.step, world._steps_in(seconds))
        wall_seconds = time.monotonic() - begun
        if log is not None:
            log.finish()
        self._sweep.write_record(index, world._core, attempt, wall_seconds,
                                 [(name, number(name, value)) for name, value in own.items()])


def main() -> None:
    """Executes commands until there are no more."""
    parser = argparse.ArgumentParser(prog="python -m stagesim.sweep.worker", allow_abbrev=False,
                                     description="Worker for stage sweep --worker.")
    parser.add_argument("--metrics", metavar="MODULE:NAME", help="function that adds metrics; see docs/sweeps.md")
    parser.add_argument("folder", metavar="FOLDER", help="folder of the sweep")
    options = parser.parse_args()
    try:
        # Child processes of controllers must not inherit these descriptors, or they would keep them open.
        for file in (COMMANDS, REPLIES):
            os.set_inheritable(file, False)
    except OSError:
        parser.error("found no commands, expected to be started by stage sweep --worker")
    worker = None
    with os.fdopen(COMMANDS, encoding="utf-8") as commands, \
            os.fdopen(REPLIES, "w", encoding="utf-8", errors="surrogateescape") as replies:
        for line in commands:
            try:
                if worker is None:
                    worker = Worker(options.folder, load_metrics(options.metrics) if options.metrics else None)
                reply = worker.obey(line)
            except SweepError as error:
                reply = f"error {error}"
            print(reply, file=replies, flush=True)


if __name__ == "__main__":
    main()
