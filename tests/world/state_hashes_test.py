#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs give the state hashes of tests/data/state_hashes.txt on every machine, with exact rays those of
exact_state_hashes.txt, and with contacts of cells those of cells_state_hashes.txt.

Other hash tests compare runs on one machine; these hashes were computed on another. After a change that is meant to
change results, STAGE_NEW_HASHES=1 updates the file.
"""

from __future__ import annotations

import os
import platform
import re
import unittest
from pathlib import Path

from hash_runs import KINDS, ROOT, Run, controller_worlds, hashes_of, shipped_worlds

BINARY_DIR = Path(os.environ.get("STAGE_BINARY_DIR") or ROOT / "build" / "release")
STAGE = BINARY_DIR / "bin" / "stage"
FILES = {kind: ROOT / "tests" / "data" / ("state_hashes.txt" if kind == "default" else f"{kind}_state_hashes.txt")
         for kind in KINDS}
HEADER = """\
# SPDX-License-Identifier: GPL-2.0-or-later
# World, simulated seconds, state hash with seed 5{}. Do not edit; this file was written by
#   STAGE_NEW_HASHES=1 tools/test -R state_hashes
"""

# The C library selects its functions by the processor. With this setting, it selects simpler ones.
OLD_PROCESSOR = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX2_Usable,-AVX512F,-SSE4_1"}


def all_runs() -> list[Run]:
    runs = [Run(world, seconds) for world in shipped_worlds() for seconds in (5, 300)]
    runs += [Run(world, 60) for world in controller_worlds()]
    return runs + [Run(world, seconds, kind) for kind in ("exact", "cells") for world in shipped_worlds()
                   for seconds in (5, 60)]


def read_files() -> dict[Run, str]:
    found = {}
    for kind, file in FILES.items():
        for line in file.read_text().splitlines():
            if not line.startswith("#"):
                world, seconds, digits = line.split()
                found[Run(world, int(seconds), kind)] = digits
    return found


def write_files() -> None:
    found = hashes_of(STAGE, all_runs(), ["--threads", "1"])
    for kind, file in FILES.items():
        header = HEADER.format(f" and {' '.join(KINDS[kind])}" if KINDS[kind] else "")
        file.write_text(header + "".join(f"{run.world} {run.seconds} {found[run]}\n"
                                         for run in all_runs() if run.kind == kind))


def longest_run() -> int:
    """Seconds of a run: STAGE_LONGEST_RUN for emulators, 5 with sanitizers."""
    cache = BINARY_DIR / "CMakeCache.txt"
    if cache.exists() and re.search(r"^STAGE_SANITIZE:\w+=.", cache.read_text(), re.M):
        return 5
    return int(os.environ.get("STAGE_LONGEST_RUN", "300"))


class StateHashesTest(unittest.TestCase):
    def compare(self, options: list[str], environment: dict[str, str] | None = None,
                longest: int = 300) -> None:
        expected = read_files()
        longest = min(longest, longest_run())
        runs = [run for run in all_runs() if run.seconds <= longest]
        found = hashes_of(STAGE, runs, options, environment)
        for run in runs:
            with self.subTest(run=str(run)):
                self.assertEqual(found[run], expected[run])

    def test_files_are_complete(self) -> None:
        self.assertEqual(list(read_files()), all_runs())

    def test_this_processor(self) -> None:
        self.compare(["--threads", "1"])

    def test_any_number_of_threads(self) -> None:
        """Without --threads, the program chooses the number of threads."""
        self.compare([], longest=60)
        for threads in ("2", "7"):
            self.compare(["--threads", threads], longest=5)

    @unittest.skipUnless(platform.machine() == "x86_64", "needs an x86-64 processor")
    def test_processor_without_fused_multiply_add(self) -> None:
        """If results depended on functions of the C library, they would differ within a minute."""
        self.compare(["--threads", "1"], OLD_PROCESSOR, longest=60)

    def test_ray_by_ray(self) -> None:
        """Without batches, no rays are traced in the lanes of vectors."""
        self.compare(["--threads", "1", "--no-batch"], longest=5)


if __name__ == "__main__":
    if os.environ.get("STAGE_NEW_HASHES"):
        write_files()
    unittest.main()
