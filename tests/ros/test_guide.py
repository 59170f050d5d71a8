# SPDX-License-Identifier: GPL-2.0-or-later
"""The three paths of docs/ros.md: their commands run in a folder of a reader, as in several terminals, and do what the
page says. Commands of a ROS 2 installation are not run."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from typing import Iterator

import numpy as np
import pytest
from build_tree import BINARY_DIR
from pages import Block, blocks_of
from patience import PATIENCE

from stagesim.scenes import GridMap

SOURCE_DIR = Path(os.environ["STAGE_SOURCE_DIR"])
ERROR = re.compile(r"median error (\S+) m and (\S+) degrees")
INSTALLED = "# with a ROS 2 installation\n"


def path_of(title: str) -> list[Block]:
    """The blocks of a path, without those for ROS 2 installations and those that show what is printed."""
    page = (SOURCE_DIR / "docs" / "ros.md").read_text(encoding="utf-8")
    text = page.split(f"\n## {title}\n")[1].split("\n## ")[0]
    shown = re.compile(r"^```\n(?:\d+ poses:|\{).*?^```$", re.MULTILINE | re.DOTALL)
    return [block for block in blocks_of(shown.sub("", text)) if not block.text.startswith(INSTALLED)]


class Terminals:
    """A reader's folder, and what runs there."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "examples").symlink_to(SOURCE_DIR / "examples")
        self._running: list[subprocess.Popen[bytes]] = []
        path = f"{Path(sys.executable).parent}:{BINARY_DIR / 'bin'}:{os.environ['PATH']}"
        self._environment = {**os.environ, "PATH": path, "DISPLAY": "", "WAYLAND_DISPLAY": ""}

    @staticmethod
    def stays(command: str) -> bool:
        """Whether a command runs until it is stopped."""
        words = shlex.split(command)
        return words[:3] == ["python", "-m", "stagesim.ros"] and "--duration" not in words or (
            Path(words[1]).stem in ("wander", "mapper", "localizer", "costmap", "follower"))

    def run(self, command: str) -> str:
        """Runs a command, and returns what it has printed; a command that stays runs on in the background."""
        words = shlex.split(command, comments=True)
        if words[0] == "python":
            words[0] = sys.executable
        if self.stays(command):
            self.start(words)
            return ""
        done = subprocess.run(words, cwd=self.folder, env=self._environment, timeout=PATIENCE, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        assert done.returncode == 0, f"{command}\n{done.stdout}"
        assert not self.ended(), f"{command}\n{self.ended()}"
        return done.stdout

    def start(self, words: list[str]) -> None:
        with open(self.folder / f"{len(self._running)}.log", "wb") as log:
            self._running.append(subprocess.Popen(words, cwd=self.folder, env=self._environment, stdout=log,
                                                  stderr=subprocess.STDOUT))

    def ended(self) -> str:
        """The output of programs that should have stayed but have ended."""
        return "".join((self.folder / f"{number}.log").read_text() for number, program in enumerate(self._running)
                       if program.poll() is not None)

    def stop(self) -> None:
        for program in self._running:
            program.send_signal(signal.SIGINT)
        for program in self._running:
            program.wait(PATIENCE)
        self._running.clear()

    def follow(self, blocks: list[Block]) -> str:
        """Makes the files and runs the commands of blocks; returns all that they have printed."""
        printed = ""
        for block in blocks:
            if block.file:
                (self.folder / block.file).write_text(block.text, encoding="utf-8")
                continue
            for command in filter(None, block.text.splitlines()):
                printed += self.run(command)
        return printed


@pytest.fixture
def terminals(tmp_path: Path, domain: None) -> Iterator[Terminals]:
    made = Terminals(tmp_path)
    yield made
    made.stop()


def errors_in(printed: str) -> tuple[float, float]:
    """The median errors that pose_error.py has printed: metres and degrees."""
    found = ERROR.search(printed)
    assert found, printed
    return float(found[1]), float(found[2])


def test_path_of_slam(terminals: Terminals) -> None:
    metres, degrees = errors_in(terminals.follow(path_of("SLAM")))
    assert 0.001 < metres < 0.5 and degrees < 5, "odometry errs by some per cent"
    mine = GridMap.from_file(terminals.folder / "mine.yaml")
    assert 200 < mine.occupied.sum() < 20_000
    assert (np.asarray(mine.array) == 0).sum() > 10 * mine.occupied.sum(), "free cells lie between the walls"


def test_path_of_nav2(terminals: Terminals) -> None:
    metres, degrees = errors_in(terminals.follow(path_of("Nav2")))
    assert metres < 0.15 and degrees < 2


def test_path_of_several_robots(terminals: Terminals) -> None:
    blocks = path_of("Several robots")
    until = next(number for number, block in enumerate(blocks) if "lockstep" in block.text)
    assert errors_in(terminals.follow(blocks[:until])) == (0, 0)
    terminals.stop()
    simulator, driver = blocks[until].text.splitlines()
    terminals.run(driver)
    figures = json.loads(next(line for line in terminals.run(simulator).splitlines() if line.startswith("{")))
    page = (SOURCE_DIR / "docs" / "ros.md").read_text(encoding="utf-8")
    assert (figures["robots"], figures["steps"]) == (2, 200)
    assert f'"state": "{figures["state"]}"' in page
