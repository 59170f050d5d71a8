#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""docs/extremes.md cites exactly the tests of extremes, so that each promise has a test."""

from __future__ import annotations

import fnmatch
import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TEST = re.compile(r"^(TEST|TEST_P)\((\w+), (\w+)\)", re.MULTILINE)
NAME = re.compile(r"`((?:Api/)?[A-Z]\w+\.(?:\w+|\*))`")


def tests_in_sources() -> set[str]:
    """All tests of tests/extremes/*_test.cc: Suite.Name, with parameters Api/Suite.Name."""
    names = set()
    for source in sorted((ROOT / "tests" / "extremes").glob("*_test.cc")):
        for kind, suite, name in TEST.findall(source.read_text()):
            names.add(f"{'Api/' if kind == 'TEST_P' else ''}{suite}.{name}")
    return names


def tests_in_docs() -> set[str]:
    """The tests cited in the last column of the tables or elsewhere in the text."""
    names = set()
    for line in (ROOT / "docs" / "extremes.md").read_text().splitlines():
        place = line.rstrip("|").rsplit("|", 1)[-1] if line.startswith("|") else line
        names.update(NAME.findall(place))
    return names


class ExtremesDocsTest(unittest.TestCase):
    def test_every_test_that_is_named_exists(self) -> None:
        tests = tests_in_sources()
        for name in tests_in_docs():
            self.assertTrue(fnmatch.filter(tests, name), name)

    def test_every_test_is_named(self) -> None:
        named = tests_in_docs()
        for name in tests_in_sources():
            self.assertTrue(any(fnmatch.fnmatch(name, pattern) for pattern in named), name)

    def test_there_are_many(self) -> None:
        self.assertGreater(len(tests_in_sources()), 50)
        self.assertGreater(len(tests_in_docs()), 50)


if __name__ == "__main__":
    unittest.main()
