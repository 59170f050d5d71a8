# SPDX-License-Identifier: GPL-2.0-or-later
"""Fixtures for tests with libraries for learning.

Tests of a library that is not installed (tools/setup --learn) are skipped. The last lines of the output then say so,
and ctest counts the whole run as skipped, not as passed.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))  # patience

# Small networks and few processors: threads of libraries would wait for each other. Ray talks to nobody else.
os.environ.update({"OMP_NUM_THREADS": "1", "RAY_AUTH_MODE": "disabled", "RAY_USAGE_STATS_ENABLED": "0"})


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Reports skipped tests to ctest unless a test has failed."""
    skipped = {str(report.longrepr[2]).replace("Skipped: ", "") for report in terminalreporter.stats.get("skipped", [])}
    if not terminalreporter.stats.get("failed") and not terminalreporter.stats.get("error"):
        for reason in sorted(skipped):
            terminalreporter.write_line(reason)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Without any of the libraries there are no tests, which is no error."""
    if session.testscollected == 0 and session.exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED:
        session.exitstatus = pytest.ExitCode.OK


@pytest.fixture(scope="session")
def root() -> Path:
    """The root of the source tree."""
    return Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
