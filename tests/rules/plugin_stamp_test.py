#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The stamp of plug-ins (libstage/include/world/plugin_stamp.hh) is up to date.

The stamp consists of the version of Stage and a checksum of the code of all headers that <stage.hh> includes. Comments
and white space do not count. STAGE_NEW_STAMP=1 updates it.
"""

from __future__ import annotations

import hashlib
import os
import re
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2])
# The folders in which cmake/install_headers.cmake finds headers.
INCLUDE_ROOTS = [ROOT / folder for folder in ("libstage/include", "libstage", ".", "libstage/gui")]
STAMP_FILE = ROOT / "libstage/include/world/plugin_stamp.hh"
STAMP = re.compile(r'(#define STAGE_PLUGIN_STAMP )"([^"]*)"')
# A string or character literal, which is kept, or a comment.
TOKEN = re.compile(r'"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)*\'|//[^\n]*|/\*.*?\*/', re.DOTALL)
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)


def code_of(text: str) -> str:
    """The text without comments, and with single spaces."""
    return " ".join(TOKEN.sub(lambda found: " " if found[0][0] == "/" else found[0], text).split())


def public_headers() -> dict[str, str]:
    """The texts of stage.hh and all its includes, by the names in the include lines."""
    headers: dict[str, str] = {}
    waiting = ["stage.hh"]
    while waiting:
        name = waiting.pop()
        if name not in headers:
            path = next(folder / name for folder in INCLUDE_ROOTS if (folder / name).exists())
            headers[name] = path.read_text(encoding="utf-8")
            waiting += INCLUDE.findall(headers[name])
    return headers


def stamp_of(version: str, headers: dict[str, str]) -> str:
    """Computes version and checksum; the stamp itself does not count."""
    digest = hashlib.sha256()
    for name in sorted(headers):
        code = code_of(STAMP.sub(r"\1", headers[name]))
        digest.update(f"{name}\n{code}\n".encode())
    return f"{version} {digest.hexdigest()[:16]}"


class PluginStampTest(unittest.TestCase):
    def setUp(self) -> None:
        self.headers = public_headers()
        found = re.search(r"^project\(\w+ VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"),
                          re.MULTILINE)
        assert found is not None
        self.version = found[1]

    def test_the_stamp_fits_the_headers(self) -> None:
        expected, text = stamp_of(self.version, self.headers), STAMP_FILE.read_text(encoding="utf-8")
        if os.environ.get("STAGE_NEW_STAMP"):
            STAMP_FILE.write_text(STAMP.sub(rf'\1"{expected}"', text), encoding="utf-8")
            return
        found = STAMP.search(text)
        assert found is not None
        self.assertEqual(found[2], expected, f"{STAMP_FILE.name}: public headers have changed since the stamp was "
                         "written; STAGE_NEW_STAMP=1 tools/test -R plugin_stamp writes it anew")
        self.assertLess(len(found[2]), 32, "PluginNote has no room for it")

    def test_what_changes_the_stamp(self) -> None:
        """The stamp changes with the code of any public header and with the version, but not with comments, white
        space or the stamp itself."""
        stamp = stamp_of(self.version, self.headers)
        self.assertGreater(len(self.headers), 40)
        self.assertIn("models/model.hh", self.headers)
        for name, text in self.headers.items():
            changed = {**self.headers, name: text + "\nextern int another;\n"}
            self.assertNotEqual(stamp_of(self.version, changed), stamp, name)
            commented = {**self.headers, name: text.replace("\n", "  // a remark\n", 1) + "\n/* another\n one */\n"}
            self.assertEqual(stamp_of(self.version, commented), stamp, name)
        self.assertNotEqual(stamp_of("9.9.9", self.headers), stamp)
        self.assertEqual(code_of('a  "//b" /* c */ d // e\n'), 'a "//b" d')
        other = self.headers["world/plugin_stamp.hh"]
        again = {**self.headers, "world/plugin_stamp.hh": STAMP.sub(r'\1"1.0.0 00"', other)}
        self.assertEqual(stamp_of(self.version, again), stamp)


if __name__ == "__main__":
    unittest.main()
