#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests the Debian packages that cpack makes. lintian finds no errors, and each package has the expected files. The
packages that README installs suffice for a run. Without stage-opencl, a run with --opencl names that package."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from build_tree import BINARY_DIR, HAS_OPENCL, HAS_WINDOW, SOURCE_DIR as ROOT, skip_if_static  # noqa: E402
from patience import PATIENCE  # noqa: E402

skip_if_static()


def run(*command: object, check: bool = True, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(word) for word in command], text=True, check=check, cwd=cwd, timeout=PATIENCE,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


@unittest.skipUnless(shutil.which("dpkg-shlibdeps") and shutil.which("file"), "skipped: try tools/setup --packages")
class PackagesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name).resolve()
        made = run("cpack", "-G", "DEB", "--config", BINARY_DIR / "CPackConfig.cmake", "-B", cls.folder, check=False)
        assert made.returncode == 0, made.stdout
        cls.packages = {path.name.split("_")[0]: path for path in cls.folder.glob("*.deb")}

    def test_all_are_there(self) -> None:
        expected = {"stage", "libstage5", "libstage-dev", *(["libstagegui5"] if HAS_WINDOW else []),
                    *(["stage-opencl"] if HAS_OPENCL else [])}
        self.assertEqual(set(self.packages), expected)
        for name, path in self.packages.items():
            files = run("dpkg-deb", "--contents", path).stdout
            for file in ("copyright", "changelog.gz"):
                self.assertIn(f" ./usr/share/doc/{name}/{file}\n", files)

    def test_the_program_suggests_what_options_need(self) -> None:
        suggested = run("dpkg-deb", "--field", self.packages["stage"], "Suggests").stdout
        self.assertEqual(set(suggested.strip().split(", ")), {"stage-opencl", "ffmpeg"})

    @unittest.skipUnless(shutil.which("lintian"), "lintian is not installed: tools/setup --packages")
    def test_lintian_finds_no_errors(self) -> None:
        said = run("lintian", "--allow-root", *self.packages.values(), check=False).stdout
        self.assertEqual([line for line in said.splitlines() if line.startswith("E:")], [])
        self.assertIn("W: ", said)  # so that the check has run

    def test_readme_installs_what_runs(self) -> None:
        """Tests program, library, window and OpenCL without the headers."""
        line = re.search(r"apt install [^#]*", (ROOT / "README.md").read_text(encoding="utf-8"))
        assert line is not None
        patterns = re.findall(r"\./(\S+)", line[0])
        installed = {name for pattern in patterns for name, path in self.packages.items() if path.match(pattern)}
        self.assertEqual(installed, set(self.packages) - {"libstage-dev"})

    def test_without_the_package_of_opencl(self) -> None:
        """The program and the library alone run a world, and name the package that has --opencl."""
        tree = self.folder / "tree"
        for name in ("stage", "libstage5"):
            run("dpkg-deb", "--extract", self.packages[name], tree)
        done = run(tree / "usr/bin/stage", "-g", "--progress", "--duration", "1", "--opencl", "simple.world", cwd=self.folder)
        self.assertRegex(done.stdout, r"stage_cl can't be loaded: .*comes in the Debian package stage-opencl")
        self.assertIn("[Stage: done]", done.stdout)


if __name__ == "__main__":
    unittest.main()
