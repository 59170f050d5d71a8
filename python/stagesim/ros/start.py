# SPDX-License-Identifier: GPL-2.0-or-later
"""Starts a node as a program."""

from __future__ import annotations

import sys
from importlib import import_module


def start(package: str) -> None:
    """Runs the node of a package, or exits with one line if a Python module is missing."""
    try:
        run = import_module(f"{package}.main").run
    except ModuleNotFoundError as error:
        sys.exit(f"{package}: there is no Python module {error.name}: source a ROS 2 installation, "
                 'or pip install "stagesim[ros]"')
    sys.exit(run(sys.argv))
