# SPDX-License-Identifier: GPL-2.0-or-later
"""Markdown tables, and readable numbers."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Iterable, Sequence

from .inference import Summary


def table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> list[str]:
    """Returns a Markdown table and an empty line."""
    def line(cells: Iterable[object]) -> str:
        return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |"
    head = list(head)
    return [line(head), "|" + "---|" * len(head), *map(line, rows), ""]


def picture(plots: dict[str, Path], name: str, text: str) -> list[str]:
    return [f"![{text}]({plots[name].name})", ""] if name in plots else []


def number(value: float) -> str:
    """Formats with three significant digits, or all digits of a larger whole number, with thin
    spaces as thousands separators."""
    if value == 0:
        return "0"
    size = abs(value)
    if size >= 100:
        text = f"{value:,.0f}"
        return text.replace(",", " ") if size >= 10_000 else text.replace(",", "")
    if size < 0.001:
        return f"{value:.2e}"
    decimals = 1 if size >= 10 else 2 if size >= 1 else 3 if size >= 0.1 else 4
    return f"{value:.{decimals}f}"


def spread(value: Summary | None) -> str:
    """Formats as "median (minimum to maximum)"."""
    if value is None:
        return ""
    if value.count == 1:
        return number(value.median)
    return f"{number(value.median)} ({number(value.least)} to {number(value.greatest)})"


def write_results(folder: Path, name: str, columns: Sequence[str], rows: Iterable[dict[str, object]],
                  text: str) -> None:
    """Writes the rows to NAME.csv and the text to NAME.md, and prints the text."""
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / f"{name}.csv", "w", newline="", encoding="utf-8") as file:
        table_of_rows = csv.DictWriter(file, columns, lineterminator="\n")
        table_of_rows.writeheader()
        table_of_rows.writerows(rows)
    (folder / f"{name}.md").write_text(text, encoding="utf-8")
    print(text)
