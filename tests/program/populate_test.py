#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests of tools/populate and tools/dev/draw_maps, and of the worlds and pictures they made."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from patience import PATIENCE  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
WORLDS = ROOT / "worlds"
BITMAPS = WORLDS / "bitmaps"
POPULATE = ROOT / "tools" / "populate"
DRAW_MAPS = ROOT / "tools" / "dev" / "draw_maps"

SIZES = {"cave": (64.0, 64.0), "hospital": (540.0, 220.0), "rooms": (16.0, 16.0)}
ROBOTS = {"cave": "explorer", "hospital": "swarmer", "rooms": "explorer"}
ROBOT_LINE = re.compile(
    r'^\w+\( name "(r\d+)" pose \[ *(\S+) +(\S+) +0 +(\S+)\]', re.MULTILINE)


def run(*command: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(word) for word in command], capture_output=True, text=True,
                          check=False, timeout=PATIENCE)


def robots_in(text: str) -> tuple[list[str], np.ndarray]:
    """Names, and an array with a row (x, y, heading) per robot."""
    found = ROBOT_LINE.findall(text)
    return [robot[0] for robot in found], np.array([[float(v) for v in r[1:]] for r in found])


def body_radius(robot: str) -> float:
    """Radius of the circumscribed circle of a robot's outline, from worlds/robots.inc."""
    text = (WORLDS / "robots.inc").read_text(encoding="utf-8")
    body = text[text.index(f"define {robot} "):].split("\ndefine ")[0]
    points = re.findall(r"point\[\d+\] +\[ *(\S+) +(\S+)\]", body)
    return max(float(np.hypot(float(x), float(y))) for x, y in points)


def least_distance_to_wall(name: str, poses: np.ndarray, reach: float) -> float:
    """Minimum distance from a robot's centre to solid pixels; `reach` if all are farther away."""
    solid = np.asarray(Image.open(BITMAPS / f"{name}.png")) <= 127
    rows, columns = solid.shape
    width, height = SIZES[name]
    across, up = width / columns, height / rows
    x, y = (poses[:, 0] + width / 2) / across, (height / 2 - poses[:, 1]) / up
    least = reach
    for dy in range(-int(reach / up) - 1, int(reach / up) + 2):
        for dx in range(-int(reach / across) - 1, int(reach / across) + 2):
            column, row = np.floor(x).astype(int) + dx, np.floor(y).astype(int) + dy
            hit = ((column < 0) | (row < 0) | (column >= columns) | (row >= rows)
                   | solid[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)])
            gap_x = np.maximum(0, np.maximum(column - x, x - column - 1)) * across
            gap_y = np.maximum(0, np.maximum(row - y, y - row - 1)) * up
            if hit.any():
                least = min(least, float(np.hypot(gap_x, gap_y)[hit].min()))
    return least


def least_distance_between(poses: np.ndarray, reach: float) -> float:
    """Minimum distance between two robots; `reach` if all are farther apart."""
    ordered = poses[np.argsort(poses[:, 0])]
    least = reach
    for skip in range(1, len(ordered)):
        gap = ordered[skip:, :2] - ordered[:-skip, :2]
        near = gap[:, 0] < reach
        if not near.any():
            break
        least = min(least, float(np.hypot(gap[near, 0], gap[near, 1]).min()))
    return least


class TemporaryFolder(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)


class Populations(TemporaryFolder):
    def populate(self, *arguments: object) -> str:
        """The world file written by a valid command line."""
        output = self.folder / "out.world"
        done = run(POPULATE, *arguments, "-o", output)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        return output.read_text(encoding="utf-8")

    def assert_refused(self, *arguments: object) -> str:
        done = run(POPULATE, *arguments)
        self.assertEqual(done.returncode, 2, arguments)
        self.assertEqual(done.stdout, "")
        self.assertRegex(done.stderr, r"\Apopulate: [^\n]+\n\Z")
        return done.stderr

    def assert_clear(self, name: str, text: str, gap: float) -> None:
        radius = body_radius(ROBOTS[name])
        _, poses = robots_in(text)
        self.assertGreaterEqual(least_distance_to_wall(name, poses, radius + 2 * gap) - radius,
                                gap)
        self.assertGreaterEqual(
            least_distance_between(poses, 2 * radius + 2 * gap) - 2 * radius, gap)

    def test_same_seed_same_file(self) -> None:
        for series in ("cave", "hospital"):
            first = self.populate(series, 150, "--seed", 7)
            self.assertEqual(first, self.populate(series, 150, "--seed", 7))
            self.assertNotEqual(robots_in(first)[1].tolist(),
                                robots_in(self.populate(series, 150, "--seed", 8))[1].tolist())

    def test_smaller_population_is_part_of_larger(self) -> None:
        small = robots_in(self.populate("cave", 20))[1]
        large = robots_in(self.populate("cave", 400))[1]
        self.assertEqual(small.tolist(), large[:20].tolist())

    def test_number_and_names(self) -> None:
        for series, count in (("cave", 1), ("cave", 321), ("hospital", 1000)):
            names, poses = robots_in(self.populate(series, count))
            self.assertEqual(names, [f"r{i}" for i in range(count)])
            self.assertTrue((np.abs(poses[:, 2]) <= 180).all())

    def test_headings_and_places_are_spread(self) -> None:
        _, poses = robots_in(self.populate("hospital", 4000))
        self.assertLess(abs(poses[:, 2].mean()), 10)
        for axis, extent in ((0, 540), (1, 220)):
            share, _ = np.histogram(poses[:, axis], bins=4, range=(-extent / 2, extent / 2))
            self.assertTrue(((share > 850) & (share < 1150)).all(), share)

    def test_nothing_overlaps(self) -> None:
        # The gaps exceed the diagonal of a cell: 0.02 m cells in the cave, 0.1 m in the hospital.
        for series, count, gap in (("cave", 1000, 0.03), ("cave", 5000, 0.03),
                                   ("hospital", 2000, 0.142), ("hospital", 100000, 0.142)):
            with self.subTest(series=series, count=count):
                text = self.populate(series, count)
                self.assertEqual(len(robots_in(text)[0]), count)
                self.assert_clear(series, text, gap)

    def test_coarse_cells_widen_the_gaps(self) -> None:
        text = self.populate("cave", 500, "--resolution", "0.1")
        self.assertIn("\nresolution 0.1 ", text)
        self.assert_clear("cave", text, 0.142)

    def test_bad_arguments(self) -> None:
        output = self.folder / "no.world"
        for arguments in ((), ("cave",), ("attic", 5), ("cave", 0), ("cave", -3), ("cave", "2.5"),
                          ("cave", 100001), ("cave", "many"), ("cave", 5, "--seed", "x"),
                          ("cave", 5, "--seed", -1), ("cave", 5, "--quit-time", "-1"),
                          ("cave", 5, "--quit-time", "nan"), ("cave", 5, "--resolution", 0),
                          ("cave", 5, "--ctrl", 'a "b"'), ("cave", 5, "--ctrl", "a\nb"),
                          ("cave", 5, "--colour", "red")):
            self.assert_refused(*arguments, "-o", output)
            self.assertFalse(output.exists())

    def test_bad_output(self) -> None:
        self.assert_refused("cave", 5, "-o", self.folder / "missing" / "a.world")
        self.assert_refused("cave", 5, "-o", self.folder)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_too_many_leave_the_old_file_alone(self) -> None:
        output = self.folder / "cave.world"
        output.write_text("old", encoding="utf-8")
        message = self.assert_refused("cave", 100000, "-o", output)
        self.assertIn("no room for 100000 robots", message)
        self.assertEqual(output.read_text(encoding="utf-8"), "old")
        self.assertEqual(list(self.folder.iterdir()), [output])

    def test_only_worlds_of_populate_are_replaced(self) -> None:
        output = self.folder / "mine.world"
        output.write_text("model ( )\n", encoding="utf-8")
        self.assertIn("holds something else", self.assert_refused("cave", 5, "-o", output))
        self.assertEqual(output.read_text(encoding="utf-8"), "model ( )\n")
        output.write_text("", encoding="utf-8")
        output.chmod(0o640)
        for _ in range(2):
            self.assertEqual(run(POPULATE, "cave", 5, "-o", output).returncode, 0)
            self.assertEqual(output.stat().st_mode & 0o777, 0o640)
        self.assertEqual(list(self.folder.iterdir()), [output])

    def test_paths_hold_from_any_folder(self) -> None:
        for text in (self.populate("hospital", 3), run(POPULATE, "hospital", 3).stdout):
            paths = re.findall(r'^ *(?:include|bitmap) "([^"]+)"', text, re.MULTILINE)
            self.assertEqual([Path(path).name for path in paths],
                             ["sensors.inc", "robots.inc", "maps.inc", "hospital.png"])
            for path in paths:
                self.assertTrue(Path(path).is_absolute() and Path(path).is_file(), path)

    def test_options_reach_the_file(self) -> None:
        text = self.populate("cave", 2, "--quit-time", "0.00001", "--ctrl", "wander fast")
        self.assertIn("\nquit_time 0.00001 ", text)
        self.assertIn('ctrl "wander fast"', text)
        self.assertIn("cave 2 --seed 1 --quit-time 0.00001 --ctrl 'wander fast'\n", text)
        self.assertNotIn("ctrl \"", self.populate("cave", 2, "--ctrl", ""))

    def test_a_device_is_written_to_not_replaced(self) -> None:
        self.assertEqual(run(POPULATE, "cave", 2, "-o", "/dev/null").returncode, 0)
        self.assertTrue(Path("/dev/null").is_char_device())


class ShippedWorlds(unittest.TestCase):
    def test_series_are_what_populate_writes(self) -> None:
        for series in ("cave", "hospital"):
            shipped = (WORLDS / f"{series}.world").read_text(encoding="utf-8")
            arguments = re.search(r"^# +tools/populate (.+)$", shipped, re.MULTILINE)
            assert arguments is not None
            fresh = run(POPULATE, *arguments[1].split()).stdout.replace(f"{WORLDS}/", "")
            self.assertEqual(fresh, shipped)
            self.assertEqual(len(robots_in(shipped)[0]), 100)

    def test_simple_robots_stand_on_free_floor(self) -> None:
        names, poses = robots_in((WORLDS / "simple.world").read_text(encoding="utf-8"))
        self.assertEqual(names, ["r0", "r1"])
        self.assertGreater(least_distance_to_wall("rooms", poses, 1.0), body_radius("explorer"))
        self.assertGreater(least_distance_between(poses, 1.0), 2 * body_radius("explorer"))

    def test_numbers_of_rays(self) -> None:
        sensors = (WORLDS / "sensors.inc").read_text(encoding="utf-8")
        self.assertEqual(len(re.findall(r"^  sonar\(", sensors, re.MULTILINE)), 16)
        self.assertEqual(re.findall(r"^ *samples (\d+)", sensors, re.MULTILINE),
                         ["1", "180", "350"])


class Maps(TemporaryFolder):
    def draw(self, description: str, *options: str) -> subprocess.CompletedProcess[str]:
        path = self.folder / "plan.map"
        path.write_text(description, encoding="utf-8")
        return run(DRAW_MAPS, *options, path)

    def test_shipped_pictures_agree(self) -> None:
        done = run(DRAW_MAPS, "--check")
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_shipped_pictures_have_solid_rims(self) -> None:
        for name in SIZES:
            with Image.open(BITMAPS / f"{name}.png") as image:
                self.assertEqual(image.mode, "L")
                solid = np.asarray(image) <= 127
            for rim in (solid[0], solid[-1], solid[:, 0], solid[:, -1]):
                self.assertTrue(rim.all(), name)

    def test_one_changed_pixel_is_found(self) -> None:
        for suffix in (".map", ".png"):
            shutil.copy(BITMAPS / f"rooms{suffix}", self.folder)
        self.assertEqual(run(DRAW_MAPS, "--check", "--folder", self.folder).returncode, 0)
        picture = self.folder / "rooms.png"
        image = Image.open(picture)
        image.putpixel((100, 100), 255 - image.getpixel((100, 100)))
        image.save(picture)
        done = run(DRAW_MAPS, "--check", "--folder", self.folder)
        self.assertEqual(done.returncode, 1)
        self.assertIn("rooms.png is not what the description gives", done.stderr)

    def test_missing_picture_is_found(self) -> None:
        self.assertEqual(self.draw("map 10 10 10\nborder\n", "--check").returncode, 1)
        self.assertFalse((self.folder / "plan.png").exists())

    def test_no_link_is_written_through(self) -> None:
        precious = self.folder / "precious"
        precious.write_text("precious", encoding="utf-8")
        (self.folder / "plan.png.new").symlink_to(precious)
        self.assertEqual(self.draw("map 20 20 8\nborder\ncave 5 60 1 3\nreach 0.5").stderr, "")
        self.assertEqual(precious.read_text(encoding="utf-8"), "precious")
        self.assertTrue((self.folder / "plan.png").is_file())

    def test_drawing_twice_gives_the_same_bytes(self) -> None:
        pictures = []
        for _ in range(2):
            self.assertEqual(self.draw("map 20 20 8\nborder\ncave 5 60 1 3\nreach 0.5").stderr, "")
            pictures.append((self.folder / "plan.png").read_bytes())
        self.assertEqual(pictures[0], pictures[1])

    def test_y_points_up(self) -> None:
        self.assertEqual(self.draw("map 10 10 10\nborder\nsolid 2 7 1 1").returncode, 0)
        solid = np.asarray(Image.open(self.folder / "plan.png")) <= 127
        self.assertTrue(solid[20:30, 20:30].all())
        self.assertFalse(solid[70:80, 20:30].any())

    def test_useless_pictures_are_reported(self) -> None:
        done = self.draw("map 10 10 10\nborder\nbox 3 3 2 2")
        self.assertEqual(done.returncode, 1)
        self.assertIn("cut off from the rest", done.stderr)
        done = self.draw("map 10 10 10\nsolid 3 3 2 2")
        self.assertEqual(done.returncode, 1)
        self.assertIn("border is not solid", done.stderr)

    def test_bad_descriptions_are_reported_in_one_line(self) -> None:
        for text, line in (("pen 2", 1), ("map 10 10", 1), ("map 10 10 10 10", 1),
                           ("map 10 10 10\nspiral 1 2", 2), ("map 10 10 10\n\nwall 1 x", 3),
                           ("map 10 10 10\nrooms 0 0 9 5 up 3 4 1", 2), ("map 1 1 1", 1),
                           ("map 10 10 10\nsuite 0 0 9 9 0 1", 2), ("map nan 10 10", 1),
                           ("map 10 10 10\npillars 0 0 9 9 0 1", 2),
                           ("map 10 10 10\nsolid 0 0 10 10\nreach 1", 3)):
            done = self.draw(text)
            self.assertEqual(done.returncode, 1, text)
            self.assertRegex(done.stderr, rf"\Adraw_maps: [^\n]+plan\.map:{line}: [^\n]+\n\Z")


if __name__ == "__main__":
    unittest.main()
