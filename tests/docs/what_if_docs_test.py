#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""docs/what-if.md quotes parts of examples/what_if/choose.cc and its output correctly."""

from __future__ import annotations

import os
import re
import subprocess
import unittest
from pathlib import Path

SOURCE_DIR = Path(os.environ["STAGE_SOURCE_DIR"]).resolve()
BINARY_DIR = Path(os.environ["STAGE_BINARY_DIR"]).resolve()
PAGE = (SOURCE_DIR / "docs" / "what-if.md").read_text()
PROGRAM = (SOURCE_DIR / "examples" / "what_if" / "choose.cc").read_text()

FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def walk() -> str:
    """The section of the page about the program."""
    return PAGE.split("## Ten minutes")[1].split("\n## ")[0]


class WhatIfDocsTest(unittest.TestCase):
    def test_code_is_that_of_the_program(self) -> None:
        blocks = [text for language, text in FENCED.findall(walk()) if language == "cpp"]
        self.assertGreaterEqual(len(blocks), 4)
        for block in blocks:
            self.assertIn(block, PROGRAM)

    def test_output_is_that_of_the_program(self) -> None:
        outputs = [text for language, text in FENCED.findall(walk()) if language == ""]
        done = subprocess.run([BINARY_DIR / "bin" / "choose", "examples/what_if/choose.world"],
                              cwd=SOURCE_DIR, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(outputs), 1)
        self.assertTrue(done.stdout.endswith(outputs[0]), done.stdout)

    def test_table_is_that_of_the_benchmark(self) -> None:
        source = (SOURCE_DIR / "benchmarks" / "corridor.cc").read_text()
        for way in re.findall(r'^    \{"([^"]+)", "', source, re.MULTILINE):
            self.assertIn(f"| {way} |", PAGE)


if __name__ == "__main__":
    unittest.main()
