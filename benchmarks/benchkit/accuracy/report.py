# SPDX-License-Identifier: GPL-2.0-or-later
"""The report: tables, plots and conclusions."""

from __future__ import annotations

import math
import statistics
from pathlib import Path
from typing import Sequence

from benchkit import report
from benchkit.inference import t_test

from . import curves
from .analysis import Speed, lost_share, pareto_front, recommend
from .curves import Marker
from .jobs import TASKS
from .needs import NEEDS
from .results import NUDGED, Results
from .settings import KNOBS, Setting

TASK_NAMES = {
    "disperse": "dispersal: mean distance to the nearest neighbour at the end, m",
    "wander": "area covered: visited squares of 0.5 m, m²",
}
ERROR_COLUMNS = ["p50", "p95", "p99", "max"]


def title_of(knob: str) -> str:
    return KNOBS[knob][0].upper() + KNOBS[knob][1:]


# ---- text ---------------------------------------------------------------------------------------

def table(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    return "\n".join(report.table(header, rows))


def length(metres: float | None) -> str:
    """Formats a length with three digits in a suitable unit."""
    if metres is None or math.isnan(metres):
        return "–"
    size = abs(metres)
    if size == 0:
        return "0"
    if size < 1e-9:
        return "< 1 nm"
    for unit, factor in (("nm", 1e9), ("µm", 1e6), ("mm", 1e3)):
        if size * factor < 999.5:
            return f"{metres * factor:.3g} {unit}"
    return f"{metres:.3g} m"


def share(value: float | None) -> str:
    if value is None or math.isnan(value):
        return "–"
    return "0" if value == 0 else f"{100 * value:.2g} %"


def number(value: float | None) -> str:
    if value is None or math.isnan(value):
        return "–"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def speed_cells(results: Results, scene: str, setting: Setting) -> list[str]:
    """Columns r_ACC, ms/step and memory."""
    speed = results.speed(scene, setting)
    if not speed:
        return ["–", "–", "–"]
    return [f"{number(speed.median)} ({number(speed.least)} to {number(speed.most)})",
            f"{speed.ms_per_step:.3g}", f"{speed.memory_mb:.0f}"]


def marker_of(label: str, series: str, speed: Speed, error: float) -> Marker:
    return Marker(label, series, speed.median, error, speed.least, speed.most)


SPEED_HEADER = ["r_ACC (least to greatest)", "ms/step", "MB"]


# ---- sections -----------------------------------------------------------------------------------

class Report:
    """Writes report.md and its pictures into a folder."""

    def __init__(self, results: Results, folder: Path, facts: dict[str, object],
                 reference: list[tuple[str, dict[str, float]]], messages: list[str]) -> None:
        self.results, self.folder, self.facts = results, folder, facts
        self.reference, self.messages = reference, messages

    def write(self) -> None:
        sections = [self.head(), self.needs(), self.cells(), self.samples(), self.interval(),
                    self.step(), self.speed_only("hits"), self.speed_only("threads"),
                    self.downstream(), self.stage_4(), self.definitions()]
        text = "\n".join(section for section in sections if section)
        (self.folder / "report.md").write_text(text, encoding="utf-8")

    def picture(self, name: str, text: str) -> str:
        return f"![{text}]({name})\n"

    def head(self) -> str:
        facts = "\n".join(f"* {name}: {value}" for name, value in self.facts.items())
        messages = "".join(f"\n**{message}**\n" for message in self.messages)
        return ("<!-- SPDX-License-Identifier: GPL-2.0-or-later -->\n# Accuracy and speed\n\nHow "
                "much accuracy each knob costs, and how much speed it gains. Written by "
                "`benchmarks/accuracy`; `docs/accuracy.md` explains the knobs, and the end of this "
                f"page explains the figures.\n\n{facts}\n{messages}")

    # ---- recommendations ----

    def needs(self) -> str:
        rows = []
        for need in NEEDS:
            for knob, limits in need.limits.items():
                rows.append([need.name if knob == "cells" else "", KNOBS[knob],
                             "; ".join(limit.text for limit in limits),
                             *self._recommended(knob, limits)])
        reasons = "\n".join(f"* **{need.name}.** {need.why}" for need in NEEDS)
        return ("\n## Which setting for which need\n\nThe table lists the fastest measured setting "
                "that meets the condition in every scene. Each knob was varied alone, so combine "
                "the rows of a need as a starting point, and check the result.\n\n"
                + table(["need", "knob", "condition", "setting", "its figures", "r_ACC"], rows)
                + f"\nWhere the conditions come from:\n\n{reasons}\n")

    def _recommended(self, knob: str, limits: Sequence) -> list[str]:
        best = recommend(self.results.candidates(knob), limits)
        if best is None:
            return ["none of the measured ones", "–", "–"]
        has = []
        for limit in limits:
            value = best.figures[limit.figure]
            if limit.figure.endswith("_share"):
                has.append(share(value))
            elif limit.figure == "changed_scores":
                has.append(f"needs {best.figures.get('memory_mb', math.nan):.0f} MB")
            else:
                has.append(length(value))
        return [f"**{best.label}**", ", ".join(has), number(best.speed)]

    # ---- cells ----

    def cells(self) -> str:
        parts = ["\n## Cell size and ray model\n\nRobots stand still, so that every setting sees "
                 "the same scene. *Lost*: the share of readings with a missed hit, a false hit, or "
                 "a hit on the wrong object. Settings in grey are beaten: another setting is both "
                 "faster and more accurate. The short bars reach from the slowest to the fastest "
                 "repeat.\n"]
        if not self.facts.get("ray models", "").startswith("cell, exact"):
            parts.append("\n*The program has no `--ray-model` yet: rows of the model `exact` are "
                         "left out.*\n")
        for scene in self.results.scenes("cells"):
            parts.append(self._cells_of(scene))
        parts.append(self._contacts())
        return "\n".join(parts)

    def _contacts(self) -> str:
        rows = []
        for cell in self.results.plan.cells:
            gaps = self.results.contact(cell)
            if gaps:
                rows.append([f"{cell:g} m", *(length(gaps[n]) for n in ("least", "p50", "p95",
                                                                        "most"))])
        return ("\n### Contact\n\nBodies meet where they share a cell, whatever the ray model. "
                "Robots drive straight at walls in steps of 2 mm, at up to 50° from the "
                "perpendicular, until they are stopped. The table shows the remaining gap; if it "
                "is negative, the robot is inside the wall.\n\n"
                + table(["cells", "least", "p50", "p95", "most"], rows))

    def _cells_of(self, scene: str) -> str:
        rows, markers = [], {"p50": [], "p95": []}
        for setting in self.results.sweeps["cells"].settings:
            figures = self.results.figures("cells", scene, setting)
            near = self.results.figures("cells", scene, setting, "near")
            speed = self.results.speed(scene, setting)
            if not figures or not speed:
                continue
            rows.append([f"{setting.cell:g} m", setting.ray_model,
                         *(length(figures[c]) for c in ERROR_COLUMNS),
                         length(near["p95"] if near else None), share(lost_share(figures)),
                         *speed_cells(self.results, scene, setting)])
            for name, list_ in markers.items():
                list_.append(marker_of(f"{setting.cell:g} m", setting.ray_model, speed,
                                       figures[name]))
        fronts = pareto_front([(m.speed, m.error) for m in markers["p95"]])
        for row, keep in zip(rows, fronts):
            row.append("" if keep else "beaten")
        name = f"cells-{scene}.png"
        lines = self._reference_lines() if scene == "boxes" else ()
        curves.trade(self.folder / name, f"Cell size and ray model: {scene}, "
                     f"{self.results.plan.robots[scene]} robots",
                     [("error, median", markers["p50"]),
                      ("error, 95th percentile", markers["p95"])], lines=lines)
        header = ["cells", "ray model", *ERROR_COLUMNS, "p95 up to 2 m", "lost", *SPEED_HEADER,
                  "by p95"]
        return (f"\n### {scene}\n\n" + self.picture(name, f"Speed against error: {scene}") + "\n"
                + table(header, rows) + self._groups_of(scene))

    def _reference_lines(self) -> list[list[tuple[str, float]]]:
        """Errors of Stage 4.3 for the two panels."""
        return [[(f"{title}: {length(figures[name])}", figures[name])
                 for title, figures in self.reference[:1]] for name in ("p50", "p95")]

    def _groups_of(self, scene: str) -> str:
        """Sources of errors with small, medium and large cells."""
        cells = sorted({s.cell for s in self.results.sweeps["cells"].settings})
        aside = len(cells) // 6
        chosen = sorted({cells[aside], cells[len(cells) // 2], cells[-1 - aside]})
        settings = [s for s in self.results.sweeps["cells"].settings if s.cell in chosen]
        panels = []
        for group, title in (("range", "by true distance"), ("incidence", "by angle of incidence"),
                             ("start", "by distance to the nearest outline"),
                             ("object", "by what is hit")):
            names = self.results.bins("cells", scene, group)
            lines = []
            for setting in settings:
                values = [self.results.figures("cells", scene, setting, group, b) for b in names]
                lines.append((setting.label("cells"),
                              [v["p95"] if v else math.nan for v in values]))
            short = [n.removesuffix(" from the sensor") for n in names]
            panels.append((title, short, lines))
        name = f"groups-{scene}.png"
        curves.bins(self.folder / name, f"Where errors come from: {scene}", panels)
        return "\n" + self.picture(name, f"Errors by group: {scene}")

    # ---- the other knobs ----

    def samples(self) -> str:
        text = ("A sensor with few samples has no information about the space between its beams. "
                f"Error: at {self.results.plan.bearings} bearings over the field of view, the "
                "difference between the true distance and the value interpolated from the two "
                "neighbouring beams. A beam without a hit counts as the maximum range, so the "
                "greatest errors occur where one beam hits something and the next one does not. "
                "Sensors with a single beam are left out.")
        return self._one_knob("samples", text, "between the beams")

    def interval(self) -> str:
        text = ("The longer the interval, the older the readings that a controller gets. Error: "
                "the difference between the reading at the beginning of a step, after sensing, and "
                "the true distance at that time. Robots wander at up to 0.4 m/s and turn at 0.5 "
                "rad/s. All ages, from 0 to one step less than the interval, occur equally often.")
        return self._one_knob("interval", text, "of held readings")

    def _one_knob(self, knob: str, text: str, what: str) -> str:
        sweep = self.results.sweeps.get(knob)
        if not sweep:
            return ""
        base = sweep.settings[0]
        parts = [f"\n## {title_of(knob)}\n\n{text} Cells of {base.cell:g} m, ray model "
                 f"`{base.ray_model}`.\n"]
        for scene in self.results.scenes(knob):
            rows, markers = [], {"p50": [], "p95": []}
            for setting in sweep.settings:
                figures = self.results.figures(knob, scene, setting)
                near = self.results.figures(knob, scene, setting, "near")
                speed = self.results.speed(scene, setting)
                if not figures or not speed:
                    continue
                rows.append([setting.label(knob), *(length(figures[c]) for c in ERROR_COLUMNS),
                             length(near["p95"] if near else None),
                             *speed_cells(self.results, scene, setting)])
                for name, list_ in markers.items():
                    list_.append(marker_of(setting.label(knob), "", speed, figures[name]))
            name = f"{knob}-{scene}.png"
            curves.trade(self.folder / name, f"{title_of(knob)}: {scene}",
                         [(f"error {what}, median", markers["p50"]),
                          (f"error {what}, 95th percentile", markers["p95"])])
            header = [knob, *ERROR_COLUMNS, "p95 up to 2 m", *SPEED_HEADER]
            parts.append(f"\n### {scene}\n\n" + self.picture(name, f"{KNOBS[knob]}: {scene}")
                         + "\n" + table(header, rows))
            if knob == "interval":
                parts.append(self._ages(scene))
        return "\n".join(parts)

    def _ages(self, scene: str) -> str:
        """Errors by the age of the readings, with the longest interval."""
        setting = self.results.sweeps["interval"].settings[-1]
        names = self.results.bins("interval", scene, "age")
        bins = [(n, self.results.figures("interval", scene, setting, "age", n)) for n in names]
        bins = [(name, figures) for name, figures in bins if figures]
        if len(bins) < 2:
            return ""
        lines = [(f"{p[1:]}th percentile", [figures[p] for _, figures in bins])
                 for p in ("p50", "p95")]
        name = f"ages-{scene}.png"
        curves.bins(self.folder / name, f"Errors by age: {scene}, {setting.label('interval')}",
                    [("by the age of the reading", [n for n, _ in bins], lines)],
                    "error")
        return "\n" + self.picture(name, f"Errors by age: {scene}")

    def step(self) -> str:
        sweep = self.results.sweeps.get("step")
        if not sweep:
            return ""
        parts = [f"\n## {title_of('step')}\n\nIn each step a robot drives straight, then turns. "
                 "Error: the distance between a robot with constant speed and turn rate, without "
                 "obstacles, and the exact arc, once per second for a minute. p50 is the median of "
                 "five commands (0.2 to 1 m/s, 0.2 to 1.5 rad/s); p95 and max are the worst "
                 "command's. The interval of sensors and controllers stays 100 ms, or is one step "
                 "if that is longer.\n"]
        for scene in self.results.scenes("step"):
            rows, markers = [], []
            for setting in sweep.settings:
                drive, speed = self.results.drive(setting), self.results.speed(scene, setting)
                if not drive or not speed:
                    continue
                rows.append([setting.label("step"), *(length(drive[c]) for c in ("p50", "p95",
                                                                                 "max")),
                             *speed_cells(self.results, scene, setting)])
                markers.append(marker_of(setting.label("step"), "", speed, drive["p95"]))
            name = f"step-{scene}.png"
            curves.trade(self.folder / name, f"Length of a step: {scene}",
                         [("distance from the true arc, 95th percentile", markers)])
            parts.append(f"\n### {scene}\n\n" + self.picture(name, f"Length of a step: {scene}")
                         + "\n" + table(["step", "p50", "p95", "max", *SPEED_HEADER], rows))
        return "\n".join(parts)

    def speed_only(self, knob: str) -> str:
        title = f"\n## {title_of(knob)}\n\n"
        sweep = self.results.sweeps.get(knob)
        if not sweep:
            return title + "Not measured: there is no OpenCL device on the CPU here.\n"
        parts = [title + "This knob changes only the speed, never the results: the state hashes of "
                         "all runs were compared.\n"]
        for scene in self.results.scenes(knob):
            rows = [[s.label(knob), *speed_cells(self.results, scene, s)] for s in sweep.settings]
            hashes = self.results.hashes(knob, scene)
            equal = (f"All runs end in the same state, `{next(iter(hashes))}`." if len(hashes) == 1
                     else f"**The runs end in {len(hashes)} different states: a defect.**")
            parts.append(f"\n### {scene}\n\n" + table([knob, *SPEED_HEADER], rows) + f"\n{equal}\n")
        return "\n".join(parts)

    # ---- downstream ----

    def downstream(self) -> str:
        plan = self.results.plan
        parts = [f"\n## Does it matter in the end?\n\n{plan.score_robots} swarmers start in a "
                 f"corner of the room with boxes and run for {plan.score_seconds:g} simulated "
                 f"seconds, with {plan.score_seeds} seeds (a different room each). *Difference*: "
                 "mean over the seeds of the difference from the finest setting of the knob. "
                 "*Spread*: standard deviation of the finest setting's score between seeds; a "
                 "difference far below the spread doesn't matter in practice. *Distinguishable*: "
                 "Student's test of the paired differences, at a level of 5 % after Holm's "
                 "correction over the table. *Stalled*: share of robots that are blocked at the "
                 "end. Controllers act when their sensor has updated, and `wander` counts its "
                 "turns in such updates. With a longer interval, or a longer step, it therefore "
                 "also turns for longer, and the differences include this effect. With "
                 f"{plan.score_seeds} seeds a difference has to be about "
                 f"{detectable(plan.score_seeds):.1f} times the scatter of the paired differences "
                 "to be significant in a single test.\n"]
        for knob in ("cells", "samples", "interval", "step"):
            if knob in self.results.sweeps:
                parts.append(f"\n### {title_of(knob)}\n")
                parts += [self._scores(knob, task) for task in TASKS]
                parts.append(self._drift(knob))
        return "\n".join(parts)

    def _scores(self, knob: str, task: str) -> str:
        finest = self.results.finest_scores(knob, task)
        if not finest:
            return ""
        spread = statistics.stdev(finest.values()) if len(finest) > 1 else math.nan
        rows: list[list[str]] = [[f"{self.results.sweeps[knob].finest.label(knob)} (finest)",
                                  number(statistics.fmean(finest.values())), "", number(spread), "",
                                  ""]]
        for row in self.results.score_rows(knob, task):
            verdict = f"{'**yes**' if row.distinguishable else 'no'} (p = {row.probability:.2g})"
            rows.append([row.label, number(row.score), f"{row.difference:+.3g}", number(row.spread),
                         verdict, share(row.stalled)])
        return (f"\nScore of {TASK_NAMES[task]}:\n\n"
                + table(["setting", "score", "difference from finest", "spread between seeds",
                         "distinguishable?", "stalled"], rows))

    def _drift(self, knob: str) -> str:
        panels = [(f"controller {task}", self.results.drifts(knob, task)) for task in TASKS]
        if not any(lines for _, lines in panels):
            return ""
        name = f"drift-{knob}.png"
        curves.drifts(self.folder / name, f"Drift from the finest run: {KNOBS[knob]}",
                      NUDGED, panels)
        extra = ("The dotted line shows the drift between runs that differ only by a millionth of "
                 "a metre at the start. Once it has reached the other lines, a trajectory contains "
                 "no information about the setting. Distances below 1 µm are drawn as 1 µm.\n")
        return ("\n" + self.picture(name, f"Drift: {KNOBS[knob]}")
                + (f"\n{extra}" if knob == "cells" else ""))

    # ---- Stage 4.3 and glossary ----

    def stage_4(self) -> str:
        if not self.reference:
            return ("\n## Stage 4.3\n\nLeft out: its measurements are not available (environment "
                    "variable STAGE_SHARED_DIR).\n")
        rows = [[title, f"{f['readings']:.0f}", f"{f['missed']:.0f}", f"{f['false']:.0f}",
                 *(length(f[c]) for c in ERROR_COLUMNS), share(f["over_0.1"])]
                for title, f in self.reference]
        return ("\n## Stage 4.3\n\nThe table compares the published readings of Stage 4.3, for a "
                "scene of 40 rotated boxes and 12 robots (cells of 0.02 m, range 12 m), with those "
                "of this program in the same scene. Both errors refer to the same truth. The scene "
                "is not the `boxes` above, and the speed of Stage 4.3 in it is unknown.\n\n"
                + table(["", "readings", "missed", "false", *ERROR_COLUMNS, "over 0.1 m"], rows))

    def definitions(self) -> str:
        return """
## What the figures are

* **truth**: the distance to the nearest outline that stops the ray, computed in extended precision
  without the simulator's grid, from the sensor's pose in double precision (`ray_truth --help`).
  Walls of a bitmap are the polygons that it is traced into.
* **error**: |reading - truth| where both hit something. *missed*: only the true ray hits something;
  *false*: only the reading does; *wrong object*: they hit different models.
* **p50, p95, p99**: percentiles of the errors; median of the populations.
* **r_ACC**: robots times simulated seconds per second of real time, for the whole program with
  controllers (`disperse`) and one thread unless stated otherwise. The value is the median of the
  repeats; the settings alternate.
* **MB**: the peak memory of the process.
"""


def detectable(seeds: int) -> float:
    """The smallest mean of paired differences that a test at 5 % distinguishes from 0, in
    standard deviations of the differences."""
    low, high = 0.0, 100.0
    pattern = [1.0 if i % 2 else -1.0 for i in range(seeds)]
    if seeds < 2:
        return math.nan
    centre, scale = statistics.fmean(pattern), statistics.stdev(pattern)
    unit = [(p - centre) / scale for p in pattern]
    for _ in range(60):
        middle = (low + high) / 2
        if t_test([u + middle for u in unit]) < 0.05:
            high = middle
        else:
            low = middle
    return high
