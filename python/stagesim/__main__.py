# SPDX-License-Identifier: GPL-2.0-or-later
"""`python -m stagesim` is the program `stage`."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def main() -> None:
    """Becomes the program; shipped worlds may be given by their names alone."""
    program = Path(__file__).resolve().parent / "bin" / "stage"
    os.execv(program, [str(program), *sys.argv[1:]])


if __name__ == "__main__":
    main()
