# SPDX-License-Identifier: GPL-2.0-or-later
"""Shared by the experiments of this folder: single runs, sweeps, statistics, tables and figures.

Each experiment is a module NAME.py beside NAME.world, with a STUDY. The controller in C++ is examples/ctrl/NAME.cc;
a class of the module is the controller in Python.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import stagesim as st
from stagesim.sweep import Experiment
from stagesim.sweep import run as run_sweep

FOLDER = Path(__file__).resolve().parent
RUNS = 30  #: of each set of values

Floats = npt.NDArray[np.float64]
Values = npt.NDArray[Any]
Table = Mapping[str, Values]  #: columns of a sweep, with an element for each run
Settings = Mapping[str, Any]


class Controller(Protocol):
    """The controller of all robots of a world. It is made before the first step, with the arguments of `ctrl`."""

    def step(self) -> None:
        """Reads the sensors and sets the commands. Called after each step of the world."""


class Measure(Protocol):
    """A metric for sweeps: see docs/sweeps.md. It is made with the world before the first step."""

    def step(self) -> None:
        """Called after each step."""

    def result(self) -> dict[str, float]:
        """Returns the metrics; called at the end."""


@dataclass(frozen=True)
class Effect:
    """The effect of the paper in short: a metric that is above a number with a mechanism, and not without it.

    Attributes:
        metric: its name.
        least: the number.
        shown: settings with the mechanism.
        hidden: settings without it.
        seconds: simulated time of a run.
        tolerance: how far the robots of C++ and Python may be apart at the end of the run with the mechanism, metres.
            0: the runs are bit-equal. None: they differ, because the controller draws random numbers, or because
            contacts magnify the last bits.
    """

    metric: str
    least: float
    shown: Settings
    hidden: Settings
    seconds: float
    tolerance: float | None


@dataclass(frozen=True)
class Axis:
    """An axis of the sweep as a column of the table in the documentation."""

    name: str
    head: str
    text: Callable[[Any], str] = str  #: of a value


@dataclass(frozen=True)
class Column:
    """A column of the table in the documentation: the median and the quartiles of a metric, or its mean."""

    metric: str
    head: str
    digits: int = 2
    mean: bool = False

    def cell(self, values: Values) -> str:
        """The text for the runs with the same settings. Runs without a value do not count."""
        found = values[np.isfinite(values)]
        if not len(found):
            return "–"
        if self.mean:
            return f"{found.mean():.{self.digits}f}"
        low, middle, high = np.quantile(found, [0.25, 0.5, 0.75])
        return f"{middle:.{self.digits}f} ({low:.{self.digits}f} to {high:.{self.digits}f})"


@dataclass(frozen=True)
class Study:
    """An experiment.

    Attributes:
        name: of the world, the module and the plug-in.
        sweep: the runs that show the result of the paper; `set` has its axes.
        controller: the controller in Python, called with a world and the arguments of `ctrl` as keywords.
        measure: the class of the metrics.
        effect: what tests check.
        axes: the first columns of the table, a row for each set of values.
        columns: the other columns of the table.
        draw: draws the table of the sweep into a figure of matplotlib.
        built_in: the controller in C++ if it is a built-in one; otherwise it is the plug-in with the name.
    """

    name: str
    sweep: Experiment
    controller: Callable[..., Controller]
    measure: Callable[[st.World], Measure]
    effect: Effect
    axes: Sequence[Axis]
    columns: Sequence[Column]
    draw: Callable[[Table, Any], None]
    built_in: str = ""

    def figure(self, table: Table, path: Path) -> None:
        """Draws the table of the sweep into a file. Raises PlotsMissing without matplotlib."""
        from stagesim.reports import plots
        from stagesim.sweep.figures import ADVICE, STYLE

        pyplot = plots.load_pyplot(STYLE, ADVICE)
        figure = pyplot.figure(figsize=(8, 3.4))
        self.draw(table, figure)
        figure.savefig(path, metadata={"Software": None}, dpi=100)
        pyplot.close(figure)

    def lines(self, table: Table) -> list[str]:
        """The table in Markdown: a row for each set of values."""
        rows = [[*(axis.head for axis in self.axes), *(column.head for column in self.columns)]]
        for values, chosen in sets_of(table, [axis.name for axis in self.axes]):
            rows.append([*(axis.text(value) for axis, value in zip(self.axes, values)),
                         *(column.cell(table[column.metric][chosen]) for column in self.columns)])
        lines = [f"| {' | '.join(row)} |" for row in rows]
        return [lines[0], "|" + "---|" * len(rows[0]), *lines[1:]]


def sweep_of(name: str, axes: Settings, **options: Any) -> Experiment:
    """The sweep of the experiment with this name, whose module has the class Measure."""
    return Experiment(FOLDER / f"{name}.world", axes, runs=RUNS, metrics=f"{name}:Measure", **options)


def find(name: str) -> Study:
    """The study in the module with this name. `names()` lists them."""
    study = importlib.import_module(name).STUDY
    assert isinstance(study, Study)
    return study


def names() -> list[str]:
    """The names of all experiments: the modules beside a world of the same name."""
    return sorted(path.stem for path in FOLDER.glob("*.py") if path.with_suffix(".world").exists())


# ---- single runs


def arguments_in(ctrl: str) -> dict[str, float]:
    """The numbers in the text of `ctrl`: {"noise": 0.5} of "flocking noise=0.5". Raises ValueError."""
    found = {}
    for word in ctrl.split()[1:]:
        name, _, value = word.partition("=")
        try:
            found[name] = float(value)
        except ValueError:
            raise ValueError(f"found the argument {word!r}, expected NAME=NUMBER") from None
    return found


def number_in(text: str, name: str) -> float:
    """The number of that name in the text of `ctrl`."""
    return arguments_in(text)[name]


def begin(study: Study, seed: int, settings: Settings, plugin: bool,
          threads: int = 1) -> tuple[st.World, Controller | None]:
    """A world before its first step, and its controller in Python, or None for that in C++, the plug-in.

    The arguments of both are those of the setting "bot.ctrl". Raises ValueError if Python does not know one.
    """
    world = st.World(study.sweep.world, seed=seed, settings=dict(settings), controllers=plugin, threads=threads)
    if plugin:
        return world, None
    arguments = arguments_in(str(settings.get("bot.ctrl", study.name)))
    known = list(inspect.signature(study.controller).parameters)[1:]
    if unknown := [name for name in arguments if name not in known]:
        raise ValueError(f"found the argument {unknown[0]!r}, expected any of {', '.join(known)}")
    return world, study.controller(world, **arguments)


def steps(world: st.World, controller: Controller | None, seconds: float) -> Iterator[None]:
    """Makes steps for a duration, with the controller after each one."""
    for _ in range(round(seconds / world.dt)):
        world.step()
        if controller:
            controller.step()
        yield


def measure_run(study: Study, seed: int, settings: Settings, seconds: float | None, plugin: bool) -> dict[str, float]:
    """The metrics of a run for a duration; None: until the quit time of the world file."""
    world, controller = begin(study, seed, settings, plugin)
    measure = study.measure(world)
    for _ in steps(world, controller, world.quit_time or 0 if seconds is None else seconds):
        measure.step()
    return measure.result()


def main(study: Study, arguments: Sequence[str] | None = None) -> None:
    """The command line of an experiment's module: makes a run and prints its metrics."""
    parser = argparse.ArgumentParser(description=f"A run of the experiment {study.name}, with the controller in Python.")
    parser.add_argument("--seed", type=int, default=1, help="of the run (default 1)")
    parser.add_argument("--seconds", type=float, help="simulated time (default: the quit time of the world)")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a setting, as of stage --set")
    parser.add_argument("--plugin", action="store_true", help="run the controller in C++ instead")
    options = parser.parse_args(arguments)
    if wrong := [word for word in options.set if "=" not in word]:
        parser.error(f"found the setting {wrong[0]!r}, expected NAME=VALUE")
    settings = dict(word.split("=", 1) for word in options.set)
    try:
        metrics = measure_run(study, options.seed, settings, options.seconds, options.plugin)
    except (ValueError, st.StageError) as error:
        parser.error(str(error))
    for name, value in metrics.items():
        print(f"{name} {value:.4g}")


# ---- sweeps and statistics


def run(study: Study, runs: int, jobs: int, folder: Path) -> Table:
    """Makes the missing runs of the sweep in the folder and returns all of them."""
    results = run_sweep(dataclasses.replace(study.sweep, runs=runs), out=folder, jobs=jobs)
    if results.failed:
        raise SystemExit(f"{folder}: found {len(results.failed)} failed runs, expected none")
    table: Table = results.table()
    return table


def sets_of(table: Table, axes: Sequence[str]) -> Iterator[tuple[tuple[Any, ...], npt.NDArray[np.bool_]]]:
    """Each combination of values of the axes, in the order of the sweep, with the runs that have it."""
    rows = list(zip(*(table[axis].tolist() for axis in axes)))
    for values in dict.fromkeys(rows):
        yield values, np.array([row == values for row in rows])


def largest_cluster(places: Floats, reach: float) -> int:
    """The largest number of places that are connected by distances of less than `reach`: places of shape (n, 2)."""
    near = ((places[:, None] - places) ** 2).sum(2) < reach**2
    labels = np.arange(len(places))
    while True:  # until each place has the least label of its cluster
        least = np.where(near, labels, len(labels)).min(1)
        least = least[least]
        if (least == labels).all():
            return int(np.bincount(labels).max())
        labels = least


# ---- figures


def draw_quartiles(axes: Any, x: Sequence[float], groups: Sequence[Values], **look: Any) -> None:
    """Draws the medians of groups of runs as a line, and the range between their quartiles as a band.

    Runs without a value do not count, and groups of such runs are left out.
    """
    found = [(place, group[np.isfinite(group)]) for place, group in zip(x, groups) if np.isfinite(group).any()]
    low, middle, high = np.array([np.quantile(group, [0.25, 0.5, 0.75]) for _, group in found]).reshape(-1, 3).T
    places = [place for place, _ in found]
    (line,) = axes.plot(places, middle, marker="o", markersize=4, **look)
    axes.fill_between(places, low, high, color=line.get_color(), alpha=0.2, linewidth=0)
