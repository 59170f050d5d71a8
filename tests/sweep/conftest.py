# SPDX-License-Identifier: GPL-2.0-or-later
"""Fixtures for tests of stagesim.sweep.

Tests that need an engine which is not installed are skipped. The last lines of the output then say so, and ctest
counts the whole run as skipped, not as passed.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import pytest
from stagesim.sweep import Experiment

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))  # patience

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
HERE = Path(__file__).parent

WALLS = """
model( name "south" pose [0 -5 0 0] size [10.2 0.2 1] )
model( name "north" pose [0 5 0 0] size [10.2 0.2 1] )
model( name "west" pose [-5 0 0 0] size [0.2 10.2 1] )
model( name "east" pose [5 0 0 0] size [0.2 10.2 1] )
"""
WORLD = f"""
resolution 0.05
interval_sim 100
quit_time 5
{WALLS}
define eye ranger( size [0.05 0.05 0.1] sensor( range [0 3] fov 180 samples 16 ) )
define bot position( size [0.3 0.3 0.3] drive "diff" joules 1000 eye() ctrl "wander" )
population( name "bots" model "bot" count 4 )
metric( name "driven" kind "distance" )
metric( name "swept" kind "coverage" cell 0.5 )
metric( name "goal" kind "time_to_goal" goal [2 2] radius 1 first 1 )
"""


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Reports skipped tests to ctest unless a test has failed."""
    skipped = {str(report.longrepr[2]).replace("Skipped: ", "") for report in terminalreporter.stats.get("skipped", [])}
    if skipped and not terminalreporter.stats.get("failed") and not terminalreporter.stats.get("error"):
        for reason in sorted(skipped):
            terminalreporter.write_line(reason)


@pytest.fixture
def root() -> Path:
    """The root of the source tree."""
    return ROOT


@pytest.fixture
def world(tmp_path: Path) -> Path:
    """A world file with robots that wander in a square room, and with three metrics."""
    file = tmp_path / "room.world"
    file.write_text(WORLD)
    return file


@pytest.fixture
def experiment(world: Path) -> Experiment:
    """An experiment of 2 x 2 sets of values with five runs each, of some 10 ms."""
    return Experiment(world, {"bots": [2, 6], "world.resolution": [.02, .1]}, runs=5, seed=3)


@pytest.fixture
def slow(world: Path) -> Experiment:
    """An experiment of thirty runs of some 100 ms, so that workers can be killed during a run."""
    return Experiment(world, {"bots": [8, 12]}, runs=15, seed=4, duration=40)


@pytest.fixture
def own_metrics(monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes the module own_metrics importable."""
    monkeypatch.syspath_prepend(str(HERE))
    sys.modules.pop("own_metrics", None)
