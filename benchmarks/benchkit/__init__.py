# SPDX-License-Identifier: GPL-2.0-or-later
"""Shared by the benchmarks: runs of programs, result stores, energy and temperature.

The modules of python/stagesim/reports (statistics, reports, plots and progress) are found here too,
so that benchmarks run without a built Python package. The energy meters are in tools/meters.
"""

import sys
from pathlib import Path

_ROOT = Path(__file__).resolve().parents[2]
__path__.append(str(_ROOT / "python" / "stagesim" / "reports"))
sys.path.append(str(_ROOT / "tools"))
