# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs the program `stage`: `python -m stagesim ARGUMENTS`."""

from __future__ import annotations

import os
import sys

from . import _paths


def main() -> None:
    """Replaces this process with the program. A shipped world may be given by its file name alone."""
    arguments = [_paths.resolve(text) if text.endswith(".world") else text for text in sys.argv[1:]]
    os.environ.setdefault("STAGE_PYTHON", sys.executable)
    os.execv(_paths.PROGRAM, [_paths.PROGRAM, *arguments])


if __name__ == "__main__":
    main()
