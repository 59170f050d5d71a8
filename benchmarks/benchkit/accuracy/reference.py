# SPDX-License-Identifier: GPL-2.0-or-later
"""Compares Stage 4.3 with exact geometry, if measurements of the scene `boxes` are available.

The folder STAGE_SHARED_DIR/reference/boxes has a world and the readings of Stage 4.3 in it. Their
errors are compared with those of this program in the same scene, by the same exact geometry.
"""

from __future__ import annotations

import csv
import os
import re
import subprocess
from pathlib import Path

from benchkit.inference import percentile
from benchkit.programs import RunError

from .programs import Programs
from .worlds import substitute

TITLE = "Stage 4.3, published reference scene, not this scene"


def folder() -> Path | None:
    """The folder of the scene, or None if it does not exist."""
    shared = os.environ.get("STAGE_SHARED_DIR")
    path = Path(shared or "") / "reference" / "boxes"
    found = shared and (path / "case.world").exists() and (path / "expected.csv").exists()
    return path if found else None


def stage_readings(path: Path) -> dict[tuple[str, int, int], list[float]]:
    """Readings by robot, ranger and sensor. Nothing moves, so the first time suffices."""
    readings: dict[tuple[str, int, int], list[float]] = {}
    with open(path, encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            key = (row["model"], int(row["ranger"]), int(row["sensor"]))
            ranges = row["values"].split(";")[0].split()
            readings.setdefault(key, [float(text) for text in ranges])
    return readings


def summary(pairs: list[tuple[float, float, float]]) -> dict[str, float]:
    """Summarizes the errors of tuples (reading, truth, maximum range)."""
    errors = [abs(reading - truth) for reading, truth, most in pairs
              if reading < most and truth < most]
    return {"readings": len(pairs),
            "missed": sum(truth < most <= reading for reading, truth, most in pairs),
            "false": sum(reading < most <= truth for reading, truth, most in pairs),
            "p50": percentile(errors, 0.5), "p95": percentile(errors, 0.95),
            "p99": percentile(errors, 0.99), "max": max(errors, default=float("nan")),
            "over_0.1": sum(e > 0.1 for e in errors) / max(len(errors), 1)}


def compare(programs: Programs, scratch: Path) -> list[tuple[str, dict[str, float]]]:
    """Rows of the table: Stage 4.3, and each ray model in the same scene. Empty if the
    measurements are not available."""
    source = folder()
    if source is None:
        return []
    text = (source / "case.world").read_text(encoding="utf-8")
    # The world's controller, which recorded the readings, is not part of this project.
    text = substitute(r'ctrl "dump[^"]*"', "", text, "case.world")
    text = re.sub(r"^threads .*$", "", text, flags=re.MULTILINE)
    rows = []
    theirs = stage_readings(source / "expected.csv")
    for model in programs.models:
        world, readings = scratch / "reference.world", scratch / "reference.csv"
        world.write_text((f'ray_model "{model}"\n' if model != "cell" else "") + text,
                         encoding="utf-8")
        done = subprocess.run([programs.ray_truth, "--still", "--quiet", "--csv", readings, world],
                              capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RunError(f"ray_truth on the reference scene: {done.stderr.strip()}")
        ours, stage = [], []
        with open(readings, encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                robot, _, number = row["ranger"].partition(".ranger:")
                key = (robot, int(number), int(row["sensor"]))
                truth, most = float(row["truth"]), float(row["range_max"])
                ours.append((float(row["reading"]), truth, most))
                stage.append((theirs[key][int(row["sample"])], truth, most))
        if not rows:
            rows.append((TITLE, summary(stage)))
        rows.append((f"this program, {model}, the same scene", summary(ours)))
    return rows
