# SPDX-License-Identifier: GPL-2.0-or-later
"""`python -m stagesim.ros` is the node."""

from __future__ import annotations

import sys


def main() -> None:
    """Runs the node; says in one line what is missing."""
    try:
        from .main import run
    except ModuleNotFoundError as error:
        sys.exit(f"stagesim.ros: there is no Python module {error.name}: source a ROS 2 installation, "
                 'or pip install "stagesim[ros]"')
    sys.exit(run(sys.argv))


if __name__ == "__main__":
    main()
