# SPDX-License-Identifier: GPL-2.0-or-later
"""Fixtures for tests of stagesim.ros.

The tests are skipped if rclpy is not installed (tools/setup --ros). All traffic stays on this machine, in a
separate domain: see domains.py.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any, Callable, Iterator

import pytest

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
sys.path.insert(0, str(ROOT / "tests" / "support"))  # patience
sys.path.append(str(ROOT / "examples" / "ros"))

try:
    import rclpy
except ModuleNotFoundError:
    rclpy = None
    collect_ignore_glob = ["test_*.py"]
else:
    from domains import take_domain
    from ros_testing import TWO, Client, Process


def pytest_terminal_summary(terminalreporter: Any) -> None:
    if rclpy is None:
        terminalreporter.write_line("skipped: rclpy is not installed; try tools/setup --ros")


def pytest_sessionfinish(session: pytest.Session) -> None:
    if rclpy is None and session.testscollected == 0:
        session.exitstatus = 0


@pytest.fixture(scope="session", autouse=True)
def domain() -> Iterator[None]:
    """A domain that other runs of tests don't use, from the first test to the last."""
    with take_domain():
        yield


@pytest.fixture(scope="session")
def ros(domain: None) -> Iterator[None]:
    rclpy.init()
    yield
    rclpy.try_shutdown()


@pytest.fixture
def client(ros: None) -> Iterator[Client]:
    made = Client()
    yield made
    made.close()


@pytest.fixture
def start() -> Iterator[Callable[..., Process]]:
    """A function that starts nodes, which are stopped at the end of the test."""
    started: list[Process] = []

    def begin(world: str, *options: str, **parameters: Any) -> Process:
        started.append(Process(world, *options, **parameters))
        return started[-1]

    yield begin
    for process in started:
        process.ask_to_end()
    for process in started:
        process.make_end()


@pytest.fixture
def two(tmp_path: Any) -> str:
    """A world file with two robots without controllers, with batteries and with odometry errors."""
    file = tmp_path / "two.world"
    file.write_text(TWO)
    return str(file)


@pytest.fixture
def one(tmp_path: Any) -> str:
    """A world file with only one such robot."""
    file = tmp_path / "one.world"
    file.write_text(TWO.replace('bot( name "b" pose [0 2 0 90] )\n', ""))
    return str(file)
