#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests tools/setup on a system that lacks packages, with replacements for apt-get and root, and the messages of
tools/dev/fresh."""

import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR", Path(__file__).resolve().parents[2]))

# No package is installed, and apt has package lists that lack the packages in $UNKNOWN.
SCRIPT = r"""
source "$1/tools/setup"
root=$FOLDER venv=$FOLDER/build/venv
is_there() { false; }
compgen() { true; }
as_root() { "$@"; }
env() { shift && "$@"; }
apt-get() {
  if [[ " $* " == *" update "* ]]; then
    [[ -z $LISTS ]] || printf '%s\n' "$LISTS"
    [[ -z $NO_UPDATE ]] && return
    return 1
  fi
  [[ " $* " != *" install "* ]] && return
  [[ " $* " != *" --simulate "* && -n $NO_ROOT ]] && return 1
  local argument unknown
  for argument; do
    for unknown in $UNKNOWN; do
      if [[ $argument == "$unknown" ]]; then echo "E: Unable to locate package $unknown" >&2; return 100; fi
    done
  done
  [[ " $* " == *" --simulate "* ]] || echo "INSTALLED $*"
}
main "${@:2}"
"""


def setup(*options, unknown="", update=True, root=True, lists=""):
    """Runs tools/setup. `lists` is the output of apt-get update; `done.log` is the resulting content of its log."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "UNKNOWN": unknown, "NO_UPDATE": "" if update else "yes", "LISTS": lists,
                       "NO_ROOT": "" if root else "yes", "FOLDER": folder}
        done = subprocess.run(["bash", "-c", SCRIPT, "setup", ROOT, *options], capture_output=True,
                              text=True, check=False, env=environment)
        done.log = (Path(folder) / "build" / "setup.log").read_text(encoding="utf-8")
    return done


def installed(done):
    """The packages that apt-get was asked to install."""
    words = [line.split()[2:] for line in done.log.splitlines() if line.startswith("INSTALLED")]
    return [word for line in words for word in line if not word.startswith("-") and "::" not in word]


@unittest.skipUnless(shutil.which("bash"), "bash is not installed")
class Setup(unittest.TestCase):
    def test_all_is_known(self):
        done = setup("--tests")
        self.assertEqual(done.returncode, 0, done.stderr)
        for package in ("g++", "opencl-headers", "libfltk1.3-dev", "xvfb", "oclgrind"):
            self.assertIn(package, installed(done))
        self.assertEqual(done.stderr, "")

    def test_output_is_short_and_says_what_each_package_is_for(self):
        done = setup("--tests", "--format")
        lines = done.stdout.splitlines()
        self.assertTrue(12 < len(lines) < 30, done.stdout)
        self.assertRegex(lines[0], r"^tools/setup: \d+ packages of this system are missing; apt installs them"
                                   r" \(see .*/build/setup\.log\):$")
        self.assertIn("  build: cmake ninja-build", lines)
        self.assertRegex(lines[-1], r"^tools/setup: installed in \d+ s$")
        for package in installed(done):
            self.assertEqual(sum(package in line.split() for line in lines), 1, package)
        self.assertNotIn("INSTALLED", done.stdout)  # output of apt

    def test_the_optional_is_left_out_and_the_rest_is_installed(self):
        done = setup("--tests", unknown="oclgrind")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("oclgrind", installed(done))
        self.assertIn("libgtest-dev", installed(done))
        self.assertIn("tools/setup: no package oclgrind here (tests of the kernels): they are"
                      " skipped\n", done.stdout)
        self.assertEqual(done.stderr, "")

    def test_what_is_needed_is_asked_for_in_one_line(self):
        done = setup("--tests", unknown="libpng-dev oclgrind")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(done.stderr, "tools/setup: no package libpng-dev here (bitmaps of worlds):"
                                      " please install it by hand\n")
        self.assertIn("g++", installed(done))

    def test_without_root_the_advice_names_no_unknown_package(self):
        done = setup("--tests", unknown="oclgrind", update=False, root=False)
        self.assertEqual(done.returncode, 1)
        self.assertEqual(installed(done), [])
        self.assertEqual(len(done.stderr.splitlines()), 1)
        self.assertIn("as root: apt-get install g++", done.stderr)
        self.assertNotIn("oclgrind", done.stderr)

    def test_lists_that_cannot_be_fetched_are_not_in_the_way(self):
        done = setup("--tests", update=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("g++", installed(done))

    def test_a_package_that_two_groups_want_is_named_once(self):
        script = 'source "$0/tools/setup"; is_there() { false; }; find_missing tests python; echo "${missing[*]}"'
        done = subprocess.run(["bash", "-c", script, ROOT], capture_output=True, text=True, check=True)
        packages = done.stdout.split()
        self.assertIn("python3", packages)
        self.assertEqual(len(packages), len(set(packages)))

    def test_some_lists_are_enough(self):
        done = setup("--tests", lists="Hit:1 http://a.example x InRelease\nErr:2 http://b.example x InRelease\n  Gone")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("g++", installed(done))

    def test_without_a_network_nothing_else_is_tried(self):
        done = setup("--tests", "--live", "--ros", "--sweep",
                     lists="Err:1 http://a.example x InRelease\n  Could not resolve 'a.example'\n"
                           "W: Some index files failed to download.")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(installed(done), [])
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertRegex(done.stderr, r"^tools/setup: no package server can be reached \(Could not resolve 'a\.example'\):"
                                      r" connect to the network and try again, or as root: apt-get install g\+\+ ")
        self.assertNotIn("PyPI", done.stdout + done.log)

    def test_groups(self):
        done = setup("--no-opencl", "--no-gui")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(installed(done), ["g++", "cmake", "ninja-build", "libpng-dev",
                                           "libjpeg-dev", "libgif-dev", "nlohmann-json3-dev", "liblz4-dev", "libzstd-dev"])


class Fresh(unittest.TestCase):
    def fresh(self, *arguments):
        return subprocess.run([ROOT / "tools/dev/fresh", *arguments], capture_output=True, text=True,
                              check=False)

    def test_it_runs_what_the_readme_says(self):
        lines = (ROOT / "README.md").read_text(encoding="utf-8").split("## Two commands")[1]
        commands = [line.split("#")[0].strip() for line in lines.splitlines()
                    if line.startswith("    ")][:2]
        self.assertEqual(commands[1], "tools/test")
        script = (ROOT / "tools/dev/fresh").read_text(encoding="utf-8")
        for command in commands:
            self.assertIn(f"\n  try {command}", script)
            self.assertIn(f"\n  {command}", self.fresh("--help").stdout)

    def test_mistakes_are_one_line(self):
        for arguments in ([], ["--tree"], ["--no-such"], ["../etc"], ["nosuchsuite"]):
            done = self.fresh(*arguments)
            self.assertIn(done.returncode, (1, 2), arguments)  # 1: not root or no debootstrap
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
            self.assertEqual(done.stdout, "")
            self.assertFalse((ROOT / "build/fresh/nosuchsuite").exists())


if __name__ == "__main__":
    unittest.main()
