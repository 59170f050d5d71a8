#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests tools/run and tools/test where building is impossible: an old CMake, a tree that is not writable, a tree
that was copied with its build, no network. Each must end immediately, with one line that says what to do."""

from __future__ import annotations

import os
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import time
import unittest
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from patience import PATIENCE, slowness  # noqa: E402

ROOT = Path(os.environ.get("STAGE_SOURCE_DIR", Path(__file__).resolve().parents[2]))
COMMANDS = (["tools/run", "worlds/w.world"], ["tools/run", "worlds/w.world", "--opencl"], ["tools/test"],
            ["tools/test", "--preset", "debug"])
NOBODY = 65534
# Root bypasses permissions, so run as another user then.
AS_NOBODY = [] if os.geteuid() else ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups"]


class Tree:
    """The tools in a separate tree where nothing is missing, with a PATH that contains replacements for some
    commands."""

    def __init__(self, folder: Path, *without: str) -> None:
        self.root = folder / "stage"
        self.commands = folder / "commands"
        self.commands.mkdir()
        for place in reversed(os.environ["PATH"].split(":")):
            for path in Path(place).iterdir() if Path(place).is_dir() else []:
                link = self.commands / path.name
                if path.name not in without:
                    link.unlink(missing_ok=True)
                    link.symlink_to(path.resolve())  # others may not look into the folder of a link
        (self.root / "tools").mkdir(parents=True)
        for name in ("run", "test", "setup", "common.sh", "debian_tree.sh"):
            shutil.copy2(ROOT / "tools" / name, self.root / "tools" / name)
        self.set_packages()
        shutil.copy2(ROOT / "CMakePresets.json", self.root)

    def set_packages(self, *rows: str) -> None:
        """Replaces the table of tools/setup, and removes its lists for PyPI."""
        file = self.root / "tools" / "setup"
        text = (ROOT / "tools" / "setup").read_text(encoding="utf-8")
        text, count = re.subn(r"(?ms)^(readonly packages=')\n.*?^'$", "\\1\n" + "".join(f"{row}\n" for row in rows) + "'",
                              text)
        assert count == 1
        file.write_text(text.replace("python=yes", "python=no").replace("live=yes", "live=no")
                        .replace("ros=yes", "ros=no").replace("sweep=yes", "sweep=no"), encoding="utf-8")

    def set_command(self, name: str, script: str) -> None:
        path = self.commands / name
        path.unlink(missing_ok=True)
        path.write_text(f"#!/bin/bash\n{script}\n", encoding="utf-8")
        path.chmod(0o755)

    def build(self) -> Path:
        """Makes a build like that of tools/run."""
        folder = self.root / "build" / "release"
        (folder / "bin").mkdir(parents=True)
        (self.root / "build" / ".lock").touch()
        (folder / "CMakeCache.txt").write_text(f"CMAKE_HOME_DIRECTORY:INTERNAL={self.root}\n", encoding="utf-8")
        program = folder / "bin" / "stage"
        program.write_text("#!/bin/sh\n", encoding="utf-8")
        program.chmod(0o755)
        return folder

    def open_to_all(self) -> None:
        """Makes the tree readable and writable for everybody."""
        for path in [self.root.parent, self.root, *self.root.rglob("*")]:
            path.chmod(0o777 if path.is_dir() or path.stat().st_mode & stat.S_IXUSR else 0o666)

    def run(self, *words: str, before: list[str] | None = None) -> subprocess.CompletedProcess[str]:
        environment = {"PATH": str(self.commands), "HOME": str(self.root.parent), "TMPDIR": str(self.root.parent)}
        return subprocess.run([*(before or []), *words], cwd=self.root, env=environment, text=True, check=False,
                              capture_output=True, stdin=subprocess.DEVNULL, timeout=PATIENCE)


class SetupFailsTest(unittest.TestCase):
    def tree(self, *without: str) -> Tree:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        return Tree(Path(folder.name).resolve(), *without)

    def check(self, done: subprocess.CompletedProcess[str], expected: str) -> None:
        """Expects one line that says what was found and what to do, and a non-zero status."""
        self.assertNotEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertRegex(done.stderr, expected)

    def test_old_cmake(self) -> None:
        tree = self.tree()
        for version in ("2.8.12.2", "3.9.0", "3.16.3", "3.18.4", "3.21.7"):
            tree.set_command("cmake", f"echo cmake version {version}")
            for words in COMMANDS:
                with self.subTest(version=version, command=words):
                    self.check(tree.run(*words), rf"^tools/(run|test): found CMake {version} \(.*/cmake\), expected 3\.22 or"
                                                 r" later: install a newer one, .*\n$")

    def test_cmake_that_is_new_enough(self) -> None:
        tree = self.tree()
        for version in ("3.22.0", "3.22.1", "3.25.1", "3.31.6-rc2", "4.0.1", "10.1.0"):
            tree.set_command("cmake", f"[[ $1 == --version ]] && echo cmake version {version} || echo built >&2")
            with self.subTest(version=version):
                self.assertNotIn("expected", tree.run("tools/run", "w.world").stderr)

    def test_no_cmake(self) -> None:
        tree = self.tree("cmake")
        for words in COMMANDS:
            self.check(tree.run(*words), r"^tools/\w+: CMake is not installed: install CMake 3\.22 or later\n$")

    def test_tree_that_must_not_be_written(self) -> None:
        """Makes the tree, or one of the paths that a build writes first, read-only. Other places are ignored."""
        def nothing(tree: Tree) -> Path:
            return tree.root
        places: list[Callable[[Tree], Path]] = [
            nothing, lambda tree: tree.build().parent, lambda tree: tree.build(),
            lambda tree: tree.build().parent / ".lock", lambda tree: tree.build() / "CMakeCache.txt"]
        for number, place in enumerate(places):
            tree = self.tree()
            path = place(tree)
            tree.open_to_all()
            path.chmod(0o555 if path.is_dir() else 0o444)
            advice = "copy the tree, without build, to a folder of yours"
            if number > 0:
                advice += ", or use build/release/bin/stage as it is"
            for words in COMMANDS if path.name != "release" and path.name != "CMakeCache.txt" else COMMANDS[:3]:
                with self.subTest(path=path.name, command=words):
                    self.check(tree.run(*words, before=AS_NOBODY),
                               rf"^tools/\w+: can't write {path}, which belongs to \w+: {advice}\n$")

    @unittest.skipUnless(os.geteuid() == 0, "needs root, to mount the tree read-only")
    def test_medium_that_can_only_be_read(self) -> None:
        """Root may write to everything except a read-only file system."""
        tree = self.tree()
        script = 'mount --bind -o ro "$0" "$0" && cd "$0" && exec "$@"'
        before = ["unshare", "--mount", "bash", "-c", script, str(tree.root)]
        if tree.run("true", before=before).returncode != 0:
            self.skipTest("mounting is not allowed here")
        for words in COMMANDS:
            self.check(tree.run(*words, before=before), r"^tools/\w+: can't write /.*/stage, which belongs to \w+: copy ")

    def test_tree_that_was_copied_with_its_build(self) -> None:
        tree = self.tree()
        tree.build()
        copy = tree.root.with_name("copy")
        shutil.copytree(tree.root, copy)
        first, tree.root = tree.root, copy
        self.check(tree.run("tools/run", "w.world"), rf"^tools/run: build/release was made for the tree {first}, not for"
                                                     rf" this one: rm -r {copy}/build\n$")

    def without_network(self) -> Iterator[tuple[str, str]]:
        """Yields outputs of apt without network, and the reason that tools/setup must report."""
        yield ("Err:1 http://deb.debian.org/debian bookworm InRelease\n"
               "  Temporary failure resolving 'deb.debian.org'\nReading package lists...",
               "Temporary failure resolving 'deb.debian.org'")
        yield ("Err:1 https://a.example x InRelease\n  Could not connect to proxy:3128 (10.0.0.1). - connect (111)\n"
               "Err:2 https://b.example x InRelease\n  Unable to connect", "Could not connect to proxy:3128 (10.0.0.1)")

    def test_no_network(self) -> None:
        tree = self.tree("cmake", "c++", "g++")
        tree.set_packages("base | some-compiler | c++ | compiler", "opencl | x | no-such-command | OpenCL")
        tree.set_command("sudo", '[[ $1 == -n ]] && shift; exec "$@"')
        for said, reason in self.without_network():
            tree.set_command("apt-get", f"""
                if [[ $* == *install* ]]; then echo "there is no point in trying" >&2; sleep 5; exit 100; fi
                printf '%s\\n' "{said}" """)
            for words in COMMANDS:
                with self.subTest(reason=reason, command=words):
                    done = tree.run(*words)
                    lines = done.stderr.splitlines()
                    self.assertNotEqual(done.returncode, 0)
                    if os.geteuid() == 0:  # other users get the message before the password prompt
                        self.assertEqual(len(lines), 1, lines)
                    self.assertIn(f"no package server can be reached ({reason}", lines[-1])
                    self.assertIn("connect to the network and try again, or as root: apt-get install some-compiler",
                                  lines[-1])

    def test_pypi_that_cannot_be_reached(self) -> None:
        """Without network, pip itself is tried once, quickly, and not for each list."""
        tree = self.tree()
        apart = ["unshare", "--net", "--map-root-user"] if os.geteuid() else ["unshare", "--net"]
        if tree.run("true", before=apart).returncode != 0:
            self.skipTest("the network can't be taken away here")
        shutil.copy2(ROOT / "tools" / "setup", tree.root / "tools" / "setup")
        (tree.root / "python").mkdir()
        for path in (ROOT / "python").glob("*requirements.txt"):
            shutil.copy2(path, tree.root / "python")
        script = ('source "$0/tools/setup"; find_missing() { missing=(); }; main --live --ros --sweep')
        began = time.monotonic()
        done = tree.run("bash", "-c", script, str(tree.root), before=apart)
        self.check(done, r"^tools/setup: could not install python/requirements\.txt: the Python package is left out"
                         r" \(PyPI can't be reached, \w+: connect to the network and try again; see .*\)\n$")
        self.assertLess(time.monotonic() - began, 20 * slowness())


if __name__ == "__main__":
    unittest.main()
