# SPDX-License-Identifier: GPL-2.0-or-later
"""The nodes of stagesim.ros: `ros2 run stage_ros2 stage_ros2 WORLD` and `ros2 run stage_ros2 what_if WORLD ROBOT`."""

import sys


def main() -> None:
    """Run the node that simulates a world, or exit with one line if stagesim is not installed."""
    try:
        from stagesim.ros.__main__ import main as run
    except ModuleNotFoundError as error:
        _exit(error)
    run()


def what_if() -> None:
    """Run the node that drives a robot by simulated futures, or exit with one line if stagesim is not installed."""
    try:
        from stagesim.ros.what_if.__main__ import main as run
    except ModuleNotFoundError as error:
        _exit(error)
    run()


def _exit(error: ModuleNotFoundError) -> None:
    sys.exit(f"stage_ros2: there is no Python module {error.name}: pip install ./python in Stage's sources")
