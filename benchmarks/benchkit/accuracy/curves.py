# SPDX-License-Identifier: GPL-2.0-or-later
"""Plots of the results."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Sequence

from matplotlib.ticker import FuncFormatter, NullFormatter

from benchkit.plots import load_pyplot, metres, plain, set_log_axis

from .analysis import NOTHING, pareto_front

pyplot = load_pyplot()

FLOOR = NOTHING  # smaller errors are drawn here, because a logarithmic axis has no 0
COLOURS = {"cell": "#1f6fb4", "exact": "#c8451b", "": "#1f6fb4"}
MARKERS = {"cell": "o", "exact": "s", "": "o"}
GREY = "#b5b5b5"


@dataclass(frozen=True)
class Marker:
    """A setting's point in a plot."""

    label: str
    series: str  # ray model, or empty
    speed: float
    error: float
    least: float  # speeds of the repeats
    most: float


# Positions of a label relative to its point, in points, the best first. Curves rise to the right,
# so there is usually space below right and above left.
PLACES = ((7, -11), (-7, 4), (7, 4), (-7, -11), (0, 9), (0, -17), (12, -22), (-12, 14), (12, 14),
          (-12, -22), (0, 22), (0, -30), (25, -34), (-25, 26))


def place_labels(figure: object, axes: object, points: Sequence[tuple[float, float, str, str]],
                 line: Sequence[tuple[float, float]] = ()) -> None:
    """Places labels (x, y, text, colour) beside their points, avoiding other labels, points and
    the line where possible."""
    renderer = figure.canvas.get_renderer()
    spots = [tuple(p) for p in axes.transData.transform([(x, y) for x, y, _, _ in points])]
    corners = [tuple(p) for p in axes.transData.transform(list(line))] if line else []
    for (ax, ay), (bx, by) in zip(corners, corners[1:]):
        spots += [(ax + (bx - ax) * k / 20, ay + (by - ay) * k / 20) for k in range(21)]
    taken: list[object] = []
    for x, y, text, colour in points:
        tried = []
        for place in PLACES:
            align = "left" if place[0] > 0 else "right" if place[0] < 0 else "center"
            label = axes.annotate(text, (x, y), place, textcoords="offset points", fontsize=8,
                                  color=colour, ha=align)
            box = label.get_window_extent(renderer)
            covered = 10 * sum(box.overlaps(other) for other in taken) + sum(
                box.x0 - 2 < sx < box.x1 + 2 and box.y0 - 1 < sy < box.y1 + 1 for sx, sy in spots)
            if not (axes.bbox.x0 < box.x0 and box.x1 < axes.bbox.x1
                    and axes.bbox.y0 < box.y0 and box.y1 < axes.bbox.y1):
                covered += 50
            tried.append((covered, len(tried), label, box))
            if covered == 0:
                break
        best = min(tried, key=lambda t: t[:2])
        for other in tried:
            if other is not best:
                other[2].remove()
        taken.append(best[3])


def trade(path: Path, title: str, panels: Sequence[tuple[str, Sequence[Marker]]],
          lines: Sequence[Sequence[tuple[str, float]]] = ()) -> None:
    """Plots speed against error, a panel per measure of error. `lines` has for each panel named
    errors whose speed is unknown."""
    figure, all_axes = pyplot.subplots(1, len(panels), figsize=(6.4 * len(panels), 5.4),
                                       squeeze=False, layout="constrained")
    figure.get_layout_engine().set(rect=(0, 0.07, 1, 0.93))
    handles: dict[str, object] = {}
    for i, (axes, (error_label, markers)) in enumerate(zip(all_axes[0], panels)):
        drawn = [m for m in markers if math.isfinite(m.error) and m.speed > 0]
        if not drawn:
            axes.set_axis_off()
            continue
        axes.set_xlabel("r_ACC (robots × simulated seconds / second), faster →")
        axes.set_ylabel(error_label + ", ↓ more exact")
        draw_panel(figure, axes, drawn, lines[i] if i < len(lines) else ())
        handles.update({text: handle for handle, text in zip(*axes.get_legend_handles_labels())})
    figure.legend(list(handles.values()), list(handles), fontsize=9, loc="lower center",
                  ncols=len(handles), frameon=False)
    figure.suptitle(title)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def draw_panel(figure: object, axes: object, drawn: Sequence[Marker],
               lines: Sequence[tuple[str, float]]) -> None:
    errors = [max(m.error, FLOOR) for m in drawn]
    keeps = pareto_front([(m.speed, m.error) for m in drawn])
    set_trade_axes(axes, [s for m in drawn for s in (m.least, m.most)],
                   [*errors, *(value for _, value in lines)])
    front = sorted((m.speed, e) for m, e, keep in zip(drawn, errors, keeps) if keep)
    axes.plot([x for x, _ in front], [y for _, y in front], color="#444444", linewidth=1,
              linestyle="--", zorder=1, label="no other is both faster and more accurate")
    for series in dict.fromkeys(m.series for m in drawn):
        if series:
            axes.plot([], [], MARKERS[series], color=COLOURS[series], label=f"ray model {series}")
        for marker, error, keep in zip(drawn, errors, keeps):
            if marker.series == series:
                axes.plot([marker.least, marker.most], [error, error], linewidth=1, zorder=2,
                          color=COLOURS[series] if keep else GREY, alpha=0.6)
                axes.plot(marker.speed, error, MARKERS[series], zorder=3, markersize=7,
                          color=COLOURS[series] if keep else GREY)
    if not all(keeps):
        axes.plot([], [], "o", color=GREY, label="beaten by another setting")
    if min(m.error for m in drawn) < FLOOR:
        axes.axhline(FLOOR, color=GREY, linewidth=0.8, linestyle=":",
                     label=f"values below {metres(FLOOR)} are drawn here")
    figure.canvas.draw()  # leaves space for labels
    for name, value in lines:
        axes.axhline(value, color="#7a4fa3", linewidth=1, linestyle=(0, (1, 1)))
        axes.annotate(name, (0.01, value), (0, 3), textcoords="offset points", fontsize=7,
                      xycoords=("axes fraction", "data"), color="#7a4fa3", ha="left")
    place_labels(figure, axes, [(m.speed, e, m.label, "#222222" if keep else "#8a8a8a")
                                for m, e, keep in zip(drawn, errors, keeps)], front)


def set_trade_axes(axes: object, speeds: Sequence[float], errors: Sequence[float]) -> None:
    low, high = min(errors), max(max(errors), 2 * min(errors))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(low / 2, high * 2)
    axes.set_xlim(min(speeds) / 1.2, max(speeds) * 1.4)
    set_log_axis(axes.xaxis, plain, min(speeds), max(speeds))
    set_log_axis(axes.yaxis, metres, low, high)
    axes.grid(which="major", color="#e6e6e6", zorder=0)


def styles(labels: Sequence[str]) -> dict[str, dict[str, object]]:
    """Styles of lines named "SETTING" or "SETTING, ray model": colours distinguish settings;
    dashes and squares mark the exact ray model."""
    settings = list(dict.fromkeys(label.partition(", ")[0] for label in labels))
    colours = pyplot.get_cmap("viridis")
    found = {}
    for label in labels:
        setting, _, model = label.partition(", ")
        place = settings.index(setting) / max(len(settings) - 1, 1)
        found[label] = {"color": colours(0.88 * place), "marker": MARKERS.get(model, "o"),
                        "linestyle": "--" if model == "exact" else "-", "markersize": 5}
    return found


def bins(path: Path, title: str, panels: Sequence[tuple[str, Sequence[str], Sequence[
        tuple[str, Sequence[float]]]]], what: str = "error, 95th percentile") -> None:
    """Plots errors of groups: a panel (name, bins, lines) per group. A line has a name and a
    value per bin, NaN for none."""
    figure, all_axes = pyplot.subplots(1, len(panels), figsize=(max(4.2 * len(panels), 6), 4.8),
                                       squeeze=False, layout="constrained", sharey=True)
    figure.get_layout_engine().set(rect=(0, 0.08, 1, 0.92))
    values = [max(v, FLOOR) for _, _, lines in panels for _, line in lines for v in line
              if math.isfinite(v)]
    for axes, (name, names, lines) in zip(all_axes[0], panels):
        look = styles([label for label, _ in lines])
        for label, line in lines:
            axes.plot(range(len(names)), [max(v, FLOOR) if math.isfinite(v) else math.nan
                                          for v in line], label=label, **look[label])
        axes.set_yscale("log")
        if values:
            set_log_axis(axes.yaxis, metres, min(values), max(values))
        axes.set_xticks(range(len(names)), names, rotation=25, ha="right", fontsize=8)
        axes.set_title(name, fontsize=10)
        axes.grid(which="major", color="#e6e6e6")
    all_axes[0][0].set_ylabel(what)
    handles, labels = all_axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=9, loc="lower center", ncols=len(labels), frameon=False)
    figure.suptitle(title)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def drifts(path: Path, title: str, moved: str, panels: Sequence[tuple[str, Sequence[tuple[
        str, Sequence[float], Sequence[float]]]]]) -> None:
    """Plots how far runs drift from the finest one: a panel per task, a line (name, times,
    metres) per setting. `moved` names the line of the finest setting with moved starts."""
    figure, all_axes = pyplot.subplots(1, len(panels), figsize=(6.2 * len(panels), 5.2),
                                       squeeze=False, layout="constrained", sharey=True)
    for axes, (name, lines) in zip(all_axes[0], panels):
        look = styles([label for label, _, _ in lines if label != moved])
        look[moved] = {"color": "#c8451b", "marker": ".", "linestyle": ":", "linewidth": 2}
        for label, times, apart in lines:
            axes.plot(times, [max(d, FLOOR) for d in apart], label=label, **look[label])
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.yaxis.set_major_formatter(FuncFormatter(metres))
        times = sorted({t for _, line_times, _ in lines for t in line_times})
        axes.set_xticks(times, [f"{t:g}" for t in times])
        axes.set_xlabel("simulated seconds")
        axes.set_title(name, fontsize=10)
        axes.grid(which="major", color="#e6e6e6")
    all_axes[0][0].set_ylabel("distance from the finest run, median of robots and seeds")
    all_axes[0][-1].legend(fontsize=8, loc="center left", bbox_to_anchor=(1.01, 0.5))
    figure.suptitle(title)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
