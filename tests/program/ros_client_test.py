#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests what ROS nodes use of Stage: package.xml, by which ROS's tools find the package, and a program
(ros_client/node.cc). The program compiles as C++11 to C++20 with GCC and Clang against an installation, and runs
with and without a window."""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
import unittest
from pathlib import Path
from xml.etree import ElementTree

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from build_tree import (BINARY_DIR, CMAKE, COMPILER, HAS_WINDOW, SANITIZE, SOURCE_DIR,  # noqa: E402
                        needs_shared_library, run)

NODE = SOURCE_DIR / "tests" / "program" / "ros_client" / "node.cc"
PKG_CONFIG, XVFB_RUN = shutil.which("pkg-config"), shutil.which("xvfb-run")
STANDARDS = ("c++11", "c++14", "c++17", "c++20")
WORLD = """
interval_sim 100
speedup -1
window( size [500 400] )
model( pose [3 0 0 0] size [0.2 8 1] )
define robot position( size [0.4 0.4 0.4] localization "gps"
  ranger( pose [0.1 0 0 0] sensor( range [0 5] fov 180 samples 19 ) sensor( range [0 2] fov 30 samples 3 ) )
  camera( resolution [40 30] range [0.2 8] fov [70 40] ) )
robot( name "one" pose [0 0 0 0] )
robot( name "two" pose [0 2 0 0] )
"""


class ManifestTest(unittest.TestCase):
    def setUp(self) -> None:
        self.root = ElementTree.parse(SOURCE_DIR / "package.xml").getroot()

    def text(self, name: str) -> str:
        return (self.root.findtext(name) or "").strip()

    def test_says_what_cmake_says(self) -> None:
        cmake = (SOURCE_DIR / "CMakeLists.txt").read_text(encoding="utf-8")
        project = re.search(r"^project\((\w+) VERSION ([\d.]+)", cmake, re.MULTILINE)
        assert project is not None
        self.assertEqual((self.text("name"), self.text("version")), project.groups())
        self.assertEqual(self.text("export/build_type"), "cmake")
        self.assertEqual(self.text("license"), "GPL-2.0-or-later")

    def test_has_what_the_format_asks_for(self) -> None:
        self.assertEqual((self.root.tag, self.root.get("format")), ("package", "3"))
        self.assertTrue(self.text("description"))
        maintainer = self.root.find("maintainer")
        assert maintainer is not None and maintainer.text
        self.assertRegex(maintainer.get("email", ""), r"^[-\w.%+]+@[-\w.]+\.[a-zA-Z]{2,}$")
        known = {"name", "version", "description", "maintainer", "license", "buildtool_depend", "depend",
                 "build_depend", "test_depend", "export"}
        self.assertLessEqual({part.tag for part in self.root}, known)
        names = [part.text for part in self.root if part.tag.endswith("depend")]
        self.assertEqual(len(names), len(set(names)))

    def test_names_the_libraries_that_the_build_looks_for(self) -> None:
        """The packages of tools/setup by their keys in rosdep."""
        keys = {"libpng-dev": "libpng-dev", "libjpeg-dev": "libjpeg", "libgif-dev": "libgif-dev",
                "nlohmann-json3-dev": "nlohmann-json-dev", "liblz4-dev": "liblz4-dev", "libzstd-dev": "libzstd-dev"}
        setup = (SOURCE_DIR / "tools" / "setup").read_text(encoding="utf-8")
        packages = re.findall(r"^base +\| ([\w-]+-dev)\b", setup, re.MULTILINE)
        self.assertGreaterEqual(len(packages), len(keys))
        names = {part.text for part in self.root if part.tag in ("depend", "build_depend")}
        self.assertLessEqual({keys[package] for package in packages}, names)


@unittest.skipUnless(PKG_CONFIG, "pkg-config is not installed")
@needs_shared_library
class NodeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name).resolve()
        cls.prefix = cls.folder / "stage"
        components = ["libstage5", "libstage-dev", *(["libstagegui5"] if HAS_WINDOW else [])]
        for component in components:
            run(CMAKE, "--install", BINARY_DIR, "--prefix", cls.prefix,
                "--component", component)
        cls.flags = run(PKG_CONFIG, "--cflags", "--libs", "stage",
                        PKG_CONFIG_PATH=cls.prefix / "lib" / "pkgconfig").split()
        cls.world = cls.folder / "node.world"
        cls.world.write_text(WORLD, encoding="utf-8")

    def compile(self, compiler: str, standard: str, *options: object) -> None:
        window = ["-DWITH_WINDOW"] if HAS_WINDOW else []
        run(compiler, f"-std={standard}", "-Wall", "-Wextra", "-Werror", *window, NODE, *self.flags, *options)

    def test_manifest_is_installed(self) -> None:
        self.assertEqual((self.prefix / "share" / "Stage" / "package.xml").read_bytes(),
                         (SOURCE_DIR / "package.xml").read_bytes())

    def test_compiles_in_each_standard(self) -> None:
        compilers = {COMPILER, *filter(None, map(shutil.which, ("g++", "clang++")))}
        for compiler in sorted(compilers):
            for standard in STANDARDS:
                with self.subTest(compiler=compiler, standard=standard):
                    self.compile(compiler, standard, "-fsyntax-only", "-Wno-unused-command-line-argument")

    def build(self) -> Path:
        program = self.folder / "node"
        if not program.exists():
            self.compile(COMPILER, "c++11", *SANITIZE, "-o", program)
        return program

    def check(self, output: str) -> None:
        """Makes 10 steps, resets, and makes 10 more. Both robots and everything that they carry work."""
        robots = re.findall(r"robot (\w+) (\w+) rangers 1 cameras 1 at (\S+) (\S+) estimated (\S+) "
                            r"speed 0.200 mount 0.100 height 0.400\n", output)
        self.assertEqual([robot[:2] for robot in robots], 2 * [("one", "one"), ("two", "two")], output)
        for _, _, x, y, estimate in robots:
            self.assertTrue(0.15 < float(x) < 0.21, output)
            self.assertLess(abs(float(x) - float(estimate)), 0.03)
            self.assertLess(min(abs(float(y)), abs(float(y) - 2)), 0.03)
        self.assertIn("updates 10 time 1.0 back 0 samples 44 nearest 2.00\n", output)
        self.assertIn("updates 20 time 2.0 back 0 samples 44 nearest 2.00\n", output)
        self.assertEqual(output.count("camera sees\n"), 2)
        self.assertTrue(output.endswith("over\n"), output)
        self.assertNotIn("bad", output)

    def test_without_a_window(self) -> None:
        self.check(run(self.build(), self.world, LD_LIBRARY_PATH=self.prefix / "lib", DISPLAY=""))

    @unittest.skipUnless(HAS_WINDOW and XVFB_RUN, "built without the window, or Xvfb is not installed")
    def test_in_a_window(self) -> None:
        self.check(run(XVFB_RUN, "-a", self.build(), self.world, "--window",
                       LD_LIBRARY_PATH=self.prefix / "lib"))


if __name__ == "__main__":
    unittest.main()
