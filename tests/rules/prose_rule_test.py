#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Comments and docstrings are plain sentences: none starts like a fragment, is too long, repeats a word or
breaks off."""

from __future__ import annotations

import ast
import io
import re
import tokenize
import unittest
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ["libstage", "libstage_cl", "kernels", "tools", "python", "ros2", "examples", "cmake", "worlds", "benchmarks",
           "tests"]
C_LIKE = {".cc", ".hh", ".h", ".cl", ".c", ".js"}
HASH_LIKE = {".cmake", ".sh", ".world", ".inc"}

# A comment names its subject. It must not start with a word that only refers to something.
FRAGMENT = re.compile(r"(?:Of|Those|That which|Who|Whoever|Whose|What|Whatever|Which|The same|As|So many|So much|Such|"
                      r"Nothing|None)\b(?! .*\?$)")
MOST_WORDS = 45
# Two equal words in a row, apart from pairs that are good English.
REPEATED = re.compile(r"(?<![\w*-])([A-Za-z]+) \1(?![\w:])")
GOOD_PAIRS = {"that", "had"}
UNFINISHED = re.compile(r"(?:[,;(]|\b(?:and|or|the))$")

COLUMNS = re.compile(r"\S {2,}\S")
ENDED = re.compile(r"[.:?!)\]}>|`\"']$")
ITEM = re.compile(r"(?:[*-]|\d+[.)]) +")
C_TOKEN = re.compile(r'R"([^()\s\\]{0,16})\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![\w])\'(?:\\.|[^\'\\\n])*\'|`[^`]*`|'
                     r"//[^\n]*|/\*.*?\*/", re.DOTALL)
# Lines for tools, drawings and code within comments.
DIRECTIVE = re.compile(r"SPDX-|SBATCH |shellcheck |NOLINT|clang-format|cmake-format|noqa|type: |pylint|!|-\*-|eslint|ruff|mypy")


@dataclass
class Paragraph:
    """Prose in consecutive lines of a comment."""

    line: int
    text: str
    introduces: bool = False  # a list, an example or a table follows
    item: bool = False  # of a list
    trailing: bool = False  # stands behind code

    def sentences(self) -> list[str]:
        return [part for part in re.split(r"(?<=[.!?])[)\"']?\s+(?=[\"'(]?[A-Z`])", self.text) if part]


@dataclass
class Line:
    number: int
    column: int  # of the comment; -1 in docstrings
    text: str
    trailing: bool = False  # stands behind code


def comment_lines(path: Path) -> Iterator[Line]:
    """Each line of each comment or docstring, without the comment marker."""
    text = path.read_text(encoding="utf-8", errors="replace")
    if path.suffix == ".py" or re.match(r"#!.*python", text):
        return python_lines(text)
    if path.suffix in C_LIKE or path.name.endswith((".hh.in", ".cc.in", ".h.in")):
        return c_lines(text)
    return hash_lines(text)


def hash_lines(text: str) -> Iterator[Line]:
    for number, line in enumerate(text.splitlines(), 1):
        if found := re.search(r"(?:^|(?<=\s))#(?!!)(.*)$", line):
            yield Line(number, found.start(), found.group(1), bool(line[:found.start()].strip()))


def c_lines(text: str) -> Iterator[Line]:
    number, counted = 1, 0
    for found in C_TOKEN.finditer(text):
        token = found.group()
        number += text.count("\n", counted, found.start())
        counted = found.start()
        line_start = text.rfind("\n", 0, found.start()) + 1
        column = found.start() - line_start
        trailing = bool(text[line_start:found.start()].strip())
        if token.startswith("//"):
            yield Line(number, column, re.sub(r"^//[/!]?<?", "", token), trailing)
        elif token.startswith("/*"):
            for offset, line in enumerate(token[2:-2].split("\n")):
                yield Line(number + offset, column, re.sub(r"^\s*\*+(?= |$)|^[*!]", "", line), trailing and not offset)


def python_lines(text: str) -> Iterator[Line]:
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT and not token.string.startswith("#!"):
            trailing = bool(token.line[:token.start[1]].strip())
            yield Line(token.start[0], token.start[1], token.string[1:].removeprefix(":"), trailing)
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            if docstring := ast.get_docstring(node, clean=False):
                first = node.body[0]
                for number, line in enumerate(docstring.split("\n") + [""], first.lineno):
                    yield Line(number, -1, " " + (line if number == first.lineno else line[first.col_offset:]))


def paragraphs(lines: Iterable[Line]) -> list[Paragraph]:
    """The paragraphs of prose. Examples, tables and drawings are left out: they are indented or have columns."""
    result: list[Paragraph] = []
    last: Line | None = None  # the previous line of prose
    for line in lines:
        text = line.text.strip()
        adjacent = last is not None and line.column == last.column and not line.trailing
        continues = adjacent and line.number == last.number + 1
        if not text or DIRECTIVE.match(text) or not (continues or re.search(r"[A-Za-z]{2}", text)):
            continue
        indent = len(line.text) - len(line.text.lstrip())
        item = ITEM.match(text)
        if adjacent and line.number <= last.number + 2 and (item or indent >= 3 or COLUMNS.search(text)):
            result[-1].introduces = True
        if item:
            result.append(Paragraph(line.number, text[item.end():], item=True))
        elif continues and not COLUMNS.search(text) and (indent < 3 or result[-1].item):
            result[-1].text += " " + text
        elif COLUMNS.search(text) or (indent >= 3 and not line.trailing):
            continue
        else:
            result.append(Paragraph(line.number, text, trailing=line.trailing))
        last = line
    return result


def faults(paragraph: Paragraph) -> Iterator[str]:
    """Describes each violation in a paragraph."""
    text, sentences = paragraph.text, paragraph.sentences()
    if FRAGMENT.match(text):
        yield f"starts like a fragment: {text}"
    for sentence in sentences:
        if len(sentence.split()) > MOST_WORDS:
            yield f"longer than {MOST_WORDS} words: {sentence}"
    for found in REPEATED.finditer(re.sub("`[^`]*`", "", text)):
        if found.group(1) not in GOOD_PAIRS:
            yield f"repeats a word: {found.group()}"
    if paragraph.introduces or paragraph.item:
        return
    prose = not paragraph.trailing and re.match(r"[A-Z]\S* ", text)
    if (prose or len(sentences) > 1) and not ENDED.search(text):
        yield f"has no full stop: {text}"
    elif UNFINISHED.search(text):
        yield f"breaks off: {text}"


def sources() -> Iterator[Path]:
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.is_file() and is_source(path):
                yield path


def is_source(path: Path) -> bool:
    if path.suffix in C_LIKE | HASH_LIKE | {".py", ".in"} or path.name == "CMakeLists.txt":
        return True
    if path.suffix:
        return False
    with path.open("rb") as file:
        return file.read(2) == b"#!"


def faults_of_text(text: str, suffix: str = ".cc") -> list[str]:
    """The faults of a source, each without the quoted comment."""
    lines = python_lines(text) if suffix == ".py" else hash_lines(text) if suffix == ".cmake" else c_lines(text)
    return [fault.split(":")[0] for paragraph in paragraphs(lines) for fault in faults(paragraph)]


class ProseRuleTest(unittest.TestCase):
    def test_comments_are_plain_sentences(self) -> None:
        found = [f"{path.relative_to(ROOT)}:{paragraph.line}: {fault}"
                 for path in sources() for paragraph in paragraphs(comment_lines(path)) for fault in faults(paragraph)]
        self.assertFalse(found, "\n".join(found))

    def test_many_sources_are_read(self) -> None:
        read = list(sources())
        self.assertGreater(len(read), 1000)
        for name in ("tools/setup", "tools/populate", "libstage/include/stage.hh", "kernels/prefilter.cl",
                     "python/src/bind_world.cc", "python/stagesim/live/page/main.js", "cmake/embed.cmake"):
            self.assertTrue(ROOT / name in read, name)
            self.assertGreater(len(paragraphs(comment_lines(ROOT / name))), 0, name)

    def test_faults_are_found(self) -> None:
        long_sentence = "It " + " ".join(f"very{i}" for i in range(45)) + " much is."
        for comment, fault in (("Of the rays.", "starts like a fragment"), ("Those that hit.", "starts like a fragment"),
                               ("The same for all.", "starts like a fragment"), (long_sentence, "longer than 45 words"),
                               ("Finds the the ray.", "repeats a word"), ("Finds rays", "has no full stop"),
                               ("one ray; two of them. Three", "has no full stop"), ("rays and", "breaks off")):
            for text in (f"// {comment}\n", f"int i;  // x\n\n/// {comment}\nint j;\n", f"/* {comment} */\n",
                         f"f(); /*\n * {comment}\n */\n"):
                self.assertEqual(faults_of_text(text), [fault], text)
            for text in (f"# {comment}\n", f'"""{comment}"""\n', f'def f():\n    """Does it.\n\n    {comment}\n    """\n'):
                self.assertEqual(faults_of_text(text, ".py"), [fault], text)
            self.assertEqual(faults_of_text(f"set(x y)\n# {comment}\n", ".cmake"), [fault])

    def test_a_sentence_may_cross_lines(self) -> None:
        self.assertEqual(faults_of_text("// Finds\n// the\n// the ray\n"), ["repeats a word", "has no full stop"])
        self.assertEqual(faults_of_text("int i;  // a ray and\n        // a fan\n"), [])

    def test_good_comments_pass(self) -> None:
        for comment in ("Number of rays.", "number of rays", "Usage:\n//\n//   Of the rays", "Does:\n// - one thing;\n// - as is",
                        "Which ray is it?", "Returns `long long`, see *to to.", "A table:\n//   ray   The same the the"):
            self.assertEqual(faults_of_text(f"// {comment}\n"), [], comment)

    def test_strings_are_no_comments(self) -> None:
        self.assertEqual(faults_of_text('const char* a = "// Of rays"; const char* b = R"(// Of rays\n// the the)";\n'), [])
        self.assertEqual(faults_of_text('text = "# Of rays"\n', ".py"), [])


if __name__ == "__main__":
    unittest.main()
