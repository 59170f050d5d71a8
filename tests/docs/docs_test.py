#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The documents are complete: they have no placeholders, empty sections or broken links within the
sources. docs/README.md lists all pages, pages show all pictures and describe them, and the terms of the glossary are
used in the sources."""

from __future__ import annotations

import os
import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NOT_OURS = {"build", ".git", ".cache"}

CODE = re.compile(r"`[^`]*`")
UNFINISHED = re.compile(r"\b(TODO|FIXME|XXX+|TBD|T\.B\.D|lorem ipsum|fill in|placeholders?)\b",
                        re.IGNORECASE)
# A placeholder in capitals that is alone in a line or in a cell of a table.
LONE_WORD = re.compile(r"^\W*[A-Z][A-Z0-9]*([_ ][A-Z0-9]+)*\W*$")
SHORT = 4  # minimum number of letters; shorter words may be names, such as GPU


def prose(text: str) -> list[str]:
    """The lines with all code removed."""
    lines, fenced = [], False
    for line in text.splitlines():
        if line.lstrip().startswith("```"):
            fenced = not fenced
        code = fenced or line.startswith(("    ", "```"))
        lines.append("" if code else CODE.sub("", line))
    return lines


def level(line: str) -> int:
    """The level of a heading; 0 if the line is no heading."""
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
    """Headings without any text before the next heading of the same or a higher level."""
    written = text.splitlines()
    headings = [i for i, line in enumerate(lines) if level(line)]
    faults = []
    for heading, following in zip(headings, [*headings[1:], len(lines)]):
        goes_deeper = following < len(lines) and level(lines[following]) > level(lines[heading])
        if not goes_deeper and not any(line.strip() for line in written[heading + 1:following]):
            faults.append(f"{heading + 1}: nothing below: {written[heading]}")
    return faults


def unfinished(text: str) -> list[str]:
    """The defects of a document as "LINE: reason"."""
    lines = prose(text)
    return words_to_replace(lines) + empty_sections(text, lines)


def documents() -> list[Path]:
    found = []
    for folder, folders, files in os.walk(ROOT):
        folders[:] = [f for f in folders if f not in NOT_OURS]
        found += [Path(folder) / f for f in files if f.endswith(".md")]
    return sorted(found)


# ---- links ----

LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
ELSEWHERE = re.compile(r"[a-z]+:", re.IGNORECASE)  # https: and other schemes


def anchors(text: str) -> set[str]:
    """The anchors that GitHub gives to headings."""
    found: set[str] = set()
    outside = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    for heading in re.findall(r"^#+ +(.*?) *$", outside, re.MULTILINE):
        name = re.sub(r"[^\w\- ]", "", LINK.sub(lambda m: m[0][1:m[0].index("]")], heading))
        name = name.lower().replace(" ", "-")
        again = [n for n in [name, *(f"{name}-{i}" for i in range(1, 100))] if n not in found]
        found.add(again[0])
    return found


def broken_links(document: Path, text: str) -> list[str]:
    """"LINE: link" for each broken link."""
    faults = []
    for number, line in enumerate(prose(text), 1):
        for link in LINK.findall(line):
            if ELSEWHERE.match(link):
                continue
            path, _, anchor = link.partition("#")
            target = document.parent / path if path else document
            if not target.exists():
                faults.append(f"{number}: there is no {link}")
            elif anchor and anchor not in anchors(
                    text if target == document else target.read_text(encoding="utf-8")):
                faults.append(f"{number}: there is no such heading: {link}")
    return faults


PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)\s]+)\)")


def shown_pictures(document: Path, text: str) -> dict[Path, str]:
    """The pictures of the sources that a document shows, with their alternative texts."""
    found = PICTURE.findall("\n".join(prose(text)))
    return {(document.parent / path).resolve(): alt for alt, path in found if not ELSEWHERE.match(path)}


def listed_pages(index: str) -> list[str]:
    """The pages of the same folder that an index links to with a description."""
    return re.findall(r"^\d+\. \[[^\]]+\]\(([\w-]+\.md)\): \S+ .*\w", index, re.MULTILINE)


class LinksTest(unittest.TestCase):
    def test_anchors(self) -> None:
        text = "# A `b_c`: d-e, f!\n\n## Two\n\n## Two\n\n```\n# none\n```\n\n## [x](y.md) z\n"
        self.assertEqual(anchors(text), {"a-b_c-d-e-f", "two", "two-1", "x-z"})

    def test_broken_links_are_found(self) -> None:
        page = ROOT / "docs" / "economy.md"
        good = "# A b\n\n[1](https://x.org/y#z) [2](accuracy.md) [3](#a-b) [4](../README.md#how-true)\n"
        self.assertEqual(broken_links(page, good), [])
        for link in ("none.md", "#a", "accuracy.md#none", "../README.md#How-true", "pictures/none.png"):
            with self.subTest(link):
                self.assertEqual(len(broken_links(page, f"# A b\n\n![x]({link})\n")), 1)
        self.assertEqual(broken_links(page, "    [code](none.md)\n\n`[x](none.md)`\n"), [])

    def test_links_lead_somewhere(self) -> None:
        for document in documents():
            with self.subTest(document.relative_to(ROOT)):
                self.assertEqual(broken_links(document, document.read_text(encoding="utf-8")), [])

    def test_pictures_are_found(self) -> None:
        text = "![a b](pictures/c.png) [d](e.png) `![f](g.png)`\n\n![](h.svg) ![x](https://y.org/z.png)\n"
        self.assertEqual(shown_pictures(Path("/docs/page.md"), text),
                         {Path("/docs/pictures/c.png"): "a b", Path("/docs/h.svg"): ""})

    def test_all_pictures_are_shown_and_described(self) -> None:
        shown: dict[Path, str] = {}
        for document in documents():
            shown |= shown_pictures(document, document.read_text(encoding="utf-8"))
        pictures = [path for path in (ROOT / "docs" / "pictures").rglob("*") if path.is_file()]
        self.assertGreater(len(pictures), 10)
        self.assertEqual([str(path) for path in pictures if path not in shown], [], "no page shows these")
        self.assertEqual([str(path) for path in shown if not path.is_file()], [], "these are shown but missing")
        brief = [str(path) for path in pictures if len(shown[path].split()) < 4]
        self.assertEqual(brief, [], "these lack a description")

    def test_all_pages_are_listed_once(self) -> None:
        folder = ROOT / "docs"
        listed = listed_pages((folder / "README.md").read_text(encoding="utf-8"))
        pages = [page.name for page in folder.glob("*.md") if page.name != "README.md"]
        self.assertEqual(sorted(listed), sorted(pages))
        self.assertEqual(listed[0], "tutorial.md")


# ---- the glossary ----

def plain(text: str) -> str:
    """Normalizes a term, so that HitList, hit_list and hit list are equal."""
    return re.sub(r"[\s_]+", "", text).lower()


def glossary_terms(text: str) -> list[str]:
    section = text.partition("\n## Glossary\n")[2].partition("\n## ")[0]
    cells = [cell for cell in re.findall(r"^\| ([^|]+?) \|", section, re.MULTILINE) if cell != "term"]
    return [re.sub(r" \(.*\)", "", term) for cell in cells for term in cell.split(", ")]


class GlossaryTest(unittest.TestCase):
    def test_terms_are_found(self) -> None:
        text = ("# A\n\n## Glossary\n\n| term | meaning |\n|---|---|\n| a b, c (of d) | e |\n\n"
                "## F\n\n| g | h |\n")
        self.assertEqual(glossary_terms(text), ["a b", "c"])
        self.assertEqual(plain("HitList hit_list"), plain("hit list") * 2)

    def test_sources_use_the_terms(self) -> None:
        terms = glossary_terms((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"))
        self.assertGreater(len(terms), 40)
        self.assertEqual(len(terms), len(set(terms)))
        files = [file for folder in ("libstage", "libstage_cl", "kernels")
                 for file in (ROOT / folder).rglob("*.*") if file.suffix in (".hh", ".cc", ".h", ".cl")]
        sources = plain("\n".join(file.read_text(encoding="utf-8") for file in files))
        self.assertEqual([term for term in terms if plain(term) not in sources], [])


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
