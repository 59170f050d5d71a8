# SPDX-License-Identifier: GPL-2.0-or-later
"""The raw tables by knob, scene and setting."""

from __future__ import annotations

import math
import statistics
from typing import Iterable, Sequence

from . import analysis
from .analysis import Candidate, ScoreRow, Speed
from .jobs import DRIFT_SHARES, NUDGE, SETTING, TASKS
from .settings import Plan, Setting, Sweep
from benchkit.store import Table

Row = dict[str, str]
NUDGED = f"finest, starts moved by {NUDGE * 1e6:g} µm"


def setting_key(row: Row) -> tuple[str, ...]:
    return tuple(row[name] for name in SETTING)


def key_of(setting: Setting) -> tuple[str, ...]:
    return tuple(str(value) for value in setting.columns().values())


class Results:
    """The results. Queries for figures that were not measured return None or an empty list."""

    def __init__(self, plan: Plan, sweeps: dict[str, Sweep], tables: dict[str, Table]) -> None:
        self.plan, self.sweeps = plan, sweeps
        self._speed = analysis.group_by(tables["speed"].rows,
                                        lambda r: (r["scene"], setting_key(r)))
        self._error = analysis.group_by(tables["error"].rows, lambda r: (
            r["sweep"], r["scene"], setting_key(r), r["group"], r["bin"]))
        self._score = analysis.group_by(tables["score"].rows, lambda r: (
            r["sweep"], r["task"], setting_key(r), float(r["nudge"]) != 0))
        self._contact = {row["cell"]: row for row in tables["contact"].rows}
        self._drive = analysis.group_by(tables["drive"].rows, setting_key)

    def scenes(self, knob: str) -> list[str]:
        return list(self.plan.robots) if knob == "cells" else list(self.plan.knob_scenes)

    # ---- speed ----

    def speed(self, scene: str, setting: Setting) -> Speed | None:
        rows = self._speed.get((scene, key_of(setting)))
        return Speed.of(rows) if rows else None

    def overall_speed(self, knob: str, setting: Setting) -> float:
        """Geometric mean over the knob's scenes; NaN if one is missing."""
        speeds = [self.speed(scene, setting) for scene in self.scenes(knob)]
        known = [s.median for s in speeds if s and s.median > 0]
        return statistics.geometric_mean(known) if known and len(known) == len(speeds) else math.nan

    def unequal_hashes(self) -> list[str]:
        """Lists state hashes that differ but must be equal: those of repeats, and of runs that
        differ only in list length or threads."""
        found = []
        for (scene, setting), rows in self._speed.items():
            if len({row["state_hash"] for row in rows}) > 1:
                found.append(f"repeats of {scene}, {' '.join(setting)}")
        for knob in ("hits", "threads"):
            if knob in self.sweeps:
                found += [f"{knob}, {scene}" for scene in self.scenes(knob)
                          if len(self.hashes(knob, scene)) > 1]
        return found

    def hashes(self, knob: str, scene: str) -> set[str]:
        """State hashes of all settings of the knob."""
        speeds = [self.speed(scene, s) for s in self.sweeps[knob].settings]
        return {h for speed in speeds if speed for h in speed.hashes}

    # ---- errors ----

    def figures(self, knob: str, scene: str, setting: Setting, group: str = "all",
                bin_name: str | None = None) -> dict[str, float] | None:
        """Figures of one bin of readings, by default of the only bin of the group."""
        names = [bin_name] if bin_name else self.bins(knob, scene, group)
        rows = self._error.get((knob, scene, key_of(setting), group, names[0])) if names else None
        return analysis.merge_bins(rows) if rows else None

    def bins(self, knob: str, scene: str, group: str) -> list[str]:
        """Names of the bins in the order of ray_truth."""
        names = {key[4] for key in self._error
                 if key[0] == knob and key[1] == scene and key[3] == group}
        return sorted(names, key=bin_order)

    # ---- driving, scores ----

    def drive(self, setting: Setting) -> dict[str, float] | None:
        """Distance from the true arc: median of the commands' medians, median of their 95th
        percentiles, and maximum."""
        rows = self._drive.get(key_of(setting))
        if not rows:
            return None
        return {"p50": statistics.median(float(r["error_p50"]) for r in rows),
                "p95": max(float(r["error_p95"]) for r in rows),
                "max": max(float(r["error_max"]) for r in rows)}

    def contact(self, cell: float) -> dict[str, float] | None:
        """Gaps between robots and the walls that stopped them; negative if they overlap."""
        row = self._contact.get(f"{cell:g}")
        return {name: float(row[f"gap_{name}"]) for name in ("least", "p50", "p95", "most")
                } if row else None

    def _scores(self, knob: str, task: str, setting: Setting, nudged: bool) -> list[Row]:
        return self._score.get((knob, task, key_of(setting), nudged), [])

    def _compared(self, knob: str, task: str) -> list[tuple[str, list[Row]]]:
        """All settings except the finest, and the finest with moved starts."""
        sweep = self.sweeps[knob]
        found = [(NUDGED, self._scores(knob, task, sweep.finest, True))]
        found += [(s.label(knob), self._scores(knob, task, s, False)) for s in sweep.settings
                  if s != sweep.finest]
        return [(label, rows) for label, rows in found if rows]

    def finest_scores(self, knob: str, task: str) -> dict[int, float]:
        """Scores by seed."""
        rows = self._scores(knob, task, self.sweeps[knob].finest, False)
        return {int(row["seed"]): float(row["score"]) for row in rows}

    def score_rows(self, knob: str, task: str) -> list[ScoreRow]:
        finest = self.finest_scores(knob, task)
        others = [(label, {int(r["seed"]): float(r["score"]) for r in rows},
                   statistics.fmean(float(r["stalled"]) for r in rows))
                  for label, rows in self._compared(knob, task)]
        return analysis.score_rows(finest, others) if finest else []

    def drifts(self, knob: str, task: str) -> list[tuple[str, list[float], list[float]]]:
        """Label, times and metres of each setting: medians over the seeds."""
        times = [share * self.plan.score_seconds for share in DRIFT_SHARES]
        return [(label, times, [statistics.median(float(r[f"drift_{share:g}"]) for r in rows)
                                for share in DRIFT_SHARES])
                for label, rows in self._compared(knob, task)]

    # ---- recommendations ----

    def candidates(self, knob: str, scenes: Sequence[str] | None = None) -> list[Candidate]:
        """All settings of the knob, each with its worst figures over the scenes."""
        scenes = list(scenes or self.scenes(knob))
        changed = self._changed_scores(knob)
        found = []
        for setting in self.sweeps[knob].settings:
            figures = dict(self._worst(knob, setting, scenes))
            if setting.label(knob) in changed:
                figures["changed_scores"] = changed[setting.label(knob)]
            drive = self.drive(setting) if knob == "step" else None
            if drive:
                figures["drive_p95"] = drive["p95"]
            contact = self.contact(setting.cell) if knob == "cells" else None
            if contact:
                figures["contact_p95"] = contact["p95"]
            speeds = [self.speed(scene, setting) for scene in scenes]
            if all(speeds):
                speed = statistics.geometric_mean(s.median for s in speeds)
                figures["memory_mb"] = max(s.memory_mb for s in speeds)
                found.append(Candidate(setting.label(knob), speed, figures))
        return found

    def _worst(self, knob: str, setting: Setting, scenes: Iterable[str]) -> dict[str, float]:
        worst: dict[str, float] = {}
        for scene in scenes:
            everything = self.figures(knob, scene, setting)
            near = self.figures(knob, scene, setting, "near")
            if not everything:
                return {}
            here = {"p50": everything["p50"], "p95": everything["p95"],
                    "lost_share": analysis.lost_share(everything),
                    "missed_share": analysis.lost_share(everything, ["missed"])}
            if near:
                here["near_p95"] = near["p95"]
            worst = {name: max(value, worst.get(name, value)) for name, value in here.items()}
        return worst

    def _changed_scores(self, knob: str) -> dict[str, int]:
        """By label, the number of tasks whose score differs from that of the finest setting
        significantly, or by more than the spread between seeds, because a test with few seeds
        has little power."""
        if not any(self.finest_scores(knob, task) for task in TASKS):
            return {}
        changed = {self.sweeps[knob].finest.label(knob): 0}
        for task in TASKS:
            for row in self.score_rows(knob, task):
                changed[row.label] = changed.get(row.label, 0) + (
                    row.distinguishable or abs(row.difference) > row.spread)
        return changed


def bin_order(name: str) -> tuple[float, str]:
    """Sorts by the first number in the name; "from 4 m" follows all bins that begin below 4."""
    for word in name.split():
        try:
            return float(word), name
        except ValueError:
            continue
    return -math.inf, name
