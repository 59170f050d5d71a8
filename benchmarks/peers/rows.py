# SPDX-License-Identifier: GPL-2.0-or-later
"""The rows of the table: each belongs to one simulator and one task."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field

from .caster import Casters, CastTask, missing
from .checks import Sight, differences, faults
from .energy import Energy, Others
from .simulators import Peer
from .task import Task
from .workers import Worker, WorkerError

FIRST = "stage"  # the simulator that others are compared with


@dataclass
class Row:
    """A simulator's result. It counts only if `failures` and `missing` are empty."""

    scene: str
    agents: int
    rays: int
    envs: int
    peer: str
    title: str
    version: str
    device: str
    missing: str = ""  # modules that are not installed
    failures: list[str] = field(default_factory=list)
    agent_steps: list[float] = field(default_factory=list)  # per second, in each round
    ray_rates: list[float] = field(default_factory=list)  # per second
    microjoules: list[float] = field(default_factory=list)  # per agent-step, or per ray in the cave
    energy: str = ""  # the meter's scope, or why there are no figures
    others: list[float] = field(default_factory=list)  # processors that other programs used
    per_processor: list[float] = field(default_factory=list)  # agent-steps, or rays in the cave, per processor-second
    ratios: list[float] = field(default_factory=list)  # speed of FIRST in units of this one, per round
    processor_ratios: list[float] = field(default_factory=list)  # the same of `per_processor`
    hits: float | None = None  # fraction of rays that hit something
    sight: Sight | None = None
    note: str = ""

    @property
    def measured(self) -> bool:
        """True if the row has valid figures."""
        return not self.missing and not self.failures and bool(self.ray_rates)

    def as_json(self) -> dict[str, object]:
        """Returns it as a dictionary."""
        return asdict(self)


def compare_rounds(rows: Sequence[Row]) -> None:
    """Computes the ratios to the row of FIRST, round by round."""
    first = next((row for row in rows if row.peer == FIRST and row.measured), None)
    for row in rows:
        if first is not None and row is not first and row.measured:
            row.ratios = [a / b for a, b in zip(first.ray_rates, row.ray_rates)]
            row.processor_ratios = [a / b for a, b in zip(first.per_processor, row.per_processor)]


@dataclass
class Rounds:
    """How often and how long to measure."""

    repeats: int
    seconds: float
    energy: Energy
    say: Callable[[str], None]

    def record(self, row: Row, count: int, took: float, own: float, others: Others, joules: list[float | None],
               unit_steps: int) -> None:
        """Adds a measurement of `count` steps or rays to a row; `unit_steps` agent-steps or rays make one of them."""
        row.others.append(others.processors(own))
        row.ray_rates.append(count * unit_steps * (row.rays if row.agents else 1) / took)
        if row.agents:
            row.agent_steps.append(count * unit_steps / took)
        row.per_processor.append(count * unit_steps / own)
        row.microjoules += [1e6 * value / (count * unit_steps) for value in joules if value is not None]
        row.energy = self.energy.scope or self.energy.reason


class Race:
    """Measures simulators in turns, all with the same task."""

    def __init__(self, task: Task, peers: Sequence[Peer], device: str, threads: int, rounds: Rounds) -> None:
        self._task, self._rounds = task, rounds
        self._workers: dict[str, Worker] = {}
        scene = "navigation, apart" if task.apart else "navigation"
        self.rows = [Row(scene, task.agents, task.rays, task.envs, peer.name, peer.title, peer.version(), device,
                         missing=peer.missing()) for peer in peers]
        self._device, self._threads = device, threads

    def run(self) -> list[Row]:
        """Returns a row per simulator."""
        try:
            for row in self.rows:
                if not row.missing:
                    self._guard(row, self._look)
            self._compare_sights()
            for row in self._going():
                self._guard(row, lambda row: self._workers[row.peer].start())
            for turn in range(self._rounds.repeats):
                going = self._going()
                for row in going if turn % 2 == 0 else going[::-1]:
                    self._guard(row, self._measure)
        finally:
            for worker in self._workers.values():
                worker.close()
        compare_rounds(self.rows)
        return self.rows

    def _going(self) -> list[Row]:
        return [row for row in self.rows if not row.missing and not row.failures]

    def _guard(self, row: Row, act: Callable[[Row], None]) -> None:
        """Does something for a row; an error becomes its failure."""
        self._rounds.say(f"{row.title}, {row.agents} agents, {row.envs} environments")
        try:
            act(row)
        except WorkerError as error:
            row.failures.append(str(error))

    def _look(self, row: Row) -> None:
        worker = self._workers[row.peer] = Worker(row.peer, self._task, self._device, self._threads)
        row.sight, row.note = worker.look()
        row.hits = row.sight.hits
        row.failures += faults(row.sight, self._task)

    def _compare_sights(self) -> None:
        first = next((row for row in self._going() if row.peer == FIRST), None)
        for row in self._going():
            if first is not None and row is not first and first.sight is not None and row.sight is not None:
                row.failures += differences(first.sight, row.sight)

    def _measure(self, row: Row) -> None:
        others = Others()
        with self._rounds.energy.measuring() as readings:
            steps, took, own = self._workers[row.peer].measure(self._rounds.seconds)
        self._rounds.record(row, steps, took, own, others, [reading.joules for reading in readings],
                            self._task.envs * self._task.agents)


def cast_rows(task: CastTask, threads: int, rounds: Rounds) -> list[Row]:
    """Compares World.cast() with a plain caster."""
    titles = {"stage": "`World.cast()`", "stage-exact": "`World.cast()`, exact", "caster": "plain caster, numba"}
    rows = [Row("cave", 0, task.rays, task.poses, name, title, "", "cpu", missing=missing())
            for name, title in titles.items()]
    if rows[0].missing:
        return rows
    casters = Casters(task, threads)
    found = casters.faults()
    for row in rows:
        row.hits = casters.hits(row.peer)
        row.failures = [fault for fault in found if fault.startswith(f"{row.peer}:")]
    for turn in range(rounds.repeats):
        for row in rows if turn % 2 == 0 else rows[::-1]:
            rounds.say(f"{row.title} in the cave")
            others, before = Others(), time.process_time()
            with rounds.energy.measuring() as readings:
                count, took = casters.measure(row.peer, rounds.seconds)
            rounds.record(row, count, took, time.process_time() - before, others,
                          [reading.joules for reading in readings], 1)
    compare_rounds(rows)
    return rows


def median(values: Sequence[float]) -> float:
    """The median; NaN without values."""
    return statistics.median(values) if values else float("nan")
