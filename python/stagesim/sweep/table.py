# SPDX-License-Identifier: GPL-2.0-or-later
"""The finished runs of a sweep as columns, as `stage merge` writes them."""

from __future__ import annotations

import csv
import json
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Iterable, Sequence

from . import program
from .plan import Plan, SweepError, record_file

TEXTS = ("status", "state_hash")
KEYS = ("index", "run", "seed")
COUNTS = ("steps", "rays", "robots")
TYPES: dict[str, Callable[[str], Any]] = {"key": int, "count": int, "figure": float, "text": str}


@dataclass
class Column:
    """A value of all finished runs; None: no value.

    `kind`: "key" (an integer that all runs have), "count" (an integer), "figure" (a float) or "text".
    """

    name: str
    kind: str
    values: list[Any]


def axis_kind(values: Iterable[str]) -> str:
    """The kind of an axis with these values: "key", "figure" or "text"."""
    for kind in ("key", "figure"):
        try:
            for value in values:
                TYPES[kind](value)
            return kind
        except ValueError:
            pass
    return "text"


def read_columns(folders: Sequence[Path], plan: Plan, timings: bool = False, partial: bool = True) -> list[Column]:
    """Reads all finished runs, sorted by index; each folder has a part of them.

    Raises:
        SweepError: a record is incomplete, the folders are of different sweeps, or runs are missing although
            `partial` is False.
    """
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "all.csv"
        merge_csv(folders, file, timings, partial)
        with open(file, newline="", encoding="utf-8", errors="surrogateescape") as lines:
            names, *rows = csv.reader(lines)
    kinds = {**dict.fromkeys(TEXTS, "text"), **dict.fromkeys(KEYS, "key"), **dict.fromkeys(COUNTS, "count"),
             **{axis.name: axis_kind(axis.values) for axis in plan.axes}}
    columns = []
    for at, name in enumerate(names):
        kind = kinds.get(name, "figure")
        columns.append(Column(name, kind, [TYPES[kind](row[at]) if row[at] else None for row in rows]))
    return columns


def merge_csv(folders: Sequence[Path], file: Path, timings: bool, partial: bool) -> None:
    """Merges the runs into a CSV file by calling `stage merge`."""
    words = ["--timings"] * timings + ["--partial"] * partial
    status, said = program.call(["merge", *map(str, folders), "-o", str(file), *words])
    if status != 0:
        raise SweepError(said)


def failed_records(folder: str | os.PathLike[str], columns: Iterable[Column]) -> list[dict[str, Any]]:
    """The records of failed runs, in the order of the columns."""
    known = {column.name: column.values for column in columns}
    return [json.loads(record_file(folder, index).read_text(encoding="utf-8"))
            for index, status in zip(known["index"], known["status"]) if status == "failed"]
