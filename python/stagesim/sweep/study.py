# SPDX-License-Identifier: GPL-2.0-or-later
"""The statistics of a sweep: means over seeds with intervals, and comparisons. Pictures: see figures.py."""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from ..reports.inference import Contrast, contrast, holm, mean_bounds
from ..text import printable
from .plan import Plan
from .table import Column

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

#: Columns of every sweep that are not results.
FIXED = {"index", "run", "seed", "status", "state_hash", "steps", "simulated_seconds", "rays", "robots"}
SPEED = "timing_r_acc"
#: Units of the built-in kinds of metrics.
KIND_UNITS = {"distance": "m", "coverage": "m²", "time_to_goal": "s", "nearest": "m", "collisions": ""}
#: Units of properties that are often varied.
PROPERTY_UNITS = {"resolution": "m", "radius": "m", "interval_sim": "ms", "update_interval": "ms", "fov": "°",
                  "joules": "J", "watts": "W"}
#: If an axis has more values, only successive values and the two ends are compared.
MAX_FOR_ALL_PAIRS = 4


@dataclass(frozen=True)
class Axis:
    """A setting that was varied.

    Attributes:
        name: name of the setting.
        label: the name with its unit, if it is known.
        values: its values: numbers or strings.
        codes: for each run the index of its value in `values`.
    """

    name: str
    label: str
    values: tuple[Any, ...]
    codes: npt.NDArray[np.int64]

    @property
    def numeric(self) -> bool:
        """True if the values are numbers."""
        return not isinstance(self.values[0], str)

    def text(self, at: int) -> str:
        """Formats the value number `at`."""
        value = self.values[at]
        return value if isinstance(value, str) else f"{value:g}"


@dataclass(frozen=True)
class Metric:
    """A result of each run; NaN: no value."""

    name: str
    label: str
    values: Floats


@dataclass(frozen=True)
class Mean:
    """Mean of `count` runs that differ only by their seeds, with a 95 % interval from `low` to `high`."""

    mean: float
    low: float
    high: float
    count: int


@dataclass(frozen=True)
class Comparison:
    """Comparison of two values of an axis; `probability` is corrected for the number of comparisons."""

    metric: Metric
    axis: Axis
    first: int
    second: int
    means: tuple[float, float]
    found: Contrast
    paired: bool
    probability: float


def units_of_metrics(world: str) -> dict[str, str]:
    """Units by name of the metrics in a world file; files that it includes are not read."""
    try:
        text = Path(world).read_text(encoding="utf-8", errors="surrogateescape")
    except OSError:
        return {}
    units: dict[str, str] = {}
    for section in re.findall(r"^\s*metric\s*\((.*?)\)", text, re.MULTILINE | re.DOTALL):
        words: dict[str, str] = dict(re.findall(r'\b(name|kind)\s+"([^"]*)"', section))
        kind = words.get("kind", "")
        units[words.get("name", kind)] = KIND_UNITS.get(kind, "")
    return units


def with_unit(name: str, unit: str) -> str:
    """A label: the name, with its unit in brackets if there is one."""
    return f"{name} ({unit})" if unit else name


class Study:
    """The finished runs of a sweep.

    Args:
        plan: the plan of the sweep.
        columns: the columns of its runs, with timings.
    """

    def __init__(self, plan: Plan, columns: Sequence[Column]) -> None:
        self.plan = plan
        known = {column.name: column for column in columns}
        self.done: Mask = np.array([status == "done" for status in known["status"].values], bool)
        self.run = np.array(known["run"].values, np.int64)
        self.index = np.array(known["index"].values, np.int64)
        self.axes = [self._axis(known[axis.name]) for axis in plan.axes if len(axis.values) > 1]
        self.metrics, self.same = self._metrics(columns)

    def _axis(self, column: Column) -> Axis:
        values = tuple(sorted(set(column.values)) if column.kind != "text" else dict.fromkeys(column.values))
        place = {value: at for at, value in enumerate(values)}
        unit = PROPERTY_UNITS.get(column.name.rpartition(".")[2], "") if "." in column.name else ""
        name, shown = printable(column.name), tuple(printable(value) if isinstance(value, str) else value
                                                    for value in values)
        return Axis(name, with_unit(name, unit), shown,
                    np.array([place[value] for value in column.values], np.int64))

    def _metrics(self, columns: Sequence[Column]) -> tuple[list[Metric], dict[str, float]]:
        """The metrics whose values differ, and the values of those that are equal in all runs (NaN: no value)."""
        units = {"energy_dissipated": "J", **units_of_metrics(self.plan.world)}
        left_out = FIXED | {axis.name for axis in self.plan.axes}
        metrics, same = [], {}
        for column in columns:
            speed = column.name == SPEED
            if column.name in left_out or (column.name.startswith("timing_") and not speed):
                continue
            if column.name.startswith("energy_") and column.name != "energy_dissipated":
                continue
            values = np.array([np.nan if value is None else value for value in column.values], np.float64)
            name = "r_ACC" if speed else printable(column.name)
            metric = Metric(name, "speed: r_ACC (robot s / s)" if speed else
                            with_unit(name.replace("_", " "), units.get(column.name, "")), values)
            there = ~np.isnan(values[self.done])
            if 0 < there.sum() < there.size:
                share = np.where(self.done, ~np.isnan(values), np.nan).astype(np.float64)
                metrics.append(Metric(f"{name}_share", f"share of runs with {name}", share))
            found = np.unique(values[self.done][there])
            if found.size > 1:
                metrics.append(metric)
            elif not column.name.startswith("energy_"):
                same[name] = float(found[0]) if found.size else np.nan
        return metrics, same

    @property
    def numeric_axes(self) -> list[Axis]:
        """The axes whose values are numbers."""
        return [axis for axis in self.axes if axis.numeric]

    def mean(self, metric: Metric, which: Mask) -> Mean:
        """The mean over the selected runs that have a value."""
        values = metric.values[which & ~np.isnan(metric.values)]
        if values.size == 0:
            return Mean(np.nan, np.nan, np.nan, 0)
        return Mean(float(values.mean()), *mean_bounds(values), values.size)

    def at(self, chosen: Sequence[tuple[Axis, int]]) -> Mask:
        """Mask of the successful runs with these values, given as pairs of an axis and a code."""
        mask = self.done.copy()
        for axis, code in chosen:
            mask &= axis.codes == code
        return mask

    def sets(self, without: Sequence[Axis] = ()) -> Iterator[list[tuple[Axis, int]]]:
        """Yields every combination of values of the axes that are not in `without`."""
        axes = [axis for axis in self.axes if all(axis is not other for other in without)]
        for codes in itertools.product(*(range(len(axis.values)) for axis in axes)):
            yield list(zip(axes, codes))

    def comparisons(self) -> list[Comparison]:
        """Compares the values of each axis in all metrics except for speed; the most significant come first."""
        made = [self._compare(metric, axis, first, second)
                for metric in self.metrics if metric.name != "r_ACC"
                for axis in self.axes for first, second in pairs(len(axis.values))]
        found = [comparison for comparison in made if comparison is not None]
        tested = [comparison for comparison in found if not np.isnan(comparison.probability)]
        corrected = iter(holm([comparison.probability for comparison in tested]))
        found = [comparison if np.isnan(comparison.probability) else
                 replace(comparison, probability=next(corrected)) for comparison in found]
        return sorted(found, key=lambda comparison: (np.isnan(comparison.probability), comparison.probability))

    def _compare(self, metric: Metric, axis: Axis, first: int, second: int) -> Comparison | None:
        """Compares two values of an axis within each combination of the other axes; None if none has both."""
        paired = self.plan.common_seeds
        more, less = [], []
        for others in self.sets([axis]):
            groups = [self._by_run(metric, [*others, (axis, code)]) for code in (first, second)]
            if paired:
                runs = sorted(groups[0].keys() & groups[1].keys())
                groups = [{run: group[run] for run in runs} for group in groups]
            if all(groups):
                less.append(np.array(list(groups[0].values())))
                more.append(np.array(list(groups[1].values())))
        if not more:
            return None
        found = contrast([b - a for a, b in zip(less, more)]) if paired else contrast(more, less)
        means = tuple(float(np.mean([group.mean() for group in groups])) for groups in (less, more))
        return Comparison(metric, axis, first, second, (means[0], means[1]), found, paired, found.probability)

    def _by_run(self, metric: Metric, chosen: Sequence[tuple[Axis, int]]) -> dict[int, float]:
        which = self.at(chosen) & ~np.isnan(metric.values)
        return dict(zip(self.run[which].tolist(), metric.values[which].tolist()))


def pairs(count: int) -> list[tuple[int, int]]:
    """Pairs of value indices to compare: all pairs, or, if there are many values, neighbours and the two ends."""
    if count <= MAX_FOR_ALL_PAIRS:
        return list(itertools.combinations(range(count), 2))
    return [(at, at + 1) for at in range(count - 1)] + [(0, count - 1)]
