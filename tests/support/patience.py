# SPDX-License-Identifier: GPL-2.0-or-later
"""How long tests wait, on machines of any speed and under any load.

A test that waits for something that must happen waits PATIENCE seconds; it goes on as soon as the thing has
happened, so that the limit costs nothing unless the test fails. A test that says that something is quick
multiplies its limit with slowness().
"""

from __future__ import annotations

import subprocess
import sys
import time

#: Seconds to wait for what must happen. ctest's own limit is longer, so that the test's message is seen.
PATIENCE = 1200

#: Seconds that the program below takes on an idle machine of two cores.
_REFERENCE = 0.07
_PROGRAM = "import json, hashlib\nfor _ in range(20): hashlib.sha256(bytes(500000)).digest()"


def slowness() -> float:
    """How many times slower this machine is at this moment than an idle machine of two cores; at least 1.

    It is measured by a small program of its own, whose start and arithmetic take the same share of a
    loaded machine as those of the program that a test waits for.
    """
    began = time.monotonic()
    subprocess.run([sys.executable, "-c", _PROGRAM], check=True)
    return max(1.0, (time.monotonic() - began) / _REFERENCE)
