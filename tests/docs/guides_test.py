#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The files and commands of the guides to controllers and to model types work, in a separate home folder with an
installation of this build."""

from __future__ import annotations

import os
import re
import shutil
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from build_tree import BINARY_DIR, COMPILER, skip_if_static  # noqa: E402
from pages import FENCED, HASH, Home  # noqa: E402

skip_if_static()
SOURCE_DIR = Path(os.environ["STAGE_SOURCE_DIR"]).resolve()
CONTROLLERS = SOURCE_DIR / "examples" / "ctrl" / "README.md"
MODELS = SOURCE_DIR / "examples" / "model" / "README.md"


@unittest.skipUnless(shutil.which(COMPILER) and shutil.which("bash"), "no compiler, or no bash")
@unittest.skipUnless(shutil.which("pkg-config"), "pkg-config is not installed")
class GuidesTest(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.home = Home(Path(folder.name).resolve())

    def run_here(self, command: str) -> str:
        return self.home.run(command.replace("cmake --install build/release", f"cmake --install '{BINARY_DIR}'"))

    def test_controller_guide(self) -> None:
        """All files and commands work in order; the controller compiles without warnings and moves its robot."""
        page = CONTROLLERS.read_text(encoding="utf-8")
        blocks = FENCED.findall(page)
        self.assertEqual([language for language, _ in blocks], ["cpp", "sh", "", "sh"])
        (_, controller), (_, install), (_, world), (_, build_and_run) = blocks
        self.assertIn("`follow_wall.cc`, and this as `my.world`", page)
        self.run_here(install)
        follow = self.home.folder / "follow"
        (follow / "follow_wall.cc").write_text(controller, encoding="utf-8")
        (follow / "my.world").write_text(world, encoding="utf-8")
        self.assertNotRegex(self.run_here(build_and_run), r"(?i)warning|error")

        run = build_and_run.splitlines()[-1].replace("my.world", "--state-hash my.world")
        (driven,) = HASH.findall(self.run_here(run))
        (left,) = HASH.findall(self.run_here(run.replace("--state-hash", "--state-hash --no-controllers")))
        self.assertNotEqual(driven, left, "the controller does nothing")
        self.run_here("c++ -std=c++17 -Wall -Wextra -Werror -fsyntax-only $(pkg-config --cflags stage) follow_wall.cc")

    def test_page_of_batch_controllers(self) -> None:
        """The controller on the page compiles without warnings and drives robots."""
        page = (SOURCE_DIR / "docs" / "controllers.md").read_text(encoding="utf-8")
        (controller,) = (text for language, text in FENCED.findall(page) if language == "cpp")
        folder = self.home.folder / "convoy"
        folder.mkdir()
        (folder / "own_convoy.cc").write_text(controller, encoding="utf-8")
        world = (SOURCE_DIR / "examples" / "batch_controller" / "convoy.world").read_text(encoding="utf-8")
        world = re.sub(r'ctrl "convoy[^"]*"', 'ctrl "own_convoy"', world)
        (folder / "own.world").write_text(world, encoding="utf-8")
        self.run_here("cmake --install build/release --prefix ~/stage-5\ncd convoy\n"
                      "export PKG_CONFIG_PATH=~/stage-5/lib/pkgconfig\n"
                      "c++ -std=c++11 -Wall -Wextra -Werror -shared -fPIC $(pkg-config --cflags stage) own_convoy.cc "
                      "-o own_convoy.so $(pkg-config --libs stage)")
        run = "STAGEPATH=. ~/stage-5/bin/stage -g --duration 3 --state-hash own.world"
        (driven,) = HASH.findall(self.run_here(run))
        (left,) = HASH.findall(self.run_here(f"{run} --no-controllers"))
        self.assertNotEqual(driven, left, "the controller does nothing")

    def test_model_type_guide(self) -> None:
        """The page's CMakeLists.txt builds the plug-in outside of the tree, and it is found as documented."""
        page = MODELS.read_text(encoding="utf-8").split("## Compile it elsewhere\n")[1]
        lists = "".join(line[4:] + "\n" for line in page.split("\n## ")[0].splitlines() if line.startswith("    "))
        self.assertIn("project(sonar", lists)
        found = re.search(r"`(STAGEPATH=\S+ stage sonar\.world)`", page)
        self.assertTrue(found)
        folder = self.home.folder / "sonar"
        shutil.copytree(SOURCE_DIR / "examples" / "model", folder, ignore=shutil.ignore_patterns("CMakeLists.txt"))
        (folder / "CMakeLists.txt").write_text(lists, encoding="utf-8")
        self.run_here("cmake --install build/release --prefix ~/stage-5\ncd sonar\n"
                      "cmake -DCMAKE_PREFIX_PATH=~/stage-5 . && cmake --build .")
        # Remove the installed plug-in of the example, which must not be mistaken for the one built here.
        for other in (self.home.folder / "stage-5").rglob("sonar_ring.so"):
            other.unlink()
        run = found[1].replace("stage ", "~/stage-5/bin/stage -g --duration 1 ")
        self.assertNotRegex(self.run_here(run), r"(?i)warning|error")


if __name__ == "__main__":
    unittest.main()
