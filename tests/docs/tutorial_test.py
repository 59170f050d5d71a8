#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The files and commands of docs/tutorial.md work in a separate home folder with an installation of this
build, and give the documented results.

STAGE_NEW_PICTURES=1 rewrites the pictures: look at each before you commit it."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from PIL import Image, ImageChops, ImageFilter

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from build_tree import BINARY_DIR, COMPILER, HAS_WINDOW, needs_shared_library  # noqa: E402
from pages import HASH, Block, Home, blocks_of  # noqa: E402
from patience import PATIENCE  # noqa: E402

SOURCE_DIR = Path(os.environ["STAGE_SOURCE_DIR"]).resolve()
PAGE = SOURCE_DIR / "docs" / "tutorial.md"
PICTURES = PAGE.parent / "pictures" / "tutorial"
LARGEST_PICTURE = 60_000  # bytes

PICTURE = re.compile(r"!\[[^\]]+\]\(([^)]+)\)")

# A second controller in addition to the page's, which reports the robot's position and whether an obstacle is in front
# of it.
WITNESS = """
#include <cstdio>
#include <stage.hh>
static int Tell(Stg::Model* model, void*) {
  const Stg::Pose pose = model->GetGlobalPose();
  std::printf("witness %s %f %f %d\\n", model->Token(), pose.x, pose.y, model->Stalled() ? 1 : 0);
  return 0;
}
extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  model->AddCallback(Stg::Model::CB_UPDATE, Tell, nullptr);
  return 0;
}
"""


def extremes(picture: Image.Image) -> tuple[Image.Image, Image.Image]:
    """The min and the max channel of each pixel."""
    red, green, blue = picture.split()
    return (ImageChops.darker(ImageChops.darker(red, green), blue),
            ImageChops.lighter(ImageChops.lighter(red, green), blue))


def difference(a: Path, b: Path) -> float:
    """The fraction of squares of 5 x 5 pixels whose mean colours differ by more than a tenth, as in
    tests/draw/gui_pictures_test.cc."""
    with Image.open(a) as first, Image.open(b) as second:
        if first.size != second.size:
            return 1.0
        squares = (first.width // 5, first.height // 5)
        seen = [p.convert("RGB").resize(squares, Image.Resampling.BOX) for p in (first, second)]
    greatest = extremes(ImageChops.difference(*seen))[1].histogram()
    return sum(greatest[26:]) / sum(greatest)


TOLERANCE = 0.015


def robots_in(picture: Path) -> Image.Image:
    """A mask that is white at robots, which are neither as grey as walls nor as pale as data."""
    with Image.open(picture) as image:
        least, greatest = extremes(image.convert("RGB"))
    dark = least.point([255 if value < 140 else 0 for value in range(256)])
    coloured = ImageChops.subtract(greatest, least).point(
        [255 if value > 40 else 0 for value in range(256)])
    return ImageChops.darker(dark, coloured)


def robots_elsewhere(a: Path, b: Path) -> int:
    """The number of robot pixels in one picture without a robot pixel within two pixels in the other. A
    missing robot gives about a hundred."""
    first, second = robots_in(a), robots_in(b)
    if first.size != second.size:
        return first.width * first.height
    near = ImageFilter.MaxFilter(5)
    lone = [ImageChops.subtract(first, second.filter(near)),
            ImageChops.subtract(second, first.filter(near))]
    return sum(image.histogram()[255] for image in lone)


FEW_PIXELS = 20

def no_pictures(folder: Path) -> str:
    """The reason why no pictures can be made here; empty if they can."""
    if not HAS_WINDOW:
        return "built without the window"
    world = folder / "nothing.world"
    world.write_text("quit_time 1\n", encoding="utf-8")
    done = subprocess.run([BINARY_DIR / "bin" / "stage", "--screenshot", folder / "nothing.png", world],
                          text=True, check=False, capture_output=True, timeout=PATIENCE)
    if done.returncode != 0 and re.search(r"EGL|OpenGL", done.stderr):
        return done.stderr.strip()
    return ""


class PageTest(unittest.TestCase):
    """Tests of the page's text."""

    def test_blocks_are_told_apart(self) -> None:
        found = blocks_of("Save this as `a.world`:\n\n```\nx 1\n```\n\nRun:\n\n```sh\nls\n```\n")
        self.assertEqual(found, [Block("a.world", "x 1\n"), Block("", "ls\n")])
        with self.assertRaises(AssertionError):
            blocks_of("What is this?\n\n```\nx 1\n```\n")

    def test_page_has_its_parts(self) -> None:
        page = PAGE.read_text(encoding="utf-8")
        blocks = blocks_of(page)
        self.assertEqual(len(blocks), page.count("\n```") // 2)
        files = [block.file for block in blocks if block.file]
        self.assertEqual(len(files), len(set(files)))
        for name in ("empty.world", "avoid.cc", "CMakeLists.txt", "ten.world"):
            self.assertIn(name, files)

    def test_pictures_are_there_and_all_are_shown(self) -> None:
        shown = {PAGE.parent / path for path in PICTURE.findall(PAGE.read_text(encoding="utf-8"))}
        self.assertEqual(sorted(shown), sorted(PICTURES.glob("*")))
        for picture in shown:
            self.assertLess(picture.stat().st_size, LARGEST_PICTURE, picture)

    def test_comparisons_notice_what_is_missing(self) -> None:
        picture = {path.stem: path for path in PICTURES.glob("*.png")}
        self.assertEqual(difference(picture["ten"], picture["ten"]), 0)
        self.assertGreater(difference(picture["one"], picture["laser"]), TOLERANCE)
        self.assertEqual(robots_elsewhere(picture["one"], picture["laser"]), 0)
        for one, other in (("flat", "one"), ("one", "wander"), ("wander", "avoid"), ("avoid", "ten")):
            self.assertGreater(robots_elsewhere(picture[one], picture[other]), 2 * FEW_PIXELS,
                               (one, other))


@unittest.skipUnless(shutil.which(COMPILER) and shutil.which("bash"), "no compiler, or no bash")
@unittest.skipUnless(shutil.which("pkg-config"), "pkg-config is not installed")
@needs_shared_library
class TutorialTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.no_pictures = no_pictures(Path(folder.name))
        home = Path(folder.name).resolve() / "home"
        home.mkdir()
        cls.home = Home(home)
        cls.robots = home / "robots"
        cls.outputs: dict[str, str] = {}  # outputs by command
        for block in blocks_of(PAGE.read_text(encoding="utf-8")):
            if block.file:
                (cls.robots / block.file).write_text(block.text, encoding="utf-8")
                continue
            for command in block.text.splitlines():
                cls.outputs[command] = cls.home.run(cls.as_run_here(command))

    @classmethod
    def as_run_here(cls, command: str) -> str:
        command = command.replace("cmake --install build/release", f"cmake --install '{BINARY_DIR}'")
        if cls.no_pictures:
            command = re.sub(r"--screenshot \S+", "-g", command)
        return command

    def output_of(self, words: str) -> list[str]:
        found = [output for command, output in self.outputs.items() if words in command]
        self.assertTrue(found, f"no command with {words}")
        return found

    def test_nothing_is_complained_about(self) -> None:
        for output in self.output_of("stage "):
            self.assertNotRegex(output, r"(?i)warning|error")

    def test_both_builds_make_the_controller(self) -> None:
        for place in (".", "build"):
            self.assertTrue((self.robots / place / "avoid.so").is_file(), place)
        hashes = [self.home.run(f"STAGEPATH={place} stage -g avoid.world --state-hash")
                  for place in (".", "build")]
        self.assertEqual(HASH.findall(hashes[0]), HASH.findall(hashes[1]))

    def test_controller_has_no_warnings(self) -> None:
        self.home.run("c++ -std=c++17 -Wall -Wextra -Werror -fsyntax-only $(pkg-config --cflags stage) "
                      "avoid.cc")

    def test_runs_repeat(self) -> None:
        first, second = (HASH.findall(output)[0] for output in self.output_of("--seed 7"))
        self.assertEqual(first, second)
        (other,) = (HASH.findall(output)[0] for output in self.output_of("--seed 8"))
        self.assertNotEqual(first, other)

    def test_figures(self) -> None:
        figures = json.loads((self.robots / "run.json").read_text(encoding="utf-8"))
        self.assertEqual(figures["robots"], 10)
        self.assertEqual(figures["simulated_seconds"], 60)
        self.assertGreater(figures["r_acc"], 0)
        (explained,) = self.output_of("--explain")
        for heading in ("Simulated", "Not simulated", "Suggestions"):
            self.assertIn(heading, explained)

    def test_robots_drive_and_none_is_stuck(self) -> None:
        (self.robots / "witness.cc").write_text(WITNESS, encoding="utf-8")
        world = (self.robots / "ten.world").read_text(encoding="utf-8")
        witnessed = world.replace('ctrl "avoid"', 'ctrl ["avoid" "witness"]')
        self.assertNotEqual(world, witnessed)
        (self.robots / "witnessed.world").write_text(witnessed, encoding="utf-8")
        output = self.home.run(
            "c++ -std=c++17 -shared -fPIC witness.cc $(pkg-config --cflags stage) -o build/witness.so\n"
            "stage -g witnessed.world")
        ways: dict[str, list[tuple[float, float, bool]]] = {}
        for name, x, y, stalled in re.findall(r"^witness (\S+) (\S+) (\S+) ([01])$", output,
                                              re.MULTILINE):
            ways.setdefault(name, []).append((float(x), float(y), stalled == "1"))
        self.assertEqual(sorted(ways), [f"r{i}" for i in range(10)])
        for name, way in ways.items():
            with self.subTest(name):
                self.assertGreater(len(way), 500)
                driven = sum(math.dist(a[:2], b[:2]) for a, b in zip(way, way[1:]))
                self.assertGreater(driven, 6, "metres, in a minute")
                late = way[-200:]  # 20 s
                self.assertFalse(all(stalled for _, _, stalled in late), "stalled for 20 s")
                self.assertGreater(max(math.dist(late[0][:2], p[:2]) for p in late), 0.3)
                self.assertTrue(all(abs(x) < 8 and abs(y) < 8 for x, y, _ in way), "left the flat")

    def test_pictures_are_what_the_program_draws(self) -> None:
        if self.no_pictures:
            self.skipTest(self.no_pictures)
        for path in PICTURE.findall(PAGE.read_text(encoding="utf-8")):
            kept = PAGE.parent / path
            made = self.robots / kept.name
            with self.subTest(kept.name):
                self.assertTrue(made.is_file(), "no command makes it")
                if os.environ.get("STAGE_NEW_PICTURES"):
                    shutil.copyfile(made, kept)
                    continue
                far, elsewhere = difference(made, kept), robots_elsewhere(made, kept)
                if far > TOLERANCE or elsewhere > FEW_PIXELS:
                    shutil.copyfile(made, BINARY_DIR / f"tutorial_{kept.name}")
                message = f"see tutorial_{kept.name} in the build folder"
                self.assertLessEqual(far, TOLERANCE, message)
                self.assertLessEqual(elsewhere, FEW_PIXELS, message)


if __name__ == "__main__":
    unittest.main()
