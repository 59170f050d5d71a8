# SPDX-License-Identifier: GPL-2.0-or-later
"""Small files of sysfs with one value each. Every OSError names its file."""

from __future__ import annotations

from pathlib import Path


def read_text(path: Path) -> str:
    """The file's text without surrounding white space."""
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError as error:
        error.filename = error.filename or str(path)  # an error of read() has no file name
        raise


def write_text(path: Path, text: str) -> None:
    """Writes to an existing file."""
    try:
        with path.open("r+", encoding="utf-8") as file:
            file.write(text + "\n")
    except OSError as error:
        error.filename = error.filename or str(path)
        error.writing = True  # type: ignore[attr-defined] # for the message
        raise


def read_whole_number(path: Path) -> int:
    """The number in a file of µJ, µW, mV or mA."""
    text = read_text(path)
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"{path}: found '{text[:20]}', expected a whole number") from None


def read_decimal(path: Path) -> float:
    """The number in a file of W."""
    text = read_text(path)
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{path}: found '{text[:20]}', expected a number") from None
