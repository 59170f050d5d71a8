# SPDX-License-Identifier: GPL-2.0-or-later
"""The code of docs/sweeps.md works."""

from __future__ import annotations

import contextlib
import io
import re
import shutil
from pathlib import Path

import pytest


def test_page_prints_what_it_shows(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each block of Python, executed in order, prints the output that follows it."""
    for package in ("pyarrow", "h5py"):
        pytest.importorskip(package, reason=f"skipped: {package} is not installed; try tools/setup --sweep")
    for file in (root / "examples" / "sweeps").glob("*.*"):
        shutil.copy(file, tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    blocks = re.findall(r"```python\n(.*?)```\n(?:\n```\n(.*?)```)?", (root / "docs" / "sweeps.md").read_text(), re.S)
    assert len(blocks) >= 5
    names: dict[str, object] = {}
    for code, expected in blocks:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, "docs/sweeps.md", "exec"), names)  # noqa: S102
        assert printed.getvalue() == expected, code
