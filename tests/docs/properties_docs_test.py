#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""docs/properties.md documents every property, and each row names a test that uses it."""

from __future__ import annotations

import os
import re
import unittest
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
DOCUMENT = ROOT / "docs" / "properties.md"
TABLE = ROOT / "tests" / "support" / "property_table.hh"

ENTRY = re.compile(r'^\s*\{"(\w+)", "([\w\[\]]+)", "', re.MULTILINE)
COLUMNS = ["Property", "Values", "Default", "Meaning", "Test"]
CODE = re.compile(r"`([^`]+)`")
INCLUDE = re.compile(r'^#include "([\w/]+)\.hh"', re.MULTILINE)
WORLD = re.compile(r"[\w/]+\.(?:world|inc)\b")
RAW_STRING = re.compile(r'R"(\w*)\((.*?)\)\1"', re.DOTALL)
STRING = re.compile(r'"((?:\\.|[^"\\\n])*)"')


class Row(NamedTuple):
    """A row of the document."""

    entity: str
    name: str
    tests: list[str]
    line: int


def properties_in_table() -> list[tuple[str, str]]:
    """(entity, name) of each entry of property_table.hh."""
    return ENTRY.findall(TABLE.read_text())


def cells(line: str) -> list[str]:
    """The cells of a line of a table."""
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def rows_in_docs() -> list[Row]:
    """All rows of the tables below a heading that names an entity in backquotes."""
    rows = []
    entity = ""
    for number, line in enumerate(DOCUMENT.read_text().splitlines(), start=1):
        if line.startswith("## "):
            named = CODE.findall(line)
            entity = named[0] if named else ""
        if not line.startswith("|") or not entity:
            continue
        row = cells(line)
        if row == COLUMNS or set(line) <= set("|-"):
            continue
        if len(row) != len(COLUMNS) or not all(row) or len(CODE.findall(row[0])) != 1:
            raise ValueError(
                f"docs/properties.md:{number}: found {line!r}, expected a property in backquotes "
                f"and no empty cell in the columns {', '.join(COLUMNS)}"
            )
        rows.append(Row(entity, CODE.findall(row[0])[0], CODE.findall(row[-1]), number))
    return rows


def source_of(test: str) -> Path | None:
    """The file of a test program, or None."""
    return next((path for suffix in (".cc", ".py")
                 for path in (ROOT / "tests").glob("*/" + test + suffix)), None)


def strings_of(text: str) -> str:
    """The string literals of a source, one per line; worlds in tests are string literals."""
    text = re.sub(r"^#include.*", "", text, flags=re.MULTILINE)
    raw = [match[1] for match in RAW_STRING.findall(text)]
    # Replace escapes such as `\n` by blanks, so that they don't join adjacent words.
    plain = [re.sub(r"\\.", " ", match) for match in STRING.findall(RAW_STRING.sub("", text))]
    return "\n".join(raw + plain)


@cache
def texts_that_use(test: str) -> str:
    """The texts of worlds in a test: its strings, those of the files in tests/ that it includes, and the
    world files that it names. For properties_test, only the table."""
    path = source_of(test)
    if path is None:
        return ""
    if test == "properties_test":
        return strings_of(TABLE.read_text())
    sources = [path]
    for name in INCLUDE.findall(path.read_text()):
        for folder in (path.parent, ROOT / "tests"):
            sources += [folder / (name + suffix) for suffix in (".hh", ".cc")]
    sources = [source for source in sources if source.is_file() and source != TABLE]
    text = "\n".join(strings_of(source.read_text()) for source in sources)
    for name in WORLD.findall(text):
        for folder in (ROOT, ROOT / "worlds", ROOT / "tests" / "data"):
            if (folder / name).is_file():
                text += (folder / name).read_text()
    return text


def pattern_of(name: str) -> re.Pattern[str]:
    """A pattern that finds a property as a word, with any index if it has one."""
    base, bracket, _ = name.partition("[")
    end = r"\[" if bracket else r"(?![\w\[])"
    return re.compile(r"(?<!\w)" + re.escape(base) + end)


class PropertiesDocsTest(unittest.TestCase):
    def test_both_have_the_same_properties(self) -> None:
        table = properties_in_table()
        rows = [(row.entity, row.name) for row in rows_in_docs()]
        for entity in sorted({entity for entity, _ in table + rows}):
            with self.subTest(entity=entity):
                self.assertEqual(
                    sorted(name for of, name in rows if of == entity),
                    sorted(name for of, name in table if of == entity),
                    f"of {entity}: first docs/properties.md, then property_table.hh",
                )

    def test_every_entry_is_understood(self) -> None:
        braces = re.findall(r'^\s*\{"', TABLE.read_text(), re.MULTILINE)
        self.assertEqual(len(properties_in_table()), len(braces))
        self.assertGreater(len(braces), 150)

    def test_every_test_exists(self) -> None:
        for row in rows_in_docs():
            self.assertTrue(row.tests, f"docs/properties.md:{row.line}: no test for {row.name}")
            for test in row.tests:
                self.assertIsNotNone(
                    source_of(test), f"docs/properties.md:{row.line}: no tests/*/{test}.cc or .py"
                )

    def test_every_test_uses_the_property(self) -> None:
        for row in rows_in_docs():
            for test in row.tests:
                self.assertTrue(
                    pattern_of(row.name).search(texts_that_use(test)),
                    f"docs/properties.md:{row.line}: {test} does not use {row.name}",
                )


if __name__ == "__main__":
    unittest.main()
