#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The state hash covers more than it did, hence its values are others; results are what they were.

tests/data/old_state_hashes.txt has what the hash of old gave before.
"""

from __future__ import annotations

import os
import unittest
from pathlib import Path

from hash_runs import ROOT, Run, controller_worlds, hashes_of, shipped_worlds

BINARY_DIR = Path(os.environ.get("STAGE_BINARY_DIR") or ROOT / "build" / "release")
TOOL = BINARY_DIR / "tests" / "old_state_hash"
FILE = ROOT / "tests" / "data" / "old_state_hashes.txt"


def read_file() -> dict[Run, str]:
    rows = [line.split() for line in FILE.read_text().splitlines() if not line.startswith("#")]
    return {Run(world, int(seconds)): digits for world, seconds, digits in rows}


# Worlds that came after the old hash.
NEWER = {"worlds/corridor.world", "worlds/swarm.world",
         "tests/data/controllers/what_if.world"}


class OldStateHashTest(unittest.TestCase):
    def test_file_is_complete(self) -> None:
        worlds = [world for world in shipped_worlds() + controller_worlds() if world not in NEWER]
        self.assertEqual(list(read_file()), [Run(world, 60) for world in worlds])

    def test_results_are_what_they_were(self) -> None:
        expected = read_file()
        found = hashes_of(TOOL, list(expected), [])
        for run, digits in expected.items():
            with self.subTest(run=str(run)):
                self.assertEqual(found[run], digits)


if __name__ == "__main__":
    unittest.main()
