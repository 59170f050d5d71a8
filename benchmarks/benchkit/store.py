# SPDX-License-Identifier: GPL-2.0-or-later
"""Raw figures in CSV files that are only appended to, so that an interrupted benchmark can
continue."""

from __future__ import annotations

import csv
import fcntl
import io
import os
import threading
from pathlib import Path
from typing import Iterable, Sequence


class StoreError(ValueError):
    """The reason in one line why a file or its folder is invalid."""


def one_line(text: str) -> str:
    return " ".join(text.split())


def line_of(values: Iterable[object]) -> str:
    output = io.StringIO()
    csv.writer(output, lineterminator="\n").writerow(values)
    return output.getvalue()


def read_rows(path: Path, columns: Sequence[str]) -> tuple[list[list[str]], list[int]]:
    """Returns the rows, and the byte offset of the end of each line including the header. An
    incomplete last line is ignored. An empty file has no lines."""
    content = path.read_bytes()
    lines = content[:content.rfind(b"\n") + 1].splitlines(keepends=True)
    if not lines:
        return [], []
    if lines[0].decode("utf-8", errors="replace") != line_of(columns):
        raise StoreError(f"{path}: its columns differ from those of this version; give another "
                         "folder")
    rows: list[list[str]] = []
    ends = [len(lines[0])]
    for number, line in enumerate(lines[1:], 2):
        try:
            row = next(csv.reader([line.decode("utf-8", errors="replace").rstrip("\r\n")],
                                  strict=True))
            if len(row) != len(columns):
                raise ValueError(f"{len(row)} fields, expected {len(columns)}")
        except (csv.Error, ValueError, StopIteration) as error:
            raise StoreError(f"{path}:{number}: not a line of this file ({error}); remove the "
                             "line, and its run will be repeated") from None
        rows.append(row)
        ends.append(ends[-1] + len(line))
    return rows, ends


class Table:
    """A CSV file, locked by this process until it is closed.

    Rows are on disk when add() returns. With `jobs`, a job has several rows, and a column marks its
    last one; opening the file removes the rows of an incomplete job.
    """

    END = "end_of_job"

    def __init__(self, path: Path, columns: Sequence[str], jobs: bool = True) -> None:
        self.columns = [*columns, self.END] if jobs else list(columns)
        self._jobs = jobs
        self._lock = threading.Lock()
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = open(path, "a+b")  # closed by close()
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            rows, ends = read_rows(path, self.columns)
        except OSError:
            self._file.close()
            raise StoreError(f"{path}: another series is writing to it") from None
        except StoreError:
            self._file.close()
            raise
        while jobs and rows and rows[-1][-1] != "1":
            rows.pop()
            ends.pop()
        self.rows = [dict(zip(self.columns, row)) for row in rows]
        whole = ends[-1] if ends else 0
        self.was_cut = whole < path.stat().st_size
        self._file.truncate(whole)
        if whole == 0:
            self._write(line_of(self.columns))

    def add(self, rows: Sequence[dict[str, object]]) -> None:
        """Adds all rows of one job."""
        if self._jobs:
            rows = [{**row, self.END: int(i + 1 == len(rows))} for i, row in enumerate(rows)]
        with self._lock:
            self._write("".join(line_of(row[name] for name in self.columns) for row in rows))
            self.rows += [{name: str(value) for name, value in row.items()} for row in rows]

    def has(self, key: dict[str, object]) -> bool:
        """True if a job with these columns was done."""
        wanted = {name: str(value) for name, value in key.items()}
        return any(all(row[name] == value for name, value in wanted.items()) for row in self.rows)

    def close(self) -> None:
        self._file.close()

    def _write(self, text: str) -> None:
        self._file.write(text.encode("utf-8"))
        self._file.flush()
        os.fsync(self._file.fileno())
