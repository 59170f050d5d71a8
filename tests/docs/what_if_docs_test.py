#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""docs/what-if.md quotes parts of the programs in examples/what_if and their output correctly."""

from __future__ import annotations

import os
import re
import subprocess
import unittest
from pathlib import Path

SOURCE_DIR = Path(os.environ["STAGE_SOURCE_DIR"]).resolve()
BINARY_DIR = Path(os.environ["STAGE_BINARY_DIR"]).resolve()
PAGE = (SOURCE_DIR / "docs" / "what-if.md").read_text()

FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


#: Programs, with the beginnings of the first section about them and of the next one, as regular expressions.
PROGRAMS = {"choose": ("## Ten minutes", "## "), "belief": ("## A robot that is not", "### "),
            "ethical": ("### Judges of whole", "##+ ")}
#: Worlds of programs that have none of their own.
WORLDS = {"ethical": "belief"}


def blocks(program: str, language: str) -> list[str]:
    """The fenced blocks of a language in the section of the page about a program."""
    first, end = PROGRAMS[program]
    section = re.split(rf"^{end}", re.split(rf"^{first}", PAGE, flags=re.MULTILINE)[1], flags=re.MULTILINE)[0]
    return [text for of, text in FENCED.findall(section) if of == language]


class WhatIfDocsTest(unittest.TestCase):
    def test_code_is_that_of_the_programs(self) -> None:
        for program in PROGRAMS:
            source = (SOURCE_DIR / "examples" / "what_if" / f"{program}.cc").read_text()
            quoted = blocks(program, "cpp")
            self.assertGreaterEqual(len(quoted), 1 if program in WORLDS else 3)
            for block in quoted:
                self.assertIn(block, source)

    def test_outputs_are_those_of_the_programs(self) -> None:
        for program in PROGRAMS:
            (output,) = blocks(program, "")
            done = subprocess.run([BINARY_DIR / "bin" / program, f"examples/what_if/{WORLDS.get(program, program)}.world"],
                                  cwd=SOURCE_DIR, capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue(done.stdout.endswith(output), done.stdout)

    def test_table_is_that_of_the_benchmark(self) -> None:
        source = (SOURCE_DIR / "benchmarks" / "corridor.cc").read_text()
        for way in re.findall(r'^    \{"([^"]+)", "', source, re.MULTILINE):
            self.assertIn(f"| {way} |", PAGE)


if __name__ == "__main__":
    unittest.main()
