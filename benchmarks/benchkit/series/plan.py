# SPDX-License-Identifier: GPL-2.0-or-later
"""Decides which run comes next and how long it will take, from the finished runs.

The outermost loop is over the repeats. So an interrupted series has all points once before any
point twice, and the repeats of a point are far apart in time. The innermost loop is over the
backends, in an order that changes with each repeat and point. So a drift of the machine affects all
backends equally, and so does the state that a run leaves behind, such as a hot processor.
"""

from __future__ import annotations

import math
import statistics
from collections import defaultdict
from dataclasses import dataclass
from typing import Iterator

from benchkit.series.runs import Backend, Job
from benchkit.series.records import COMPILE, MEASURE, WARM_UP, Key, Record

STEP = 0.1  # simulated seconds per step in the worlds of tools/populate
LEAST_STEPS = 20
MOST_STEPS = 20_000  # more steps give no further insight
SHORT_RUN_SECONDS = 1.0  # average over the backends
LONG_SECONDS = 600.0  # simulated seconds, as in the paper
# Shorter warm-ups do not predict the machine's speed.
WARM_UP_SECONDS = 0.1
MOST_WARM_UPS = 4
# Assumed seconds for starting the program and loading a world, until runs have measured it.
USUAL_OVERHEAD = 0.3


@dataclass(frozen=True)
class Plan:
    """The definition of a series."""

    worlds: dict[str, tuple[int, ...]]  # populations in ascending order
    backends: tuple[Backend, ...]
    repeats: int
    form: str
    fixed_seconds: float | None  # simulated seconds of all runs; None: as many as the time allows


class History:
    """The finished runs, indexed for planning."""

    def __init__(self, records: list[Record]) -> None:
        self._runs: dict[tuple, list[Record]] = defaultdict(list)
        self._steps: dict[tuple, dict[int, float]] = defaultdict(dict)
        self._overheads: dict[tuple, dict[int, float]] = defaultdict(dict)
        self._durations: dict[tuple, float] = {}
        self._done: dict[Key, Record] = {}
        self.failed: set[Key] = set()  # in this call; earlier failures are tried again
        for record in records:
            if record.ok:
                self.add(record)

    def add(self, record: Record) -> None:
        if not record.ok:
            self.failed.add(record.key)
            return
        self._done[record.key] = record
        if record.purpose != COMPILE:
            runs = self._runs[record.world, record.backend, record.population]
            runs.append(record)
            self._steps[record.world, record.backend][record.population] = step_time(runs)
            self._overheads[record.world, record.backend][record.population] = \
                statistics.median(run.process_seconds - run.wall_seconds for run in runs)
        if record.purpose == MEASURE:
            self._durations[record.world, record.population] = record.simulated_seconds

    def record_of(self, key: Key) -> Record | None:
        return self._done.get(key)

    def is_over(self, key: Key) -> bool:
        """True if the run has succeeded or failed."""
        return key in self._done or key in self.failed

    def duration(self, world: str, population: int) -> float | None:
        """Simulated seconds of the runs of this point, or None."""
        return self._durations.get((world, population))

    def step_seconds(self, world: str, backend: str, population: int) -> float | None:
        """Estimates real seconds per step from the nearest smaller populations.

        Continues the slope between the last two, or else assumes a time proportional to the robots.
        """
        known = self._steps.get((world, backend), {})
        if not known or population in known:
            return known.get(population)
        below = sorted(n for n in known if n < population)
        if not below:
            nearest = min(known)
            return known[nearest] * population / nearest
        last, slope = below[-1], 1.0
        if len(below) > 1:
            before = below[-2]
            slope = math.log(known[last] / known[before]) / math.log(last / before)
            slope = min(1.2, max(0.0, slope))
        return known[last] * (population / last) ** slope

    def overhead(self, world: str, backend: str, population: int) -> float:
        """Real seconds of a run outside its steps, from the nearest population."""
        known = self._overheads.get((world, backend))
        if not known:
            return USUAL_OVERHEAD
        return known[min(known, key=lambda n: abs(math.log(n / population)))]


def step_time(records: list[Record]) -> float:
    """Step time of the measured runs, or else of the longest warm-up."""
    measured = [r.step_seconds for r in records if r.purpose == MEASURE]
    return statistics.median(measured) if measured else \
        max(records, key=lambda r: r.steps).step_seconds


def two_digits(number: float) -> int:
    """Rounds to two significant digits, if these are whole steps."""
    scale = 10 ** max(0, math.floor(math.log10(number)) - 1)
    return round(number / scale) * scale


def simulated_seconds(plan: Plan, history: History, world: str, population: int) -> float | None:
    """Simulated seconds of all runs of a point; None until the speed is known."""
    if plan.fixed_seconds is not None:
        return plan.fixed_seconds
    chosen = history.duration(world, population)
    if chosen is not None:
        return chosen
    times = [history.step_seconds(world, backend.label, population) for backend in plan.backends]
    known = [time for time in times if time is not None]
    if not known:
        return None
    steps = SHORT_RUN_SECONDS / statistics.mean(known)
    return round(two_digits(min(MOST_STEPS, max(LEAST_STEPS, steps))) * STEP, 6)


def preparations(plan: Plan, history: History) -> Iterator[Job]:
    """Runs that compile with an empty cache, then warm-ups."""
    first_world = next(iter(plan.worlds))
    steps = LEAST_STEPS * STEP
    if plan.fixed_seconds is not None:
        steps = min(steps, plan.fixed_seconds)
    for backend in plan.backends:
        if backend.is_device:
            yield Job(COMPILE, first_world, plan.worlds[first_world][0], backend, 1, steps)
    for world, populations in plan.worlds.items():
        for backend in plan.backends:
            seconds = steps
            for attempt in range(1, MOST_WARM_UPS + 1):
                job = Job(WARM_UP, world, populations[0], backend, attempt, seconds)
                yield job
                record = history.record_of(job.key)
                if plan.fixed_seconds is not None or record is None or \
                        record.wall_seconds >= WARM_UP_SECONDS:
                    break
                seconds *= 10


def balanced_order(backends: tuple[Backend, ...], turn: int) -> tuple[Backend, ...]:
    """Order of the backends in a turn.

    After n turns of n backends (2 n turns if n is odd), each backend has been at each position
    equally often, and has directly followed each other backend equally often.

    Source: E. J. Williams, Experimental designs balanced for the estimation of residual effects of
    treatments, 1949.
    """
    count = len(backends)
    zigzag = [(place + 1) // 2 if place % 2 else -(place // 2) for place in range(count)]
    order = tuple(backends[(place + turn) % count] for place in zigzag)
    return order[::-1] if count % 2 and turn // count % 2 else order


def measurements(plan: Plan, history: History) -> Iterator[tuple[Job, float]]:
    """Measured runs in order. The seconds of short runs are estimates until they are next."""
    for repeat in range(1, plan.repeats + 1):
        turn = repeat - 1
        for world, populations in plan.worlds.items():
            for population in populations:
                seconds = simulated_seconds(plan, history, world, population)
                for backend in balanced_order(plan.backends, turn):
                    job = Job(MEASURE, world, population, backend, repeat,
                              seconds or LEAST_STEPS * STEP)
                    yield job, expected_seconds(history, job)
                turn += 1


def remaining(plan: Plan, history: History) -> list[tuple[Job, float]]:
    """The remaining runs in order, each with its expected real seconds."""
    jobs = [(job, expected_seconds(history, job)) for job in preparations(plan, history)]
    jobs += measurements(plan, history)
    return [(job, seconds) for job, seconds in jobs if not history.is_over(job.key)]


def expected_seconds(history: History, job: Job) -> float:
    """Expected real seconds of a run."""
    label = job.backend.label
    step = history.step_seconds(job.world, label, job.population)
    running = SHORT_RUN_SECONDS if step is None else step * job.simulated_seconds / STEP
    if job.purpose == COMPILE:
        running = 2.0  # compilers take about this long
    return running + history.overhead(job.world, label, job.population)
