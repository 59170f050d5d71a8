# SPDX-License-Identifier: GPL-2.0-or-later
"""Makes `python benchmarks/peers` a program: see program.py."""

import sys
from pathlib import Path

sys.path[0] = str(Path(__file__).resolve().parents[1])

from peers.program import main  # noqa: E402  pylint: disable=wrong-import-position

if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
