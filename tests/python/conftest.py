# SPDX-License-Identifier: GPL-2.0-or-later
"""Fixtures for tests of the Python package.

The tests use the package that `import stagesim` finds: the build tree (PYTHONPATH=build/release/python) or an
installed wheel.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import stagesim as st
from beliefs import ROBOT

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))  # patience, plugin

from plugin import compile_plugin  # noqa: E402

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])


@pytest.fixture(scope="session")
def root() -> Path:
    """The root of the source tree."""
    return ROOT


@pytest.fixture(scope="session")
def plugin_of(root: Path) -> Callable[[str, Path], Path]:
    """A function that compiles a plug-in, such as a controller, from source text into a file."""
    return lambda text, file: compile_plugin(text, file, root)


@pytest.fixture(scope="session")
def hashes(root: Path) -> dict[tuple[str, int], str]:
    """The stored state hashes with seed 5, by world and simulated seconds."""
    lines = (root / "tests" / "data" / "state_hashes.txt").read_text().splitlines()
    rows = [line.split() for line in lines if not line.startswith("#")]
    return {(world, int(seconds)): digits for world, seconds, digits in rows}


@pytest.fixture
def robot_file(tmp_path: Path) -> str:
    """A world file with the robot of tests of beliefs."""
    path = tmp_path / "robot.world"
    path.write_text(ROBOT)
    return str(path)


ROOM = """
resolution 0.02
model( name "wall" pose [3 0 0 0] size [0.1 8 1] )
define eye ranger( size [0.1 0.1 0.1]
  sensor( range [0 5] fov 90 samples 5 ) )
define bot position( size [0.4 0.4 0.4] drive "diff" localization "gps" eye() )
bot( name "a" pose [0 0 0 0] )
bot( name "b" pose [0 2 0 90] )
bot( name "c" pose [0 -2 0 180] )
"""


@pytest.fixture
def room() -> str:
    """A world file with three robots without controllers, and a wall in front of the first one."""
    return ROOM


@pytest.fixture
def server(room: str) -> Iterator[Any]:
    """A paused server of stagesim.live with the world of `room`."""
    from stagesim import World
    from stagesim.live import Server

    with Server(World.from_text(room), paused=True) as made:
        yield made
