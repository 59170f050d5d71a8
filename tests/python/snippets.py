# SPDX-License-Identifier: GPL-2.0-or-later
"""Executes the Python code of documents."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from typing import Any


def executed(code: str, names: dict[str, Any], source: str = "a snippet") -> str:
    """Executes code and returns the text that it prints."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, source, "exec"), names)  # noqa: S102
    return printed.getvalue()


def check_outputs(page: Path) -> int:
    """Executes the blocks of Python of a page in order, with common names. Returns how many there are.

    Each block that is followed by a block of output must print that.
    """
    blocks = re.findall(r"```python\n(.*?)```\n(?:\n```\n(.*?)```)?", page.read_text(encoding="utf-8"), re.S)
    names: dict[str, Any] = {}
    for code, expected in blocks:
        printed = executed(code, names, str(page))
        if expected:
            assert printed == expected, code
    return len(blocks)
