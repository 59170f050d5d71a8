#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs the kernels under Oclgrind, which watches every access to memory.

Oclgrind is about a hundred times slower than a device, so the world is tiny.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
sys.path.insert(0, str(Path(__file__).resolve().parent))
import kernel_language_test as kernels  # noqa: E402
from build_tree import HAS_OPENCL  # noqa: E402
from patience import PATIENCE  # noqa: E402

BINARY_DIR = os.environ.get("STAGE_BINARY_DIR", ".")
STAGE = os.path.join(BINARY_DIR, "bin", "stage")
OCLGRIND = shutil.which("oclgrind")

# Moving robots, so that tiles change; two heights, a noisy sensor, a distant body, rays of one leg
# and of several.
WORLD = """
resolution 0.05
quit_time 0.6
define eye sensor( range [0 3] samples 9 fov 200 )
define robot position
(
  alwayson 1
  size [0.4 0.3 0.8]
  drive "omni"
  velocity_bounds [-9 9 -9 9 0 0 -900 900]
  ctrl "wander"
  ranger( alwayson 1 pose [0 0 -0.6 0] eye() eye( pose [0 0 0.3 180] range [0 0.0001] ) )
  ranger( alwayson 1 pose [0 0 -0.5 0] eye( samples 3 noise [0.001 0.1 20] ) )
)
model( size [6 6 1] noblocks 1 boundary 1 )
model( pose [1 1 0 30] size [1 0.4 0.3] ranger_return 0.5 )
model( pose [4000 -2500 0 0] size [1 1 1] )
robot( pose [0 0 0 0] )
robot( pose [-1 1 0 45] )
ranger( alwayson 1 pose [2.5 -2.5 0 135] eye( range [0 700] samples 2 fov 10 ) )
ranger( alwayson 1 pose [2.5 2.5 0 -135] eye( range [0 1000000000] samples 1 ) )
"""


def is_sanitized():
    """Oclgrind must be the first library that a program loads, and so must sanitizers."""
    cache = os.path.join(BINARY_DIR, "CMakeCache.txt")
    if not os.path.exists(cache):
        return False
    with open(cache, encoding="utf-8") as file:
        return re.search(r"^STAGE_SANITIZE:\w+=.", file.read(), re.MULTILINE) is not None


def why_not():
    """Says why Oclgrind cannot be used; empty if it can."""
    if not OCLGRIND:
        return "oclgrind is not installed"
    if not HAS_OPENCL:
        return "this build has no OpenCL"
    return "the program is built with sanitizers" if is_sanitized() else ""


class OclgrindTest(unittest.TestCase):
    def run_stage(self, before, options, hits):
        environment = dict(os.environ)
        if hits is not None:
            environment["STAGE_CL_HITS"] = str(hits)
        result = subprocess.run(
            before + [STAGE, "-g", self.world, "--state-hash"] + options,
            env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False)
        output = result.stdout + result.stderr
        self.assertEqual(result.returncode, 0, output)
        found = re.search(r"^state-hash [0-9a-f]{16}$", result.stdout, re.MULTILINE)
        self.assertTrue(found, output)
        return found.group(), output

    def setUp(self):
        if why_not():
            self.skipTest(why_not())
        self.directory = tempfile.TemporaryDirectory()
        self.addCleanup(self.directory.cleanup)
        self.world = os.path.join(self.directory.name, "tiny.world")
        with open(self.world, "w", encoding="utf-8") as file:
            file.write(WORLD)

    def check(self, hits, options=()):
        stats = os.path.join(self.directory.name, "stats.json")
        expected, _ = self.run_stage([], list(options), hits)
        log = os.path.join(self.directory.name, "oclgrind.log")
        found, output = self.run_stage(
            [OCLGRIND, "--data-races", "--uninitialized", "--check-api", "--log", log],
            ["--opencl", "--opencl-always", "--stats", stats, *options], hits)
        self.assertEqual(found, expected)
        # Oclgrind prints nothing if there is no error.
        report = ""
        if os.path.exists(log):
            with open(log, encoding="utf-8") as file:
                report = file.read()
        self.assertEqual(report.strip(), "")
        self.assertNotIn("warning", output)
        with open(stats, encoding="utf-8") as file:
            text = file.read()
        self.assertIn("Oclgrind", text)
        ranges = json.loads(text)["ranges_from_device"]
        self.assertEqual(ranges > 0, hits is None)

    def test_one_hit_for_each_ray(self):
        self.check(1)

    def test_four_hits_for_each_ray(self):
        self.check(4)

    def test_ranges(self):
        """The device finds ranges where all bodies have one ranger_return."""
        with open(self.world, "w", encoding="utf-8") as file:
            file.write(WORLD.replace(" ranger_return 0.5", ""))
        for model in ("cell", "exact"):
            with self.subTest(model=model):
                self.check(None, ["--ray-model", model])


class RowRacesTest(unittest.TestCase):
    """Steps of rows, by a program that calls the kernels itself. The worlds are such that none of them takes its turn
    in the memory that worlds share: Oclgrind does not know the lock of it."""

    def setUp(self):
        if why_not():
            self.skipTest(why_not())
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.directory = Path(directory.name)

    def report_of(self, rows, contacts, seed, items):
        """Returns what Oclgrind found in steps by these kernels, which must have the bits of the host."""
        islands = kernels.read_kernels(kernels.ISLANDS)
        texts = {"rows.cl": rows, "small.cl": islands, "large.cl": "#define ROW_SOLVES_LARGE\n" + islands}
        for name, text in texts.items():
            (self.directory / name).write_text(text, encoding="utf-8")
        log = self.directory / "oclgrind.log"
        log.unlink(missing_ok=True)
        result = subprocess.run(
            [OCLGRIND, "--data-races", "--check-api", "--log", log, os.path.join(BINARY_DIR, "tests", "row_races"),
             *(self.directory / name for name in texts), contacts, str(seed), str(items)],
            capture_output=True, text=True, timeout=PATIENCE, check=False)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return log.read_text(encoding="utf-8").strip() if log.exists() else ""

    def test_steps_have_no_races(self):
        for case in (("cells", 3, 8), ("cells", 4, 5), ("cells", 5, 1), ("outlines", 1, 8), ("outlines", 3, 4),
                     ("outlines", 5, 8), ("outlines", 7, 3)):
            with self.subTest(case=case):
                self.assertEqual(self.report_of(kernels.read_kernels(kernels.ROWS), *case), "")

    def test_a_missing_barrier_is_found(self):
        rows = kernels.read_kernels(kernels.ROWS)
        broken = rows.replace("row_set_target(w, i);\n  ROW_BARRIER();", "row_set_target(w, i);")
        self.assertNotEqual(broken, rows)
        self.assertIn("data race", self.report_of(broken, "outlines", 3, 8))


if __name__ == "__main__":
    unittest.main()
