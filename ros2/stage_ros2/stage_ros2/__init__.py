# SPDX-License-Identifier: GPL-2.0-or-later
"""`ros2 run stage_ros2 stage_ros2 WORLD` starts the node of stagesim.ros."""

import sys


def main() -> None:
    """Run the node, or exit with one line if stagesim is not installed."""
    try:
        from stagesim.ros.__main__ import main as run
    except ModuleNotFoundError as error:
        sys.exit(f"stage_ros2: there is no Python module {error.name}: pip install ./python in Stage's sources")
    run()
