# SPDX-License-Identifier: GPL-2.0-or-later
"""The code of docs/python.md and the world of docs/motion.md work, and docs/python_api.md is up to date with the
docstrings."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path

import pytest
import stagesim as st
from snippets import check_outputs


def test_page_prints_what_it_shows(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each block of Python, executed in order, prints the output that follows it."""
    page = root / "docs" / "python.md"
    if not page.exists():
        pytest.skip("there is no docs/python.md")
    monkeypatch.chdir(tmp_path)
    assert check_outputs(page) > 5


def test_api_page(root: Path) -> None:
    tool, page = root / "tools" / "dev" / "python_api", root / "docs" / "python_api.md"
    if not tool.exists():
        pytest.skip("there is no tools/dev/python_api")
    made = subprocess.run([sys.executable, str(tool)], capture_output=True, text=True, check=True)
    assert made.stdout == page.read_text(), "make it anew: see tools/dev/python_api"


def test_robots_of_the_motion_page_push_their_box(root: Path) -> None:
    """Both bring the box home at the time that the page states; one alone does not move it."""
    page = root / "docs" / "motion.md"
    if not page.exists():
        pytest.skip("there is no docs/motion.md")
    text = page.read_text()
    (world_file,) = re.findall(r"```\n(contacts .*?)```", text, re.S)
    found = re.search(r"After ([\d.]+) s the box is within (\d+) cm of \(3, 0\)", text)
    assert found
    world = st.World.from_text(world_file)
    box = world.model("box")
    while math.hypot(box.pose[0] - 3, box.pose[1]) > float(found[2]) / 100 and world.time < 60:
        world.step()
    assert world.time == pytest.approx(float(found[1]))
    alone = st.World.from_text(re.sub(r"pusher\( .*blue.*\n", "", world_file))
    alone.step(300)
    assert alone.model("box").pose[0] == pytest.approx(0, abs=1e-6) and len(alone.fleet()) == 1
