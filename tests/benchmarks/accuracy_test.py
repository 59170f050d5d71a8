#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests of benchmarks/accuracy: its analysis with made-up figures, and its programs in scenes with known exact
results."""

from __future__ import annotations

import csv
import importlib.util
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE_DIR = Path(os.environ["STAGE_SOURCE_DIR"]).resolve()
BINARY_DIR = Path(os.environ["STAGE_BINARY_DIR"]).resolve()
RAY_TRUTH = BINARY_DIR / "benchmarks" / "ray_truth"
POSE_LOG = BINARY_DIR / "benchmarks" / "pose_log"
BENCHMARK = SOURCE_DIR / "benchmarks" / "accuracy"
NOT_BUILT = f"{RAY_TRUTH} is not built: no Google Benchmark"
sys.path[:0] = [str(SOURCE_DIR / "benchmarks"), str(SOURCE_DIR / "tests" / "support")]
from patience import PATIENCE  # noqa: E402

try:
    import numpy
    from benchkit import inference
    from benchkit.accuracy import analysis, worlds
    from benchkit.inference import percentile
    from benchkit.accuracy.analysis import Candidate, Limit
    from benchkit.accuracy.jobs import Benchmark
    from benchkit.accuracy.needs import NEEDS
    from benchkit.accuracy.programs import Programs
    from benchkit.accuracy.results import bin_order
    from benchkit.accuracy.settings import PLANS, Setting, sweeps
    from benchkit.store import Table
    MISSING = ""
except ImportError as error:
    MISSING = f"a package is missing: {error}"


def run(*command: object, status: int = 0, **environment: str
        ) -> "subprocess.CompletedProcess[str]":
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True,
                          check=False, timeout=PATIENCE, env={**os.environ, **environment})
    if done.returncode != status:
        raise AssertionError(f"{command}: exit status {done.returncode}, expected {status}\n"
                             f"{done.stdout}{done.stderr}")
    return done


# ---- analysis -----------------------------------------------------------------------------------

@unittest.skipIf(MISSING, MISSING)
class AnalysisTest(unittest.TestCase):
    def test_percentile_is_one_of_the_values(self) -> None:
        values = list(range(100, 0, -1))
        self.assertEqual(percentile(values, 0.5), 50)
        self.assertEqual(percentile(values, 0.95), 95)
        self.assertEqual(percentile(values, 1), 100)
        self.assertEqual(percentile([7], 0.01), 7)
        self.assertTrue(math.isnan(percentile([], 0.5)))

    def test_pareto_front(self) -> None:
        points = [(1, 0.1), (2, 0.2), (1.5, 0.3), (2, 0.25), (3, 0.9), (3, 0.9)]
        self.assertEqual(analysis.pareto_front(points), [True, True, False, False, True, True])

    def test_errors_of_nothing_are_equal(self) -> None:
        self.assertEqual(analysis.pareto_front([(1, 1e-15), (2, 1e-9), (3, 1e-3)]),
                         [False, True, True])

    def test_bins_of_several_populations(self) -> None:
        row = {name: "2" for name in analysis.COUNTS} | {name: "0.5" for name in analysis.MEDIANS}
        rows = [{**row, "p95": value, "max": value} for value in ("1", "3", "8")]
        empty = {**row, "errors": "0", "p95": "0", "max": "0"}
        merged = analysis.merge_bins([*rows, empty])
        self.assertEqual(merged["readings"], 8)
        self.assertEqual(merged["p95"], 3)  # rows without errors do not count
        self.assertEqual(merged["max"], 8)

    def test_order_of_bins(self) -> None:
        names = ["from 16 m", "2 to 4 m", "0.5 to 1 m", "0 to 0.5 m", "8 to 16 m"]
        self.assertEqual(sorted(names, key=bin_order),
                         ["0 to 0.5 m", "0.5 to 1 m", "2 to 4 m", "8 to 16 m", "from 16 m"])

    def test_students_test(self) -> None:
        # Critical values of Student's distribution, from tables: 4 and 9 degrees of freedom.
        for n, critical, probability in ((5, 2.776, 0.05), (5, 4.604, 0.01), (10, 2.262, 0.05)):
            pattern = [float(i % 2) for i in range(n)]
            mean = sum(pattern) / n
            deviation = math.sqrt(sum((p - mean) ** 2 for p in pattern) / (n - 1))
            shift = critical * deviation / math.sqrt(n)
            found = inference.t_test([p - mean + shift for p in pattern])
            self.assertAlmostEqual(found, probability, places=4)
        self.assertEqual(inference.t_test([0, 0, 0]), 1)
        self.assertEqual(inference.t_test([2, 2, 2]), 0)
        self.assertTrue(math.isnan(inference.t_test([1])))

    def test_holms_correction(self) -> None:
        # The sorted values times 4, 3, 2 and 1, made non-decreasing.
        corrected = inference.holm([0.01, 0.04, 0.03, 0.005])
        for found, expected in zip(corrected, (0.03, 0.06, 0.06, 0.02)):
            self.assertAlmostEqual(found, expected)

    def test_scores_seed_by_seed(self) -> None:
        finest = {1: 10.0, 2: 20.0, 3: 30.0}
        same = {1: 10.1, 2: 19.9, 3: 30.0, 4: 99.0}  # seed 4 has no counterpart
        worse = {1: 5.0, 2: 15.1, 3: 24.9}
        first, second = analysis.score_rows(finest, [("same", same, 0.0), ("worse", worse, 0.5)])
        self.assertAlmostEqual(first.difference, 0)
        self.assertFalse(first.distinguishable)
        self.assertAlmostEqual(second.difference, -5)
        self.assertAlmostEqual(second.spread, 10)
        self.assertTrue(second.distinguishable)  # although far smaller than the spread

    def test_recommendation(self) -> None:
        limits = [Limit("p95", 0.05, "")]
        slow = Candidate("slow", 1, {"p95": 0.01})
        good = Candidate("good", 5, {"p95": 0.05})
        coarse = Candidate("coarse", 9, {"p95": 0.2})
        unknown = Candidate("unknown", 99, {})
        self.assertEqual(analysis.recommend([slow, good, coarse, unknown], limits), good)
        self.assertEqual(analysis.recommend([slow, good, coarse, unknown], []), unknown)
        self.assertIsNone(analysis.recommend([coarse, unknown], limits))

    def test_needs_speak_of_all_knobs(self) -> None:
        for need in NEEDS:
            self.assertEqual(list(need.limits), ["cells", "samples", "interval", "step"], need.name)

    def test_scores_and_drift(self) -> None:
        x, y = numpy.array([0.0, 3.0, 3.0]), numpy.array([0.0, 0.0, 4.0])
        self.assertAlmostEqual(analysis.nearest_neighbour_distance(x, y), (3 + 3 + 4) / 3)
        # Squares of 0.5 m: (0, 0) twice, (-1, 0), (0, 2).
        path_x = numpy.array([[0.1, 0.4], [-0.1, 0.2]])
        path_y = numpy.array([[0.1, 0.4], [0.1, 1.1]])
        self.assertAlmostEqual(analysis.visited_area(path_x, path_y), 3 * 0.25)
        apart = analysis.drift(path_x, path_y, path_x + 3, path_y - 4)
        self.assertEqual(apart.tolist(), [5, 5])


# ---- raw results --------------------------------------------------------------------------------

@unittest.skipIf(MISSING, MISSING)
class TableTest(unittest.TestCase):
    def test_jobs_that_were_broken_off_are_forgotten(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "raw" / "t.csv"
            table = Table(path, ["job", "value"])
            table.add([{"job": 1, "value": "a"}, {"job": 1, "value": "b"}])
            table.close()
            whole = path.read_text()
            for torn in ("2,c,0\n", "2,c", "2,c,0\n2,"):  # the last row is missing or incomplete
                path.write_text(whole + torn)
                again = Table(path, ["job", "value"])
                self.assertTrue(again.has({"job": 1}))
                self.assertFalse(again.has({"job": 2}))
                self.assertEqual(path.read_text(), whole)
                again.close()
            again = Table(path, ["job", "value"])
            again.add([{"job": 2, "value": "c"}])
            with self.assertRaisesRegex(ValueError, "another series is writing"):
                Table(path, ["job", "value"])
            again.close()
            again = Table(path, ["job", "value"])
            self.assertEqual(len(again.rows), 3)
            again.close()
            with self.assertRaisesRegex(ValueError, "columns differ from those"):
                Table(path, ["job", "weight"])


# ---- worlds -------------------------------------------------------------------------------------

@unittest.skipIf(MISSING, MISSING)
class WorldsTest(unittest.TestCase):
    def test_knobs_are_put_in(self) -> None:
        text = worlds.scene_world("boxes", 3, 1, Setting(cell=0.07, ray_model="exact", samples=33,
                                                         interval=300, step=40), "wander")
        for line in ("resolution 0.07", "interval_sim 40", 'ray_model "exact"', "samples 33",
                     "update_interval 300", 'ctrl "wander"'):
            self.assertIn(line, text)
        self.assertNotIn("ray_model", worlds.header(Setting()))
        with self.assertRaisesRegex(worlds.WorldError, "x.inc: found nothing that matches"):
            worlds.substitute("samples", "", "no such word", "x.inc")

    def test_scene_is_the_same_for_all_settings(self) -> None:
        def models(setting: Setting) -> list[str]:
            text = worlds.scene_world("boxes", 5, 7, setting, "wander")
            return [line for line in text.splitlines() if line.startswith(("model(", "robot("))]
        self.assertEqual(models(Setting(cell=0.5, step=10)), models(Setting()))
        self.assertEqual(len(models(Setting())), 44 + 5)

    def test_gap_before_a_wall(self) -> None:
        wall = worlds.Approach(0, 0, 0, wall_x=2, wall_y=5, wall_heading=0)
        self.assertAlmostEqual(wall.gap(1, 0, 0), 2 - 0.1 - 1 - 0.1)
        self.assertAlmostEqual(wall.gap(1, 0, math.pi / 4), 0.9 - 0.1 * math.sqrt(2))
        self.assertAlmostEqual(wall.gap(1.9, 0, 0), -0.1)

    def test_sweeps_leave_out_what_there_is_not(self) -> None:
        plan = PLANS["short"]
        found = sweeps(plan, ("cell",), 2, opencl=False)
        self.assertNotIn("hits", found)
        self.assertEqual({s.ray_model for s in found["cells"].settings}, {"cell"})
        both = sweeps(plan, ("cell", "exact"), 8, opencl=True)
        self.assertEqual(len(both["cells"].settings), 2 * len(plan.cells))
        self.assertEqual(both["cells"].finest, Setting(cell=0.005, ray_model="exact"))
        self.assertEqual([s.threads for s in both["threads"].settings], [1, 2, 8])
        for sweep in both.values():
            self.assertIn(sweep.finest, sweep.settings)


# ---- ray_truth ----------------------------------------------------------------------------------

ROOM = """
resolution {cell}
model( name "east" pose [2.05 0 0 0] size [0.1 4.2 {height}] )
model( name "west" pose [-2.05 0 0 0] size [0.1 4.2 {height}] )
model( name "north" pose [0 2.05 0 0] size [4.2 0.1 {height}] )
model( name "south" pose [0 -2.05 0 0] size [4.2 0.1 {height}] )
ranger( name "eye" alwayson 1 pose [{x} {y} {z} {degrees}]
  sensor( range [0 {range}] samples 721 fov 360 {more} ) )
{others}
"""


def room(cell: float = 0.02, height: float = 1, x: float = 0.3, y: float = -0.7, z: float = 0.1,
         degrees: float = 33, most: str = "8", more: str = "", others: str = "") -> str:
    """A square room, 4 m by 4 m inside, and a sensor."""
    return ROOM.format(cell=cell, height=height, x=x, y=y, z=z, degrees=degrees, range=most,
                       more=more, others=others)


class Comparison:
    """A result of ray_truth for a world."""

    def __init__(self, text: str, *options: object) -> None:
        with tempfile.TemporaryDirectory() as folder:
            world, readings = Path(folder) / "t.world", Path(folder) / "t.csv"
            summary = Path(folder) / "t.json"
            world.write_text(text, encoding="utf-8")
            self.messages = run(RAY_TRUTH, "--csv", readings, "--json", summary, "--quiet",
                                *options, world).stderr
            self.summary = json.loads(summary.read_text(encoding="utf-8"))
            with open(readings, encoding="utf-8", newline="") as file:
                self.rows = list(csv.DictReader(file))

    def column(self, name: str, of: str = "") -> list[float]:
        return [float(row[name]) for row in self.rows if not of or row["ranger"] == of]

    def bin(self, group: str, name: str) -> dict[str, float]:
        return next(b for b in self.summary["groups"] if b["group"] == group and b["bin"] == name)


def room_truth(x: float, y: float, heading: float) -> float:
    """Distance from a point in the room to its walls in a direction."""
    c, s = math.cos(heading), math.sin(heading)
    return min((math.copysign(2, c) - x) / c if c else math.inf,
               (math.copysign(2, s) - y) / s if s else math.inf)


@unittest.skipUnless(RAY_TRUTH.exists(), NOT_BUILT)
class RayTruthTest(unittest.TestCase):
    def test_truth_in_a_square_room(self) -> None:
        for degrees in (33, 0, 45, -90.5):  # includes axes and diagonals
            found = Comparison(room(degrees=degrees), "--still")
            self.assertEqual(len(found.rows), 721)
            for row in found.rows:
                # The walls' thickness and positions are not exact in binary.
                heading = float(row["heading"]) + float(row["bearing"])
                expected = room_truth(0.3, -0.7, heading)
                self.assertLess(abs(float(row["truth"]) - expected), 1e-12, row)
            errors = [abs(r - t) for r, t in zip(found.column("reading"), found.column("truth"))]
            self.assertLess(sorted(errors)[360], 0.03)  # the median is within a cell's diagonal
            self.assertEqual(found.bin("all", "all")["errors"], 721)
            self.assertEqual(found.bin("all", "all")["missed"], 0)
            self.assertAlmostEqual(found.bin("all", "all")["p50"], sorted(errors)[360], places=6)

    def test_truth_does_not_depend_on_cells(self) -> None:
        fine, coarse = (Comparison(room(cell=cell), "--still") for cell in (0.005, 0.5))
        self.assertEqual(fine.column("truth"), coarse.column("truth"))
        self.assertLess(10 * fine.bin("all", "all")["p50"], coarse.bin("all", "all")["p50"])

    def test_rotated_robot_with_offset_body(self) -> None:
        # A square of 1 m with its centre 0.5 m ahead of the robot's pose, turned by 45 degrees, so
        # that the sensor at the origin looks at its corner.
        others = ('position( name "rob" pose [1 0 0 45] origin [0.5 0 0 0] size [1 1 1] '
                  "ranger_return 0.5 )")
        found = Comparison(room(x=0, y=0, degrees=0, others=others), "--still")
        middle = 1 + 0.5 * math.sqrt(0.5), 0.5 * math.sqrt(0.5)
        ahead = found.rows[360]
        self.assertEqual(float(ahead["bearing"]), 0)
        # y = 0 crosses the edge from the square's nearest corner, (middle x - 0.707, 0.354), to
        # (middle x, -0.354), at 45 degrees.
        expected = middle[0] - math.sqrt(0.5) + middle[1]
        self.assertAlmostEqual(float(ahead["truth"]), expected, places=12)
        self.assertEqual((ahead["truth_model"], ahead["truth_is_robot"]), ("rob", "1"))
        self.assertEqual(ahead["seen_model"], "rob")
        self.assertAlmostEqual(float(ahead["incidence_deg"]), 45, places=5)
        self.assertGreater(found.bin("object", "robot")["readings"], 50)
        self.assertGreater(found.bin("object", "wall")["readings"], 500)
        # The nearest point is the left corner.
        corner = middle[0] - math.sqrt(0.5), middle[1]
        self.assertAlmostEqual(float(ahead["clearance"]), math.hypot(*corner), places=8)

    def test_what_does_not_stop_a_ray(self) -> None:
        others = ('model( pose [1 0 0 0] size [0.2 0.2 0.05] ) '  # too low for rays at 0.11
                  'model( pose [1 0 0.5 0] size [0.2 0.2 0.05] ) '  # too high
                  'model( pose [1 0 0 0] size [0.2 0.2 1] ranger_return -1 )')
        found = Comparison(room(x=0, y=0, degrees=0, others=others), "--still")
        self.assertAlmostEqual(float(found.rows[360]["truth"]), 2, places=12)
        self.assertLess(found.bin("all", "all")["max"], 0.5)  # as in the simulator
        # A body whose top is exactly at the height of the rays is hit.
        top = Comparison(room(x=0, y=0, degrees=0, others="model( pose [1 0 0 0] "
                              "size [0.2 0.2 0.11] )"), "--still")
        self.assertAlmostEqual(float(top.rows[360]["truth"]), 0.9, places=12)
        self.assertLess(abs(float(top.rows[360]["reading"]) - 0.9), 0.03)

    def test_own_body_is_not_seen(self) -> None:
        text = ('resolution 0.02 position( pose [0 0 0 0] size [0.4 0.4 0.4] ranger( name "eye" '
                'alwayson 1 pose [0 0 -0.2 0] sensor( range [0 3] samples 4 fov 270 ) ) )')
        found = Comparison(text, "--still")
        self.assertEqual([row["verdict"] for row in found.rows], ["nothing"] * 4)

    def test_false_hit_beside_a_corner(self) -> None:
        # The ray along y = 0.01 passes a box that begins at y = 0.03, in the same row of cells.
        text = ('resolution 0.05 model( name "box" pose [2 0.53 0 0] size [1 1 1] ) '
                'ranger( alwayson 1 pose [0 0.01 0.1 0] sensor( range [0 5] samples 1 ) )')
        found = Comparison(text, "--still")
        row = found.rows[0]
        self.assertEqual((row["verdict"], row["truth_model"], row["seen_model"]),
                         ("false", "", "box"))
        self.assertAlmostEqual(float(row["clearance"]), math.hypot(1.5, 0.02), places=8)
        self.assertEqual(found.bin("all", "all")["false"], 1)
        self.assertEqual(found.bin("all", "all")["errors"], 0)

    def test_wrong_object_beside_a_corner(self) -> None:
        text = ('resolution 0.05 model( name "box" pose [2 0.53 0 0] size [1 1 1] ) '
                'model( name "back" pose [4.5 0 0 0] size [1 1 1] ) '
                'ranger( alwayson 1 pose [0 0.01 0.1 0] sensor( range [0 5] samples 1 ) )')
        row = Comparison(text, "--still").rows[0]
        self.assertEqual((row["verdict"], row["truth_model"], row["seen_model"]),
                         ("wrong object", "back", "box"))
        self.assertAlmostEqual(float(row["truth"]), 4, places=12)

    def test_missed_hits_and_noise(self) -> None:
        # The controller multiplies readings of walls just within range by about one.
        text = room(x=0, y=0, most="2.02", more="").replace("alwayson 1",
                                                           'alwayson 1 ctrl "lasernoise"')
        found = Comparison(text, "--still")
        missed = [r for r in found.rows if r["verdict"] == "missed"]
        beyond = [r for r in found.rows if r["truth_model"] and float(r["reading"]) >= 2.02]
        self.assertEqual(missed, beyond)
        self.assertGreater(len(missed), 5)
        self.assertEqual(found.bin("all", "all")["missed"], len(missed))
        # With the sensor's own noise, comparing with the truth is meaningless.
        noisy = run_world(room(more="noise [0 0.1 0]"), status=1)
        self.assertIn("721 readings have noise and were left out", noisy.stderr)
        self.assertIn("no reading was compared", noisy.stderr)

    def test_between_the_beams(self) -> None:
        # Two beams, 45 degrees to either side, and a wall at distance 2: both read 2 sqrt(2), so the
        # interpolated range in the middle is 2 sqrt(2) instead of 2.
        text = ('resolution 0.001 model( pose [2.5 0 0 0] size [1 8 1] ) '
                'ranger( alwayson 1 pose [0 0 0.1 0] sensor( range [0 5] samples 2 fov 90 ) )')
        found = Comparison(text, "--still", "--between", 3)
        self.assertEqual([row["verdict"] for row in found.rows], ["between"] * 3)
        self.assertAlmostEqual(float(found.rows[1]["truth"]), 2, places=12)
        self.assertAlmostEqual(float(found.rows[1]["reading"]), math.sqrt(8), delta=0.003)
        self.assertEqual(found.bin("all", "all")["errors"], 3)

    def test_robots_that_drive(self) -> None:
        """The truth is computed for the moment of sensing; a step later it would differ by 0.04 m."""
        driving = room(cell=0.005, x=1.5, y=1.5, others=(
            "interval_sim 100 define eye ranger( alwayson 1 update_interval {interval} "
            "sensor( range [0 8] samples 16 fov 300 ) ) "
            'position( name "rob" alwayson 1 pose [-1 -1 0 30] size [0.2 0.2 0.2] '
            'ctrl "wander" eye() )'))
        fresh = Comparison(driving.format(interval=100), "--seconds", 3)
        rob = [r for r in fresh.rows if r["ranger"].startswith("rob")]
        moved = {r["x"] for r in rob}
        self.assertGreater(len(moved), 20)
        errors = sorted(abs(float(r["reading"]) - float(r["truth"])) for r in rob)
        self.assertLess(errors[len(errors) * 9 // 10], 0.02)
        self.assertEqual({r["age_us"] for r in fresh.rows}, {"0"})

        held = Comparison(driving.format(interval=300), "--held", "--seconds", 3)
        by_age = {age: sorted(abs(float(r["reading"]) - float(r["truth"])) for r in held.rows
                              if r["ranger"].startswith("rob") and r["age_us"] == age)
                  for age in ("0", "100000", "200000")}
        middles = [errors[len(errors) // 2] for errors in by_age.values()]
        self.assertLess(middles[0], 0.01)
        self.assertGreater(middles[1], 2 * middles[0])
        self.assertGreater(middles[2], middles[1])
        self.assertGreater(held.bin("age", "0.2 s")["readings"], 50)

    def test_looking_on_changes_nothing(self) -> None:
        world = SOURCE_DIR / "worlds" / "cave.world"
        with tempfile.TemporaryDirectory() as folder:
            summary = Path(folder) / "t.json"
            run(RAY_TRUTH, "--seconds", 1, "--every", 5, "--json", summary, "--quiet", world)
            found = json.loads(summary.read_text(encoding="utf-8"))["state_hash"]
        plain = run(BINARY_DIR / "bin" / "stage", "-g", "--duration", 1, "--state-hash", world)
        self.assertIn(f"state-hash {found}", plain.stdout)

    def test_exact_ray_model(self) -> None:
        if "--ray-model" not in run(BINARY_DIR / "bin" / "stage", "--help").stdout:
            self.skipTest("this build has no --ray-model")
        found = Comparison('ray_model "exact"\n' + room(cell=0.1), "--still")
        self.assertEqual(found.bin("all", "all")["readings"], 721)
        self.assertLess(found.bin("all", "all")["p95"], 1e-6)

    def test_wrong_options(self) -> None:
        for options, message in (
                (["--every", "0", "x"], "--every: found '0', expected a number from 1 to 1e+09"),
                (["--held", "--between", "9", "x"], "--held and --between exclude each other"),
                (["--nonsense", "x"], "there is no such option"),
                ([], "found 0 world files, expected one")):
            self.assertIn(message, run(RAY_TRUTH, *options, status=2).stderr)
        run(RAY_TRUTH, "/no/such.world", status=1)


def run_world(text: str, status: int) -> "subprocess.CompletedProcess[str]":
    with tempfile.NamedTemporaryFile(suffix=".world", mode="w", encoding="utf-8") as world:
        world.write(text)
        world.flush()
        return run(RAY_TRUTH, "--still", "--quiet", world.name, status=status)


# ---- pose_log, and the whole analysis -----------------------------------------------------------

@unittest.skipUnless(POSE_LOG.exists(), NOT_BUILT)
@unittest.skipIf(MISSING, MISSING)
class PoseLogTest(unittest.TestCase):
    def poses(self, text: str, *options: object) -> list[dict[str, str]]:
        with tempfile.TemporaryDirectory() as folder:
            world, table = Path(folder) / "t.world", Path(folder) / "t.csv"
            world.write_text(text, encoding="utf-8")
            run(POSE_LOG, "--output", table, *options, world)
            with open(table, encoding="utf-8", newline="") as file:
                return list(csv.DictReader(file))

    def test_steps_along_an_arc(self) -> None:
        for step in (10, 100, 500):
            rows = self.poses(worlds.drive_world(step), "--seconds", 4, "--speed", 0.5, "--turn",
                              0.7)
            self.assertEqual([float(row["time"]) for row in rows], [0, 1, 2, 3, 4])
            for row in rows:
                # Each step moves straight ahead, then turns.
                dt, steps = step / 1000, round(float(row["time"]) * 1000 / step)
                x = sum(0.5 * dt * math.cos(0.7 * dt * k) for k in range(steps))
                y = sum(0.5 * dt * math.sin(0.7 * dt * k) for k in range(steps))
                self.assertLess(math.hypot(float(row["x"]) - x, float(row["y"]) - y), 1e-12)
        true_x, true_y = analysis.arc(0.5, 0.7, 4)
        self.assertLess(math.hypot(x - true_x, y - true_y), 0.5 * 0.5)  # half of the longest step
        self.assertEqual(analysis.arc(0.5, 0, 4), (2, 0))

    def test_nudge(self) -> None:
        plain, moved = (self.poses(worlds.drive_world(100), "--seconds", 1, "--nudge", nudge)
                        for nudge in (0, 0.25))
        self.assertEqual([float(m["x"]) - float(p["x"]) for m, p in zip(moved, plain)], [0.25] * 2)


@unittest.skipUnless(RAY_TRUTH.exists(), NOT_BUILT)
@unittest.skipIf(MISSING, MISSING)
@unittest.skipUnless(importlib.util.find_spec("matplotlib"), "matplotlib is missing")
@unittest.skipIf(os.environ.get("STAGE_EMULATED"), "PoCL does not find its linker in an emulator: docs/boards.md")
class BenchmarkTest(unittest.TestCase):
    def test_tiny_run(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, BENCHMARK, "--tiny", "--build", BINARY_DIR, "--results",
                       folder]
            first = run(*command, STAGE_COMMIT="abc", STAGE_SHARED_DIR="")
            self.assertRegex(first.stdout, r"^[1-9]\d* runs")
            report = (Path(folder) / "report.md").read_text(encoding="utf-8")
            for part in ("commit: abc", "obstacle avoidance in swarms", "### Contact",
                         "All runs end in the same state", "distinguishable?",
                         "its measurements are not available"):
                self.assertIn(part, report)
            for line in report.splitlines():
                if line.startswith("!["):
                    picture = Path(folder) / line.split("](")[1].rstrip(")")
                    self.assertEqual(picture.read_bytes()[:4], b"\x89PNG")
            self.check_that_it_goes_on(Path(folder))
            other = run(*command, status=1, STAGE_COMMIT="other", STAGE_SHARED_DIR="")
            self.assertIn("found commit 'abc', expected 'other'", other.stderr)

    def check_that_it_goes_on(self, folder: Path) -> None:
        """After the last three scores are lost, three runs are done again and give the same scores."""
        scores = folder / "raw" / "score.csv"
        lines = scores.read_text(encoding="utf-8").splitlines(keepends=True)
        scores.write_text("".join(lines[:-3]), encoding="utf-8")
        programs = Programs(BINARY_DIR)
        with tempfile.TemporaryDirectory() as scratch:
            benchmark = Benchmark(PLANS["tiny"], programs, sweeps(
                PLANS["tiny"], programs.models, os.cpu_count() or 1,
                bool(programs.opencl_device())), folder, Path(scratch))
            self.assertEqual(benchmark.run(2), 3)
            self.assertEqual(benchmark.run(2), 0)
        self.assertEqual(sorted(scores.read_text(encoding="utf-8").splitlines()),
                         sorted("".join(lines).splitlines()))


if __name__ == "__main__":
    unittest.main()
