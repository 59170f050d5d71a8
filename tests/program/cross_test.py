#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests how the tools for other processors and OpenCL drivers report mistakes and find their files.

Whole cross builds take minutes and fetch libraries: CONTRIBUTING.md has the commands.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ARCHITECTURES = ("arm64", "armhf", "i386")


def run(*command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)


def in_bash(text: str, path: str = os.environ["PATH"]) -> str:
    done = subprocess.run(["bash", "-euc", f"source tools/common.sh; {text}"], capture_output=True, text=True,
                          check=True, cwd=ROOT, env=os.environ | {"PATH": path})
    return done.stdout.strip()


class MistakesTest(unittest.TestCase):
    def expect_refused(self, expected: str, *command: str) -> None:
        done = run(*command)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(done.stdout, "")
        self.assertIn(expected, done.stderr)

    def test_other_processors(self) -> None:
        self.expect_refused("found vax, expected arm64, armhf or i386", "tools/dev/cross", "vax")
        self.expect_refused("Usage: tools/dev/cross", "tools/dev/cross")
        self.expect_refused("found --arch vax, expected arm64", "tools/test", "--arch", "vax")
        self.expect_refused("unknown option --cross=vax", "tools/setup", "--cross=vax")

    def test_other_opencl_drivers(self) -> None:
        self.expect_refused("found vax, expected one of pocl", "tools/dev/opencl_matrix", "vax")
        self.expect_refused("no world's file name contains nowhere", "tools/dev/opencl_matrix", "--program", "/bin/true",
                            "--worlds", "nowhere")
        self.expect_refused("no program /nowhere", "tools/dev/opencl_matrix", "--program", "/nowhere")


class PresetsTest(unittest.TestCase):
    def test_each_processor_has_its_presets_and_toolchain(self) -> None:
        presets = json.loads((ROOT / "CMakePresets.json").read_text(encoding="utf-8"))
        for kind in ("configurePresets", "buildPresets", "testPresets"):
            names = {preset["name"] for preset in presets[kind]}
            self.assertLessEqual(set(ARCHITECTURES), names, kind)
        for name in ARCHITECTURES:
            text = (ROOT / "cmake" / "toolchains" / f"{name}.cmake").read_text(encoding="utf-8")
            self.assertIn(f"set(stage_architecture {name})", text)


class JobsTest(unittest.TestCase):
    """There are at most as many compilers as processors, and as many as fit into memory."""

    def jobs(self, processors: int) -> int:
        with tempfile.TemporaryDirectory() as folder:
            nproc = Path(folder) / "nproc"
            nproc.write_text(f"#!/bin/sh\necho {processors}\n", encoding="utf-8")
            nproc.chmod(0o755)
            return int(in_bash("stage_jobs", f"{folder}:{os.environ['PATH']}"))

    def test_processors_or_memory(self) -> None:
        self.assertEqual(self.jobs(1), 1)
        available = next(int(line.split()[1]) for line in Path("/proc/meminfo").read_text().splitlines()
                         if line.startswith("MemAvailable"))
        most = available / 620000
        self.assertLess(self.jobs(1000000), 1.3 * most + 1)
        self.assertGreaterEqual(self.jobs(1000000), 1)


if __name__ == "__main__":
    unittest.main()
