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
import json
import math
import os
import re
import tempfile
import time
from pathlib import Path
from typing import Any, Callable, Mapping

from .. import _core
from ..errors import WorldError
from ..world import World
from .merge import current_umask
from .plan import Plan, SweepError, record_file

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


def shell_word(text: str) -> str:
    """Quotes a string for a shell if that is necessary."""
    return text if re.fullmatch(r"[\w./=:,@%+-]+", text, re.ASCII) else "'" + text.replace("'", "'\\''") + "'"


def seed_of(plan: Plan, index: int) -> int:
    """The seed of run `index`, derived as the program does it."""
    pairs = [] if plan.common_seeds else sorted(plan.values_of(index).items())
    digest = 0xcbf29ce484222325  # FNV-1a
    for byte in "".join(f"{name}={value}\n" for name, value in pairs).encode(errors="surrogateescape"):
        digest = (digest ^ byte) * 0x100000001b3 % 2**64
    return _core.mix_seeds(_core.mix_seeds(plan.seed, digest), plan.run_of(index)) >> 11


def replay_command(plan: Plan, index: int) -> str:
    """The shell command that does only run `index`, formatted as the program does it."""
    words = ["stage", "-g", "--seed", str(seed_of(plan, index))]
    for name, value in plan.values_of(index).items():
        words += ["--set", shell_word(f"{name}={value}")]
    if plan.duration is not None:
        words += ["--duration", f"{plan.duration:.17g}"]
    if plan.options["args"]:
        words += ["--args", shell_word(plan.options["args"])]
    if plan.options["ray_model"] is not None:
        words += ["--ray-model", plan.options["ray_model"]]
    if not plan.options["controllers"]:
        words.append("--no-controllers")
    return " ".join([*words, "--state-hash", shell_word(plan.world)])


class BadRun(Exception):
    """A run can't be done, and another attempt is useless."""


class Worker:
    """Does runs of a sweep one after the other. Successive runs with equal settings reuse the world."""

    def __init__(self, folder: str, metrics: Metrics | None) -> None:
        self._folder = folder
        self._plan = Plan.read(folder)
        self._metrics = metrics
        self._world: World | None = None
        self._settings: dict[str, str] | None = None
        _core.set_controller_arguments(self._plan.options["args"])

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
        settings, seed = self._plan.values_of(index), seed_of(self._plan, index)
        # Seed the C library's generators, which libstage does not use, for old controllers that do.
        LIBC.srand48(ctypes.c_long(seed))
        LIBC.srandom(ctypes.c_uint(seed & 0xffffffff))
        try:
            if self._world is None or settings != self._settings:
                self._world = None
                self._world = self._new_world(seed, settings)
                self._settings = settings
            else:
                self._world.reset(seed)
        except WorldError as error:
            self._world = None
            raise BadRun(str(error)) from None
        seconds = self._plan.duration if self._plan.duration is not None else self._world.quit_time
        if seconds is None:
            raise BadRun("found a world without a quit_time, expected a --duration, or runs never end")
        return self._world, seconds

    def _new_world(self, seed: int, settings: Mapping[str, str]) -> World:
        options = self._plan.options
        device = options["opencl"]
        return World(self._plan.world, seed=seed, settings=settings, threads=options["threads"],
                     opencl=False if device is None else device or True, controllers=options["controllers"],
                     ray_model=options["ray_model"])

    def _run(self, index: int, attempt: int) -> None:
        world, seconds = self._load(index)
        file = record_file(self._folder, index)
        file.parent.mkdir(parents=True, exist_ok=True)
        log = self._start_log(world, file)
        begun = time.monotonic()
        own = measured(self._metrics, world, world.step, world._steps_in(seconds))
        wall_seconds = time.monotonic() - begun
        if log is not None:
            log.finish()
            os.replace(f"{file.with_suffix('.mcap')}.part", file.with_suffix(".mcap"))
        write_whole(file, json.dumps(self._record(world, index, attempt, own, wall_seconds),
                                     separators=(",", ":")) + "\n")

    def _start_log(self, world: World, file: Path) -> _core.Recorder | None:
        order = self._plan.options["log"]
        if order is None:
            return None
        return world._core.record(f"{file.with_suffix('.mcap')}.part", order["every"], order["models"],
                                  order["compression"], order.get("ranges", "rep117"))

    def _record(self, world: World, index: int, attempt: int, own: Mapping[str, Any],
                wall_seconds: float) -> dict[str, Any]:
        figures = world._core.figures()
        r_acc = figures["robots"] * world.time / wall_seconds if wall_seconds > 0 else 0.0
        return {
            "index": index, "set": self._plan.values_of(index), "run": self._plan.run_of(index),
            "seed": world.seed, "status": "done", "state_hash": world.state_hash(), "steps": figures["steps"],
            "simulated_seconds": world.time, "rays": figures["rays"], "robots": figures["robots"],
            "energy": figures["energy"],
            "metrics": {**world.metrics, **{name: number(name, value) for name, value in own.items()}},
            "timing": {"load_seconds": figures["load_seconds"], "wall_seconds": wall_seconds, "r_acc": r_acc},
            "attempts": attempt, "replay": replay_command(self._plan, index),
        }


def write_whole(file: Path, text: str) -> None:
    """Writes a file atomically; its folder must exist."""
    # An unpredictable name that follows no link is safe even if everybody may write into the folder.
    handle, part = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}.")
    with os.fdopen(handle, "w", encoding="utf-8") as out:
        out.write(text)
    os.chmod(part, 0o666 & ~current_umask())
    os.replace(part, file)


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
