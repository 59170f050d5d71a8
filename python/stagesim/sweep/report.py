# SPDX-License-Identifier: GPL-2.0-or-later
"""The report of a sweep: a self-contained HTML page, and its pictures as files beside it."""

from __future__ import annotations

import base64
import html
import math
import os
import re
import tempfile
from pathlib import Path
from typing import Any, Iterable, Sequence

from ..reports.report import number
from ..text import printable
from .figures import Picture, draw_all, draw_traces
from .plan import Plan, SweepError, missing, record_file
from .study import Comparison, Mean, Study
from .table import Column, failed_records, read_columns

#: The element of a report's page that lists the file names of its pictures.
FILE_LIST = re.compile(r"<meta name=stage-report content='([^']*)'>")
SIGNIFICANT = 0.05
MAX_ROWS = 200
MAX_FAILED = 100

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; max-width: 66rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; margin: .6rem 0; font-size: .92rem; }
th, td { padding: .2rem .7rem; text-align: right; border-bottom: 1px solid #e2e2e2; }
th { background: #f3f3f3; } td.text, th.text { text-align: left; }
figure { margin: 1rem 0; } figcaption { color: #555; font-size: .88rem; } img { max-width: 100%; height: auto; }
code, pre { font-size: .85rem; background: #f5f5f5; } pre { padding: .5rem; overflow-x: auto; }
.note { color: #555; } .bad { color: #a33; font-weight: 600; } summary { cursor: pointer; }
"""


def write_report(folder: Path) -> Path:
    """Writes the folder `report` in the folder of a sweep; returns the path of its page. Replaces an earlier report.

    Raises:
        SweepError: there is no sweep, none of its runs has succeeded, or `report` contains other files.
        PlotsMissing: matplotlib is not installed.
    """
    plan = Plan.read(folder)
    columns = read_columns([folder], plan, timings=True)
    study = Study(plan, columns)
    if not study.done.any():
        raise SweepError(f"{folder}: found no run that is done, expected some; go on with "
                         f"`stage sweep --resume {folder}`")
    out = folder / "report"
    files_of_report(out)  # checked early, because drawing takes long
    with tempfile.TemporaryDirectory(dir=folder, prefix=".report-") as place:
        new = Path(place) / "new"
        new.mkdir()
        write_files(study, columns, folder, new)
        for file in files_of_report(out):
            file.unlink()
        os.replace(new, out)  # replaces the empty folder, if there is one
    return out / "index.html"


def write_files(study: Study, columns: Sequence[Column], folder: Path, out: Path) -> None:
    """Writes the page and the pictures of the sweep in `folder` to the new folder `out`."""
    pictures = draw_all(study, out)
    logs = {index: record_file(folder, index).with_suffix(".mcap") for index in study.index.tolist()}
    logs = {index: log for index, log in logs.items() if log.exists()}
    traces = draw_traces(study, logs, out) if logs else None
    pictures += [traces] if traces else []
    text = page_text(study, pictures, failed_records(folder, columns), len(missing(folder, study.plan)))
    (out / "index.html").write_text(text, encoding="utf-8")


def files_of_report(out: Path) -> list[Path]:
    """Lists the files of an earlier report in the folder `out`: its page, and the pictures that the page names.

    Raises:
        SweepError: the folder contains other files, which belong to the user.
    """
    if not out.is_symlink() and not out.exists():
        return []
    if out.is_symlink() or not out.is_dir():
        raise SweepError(f"{out}: found something else than a folder, expected an earlier report or nothing; move "
                         "it away")
    page = out / "index.html"
    text = page.read_text(encoding="utf-8", errors="replace") if page.is_file() else ""
    listed = FILE_LIST.search(text)
    known = {page.name, *listed[1].split()} if listed else set()
    files = sorted(out.iterdir())
    for file in files:
        if file.name not in known or not file.is_file():
            raise SweepError(f"{out}: found {file.name!r}, which no report has made, expected an earlier report or "
                             "nothing; move it away")
    return files


def escaped(text: object) -> str:
    r"""Escapes a text for HTML; writes bytes that are not UTF-8 as \xff and the like."""
    return html.escape(printable(str(text)))


def table(head: Sequence[str], rows: Iterable[Sequence[object]], texts: int = 1) -> str:
    """An HTML table, whose first `texts` columns hold text."""
    def row(cells: Sequence[object], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}{' class=text' if at < texts else ''}>{escaped(cell)}</{tag}>"
                                for at, cell in enumerate(cells)) + "</tr>"
    return "<table>" + row(head, "th") + "".join(row(cells, "td") for cells in rows) + "</table>"


def shown(value: float) -> str:
    """Formats a number with three digits; a dash if it is not finite."""
    if not math.isfinite(value):
        return "–"
    return number(value) if value >= 0 else f"−{number(-value)}"


def interval(low: float, high: float) -> str:
    """Formats an interval."""
    return f"{shown(low)} to {shown(high)}" if math.isfinite(low) else "–"


def page_text(study: Study, pictures: Sequence[Picture], failed: Sequence[dict[str, Any]], lacking: int) -> str:
    """The HTML of the whole page."""
    title = f"Sweep of {Path(study.plan.world).name}"
    parts = [f"<!DOCTYPE html><html lang=en><meta charset=utf-8><title>{escaped(title)}</title>"
             f"<meta name=stage-report content='{' '.join(picture.file.name for picture in pictures)}'>"
             f"<meta name=viewport content='width=device-width'><style>{STYLE}</style>"
             f"<h1>{escaped(title)}</h1>", summary_text(study, len(failed), lacking)]
    comparisons = study.comparisons()
    if comparisons:
        parts += ["<h2>What differs</h2>", differences_text(comparisons)]
    if failed:
        parts += ["<h2 id=failed>Failed runs</h2>", failed_text(failed)]
    for metric in dict.fromkeys(picture.metric.name for picture in pictures):
        own = [picture for picture in pictures if picture.metric.name == metric]
        parts += [f"<h2>{escaped(own[0].metric.label)}</h2>", *map(figure_text, own)]
    if study.metrics:
        parts += ["<h2>Means</h2>", means_text(study)]
    return "\n".join(parts) + "\n"


def summary_text(study: Study, failed: int, lacking: int) -> str:
    """The summary: world, settings, and numbers of runs."""
    plan = study.plan
    seeds = "the same seeds in all sets" if plan.common_seeds else "other seeds in each set"
    lines = [f"<code>{escaped(plan.world)}</code>, "
             f"{plan.last - plan.first} runs of each set of values ({seeds}; experiment seed {plan.seed})"
             + (f", {plan.duration:g} simulated seconds each." if plan.duration is not None else "."),
             f"<b>{int(study.done.sum())} of {plan.count} runs are done"
             + (f", <a href='#failed' class=bad>{failed} failed</a>" if failed else ", none failed")
             + (f", <span class=bad>{lacking} are missing</span>" if lacking else "") + ".</b>"]
    rows = [(axis.name, ", ".join(axis.values)) for axis in plan.axes]
    text = "".join(f"<p>{line}</p>" for line in lines) + (table(("varied", "values"), rows, 2) if rows else "")
    if study.same:
        same = ", ".join(f"{escaped(name)} = {shown(value)}" for name, value in study.same.items())
        text += f"<p class=note>The same in all runs: {same}.</p>"
    return text


def differences_text(comparisons: Sequence[Comparison]) -> str:
    """The significant differences, and the other comparisons in a collapsed section."""
    tested = [one for one in comparisons if math.isfinite(one.probability)]
    sure = [one for one in tested if one.probability < SIGNIFICANT]
    rest = [one for one in comparisons if one not in sure]
    how = "in pairs, as seeds are common" if comparisons[0].paired else "of independent runs"
    text = (f"<p class=note>Differences of means between two values of an axis, all else equal, {how}: studentised "
            f"bootstrap, 95 % intervals, p corrected for {len(tested)} comparisons (Holm). Five runs or more of each "
            "set are needed.</p>")
    head = ("metric", "axis", "from", "to", "mean", "becomes", "difference", "95 % interval", "p")
    text += table(head, map(comparison_row, sure), 2) if sure else "<p>Nothing differs significantly.</p>"
    if rest:
        text += (f"<details><summary>{len(rest)} comparisons without a significant difference</summary>"
                 + table(head, map(comparison_row, rest), 2) + "</details>")
    return text


def comparison_row(one: Comparison) -> tuple[str, ...]:
    p = "too few runs" if math.isnan(one.probability) else \
        "< 0.001" if one.probability < 0.001 else f"{one.probability:.3f}"
    return (one.metric.label, one.axis.name, one.axis.text(one.first), one.axis.text(one.second),
            shown(one.means[0]), shown(one.means[1]), shown(one.found.difference),
            interval(one.found.low, one.found.high), p)


def failed_text(failed: Sequence[dict[str, Any]]) -> str:
    """The failed runs: how each ended, the command that repeats it, and its output."""
    parts = []
    for record in failed[:MAX_FAILED]:
        values = ", ".join(f"{name}={value}" for name, value in record["set"].items())
        end = record.get("reason") or record.get("signal") or f"exit status {record.get('exit_status')}"
        lines = "\n".join(record.get("lines", []))
        parts.append(f"<p><b>run {record['index']}</b> ({escaped(values)}, number {record['run']}): "
                     f"<span class=bad>{escaped(end)}</span> in {record['attempts']} attempts</p>"
                     f"<pre>{escaped(record['replay'])}\n\n{escaped(lines)}</pre>")
    if len(failed) > MAX_FAILED:
        parts.append(f"<p>and {len(failed) - MAX_FAILED} more: <code>stage sweep --status</code> tells</p>")
    return "".join(parts)


def figure_text(picture: Picture) -> str:
    """A figure with the picture embedded in the page."""
    data = base64.b64encode(picture.file.read_bytes()).decode()
    caption = escaped(picture.caption)
    return (f"<figure><img alt=\"{caption}\" src='data:image/png;base64,{data}'>"
            f"<figcaption>{caption}</figcaption></figure>")


def means_text(study: Study) -> str:
    """The table of means: a row for each set of values."""
    rows = []
    for chosen in study.sets():
        which = study.at(chosen)
        means = [study.mean(metric, which) for metric in study.metrics]
        rows.append([*(axis.text(code) for axis, code in chosen), int(which.sum()), *map(mean_text, means)])
    head = [*(axis.name for axis in study.axes), "runs", *(metric.label for metric in study.metrics)]
    text = table(head, rows[:MAX_ROWS], 0)
    if len(rows) > MAX_ROWS:
        text += f"<p class=note>The first {MAX_ROWS} of {len(rows)} sets; `stage merge` writes all runs.</p>"
    return "<p class=note>Means over seeds, 95 % bootstrap intervals.</p>" + text


def mean_text(mean: Mean) -> str:
    """Formats a mean with its interval."""
    if math.isfinite(mean.low) and mean.low != mean.high:
        return f"{shown(mean.mean)} ({interval(mean.low, mean.high)})"
    return shown(mean.mean)
