# SPDX-License-Identifier: GPL-2.0-or-later
"""The plots of a report: PNG files of 800 pixels width, with a panel per world."""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import TYPE_CHECKING, Callable, Iterator

from benchkit.inference import Summary
from benchkit.plots import (BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED, SKY, YELLOW,
                            load_pyplot)
from benchkit.report import number
from benchkit.series.analysis import LARGE, Series
from benchkit.series.labels import (PAPER, PAPER_ENERGY, PAPER_FASTER, PAPER_ROBOTS,
                                    backend_name)
from benchkit.series.records import PHASES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, PANEL = 8.0, 3.9  # inches of 100 pixels
STYLE = {
    "figure.dpi": 100, "savefig.dpi": 100, "font.size": 10.5, "axes.titlesize": 11.5,
    "axes.grid": True, "grid.alpha": 0.3, "legend.fontsize": 9.5, "lines.linewidth": 1.6,
    "axes.axisbelow": True,
}
PAPER_COLOUR = "#555555"
DEVICE_STYLES = [(ORANGE, "D"), (GREEN, "^"), (RED, "P"), (YELLOW, "h")]
HOST_STYLES = [(SKY, "v"), (GREY, "<")]
PHASE_COLOURS = [BLUE, ORANGE, SKY, GREEN, PURPLE, YELLOW, GREY]


def styles(series: Series) -> dict[str, dict]:
    """Colour, marker and line style of each backend."""
    chosen = {"host1": (BLACK, "o", "-"), "hostN": (BLUE, "s", "-"), "auto": (PURPLE, "X", "--")}
    devices = [label for label in series.backends if label in series.devices]
    others = [label for label in series.hosts if label not in chosen]
    for labels, looks in ((devices, DEVICE_STYLES), (others, HOST_STYLES)):
        for i, label in enumerate(labels):
            chosen[label] = (*looks[i % len(looks)], "-" if i < len(looks) else ":")
    return {label: {"color": chosen[label][0], "marker": chosen[label][1],
                    "linestyle": chosen[label][2]} for label in series.backends}


def panels(series: Series, title: str) -> Iterator[tuple["Figure", "Axes", str]]:
    """A panel for each world, stacked vertically."""
    pyplot = load_pyplot(STYLE)
    rows = len(series.worlds)
    figure, axes = pyplot.subplots(rows, 1, figsize=(WIDTH, PANEL * rows), squeeze=False)
    for axis, world in zip(axes[:, 0], series.worlds):
        axis.set_title(f"{world}: {title}", loc="left")
        yield figure, axis, world


def plain_ticks(axis: "Axes", name: str) -> None:
    """Labels logarithmic axes with 1000, not 10³, and adds ticks to short ranges."""
    from matplotlib.ticker import (FuncFormatter, LogLocator,  # pylint: disable=C0415
                                   NullFormatter)
    low, high = getattr(axis, f"get_{name}lim")()
    decades = math.log10(high / low)
    subs = (1, 1.5, 2, 3, 5, 7) if decades < 0.8 else (1, 2, 5) if decades < 4.6 else (1,)
    ticks = getattr(axis, f"{name}axis")
    ticks.set_major_locator(LogLocator(subs=subs, numticks=30))
    ticks.set_major_formatter(
        FuncFormatter(lambda value, _: f"{value:g}" if value < 1e6 else f"{value:.0e}"))
    ticks.set_minor_formatter(NullFormatter())


def save(figure: "Figure", path: Path, legend_rows: int = 0) -> Path:
    """Saves a figure with space below for a legend of `legend_rows` rows."""
    height = figure.get_size_inches()[1]
    figure.tight_layout(rect=(0, (0.1 + 0.22 * legend_rows) / height if legend_rows else 0, 1, 1))
    # Without the software version, equal figures give equal files.
    figure.savefig(path, metadata={"Software": None})
    load_pyplot().close(figure)
    return path


def save_with_legend(figure: "Figure", path: Path, columns: int) -> Path:
    """Saves with one legend for all panels, below them."""
    entries: dict[str, object] = {}
    for axis in figure.axes:
        for handle, label in zip(*axis.get_legend_handles_labels()):
            entries.setdefault(label, handle)
    names = sorted(entries, key=lambda name: name.startswith(PAPER))  # our own lines come first
    rows = math.ceil(len(entries) / columns)
    figure.set_figheight(figure.get_size_inches()[1] + 0.1 + 0.22 * rows)
    figure.legend([entries[name] for name in names], names, loc="lower center", ncol=columns,
                  frameon=False)
    return save(figure, path, rows)


def draw_line(axis: "Axes", points: list[tuple[int, Summary]], look: dict, name: str) -> None:
    """Draws medians as a line, and minimum to maximum as a band with bars."""
    robots = [n for n, _ in points]
    medians = [value.median for _, value in points]
    below = [value.median - value.least for _, value in points]
    above = [value.greatest - value.median for _, value in points]
    axis.errorbar(robots, medians, yerr=[below, above], label=name, capsize=2.5, elinewidth=1,
                  markeredgecolor="black", markeredgewidth=0.4, **look)
    axis.fill_between(robots, [v.least for _, v in points], [v.greatest for _, v in points],
                      color=look["color"], alpha=0.15, linewidth=0)


def draw_world(axis: "Axes", series: Series, world: str, labels: list[str],
               value: Callable[[int, str], Summary | None]) -> None:
    """Draws a line per backend over the populations, with a logarithmic axis."""
    looks = styles(series)
    for i, label in enumerate(labels):
        # Later markers are smaller, so that coinciding lines can be distinguished.
        looks[label]["markersize"] = max(4.0, 7.5 - 1.2 * i)
        found = [(n, value(n, label)) for n in series.populations(world, label)]
        points = [(n, v) for n, v in found if v is not None]
        if points:
            draw_line(axis, points, looks[label], backend_name(series, label))
    axis.set_xscale("log")
    axis.set_xlabel("population (robots)")
    plain_ticks(axis, "x")


def plot_against_population(series: Series, path: Path, column: str, title: str,
                            label: str) -> Path:
    """Plots a figure against the population with logarithmic axes."""
    for figure, axis, world in panels(series, title):
        draw_world(axis, series, world, series.backends,
                   functools.partial(series.column, world, name=column))
        axis.set_yscale("log")
        axis.set_ylabel(label)
        plain_ticks(axis, "y")
    return save_with_legend(figure, path, 2)


def plot_relative(series: Series, path: Path, base: str, column: str) -> Path:
    """Plots OpenCL relative to the host, with the published values of the paper."""
    faster = column == "r_acc"
    what = "r_ACC" if faster else "r_EPSS"
    name = backend_name(series, base)
    labels = [b for b in series.backends if b != base and b not in ("host1",)]
    for figure, axis, world in panels(series, f"{what} relative to {name}"):
        draw_world(axis, series, world, labels,
                   functools.partial(series.relative, world, base=base, name=column))
        axis.axhline(1, color=BLACK, linewidth=1)
        axis.set_yscale("log")
        axis.set_ylabel(f"{what} / {what} of the host")
        draw_paper(axis, PAPER_FASTER if faster else PAPER_ENERGY,
                   f"up to {PAPER_FASTER:g} times" if faster else "30 % less energy")
        plain_ticks(axis, "y")
    return save_with_legend(figure, path, 2)


def draw_paper(axis: "Axes", value: float, words: str) -> None:
    """Draws a published value of the paper as a line in another style."""
    axis.axhline(value, color=PAPER_COLOUR, linestyle=(0, (6, 3)), linewidth=1.2,
                 label=f"{PAPER} (Exynos, Mali GPU): {words}")
    axis.axvline(PAPER_ROBOTS, color=PAPER_COLOUR, linestyle=":", linewidth=1.4,
                 label=f"{PAPER}: GPU slower below about {PAPER_ROBOTS} robots")
    low, high = axis.get_ylim()
    axis.set_ylim(min(low, value / 1.15), max(high, value * 1.25))
    axis.text(0.01, value * 1.02, PAPER, transform=axis.get_yaxis_transform(), fontsize=9,
              color=PAPER_COLOUR, va="bottom")


def plot_averages(series: Series, path: Path, column: str, label: str) -> Path:
    """Plots bars of the mean over the large populations, with the ratio to host1."""
    looks = styles(series)
    for figure, axis, world in panels(series, f"mean over the populations of at least {LARGE} "
                                              "robots"):
        found = [(b, series.average(world, b, column)) for b in series.backends]
        bars = [(b, v) for b, v in found if v is not None]
        for i, (backend, value) in enumerate(bars):
            errors = [[value.median - value.least], [value.greatest - value.median]]
            axis.barh(i, value.median, xerr=errors, color=looks[backend]["color"], height=0.65,
                      edgecolor="black", linewidth=0.6, capsize=4, ecolor=GREY)
            times = series.average_relative(world, backend, "host1", column) \
                if backend != "host1" and "host1" in series.backends else None
            words = f"  {number(value.median)}"
            if times is not None:
                words += f"\n  {times.median:.2f} × host1"
            axis.text(value.greatest, i, words, va="center")
        axis.set_yticks(range(len(bars)), [wrapped(backend_name(series, b)) for b, _ in bars])
        axis.invert_yaxis()
        axis.set_xlim(0, 1.25 * max((value.greatest for _, value in bars), default=1))
        axis.grid(axis="y", visible=False)
        axis.set_xlabel(label)
    return save(figure, path)


def wrapped(name: str) -> str:
    """Splits a name into two lines, which leaves space for the bars."""
    return name.replace(", ", ",\n").replace(" (auto)", "\n(auto)")


def phase_populations(series: Series, world: str) -> list[int]:
    """A population of about LARGE robots, and the greatest that all backends have."""
    populations = series.populations(world, *series.backends)
    if not populations:
        return []
    near = min(populations, key=lambda n: (abs(n - LARGE), n))
    return sorted({near, populations[-1]})


def plot_phases(series: Series, path: Path) -> Path:
    """Plots the phases of a step as stacked bars."""
    pyplot = load_pyplot(STYLE)
    rows = [(world, n) for world in series.worlds for n in phase_populations(series, world)]
    height = 0.3 + len(rows) * (0.9 + 0.33 * len(series.backends))
    figure, axes = pyplot.subplots(max(1, len(rows)), 1, figsize=(WIDTH, height), squeeze=False)
    for axis, (world, population) in zip(axes[:, 0], rows):
        left = [0.0] * len(series.backends)
        found = [series.phases(world, population, b) for b in series.backends]
        for phase, colour in zip((*PHASES, "other"), PHASE_COLOURS):
            widths = [times[phase] for times in found]
            axis.barh(range(len(found)), widths, left=left, color=colour, label=phase,
                      edgecolor="white", linewidth=0.4)
            left = [a + b for a, b in zip(left, widths)]
        axis.set_title(f"{world}, {population} robots", loc="left")
        axis.set_yticks(range(len(found)), [backend_name(series, b) for b in series.backends])
        axis.invert_yaxis()
        axis.grid(axis="y", visible=False)
        axis.set_xlabel("time of a step (ms, median)")
        axis.set_xlim(0, 1.04 * max(left))
    return save_with_legend(figure, path, len(PHASES) + 1)


def plot_all(series: Series, folder: Path) -> dict[str, Path]:
    """All plots for which there are figures, by name."""
    made = {
        "r_acc": plot_against_population(
            series, folder / "r_acc.png", "r_acc", "simulation speed",
            "r_ACC (robot s / real s)"),
        "phases": plot_phases(series, folder / "phases.png"),
        "memory": plot_against_population(
            series, folder / "memory.png", "peak_memory_mb", "memory", "peak memory (MiB)"),
    }
    energy = series.has("r_epss")
    if energy:
        made["r_epss"] = plot_against_population(
            series, folder / "r_epss.png", "r_epss", f"energy ({series.scopes})",
            "r_EPSS (J / robot s)")
    for base in series.bases:
        if any(b != base for b in series.accelerated):
            made[f"relative-{base}"] = plot_relative(
                series, folder / f"relative-{base}.png", base, "r_acc")
            if energy:
                made[f"relative-energy-{base}"] = plot_relative(
                    series, folder / f"relative-energy-{base}.png", base, "r_epss")
    if any(series.large_populations(world) for world in series.worlds):
        made["averages"] = plot_averages(series, folder / "averages.png", "r_acc",
                                         "mean r_ACC (robot s / real s)")
        if energy:
            made["averages-energy"] = plot_averages(
                series, folder / "averages-energy.png", "r_epss",
                f"mean r_EPSS (J / robot s, {series.scopes})")
    return made
