# SPDX-License-Identifier: GPL-2.0-or-later
"""Time limits of tests that hold on machines of any speed and load.

A test that waits for an event that must happen waits up to PATIENCE seconds. It goes on as soon as the event has
happened, so a high limit costs nothing unless the test fails. A test that limits a duration multiplies the limit by
slowness().
"""

from __future__ import annotations

import subprocess
import sys
import time

#: Max seconds to wait. ctest's own limit is longer, so that the test's message is seen.
PATIENCE = 300

#: Seconds that the program below takes on an idle machine of two cores.
_REFERENCE = 0.07
_PROGRAM = "import json, hashlib\nfor _ in range(20): hashlib.sha256(bytes(500000)).digest()"


def slowness() -> float:
    """The current factor, at least 1, by which this machine is slower than an idle machine with two cores.

    It is measured with a small program, whose start and arithmetic are slowed by the load like those of the program
    under test.
    """
    began = time.monotonic()
    subprocess.run([sys.executable, "-c", _PROGRAM], check=True)
    return max(1.0, (time.monotonic() - began) / _REFERENCE)
