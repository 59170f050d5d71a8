# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs the node: `python -m stagesim.ros.what_if`."""

from __future__ import annotations

import sys


def main() -> None:
    """Runs the node, or exits with one line if a Python module is missing."""
    try:
        from .main import run
    except ModuleNotFoundError as error:
        sys.exit(f"stagesim.ros.what_if: there is no Python module {error.name}: source a ROS 2 installation, "
                 'or pip install "stagesim[ros]"')
    sys.exit(run(sys.argv))


if __name__ == "__main__":
    main()
