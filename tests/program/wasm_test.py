#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The program as WebAssembly, if tools/dev/wasm has built it, and what that tool says to mistakes.

Making its tree takes minutes and needs root, so that is not part of the test.
"""

from __future__ import annotations

import os
import subprocess
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])


def wasm(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([ROOT / "tools" / "dev" / "wasm", *arguments], capture_output=True, text=True, check=False)


class WasmTest(unittest.TestCase):
    def test_unknown_options_are_refused(self) -> None:
        done = wasm("--vax")
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("found --vax, expected --no-build", done.stderr)

    def test_simple_and_cave_have_the_state_hashes_of_native_runs(self) -> None:
        if os.geteuid() != 0 or not (ROOT / "build" / "cross" / "wasm.made").exists():
            self.skipTest("Emscripten is not installed in build/cross/wasm; run sudo tools/dev/wasm")
        done = wasm()
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(len(done.stdout.splitlines()), 2, done.stdout)


if __name__ == "__main__":
    unittest.main()
