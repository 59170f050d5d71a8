# SPDX-License-Identifier: GPL-2.0-or-later
"""A process per simulator, so that libraries, threads and memory of one do not disturb another."""

from __future__ import annotations

import gc
import multiprocessing
import os
import sys
import time
import traceback
from multiprocessing.connection import Connection
from typing import Any

from .checks import CheckError, Sight, check_end, look
from .driving import Driver
from .simulators import peer_named
from .simulators.simulation import Simulation
from .task import Task

LOOK_SECONDS = 10.0
WARM_UP = 5  # steps


class WorkerError(Exception):
    """The reason in one line why a simulator gave no figure."""


class Served:
    """A simulator in the process of a worker, and the answers to requests."""

    def __init__(self, name: str, task: Task, device: str, threads: int) -> None:
        self._peer, self._task, self._device, self._threads = peer_named(name), task, device, threads
        self._simulation: Simulation | None = None
        self._driver: Driver | None = None

    def _open(self) -> Simulation:
        return self._peer.open(self._task, self._device, self._threads)

    def look(self) -> tuple[Sight, str]:
        """Returns what episodes show, and the simulator's note."""
        simulation = self._open()
        return look(simulation, self._task, LOOK_SECONDS), simulation.note

    def start(self) -> None:
        """Prepares measurements, with new environments that no check has touched."""
        gc.collect()
        self._simulation = self._open()
        self._driver = Driver(self._simulation, self._task)
        for _ in range(WARM_UP):
            self._driver.step()

    def measure(self, seconds: float) -> tuple[int, float, float]:
        """Returns steps, the seconds that they took, and the processor time of this process."""
        assert self._simulation is not None and self._driver is not None
        before = time.process_time()
        steps, took, result = self._driver.measure(seconds)
        spent = time.process_time() - before
        check_end(self._simulation.facts(result), self._task)
        return steps, took, spent


def serve(pipe: Connection, name: str, task: Task, device: str, threads: int) -> None:
    """Answers requests until the other end closes the pipe."""
    os.dup2(sys.stderr.fileno(), 1)  # some simulators print
    try:
        served = Served(name, task, device, threads)
        while True:
            request, *arguments = pipe.recv()
            pipe.send(("done", getattr(served, request)(*arguments)))
    except (EOFError, KeyboardInterrupt):
        pass
    except CheckError as error:
        pipe.send(("failed", str(error)))
    except Exception as error:  # any error of a simulator is the result of its row
        traceback.print_exc()
        pipe.send(("failed", f"{type(error).__name__}: {' '.join(str(error).split())}"))


class Worker:
    """A simulator in a process of its own."""

    def __init__(self, name: str, task: Task, device: str, threads: int) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(target=serve, args=(other, name, task, device, threads), daemon=True)
        self._process.start()
        other.close()

    def _ask(self, *request: Any) -> Any:
        try:
            self._pipe.send(request)
            kind, answer = self._pipe.recv()
        except (EOFError, OSError):
            self._process.join()
            raise WorkerError(f"its process ended with status {self._process.exitcode}") from None
        if kind != "done":
            raise WorkerError(answer)
        return answer

    def look(self) -> tuple[Sight, str]:
        """Returns what episodes show, and the simulator's note."""
        answer: tuple[Sight, str] = self._ask("look")
        return answer

    def start(self) -> None:
        """Prepares measurements."""
        self._ask("start")

    def measure(self, seconds: float) -> tuple[int, float, float]:
        """Returns steps, the seconds that they took, and the processor time of the process."""
        answer: tuple[int, float, float] = self._ask("measure", seconds)
        return answer

    def close(self) -> None:
        """Ends the process."""
        self._pipe.close()
        self._process.join(10)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
