# SPDX-License-Identifier: GPL-2.0-or-later
"""The pictures of a sweep's report."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Mapping, Sequence

import numpy as np

from .. import _core
from ..reports import plots
from ..reports.report import number
from .study import Axis, Metric, Study

STYLE: dict[str, object] = {
    "font.size": 10, "axes.titlesize": 10, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
    "grid.color": "#dddddd", "grid.linewidth": 0.6, "axes.axisbelow": True, "legend.frameon": False,
    "savefig.dpi": 130, "figure.constrained_layout.use": True}
ADVICE = 'pip install "stagesim[report]" installs it'
LINES = [(plots.BLUE, "o", "-"), (plots.RED, "s", "--"), (plots.GREEN, "^", "-."), (plots.PURPLE, "D", ":"),
         (plots.ORANGE, "v", "-"), (plots.SKY, "P", "--"), (plots.BLACK, "X", "-.")]
MAX_PANELS = 6
LOGS_EACH = 20  # max logs per panel of the picture of places
CELLS_ACROSS = 60
APART = 0.012  # offset between lines, as a fraction of the panel's width
MAX_LABELLED = 100  # max cells of a heat map with numbers in them
LOGARITHMIC = 20.0  # min ratio of max to min value for a logarithmic axis


@dataclass(frozen=True)
class Picture:
    """A picture file and its caption."""

    file: Path
    caption: str
    metric: Metric


def some(count: int, most: int) -> list[int]:
    """Up to `most` evenly spread indices in [0, count), including both ends."""
    return sorted({round(at) for at in np.linspace(0, count - 1, min(count, most))})


def draw_all(study: Study, folder: Path) -> list[Picture]:
    """Draws all pictures of a study into a folder.

    Raises:
        PlotsMissing: matplotlib is not installed.
    """
    pyplot = plots.load_pyplot(STYLE, ADVICE)
    made = []
    for metric in study.metrics:
        for axis in study.axes:
            made.append(draw_curves(pyplot, study, metric, axis, folder))
        for x, y in itertools.combinations(study.numeric_axes, 2):
            if max(len(x.values), len(y.values)) > 2:
                made.append(draw_heat_map(pyplot, study, metric, x, y, folder))
    return made


def draw_traces(study: Study, logs: Mapping[int, Path], folder: Path) -> Picture | None:
    """Draws where robots spent their time: a panel for each value of the first axis, or one for all runs.

    A cell shows its percentage of the robots' time. Each panel uses the first LOGS_EACH logs of its runs. Returns
    None if nothing has moved in them.
    """
    pyplot = plots.load_pyplot(STYLE, ADVICE)
    over = study.axes[0] if study.axes else None
    panels = Panels(pyplot, over, (5.0, 4.2))
    drawn = panels.each()
    places = [places_of(study, common, logs) for _, common in drawn]
    if not any(map(len, places)):
        pyplot.close(panels.figure)
        return None
    edges, shares = shares_of_time(places)
    most = float(np.quantile(np.concatenate([share[share > 0] for share in shares]), 0.99))
    for (panel, _), share in zip(drawn, shares):
        image = panel.pcolormesh(*edges, np.where(share > 0, share, np.nan), cmap="cividis_r", vmin=0, vmax=most)
        panel.set_aspect("equal")
        panel.set_xlabel("x (m)")
    panels.axes[0].set_ylabel("y (m)")
    panels.figure.colorbar(image, ax=panels.axes[:len(drawn)], label="share of the time (%)", extend="max")
    file = folder / file_name("where", "robots", "were")
    panels.save(pyplot, file)
    caption = f"Where robots spent their time, in squares of {number(edges[0][1] - edges[0][0])} m; white: never. " \
        f"From the logs of {LOGS_EACH} runs at most" + (f" for each {over.name}." if over else ".")
    return Picture(file, caption, Metric("where robots were", "where robots were", np.empty(0)))


def places_of(study: Study, common: Sequence[tuple[Axis, int]], logs: Mapping[int, Path]) -> Any:
    """Positions of moving robots at all moments of the first LOGS_EACH logs: x, y in metres, shape (n, 2)."""
    runs = [int(index) for index in study.index[study.at(common)] if int(index) in logs][:LOGS_EACH]
    read = [np.frombuffer(_core.places_in_log(str(logs[index]))).reshape(-1, 2) for index in runs]
    return np.concatenate([np.empty((0, 2)), *read])


def shares_of_time(places: Sequence[Any]) -> tuple[list[Any], list[Any]]:
    """The cell edges of a square grid over all places, along x and y, and the percentages of each group in it."""
    together = np.concatenate(places)
    low, high = together.min(0), together.max(0)
    side = max(high - low) / CELLS_ACROSS or 1.0
    edges = [np.arange(start, end + 2 * side, side) for start, end in zip(low, high)]
    return edges, [100 / max(1, len(found)) * np.histogram2d(found[:, 0], found[:, 1], bins=edges)[0].T
                   for found in places]


def file_name(*parts: str) -> str:
    """Makes a file name from parts, with underscores for special characters."""
    return "-".join(re.sub(r"[^A-Za-z0-9_.]+", "_", part) for part in parts) + ".png"


class Panels:
    """Small multiples: a panel for each value of an axis, or a single panel."""

    def __init__(self, pyplot: Any, over: Axis | None, size: tuple[float, float]) -> None:
        self.over = over
        self.codes = some(len(over.values), MAX_PANELS) if over else [0]
        columns = min(len(self.codes), 3)
        rows = -(-len(self.codes) // columns)
        width = size[0] * (1 if columns == 1 else 0.72 * columns)
        self.figure, grid = pyplot.subplots(rows, columns, squeeze=False, sharex=True, sharey=True,
                                            figsize=(width, size[1] * rows))
        self.axes = list(grid.flat)
        for unused in self.axes[len(self.codes):]:
            unused.set_visible(False)

    def each(self) -> list[tuple[Any, list[tuple[Axis, int]]]]:
        """Sets the titles; returns each panel with the value that selects its runs."""
        found = []
        for panel, code in zip(self.axes, self.codes):
            if self.over:
                panel.set_title(f"{self.over.name} = {self.over.text(code)}")
            found.append((panel, [(self.over, code)] if self.over else []))
        return found

    def save(self, pyplot: Any, file: Path) -> None:
        self.figure.savefig(file, metadata={"Software": None})
        pyplot.close(self.figure)


def positions(axis: Axis) -> tuple[list[float], bool]:
    """Positions of an axis's values, and whether its scale is logarithmic; strings are evenly spaced."""
    if not axis.numeric:
        return list(range(len(axis.values))), False
    values = [float(value) for value in axis.values]
    return values, min(values) > 0 and max(values) / min(values) >= LOGARITHMIC


def moved(axis: Axis, aside: float) -> list[float]:
    """Positions of an axis's values, moved right by the fraction `aside` of the panel's width."""
    places, logarithmic = positions(axis)
    if logarithmic:
        return [place * (max(places) / min(places)) ** aside for place in places]
    return [place + aside * (max(places) - min(places) if axis.numeric else len(places)) for place in places]


def set_values(panel: Any, axis: Axis) -> None:
    """Sets ticks at up to 8 of the axis's values."""
    from matplotlib import ticker  # pylint: disable=import-outside-toplevel

    places, logarithmic = positions(axis)
    if logarithmic:
        panel.set_xscale("log")
    shown = some(len(places), 8)
    panel.set_xticks([places[at] for at in shown], [axis.text(at) for at in shown])
    panel.xaxis.set_minor_locator(ticker.NullLocator())
    if not axis.numeric:
        panel.set_xlim(-0.5, len(places) - 0.5)
    panel.tick_params(axis="x", labelrotation=30 if max(len(axis.text(at)) for at in shown) > 7 else 0)


def draw_curves(pyplot: Any, study: Study, metric: Metric, axis: Axis, folder: Path) -> Picture:
    """Draws a metric over an axis: a line for each value of a second axis, a panel for each of a third."""
    others = [other for other in study.axes if other is not axis]
    lines, over = (others + [None, None])[:2]
    panels = Panels(pyplot, over, (6.4, 4.0))
    codes = some(len(lines.values), len(LINES)) if lines else [0]
    for panel, common in panels.each():
        for at, (code, look) in enumerate(zip(codes, LINES)):
            chosen = [*common, (lines, code)] if lines else common
            draw_line(panel, study, metric, axis, chosen, look, lines.text(code) if lines else None,
                      APART * (at - (len(codes) - 1) / 2))
        set_values(panel, axis)
        if metric.name.endswith("_share"):
            panel.set_ylim(-0.03, 1.03)
    for panel in panels.axes[:len(panels.codes)]:
        panel.set_xlabel(axis.label)
    panels.axes[0].set_ylabel(metric.label)
    if lines:
        panels.figure.legend(*panels.axes[0].get_legend_handles_labels(), title=lines.label, loc="outside right upper")
    file = folder / file_name(metric.name, "over", axis.name)
    panels.save(pyplot, file)
    pooled = [other.name for other in others[2:]]
    caption = f"{metric.label} over {axis.name}" + each_of("line", lines, len(LINES)) + \
        each_of("panel", over, MAX_PANELS) + (f", all {', '.join(pooled)} together" if pooled else "")
    return Picture(file, caption + ". Means over seeds, 95 % bootstrap intervals.", metric)


def each_of(thing: str, axis: Axis | None, most: int) -> str:
    """The phrase of a caption for the lines or panels, or an empty string without an axis."""
    if axis is None:
        return ""
    return f", a {thing} for {'each' if len(axis.values) <= most else f'{most} values of'} {axis.name}"


def draw_line(panel: Any, study: Study, metric: Metric, axis: Axis, chosen: Sequence[tuple[Axis, int]],
              look: tuple[str, str, str], label: str | None, aside: float) -> None:
    """Draws the means and intervals of one line, moved by `aside`, so that intervals don't hide each other."""
    places = moved(axis, aside)
    means = [study.mean(metric, study.at([*chosen, (axis, code)])) for code in range(len(places))]
    colour, marker, dashes = look
    middle = np.array([mean.mean for mean in means])
    low, high = (np.array([value if math.isfinite(value) else mean.mean for value, mean in zip(ends, means)])
                 for ends in ([mean.low for mean in means], [mean.high for mean in means]))
    panel.errorbar(places, middle, yerr=[np.maximum(0, middle - low), np.maximum(0, high - middle)], color=colour,
                   marker=marker, linestyle=dashes if axis.numeric else "none", markersize=5.5, linewidth=1.5,
                   capsize=3, elinewidth=1, label=label)


def draw_heat_map(pyplot: Any, study: Study, metric: Metric, x: Axis, y: Axis, folder: Path) -> Picture:
    """Draws a metric's mean over two axes: a panel for each value of a third."""
    others = [other for other in study.axes if other is not x and other is not y]
    over = others[0] if others else None
    panels = Panels(pyplot, over, (1.8 + max(0.62 * len(x.values), 3.4), 1.2 + max(0.42 * len(y.values), 2.0)))
    drawn = panels.each()
    means = [np.array([[study.mean(metric, study.at([*common, (x, i), (y, j)])).mean for i in range(len(x.values))]
                       for j in range(len(y.values))]) for _, common in drawn]
    limits = {"vmin": np.nanmin(means), "vmax": np.nanmax(means)}
    for (panel, _), cells in zip(drawn, means):
        image = panel.imshow(cells, origin="lower", aspect="auto", cmap="cividis", **limits)
        panel.grid(False)
        set_cells(panel.set_xticks, x)
        set_cells(panel.set_yticks, y)
        panel.set_xlabel(x.label)
        if cells.size <= MAX_LABELLED:
            write_cells(panel, cells, **limits)
    panels.axes[0].set_ylabel(y.label)
    panels.figure.colorbar(image, ax=panels.axes[:len(drawn)], label=metric.label)
    file = folder / file_name(metric.name, "over", x.name, y.name)
    panels.save(pyplot, file)
    caption = f"{metric.label}: means over {x.name} and {y.name}" + each_of("panel", over, MAX_PANELS)
    return Picture(file, caption + ".", metric)


def set_cells(set_ticks: Callable[..., object], axis: Axis) -> None:
    """Sets the ticks of a heat map at the centers of up to 10 cells."""
    shown = some(len(axis.values), 10)
    set_ticks(shown, [axis.text(at) for at in shown])


def write_cells(panel: Any, cells: Any, vmin: float, vmax: float) -> None:
    """Writes the numbers into cells: black on bright cells, white on dark ones."""
    for (j, i), value in np.ndenumerate(cells):
        if np.isfinite(value):
            bright = vmax > vmin and (value - vmin) / (vmax - vmin) > 0.55
            panel.text(i, j, number(value) if value >= 0 else f"-{number(-value)}", ha="center", va="center",
                       fontsize=8, color="black" if bright else "white")
