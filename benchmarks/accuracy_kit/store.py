# SPDX-License-Identifier: GPL-2.0-or-later
"""Raw results in CSV files that a broken-off run can be continued from."""

from __future__ import annotations

import csv
import io
import threading
from pathlib import Path


class Table:
    """A CSV file that only grows. The rows of one job are written at once, and the last row of a
    job says so, so that a job that was cut off is done again."""

    END = "end_of_job"

    def __init__(self, path: Path, columns: list[str]) -> None:
        self._path = path
        self.columns = [*columns, self.END]
        self._lock = threading.Lock()
        self.rows: list[dict[str, str]] = []
        if path.exists():
            self._load()
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(",".join(self.columns) + "\n", encoding="utf-8")

    def _load(self) -> None:
        """Keeps the rows of whole jobs and rewrites the file if there are others."""
        text = self._path.read_text(encoding="utf-8")
        reader = csv.DictReader(io.StringIO(text))
        if reader.fieldnames != self.columns:
            raise ValueError(f"{self._path}: found other columns than this program writes; move "
                             "the folder away or start afresh (--fresh)")
        pending: list[dict[str, str]] = []
        for row in reader:
            if None in row.values() or None in row:
                break  # torn off in the middle
            pending.append(row)
            if row[self.END] == "1":
                self.rows += pending
                pending = []
        whole = self._text_of(self.rows, header=True)
        if whole != text:
            self._path.write_text(whole, encoding="utf-8")

    def _text_of(self, rows: list[dict[str, object]], header: bool = False) -> str:
        buffer = io.StringIO()
        writer = csv.DictWriter(buffer, self.columns, lineterminator="\n")
        if header:
            writer.writeheader()
        writer.writerows(rows)
        return buffer.getvalue()

    def add(self, rows: list[dict[str, object]]) -> None:
        """All rows of one job."""
        marked = [{**row, self.END: int(i + 1 == len(rows))} for i, row in enumerate(rows)]
        with self._lock:
            with open(self._path, "a", encoding="utf-8", newline="") as file:
                file.write(self._text_of(marked))
            self.rows += [{name: str(value) for name, value in row.items()} for row in marked]

    def has(self, key: dict[str, object]) -> bool:
        """Whether a job with these columns was done."""
        wanted = {name: str(value) for name, value in key.items()}
        return any(all(row[name] == value for name, value in wanted.items()) for row in self.rows)
