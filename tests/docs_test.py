#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The documents are finished: no word that stands for a text to come, no empty section."""

from __future__ import annotations

import os
import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NOT_OURS = {"build", ".git", ".cache"}

CODE = re.compile(r"`[^`]*`")
UNFINISHED = re.compile(r"\b(TODO|FIXME|XXX+|TBD|T\.B\.D|lorem ipsum|fill in|placeholders?)\b",
                        re.IGNORECASE)
# A word that a script or a person meant to replace: alone in its line, or in its cell of a table.
LONE_WORD = re.compile(r"^\W*[A-Z][A-Z0-9]*([_ ][A-Z0-9]+)*\W*$")
SHORT = 4  # letters: what is shorter may be a name, such as GPU


def prose(text: str) -> list[str]:
    """The lines; those of code are empty, and so is code within a line."""
    lines, fenced = [], False
    for line in text.splitlines():
        if line.lstrip().startswith("```"):
            fenced = not fenced
        code = fenced or line.startswith(("    ", "```"))
        lines.append("" if code else CODE.sub("", line))
    return lines


def level(line: str) -> int:
    """Of a heading; 0 if it is none."""
    return len(line) - len(line.lstrip("#")) if re.match(r"#+ ", line) else 0


def words_to_replace(lines: list[str]) -> list[str]:
    faults = []
    for number, line in enumerate(lines, 1):
        if UNFINISHED.search(line):
            faults.append(f"{number}: unfinished: {line}")
        cells = [] if level(line) else [cell.strip() for cell in line.split("|")]
        faults += [f"{number}: stands alone: {cell}" for cell in cells
                   if len(cell) >= SHORT and LONE_WORD.match(cell)]
    return faults


def empty_sections(text: str, lines: list[str]) -> list[str]:
    """A heading, and then nothing but the next one of its kind, or the end."""
    written = text.splitlines()
    headings = [i for i, line in enumerate(lines) if level(line)]
    faults = []
    for heading, following in zip(headings, [*headings[1:], len(lines)]):
        goes_deeper = following < len(lines) and level(lines[following]) > level(lines[heading])
        if not goes_deeper and not any(line.strip() for line in written[heading + 1:following]):
            faults.append(f"{heading + 1}: nothing below: {written[heading]}")
    return faults


def unfinished(text: str) -> list[str]:
    """What is wrong with a document: "LINE: reason"."""
    lines = prose(text)
    return words_to_replace(lines) + empty_sections(text, lines)


def documents() -> list[Path]:
    found = []
    for folder, folders, files in os.walk(ROOT):
        folders[:] = [f for f in folders if f not in NOT_OURS]
        found += [Path(folder) / f for f in files if f.endswith(".md")]
    return sorted(found)


class DocsTest(unittest.TestCase):
    def test_what_is_unfinished_is_found(self) -> None:
        for text in ("# A\n\nESTIMATES\n", "# A\n\nTODO: more\n", "# A\n\nsome text, xxx\n",
                     "# A\n\n<!-- the table: tbd -->\n", "# A\n\n| a | RESULTS_HERE |\n",
                     "# A\n\n[TABLE]\n", "# A\n\na placeholder\n", "# A\n\n# B\n\ntext\n",
                     "# A\n\ntext\n\n## B\n"):
            self.assertTrue(unfinished(text), text)

    def test_what_is_finished_is_not(self) -> None:
        for text in ("# A\n\nAll of it: a GPU, `TODO`.\n", "# A\n\n    STAGE\n\n```\nTODO\n```\n",
                     "# A\n\n## B\n\ntext\n", "# A\n\n| GPU | 3 |\n|---|---|\n", "# NAMES\n\ntext\n"):
            self.assertEqual(unfinished(text), [], text)

    def test_documents(self) -> None:
        found = documents()
        self.assertIn(ROOT / "docs/economy.md", found)
        for document in found:
            with self.subTest(document.relative_to(ROOT)):
                self.assertEqual(unfinished(document.read_text(encoding="utf-8")), [])


if __name__ == "__main__":
    unittest.main()
