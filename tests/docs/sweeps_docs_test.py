#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The commands at the top of docs/sweeps.md give the output on the page. Of the 80 runs, only those in that output
are done; tests/sweep/test_docs.py runs the page's Python."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from patience import PATIENCE  # noqa: E402

SOURCE_DIR = Path(os.environ["STAGE_SOURCE_DIR"]).resolve()
BINARY_DIR = Path(os.environ["STAGE_BINARY_DIR"]).resolve()
PAGE = (SOURCE_DIR / "docs" / "sweeps.md").read_text(encoding="utf-8")
SHOWN_RUNS = ("0:1", "17:18")


def shown() -> dict[str, str]:
    """The output of each command on the page."""
    text = "".join(re.findall(r"^```console\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL))
    return {command: output for command, output in re.findall(r"^\$ (.*)\n((?:[^$].*\n)*)", text, re.MULTILINE)}


class SweepsDocsTest(unittest.TestCase):
    def run_command(self, folder: Path, command: str) -> str:
        done = subprocess.run(["bash", "-c", command], cwd=folder, text=True, check=False, timeout=PATIENCE,
                              env={**os.environ, "PATH": f"{BINARY_DIR}/bin:{os.environ['PATH']}"},
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertEqual(done.returncode, 0, f"{command}\n{done.stdout}")
        return done.stdout

    def test_commands_print_what_the_page_shows(self) -> None:
        outputs = shown()
        sweep, merge, head, status, grep = outputs
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name).resolve()
            (folder / "worlds").symlink_to(SOURCE_DIR / "worlds")
            self.run_command(folder, f"{sweep} --plan-only")
            for shown_run in SHOWN_RUNS:
                self.run_command(folder, f"stage sweep --resume out --only {shown_run}")
            self.run_command(folder, f"{merge} --partial")
            self.assertEqual(self.run_command(folder, head), outputs[head])
            first_line = outputs[status].splitlines()[0]
            self.assertEqual(self.run_command(folder, status).splitlines()[0], first_line)
            runs = re.findall(r"^out: (\d+) runs", first_line)[0]
            self.assertRegex(outputs[sweep], rf"^{runs} of {runs} runs done in \d+ s\n$")
            record = self.run_command(folder, grep)
            self.assertEqual(re.sub(r"/\S*/worlds/", "/home/me/stage/worlds/", record), outputs[grep])
            # The replay command gives the state hash of the record.
            replay = shlex.split(re.findall(r'"replay":"(.*)"', record)[0])
            hashed = self.run_command(folder, shlex.join(replay)).split()[-1]
            self.assertIn(f'"state_hash":"{hashed}"', (folder / "out/runs/000/000017.json").read_text())


if __name__ == "__main__":
    unittest.main()
