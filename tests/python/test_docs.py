# SPDX-License-Identifier: GPL-2.0-or-later
"""The code of docs/python.md works, and docs/python_api.md is up to date with the docstrings."""

from __future__ import annotations

import contextlib
import io
import re
import subprocess
import sys
from pathlib import Path

import pytest


def test_page_prints_what_it_shows(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each block of Python, executed in order, prints the output that follows it."""
    page = root / "docs" / "python.md"
    if not page.exists():
        pytest.skip("there is no docs/python.md")
    blocks = re.findall(r"```python\n(.*?)```\n(?:\n```\n(.*?)```)?", page.read_text(), re.S)
    assert len(blocks) > 5
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for code, expected in blocks:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, str(page), "exec"), names)  # noqa: S102
        if expected:
            assert printed.getvalue() == expected, code


def test_api_page(root: Path) -> None:
    tool, page = root / "tools" / "dev" / "python_api", root / "docs" / "python_api.md"
    if not tool.exists():
        pytest.skip("there is no tools/dev/python_api")
    made = subprocess.run([sys.executable, str(tool)], capture_output=True, text=True, check=True)
    assert made.stdout == page.read_text(), "make it anew: see tools/dev/python_api"
