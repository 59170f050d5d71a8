# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs the node: `python -m stagesim.ros.what_if`."""

from __future__ import annotations

from ..start import start


def main() -> None:
    """Runs the node, or exits with one line if a Python module is missing."""
    start("stagesim.ros.what_if")


if __name__ == "__main__":
    main()
