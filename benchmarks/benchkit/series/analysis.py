# SPDX-License-Identifier: GPL-2.0-or-later
"""Analysis of the raw figures: medians and spreads, comparisons, averages, memory, different
results.

Spreads are minimum and maximum of the repeats. Comparisons are made within a repeat, whose runs are
close together in time; then the median of the repeats is taken.
"""

from __future__ import annotations

import math
import statistics
from collections import defaultdict
from dataclasses import dataclass
from typing import Callable, Iterable

from benchkit.inference import Summary, quotient, summary
from benchkit.series.breakeven import BreakEven, Point, break_even
from benchkit.series.records import COMPILE, MEASURE, PHASES, Record

LARGE = 100  # minimum number of robots of the populations that averages include, as in the paper


@dataclass(frozen=True)
class HashDifference:
    """Runs whose state hashes should be equal but differ."""

    world: str
    population: int
    simulated_seconds: float
    hashes: dict[str, list[str]]  # for each state hash, the backends that computed it


@dataclass(frozen=True)
class Loss:
    """A population for which OpenCL was slower than the host."""

    world: str
    population: int
    backend: str
    base: str
    ratio: Summary


def differences(records: Iterable[Record]) -> list[HashDifference]:
    """State hashes must not depend on backend, repeat or purpose. (Commits may differ.)"""
    found: dict[tuple, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
    for r in records:
        if r.ok:
            key = (r.commit, r.world, r.population, r.seed, r.simulated_seconds)
            found[key][r.state_hash].add(r.backend)
    return [HashDifference(key[1], key[2], key[4],
                           {state: sorted(labels) for state, labels in hashes.items()})
            for key, hashes in found.items() if len(hashes) > 1]


def in_order(label: str) -> tuple:
    """Sorts backends: host1, hostN, other hosts, devices, auto."""
    kinds = ("host1", "hostN", "host:", "cl:", "auto")
    return next((i for i, kind in enumerate(kinds) if label.startswith(kind)), len(kinds)), label


class Series:
    """Queries about the finished runs of a series."""

    def __init__(self, records: list[Record]) -> None:
        self.records = records
        self.good = [record for record in records if record.ok]
        self._runs: dict[tuple, dict[int, Record]] = defaultdict(dict)
        for record in self.good:
            if record.purpose == MEASURE:
                key = (record.world, record.population, record.backend)
                self._runs[key][record.repeat] = record
        self.worlds = sorted({key[0] for key in self._runs})
        self.backends = sorted({key[2] for key in self._runs}, key=in_order)
        self.devices = [label for label in self.backends if label.startswith("cl:")]
        self.accelerated = [b for b in self.backends if b == "auto" or b in self.devices]
        self.hosts = [label for label in self.backends if label.startswith("host")]
        self.bases = [label for label in ("host1", "hostN") if label in self.backends]

    def repeats(self, *backends: str) -> tuple[int, int]:
        """Minimum and maximum number of repeats of a population, for the given backends or all."""
        counts = [len(runs) for key, runs in self._runs.items()
                  if not backends or key[2] in backends]
        return min(counts, default=0), max(counts, default=0)

    @property
    def measured(self) -> list[Record]:
        return [record for runs in self._runs.values() for record in runs.values()]

    def populations(self, world: str, *backends: str) -> list[int]:
        """Populations measured with all of these backends; without backends, with any."""
        sets = [{key[1] for key in self._runs if key[0] == world and key[2] == backend}
                for backend in backends]
        if not sets:
            sets = [{key[1] for key in self._runs if key[0] == world}]
        return sorted(set.intersection(*sets))

    def runs(self, world: str, population: int, backend: str) -> dict[int, Record]:
        """Runs by repeat."""
        return self._runs.get((world, population, backend), {})

    def figure(self, world: str, population: int, backend: str,
               of: Callable[[Record], float]) -> Summary | None:
        return summary(map(of, self.runs(world, population, backend).values()))

    def column(self, world: str, population: int, backend: str, name: str) -> Summary | None:
        return self.figure(world, population, backend, lambda record: getattr(record, name))

    def has(self, name: str) -> bool:
        """True if any run has this figure."""
        return any(not math.isnan(getattr(record, name)) for record in self.measured)

    @property
    def scopes(self) -> str:
        """The scopes of the energy figures."""
        found = {r.scope or "unknown" for r in self.measured if not math.isnan(r.r_epss)}
        return "/".join(sorted(found))

    def ratios(self, world: str, population: int, backend: str, base: str,
               name: str = "r_acc") -> list[float]:
        """Ratios of the figure to that of the base, for each repeat of both."""
        mine, theirs = self.runs(world, population, backend), self.runs(world, population, base)
        values = [quotient(getattr(mine[i], name), getattr(theirs[i], name))
                  for i in sorted(mine.keys() & theirs.keys())]
        return [value for value in values if not math.isnan(value)]

    def relative(self, world: str, population: int, backend: str, base: str,
                 name: str = "r_acc") -> Summary | None:
        return summary(self.ratios(world, population, backend, base, name))

    def losses(self) -> list[Loss]:
        """Populations for which OpenCL did not pay."""
        found = []
        for base in self.bases:
            for backend in self.accelerated:
                for world in self.worlds:
                    for population in self.populations(world, backend, base):
                        ratio = self.relative(world, population, backend, base)
                        if ratio is not None and ratio.median < 1:
                            found.append(Loss(world, population, backend, base, ratio))
        return found

    # Averages over large populations.

    def large_populations(self, world: str) -> list[int]:
        """Populations of at least LARGE robots that every backend has, so that averages are
        comparable."""
        return [n for n in self.populations(world, *self.backends) if n >= LARGE]

    def average(self, world: str, backend: str, name: str = "r_acc") -> Summary | None:
        """Mean over the large populations, with equal weights."""
        return self._over_large(world, backend, statistics.fmean,
                                lambda n, i: getattr(self.runs(world, n, backend)[i], name))

    def average_relative(self, world: str, backend: str, base: str,
                         name: str = "r_acc") -> Summary | None:
        """Geometric mean over the large populations, which suits ratios."""
        def ratio(population: int, repeat: int) -> float:
            return quotient(getattr(self.runs(world, population, backend)[repeat], name),
                            getattr(self.runs(world, population, base)[repeat], name))
        return self._over_large(world, backend, statistics.geometric_mean, ratio, base)

    def _over_large(self, world: str, backend: str, mean: Callable[[list[float]], float],
                    value: Callable[[int, int], float], base: str = "") -> Summary | None:
        """Summarizes the means of the repeats that have all large populations."""
        populations = self.large_populations(world)
        labels = [backend, base] if base else [backend]
        complete = [set(self.runs(world, n, label)) for n in populations for label in labels]
        means = []
        for repeat in sorted(set.intersection(*complete)) if complete else ():
            values = [value(population, repeat) for population in populations]
            if not any(map(math.isnan, values)):
                means.append(mean(values))
        return summary(means)

    # Break-even, phases, memory, compiling.

    def break_even(self, world: str, device: str, base: str) -> BreakEven | None:
        """Break-even of the device against the host; None if too little was measured."""
        points = []
        for population in self.populations(world, device, base):
            rays = self.column(world, population, device, "rays_per_step")
            # Device and host ran the same steps, so ratios of r_ACC are ratios of the step time.
            ratios = self.ratios(world, population, device, base)
            if rays is not None and rays.median > 0:
                points.append(Point(rays.median, population, tuple(ratios)))
        return break_even(points)

    def phases(self, world: str, population: int, backend: str) -> dict[str, float]:
        """Median milliseconds per step of each phase; "other" is the rest of the step."""
        found = {}
        for phase in PHASES:
            value = self.column(world, population, backend, f"{phase}_ms")
            found[phase] = value.median if value else 0.0
        step = self.figure(world, population, backend, lambda record: record.step_seconds * 1000)
        found["other"] = max(0.0, (step.median if step else 0.0) - sum(found.values()))
        return found

    def memory_per_robot(self, world: str, backend: str) -> float | None:
        """KiB per additional robot, between the smallest and the largest population."""
        populations = self.populations(world, backend)
        if len(populations) < 2:
            return None
        ends = [self.column(world, n, backend, "peak_memory_mb")
                for n in (populations[0], populations[-1])]
        if ends[0] is None or ends[1] is None:
            return None
        return (ends[1].median - ends[0].median) * 1024 / (populations[-1] - populations[0])

    def compiling(self, device: str) -> tuple[Record | None, Summary | None]:
        """The run with an empty kernel cache, and the seconds that warm runs spent compiling."""
        cold = [record for record in self.good
                if record.purpose == COMPILE and record.backend == device]
        warm = summary(record.compile_seconds for record in self.good
                       if record.purpose == MEASURE and record.backend == device)
        return (cold[-1] if cold else None), warm

    def start_up_share(self) -> Summary | None:
        """Fraction of the program's time that is not spent in steps; the meter covers it as
        well."""
        return summary(1 - record.wall_seconds / record.process_seconds
                       for record in self.measured)

    def failures(self) -> list[Record]:
        """Failed runs that were not repeated successfully."""
        done = {record.key for record in self.good}
        last = {record.key: record for record in self.records if not record.ok}
        return [record for place, record in last.items() if place not in done]
