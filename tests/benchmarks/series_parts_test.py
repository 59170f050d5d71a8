#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests of the parts of benchmarks/benchkit: analysis, break-even, plan, store, machine."""

from __future__ import annotations

import io
import itertools
import math
import platform
import random
import tempfile
import unittest
from collections import Counter
from dataclasses import replace
from pathlib import Path

from series_testing import AUTO, DEVICE, HOST, HOSTS, failed, made_up
from benchkit import machine
from benchkit.series import records as store
from benchkit.series.analysis import Series, differences
from benchkit.series.breakeven import Point, break_even
from benchkit.report import number
from benchkit.series.measure import energy_figures
from benchkit.series.energy import GuardedMeter, NoReading
from benchkit.series.nearness import nearness
from benchkit.series.plan import (LEAST_STEPS, SHORT_RUN_SECONDS, History, Plan, balanced_order,
                          remaining)
from benchkit.progress import Progress, duration_text
from benchkit.series.runs import Backend, Job
from benchkit.series.records import COMPILE, MEASURE, WARM_UP, Record

POPULATIONS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000)


def power_laws(truth: float, slope: float, populations: tuple[int, ...] = POPULATIONS,
               noise: float = 0.0, repeats: int = 3, seed: int = 1) -> list[Point]:
    """Host time over device time, which is 1 at `truth` rays per step."""
    dice = random.Random(seed)
    return [Point(200 * n, n, tuple((200 * n / truth) ** slope * math.exp(dice.gauss(0, noise))
                                    for _ in range(repeats))) for n in populations]


class BreakEvenTest(unittest.TestCase):
    def test_two_power_laws(self) -> None:
        for truth, slope in ((30_000, 0.5), (1_234, 0.1), (333_000, 1.0), (401, 0.02)):
            found = break_even(power_laws(truth, slope))
            assert found is not None
            self.assertAlmostEqual(found.rays / truth, 1, delta=0.01)
            self.assertAlmostEqual(found.robots / (truth / 200), 1, delta=0.01)
            self.assertEqual(found.crossings, 1)

    def test_one_point_exactly_at_break_even(self) -> None:
        found = break_even(power_laws(20_000, 0.5))  # 100 robots
        assert found is not None
        self.assertAlmostEqual(found.rays, 20_000, delta=1)

    def test_interval_contains_the_truth(self) -> None:
        # 95 % of 120 series are 114. A wrong interval fails this by far.
        for repeats in (3, 5):
            hits = 0
            for seed in range(120):
                found = break_even(power_laws(30_000, 0.4, noise=0.1, repeats=repeats, seed=seed))
                assert found is not None
                self.assertTrue(found.low <= found.high)
                hits += found.low <= 30_000 <= found.high
            self.assertGreaterEqual(hits, 103, f"{repeats} repeats")

    def test_interval_is_no_wider_than_the_noise_allows(self) -> None:
        found = break_even(power_laws(30_000, 0.5, noise=0.01))
        assert found is not None
        self.assertLess(found.high / found.low, 1.15)
        self.assertGreater(found.high / found.low, 1.001)

    def test_none_in_the_range(self) -> None:
        found = break_even(power_laws(1e9, 0.5))
        assert found is not None
        self.assertEqual((found.rays, found.low, found.high), (math.inf, math.inf, math.inf))
        self.assertEqual((found.found, found.wins), (False, ()))
        self.assertTrue(math.isnan(found.robots))

    def test_below_the_range(self) -> None:
        found = break_even(power_laws(10, 0.5))
        assert found is not None
        self.assertEqual((found.rays, found.low, found.high), (-math.inf, -math.inf, -math.inf))
        self.assertEqual(len(found.wins), len(POPULATIONS))

    def test_losing_again_at_the_end_is_no_break_even(self) -> None:
        points = [Point(100, 1, (0.5, 0.5)), Point(1000, 10, (2.0, 2.0)),
                  Point(10_000, 100, (0.9, 0.9))]
        found = break_even(points)
        assert found is not None
        self.assertEqual((found.rays, found.wins, found.crossings), (math.inf, (1000,), 2))

    def test_the_last_of_several_crossings_counts(self) -> None:
        points = [Point(10 ** i, i, (ratio,)) for i, ratio in enumerate((0.5, 2, 0.5, 2, 4), 1)]
        found = break_even(points)
        assert found is not None
        self.assertAlmostEqual(found.rays, 10 ** 3.5, delta=1)
        self.assertEqual(found.crossings, 3)
        self.assertTrue(math.isnan(found.low), "one repeat gives no interval")

    def test_too_few_points(self) -> None:
        self.assertIsNone(break_even(power_laws(1000, 0.5, populations=(5,))))
        self.assertIsNone(break_even([]))


def drifting(world: str = "cave") -> list[Record]:
    """A machine that becomes slower by half with each repeat; the device is twice as fast as
    host1."""
    return [made_up(world=world, population=n, backend=label, repeat=repeat,
                    wall_seconds=wall * 1.5 ** repeat * n, peak_memory_mb=10 + n / 64)
            for n in (10, 100, 1000) for repeat in (1, 2, 3)
            for label, wall in (("host1", 1.0), ("hostN", 0.8), ("cl:gpu", 0.5), ("auto", 0.5))]


class AnalysisTest(unittest.TestCase):
    def test_median_and_spread(self) -> None:
        series = Series(drifting())
        found = series.column("cave", 10, "host1", "wall_seconds")
        assert found is not None
        self.assertEqual((found.median, found.least, found.greatest, found.count),
                         (22.5, 15.0, 33.75, 3))
        self.assertIsNone(series.column("cave", 11, "host1", "wall_seconds"))

    def test_drift_cancels_within_repeats(self) -> None:
        found = Series(drifting()).relative("cave", 100, "cl:gpu", "host1")
        assert found is not None
        for value in (found.median, found.least, found.greatest):
            self.assertAlmostEqual(value, 2.0)

    def test_only_common_repeats_are_compared(self) -> None:
        records = [r for r in drifting() if not (r.backend == "host1" and r.repeat == 1)]
        self.assertEqual(len(Series(records).ratios("cave", 100, "cl:gpu", "host1")), 2)

    def test_averages_begin_at_100_robots(self) -> None:
        series = Series(drifting())
        self.assertEqual(series.large_populations("cave"), [100, 1000])
        mean, times = series.average("cave", "host1"), series.average_relative("cave", "cl:gpu",
                                                                               "hostN")
        assert mean is not None and times is not None
        self.assertAlmostEqual(mean.median, 10 / 1.5 ** 2)
        self.assertAlmostEqual(times.median, 1.6)

    def test_averages_leave_out_what_a_backend_lacks(self) -> None:
        records = [r for r in drifting() if (r.backend, r.population) != ("auto", 1000)]
        self.assertEqual(Series(records).large_populations("cave"), [100])

    def test_memory_per_robot(self) -> None:
        self.assertAlmostEqual(Series(drifting()).memory_per_robot("cave", "host1") or 0, 16.0)

    def test_phases_leave_the_rest_to_other(self) -> None:
        phases = Series([made_up(wall_seconds=1.0)]).phases("cave", 10, "host1")
        self.assertEqual(phases["trace"], 1.0)
        self.assertAlmostEqual(phases["other"], 10.0 - 6.0)

    def test_break_even_of_a_series(self) -> None:
        # host1: 1 ms per 200 rays. Device: 40 ms plus a hundredth of that.
        records = [made_up(population=n, backend=label, repeat=repeat,
                           wall_seconds=100 * (0.001 * n if label == "host1" else
                                               0.04 * (n / 40) ** 0.01))
                   for n in POPULATIONS for repeat in (1, 2) for label in ("host1", "cl:gpu")]
        found = Series(records).break_even("cave", "cl:gpu", "host1")
        assert found is not None
        self.assertAlmostEqual(found.rays / 8000, 1, delta=0.01)
        self.assertIsNone(Series(records).break_even("cave", "cl:gpu", "hostN"))

    def test_nearness_to_the_fastest_backend(self) -> None:
        records = [replace(r, r_acc=r.r_acc * 0.9) if (r.backend, r.population) == ("auto", 100)
                   else r for r in drifting()]
        found = nearness(Series(records), "cave")
        assert found is not None
        self.assertEqual(found.fastest, {10: "cl:gpu", 100: "cl:gpu", 1000: "cl:gpu"})
        for population, ratio in ((10, 1.0), (100, 0.9), (1000, 1.0)):
            near = found.points[population]
            for value in (near.ratio, near.low, near.high):  # repeats are equal
                self.assertAlmostEqual(value, ratio)
        self.assertAlmostEqual(found.mean.ratio, 0.9 ** (1 / 3))

    def test_interval_of_nearness_has_the_truth(self) -> None:
        hits = 0
        for seed in range(100):
            dice = random.Random(seed)
            noisy = [replace(r, r_acc=r.r_acc * math.exp(dice.gauss(0, 0.1))) for r in drifting()]
            found = nearness(Series(noisy), "cave")
            assert found is not None
            hits += found.mean.low <= 1.0 <= found.mean.high
        self.assertGreaterEqual(hits, 85)

    def test_nearness_where_there_is_little_to_compare(self) -> None:
        once = [r for r in drifting() if r.repeat == 1]
        found = nearness(Series(once), "cave")
        assert found is not None
        self.assertTrue(math.isnan(found.points[10].low) and math.isnan(found.mean.high))
        for missing in ({"auto"}, {"host1", "hostN", "cl:gpu"}):
            left = [r for r in drifting() if r.backend not in missing]
            self.assertIsNone(nearness(Series(left), "cave"))

    def test_losses(self) -> None:
        slow = [replace(r, r_acc=r.r_acc / 3) if r.backend == "cl:gpu" and r.population == 10 else r
                for r in drifting()]
        found = Series(slow).losses()
        self.assertEqual([(loss.population, loss.backend, loss.base) for loss in found],
                         [(10, "cl:gpu", "host1"), (10, "cl:gpu", "hostN")])

    def test_hashes(self) -> None:
        records = [made_up(), made_up(backend="cl:gpu"), made_up(simulated_seconds=2.0,
                                                                 state_hash="2")]
        self.assertEqual(differences(records), [])
        self.assertEqual(differences(records + [failed(state_hash="9")]), [])
        found = differences(records + [made_up(backend="auto", state_hash="3", repeat=2)])
        self.assertEqual([d.hashes for d in found], [{"1": ["cl:gpu", "host1"], "3": ["auto"]}])

    def test_failures_are_forgotten_once_the_run_succeeds(self) -> None:
        self.assertEqual(len(Series([failed(), failed()]).failures()), 1)
        self.assertEqual(Series([failed(), made_up()]).failures(), [])

    def test_energy_of_a_robot_second(self) -> None:
        job = Job(MEASURE, "cave", 20, HOST, 1, 5.0)
        figures = energy_figures(job, NoReading(joules=300.0, watts=30.0, seconds=10.0,
                                                scope="package", meter="rapl"))
        self.assertEqual((figures["r_epss"], figures["scope"]), (3.0, "package"))
        self.assertTrue(math.isnan(energy_figures(job, NoReading(meter="rapl"))["r_epss"]))


class Broken:
    """Tests of a meter that fails."""

    def start(self) -> None:
        raise OSError(5, "no power")

    def stop(self) -> NoReading:
        raise AssertionError("never started")


class PlanTest(unittest.TestCase):
    """Tests of planning on a machine with known step times."""

    BACKENDS = (HOST, HOSTS, DEVICE, AUTO)

    @staticmethod
    def step_seconds(job: Job) -> float:
        if job.backend.is_device:
            return 4e-4 + 2e-6 * job.population
        return 1e-5 + 4e-5 * job.population

    def plan(self, **changes: object) -> Plan:
        plan = Plan({"cave": POPULATIONS, "hospital": (1, 100, 10_000)}, self.BACKENDS, 3, "short",
                    None)
        return replace(plan, **changes)  # type: ignore[arg-type]

    def play(self, plan: Plan, records: list[Record], most: int = 10_000) -> list[Job]:
        """Executes up to the given number of runs like a series, and adds their records."""
        history = History(records)
        jobs: list[Job] = []
        while len(jobs) < most and (left := remaining(plan, history)):
            job, expected = left[0]
            steps = job.simulated_seconds * 10
            wall = self.step_seconds(job) * steps
            record = made_up(purpose=job.purpose, world=job.world, population=job.population,
                             backend=job.backend.label, repeat=job.repeat, steps=steps,
                             simulated_seconds=job.simulated_seconds, wall_seconds=wall,
                             process_seconds=wall + 0.2)
            if job.purpose == MEASURE and job.repeat > 1:
                self.assertAlmostEqual(expected, wall + 0.2)
            records.append(record)
            history.add(record)
            jobs.append(job)
        return jobs

    def test_every_run_once(self) -> None:
        jobs = self.play(self.plan(), [])
        self.assertEqual(len({job.key for job in jobs}), len(jobs))
        measured = [job for job in jobs if job.purpose == MEASURE]
        self.assertEqual(len(measured), (11 + 3) * 4 * 3)
        purposes = [job.purpose for job in jobs]
        self.assertEqual(purposes[0], COMPILE)
        self.assertEqual(purposes.count(COMPILE), 1, "one device")
        self.assertEqual(purposes, sorted(purposes, key=[COMPILE, WARM_UP, MEASURE].index))

    def test_backends_take_turns(self) -> None:
        measured = [job for job in self.play(self.plan(), []) if job.purpose == MEASURE]
        points = [measured[i:i + 4] for i in range(0, len(measured), 4)]
        for point in points:
            self.assertEqual(len({(job.world, job.population, job.repeat) for job in point}), 1)
            self.assertEqual({job.backend for job in point}, set(self.BACKENDS))
        firsts = [point[0].backend.label for point in points]
        for backend in self.BACKENDS:
            self.assertAlmostEqual(firsts.count(backend.label), len(points) / 4, delta=1)
        cave_10 = [p[0].backend.label for p in points if (p[0].world, p[0].population) ==
                   ("cave", 10)]
        self.assertEqual(len(set(cave_10)), 3, "another one begins in each repeat")

    def test_each_backend_follows_each_other_as_often(self) -> None:
        for count in (1, 2, 3, 4, 5):
            backends = tuple(Backend(f"host:{n + 1}", ()) for n in range(count))
            turns = 2 * count if count % 2 else count
            orders = [balanced_order(backends, turn) for turn in range(turns)]
            followed = Counter(pair for order in orders for pair in zip(order, order[1:]))
            self.assertEqual(set(followed), set(itertools.permutations(backends, 2)))
            self.assertLessEqual(len(set(followed.values())), 1)
            for place in range(count):
                self.assertEqual(Counter(order[place] for order in orders),
                                 Counter({backend: turns // count for backend in backends}))

    def test_repeats_lie_far_apart(self) -> None:
        measured = [job for job in self.play(self.plan(), []) if job.purpose == MEASURE]
        repeats = [job.repeat for job in measured]
        self.assertEqual(repeats, sorted(repeats))

    def test_short_runs_are_short(self) -> None:
        records: list[Record] = []
        self.play(self.plan(), records)
        for n in POPULATIONS:
            walls = [r.wall_seconds for r in records
                     if (r.world, r.population, r.purpose) == ("cave", n, MEASURE)]
            mean = sum(walls) / len(walls)
            self.assertTrue(0.5 * SHORT_RUN_SECONDS < mean < 1.5 * SHORT_RUN_SECONDS, (n, mean))
        largest = [r for r in records if r.population == 10_000]
        self.assertEqual({r.steps for r in largest}, {LEAST_STEPS})

    def test_all_backends_simulate_the_same_seconds(self) -> None:
        records: list[Record] = []
        self.play(self.plan(), records)
        for n in POPULATIONS:
            seconds = {r.simulated_seconds for r in records
                       if (r.world, r.population, r.purpose) == ("cave", n, MEASURE)}
            self.assertEqual(len(seconds), 1)

    def test_a_resumed_series_is_the_same(self) -> None:
        whole = [job.key for job in self.play(self.plan(), [])]
        for cut in (1, 5, 20, 61, 150):
            records: list[Record] = []
            first = self.play(self.plan(), records, most=cut)
            second = self.play(self.plan(), records)
            self.assertEqual([job.key for job in first + second], whole)

    def test_fixed_seconds(self) -> None:
        jobs = self.play(self.plan(form="long", fixed_seconds=600.0), [])
        self.assertEqual({job.simulated_seconds for job in jobs if job.purpose == MEASURE}, {600.0})
        self.assertEqual(len([job for job in jobs if job.purpose == WARM_UP]), 2 * 4)

    def test_a_failed_run_is_left_until_the_next_call(self) -> None:
        plan = self.plan(worlds={"cave": (10,)}, backends=(HOST,), repeats=2, fixed_seconds=2.0)
        history = History([])
        history.add(failed(purpose=WARM_UP))
        self.assertEqual([(job.purpose, job.repeat) for job, _ in remaining(plan, history)],
                         [(MEASURE, 1), (MEASURE, 2)])
        again = History([failed(purpose=WARM_UP)])
        self.assertEqual(len(remaining(plan, again)), 3)


class StoreTest(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name) / "raw.csv"

    def write(self, *records: Record) -> None:
        raw = store.RawFile(self.path)
        for record in records:
            raw.append(record)
        raw.close()

    def test_records_come_back(self) -> None:
        records = [made_up(machine='A "fast" CPU, 2 cores', notes="two\nlines"),
                   failed(joules=1.5), made_up(r_epss=0.25, repeat=2)]
        self.write(*records)
        back = store.read_records(self.path)[0]
        self.assertEqual(back[0].notes, "two lines")
        self.assertEqual(back[0].machine, records[0].machine)
        self.assertTrue(math.isnan(back[0].r_epss))
        self.assertEqual((back[1].error, back[1].ok, back[1].joules), ("no", False, 1.5))
        self.assertEqual(back[2].r_epss, 0.25)

    def test_each_line_is_on_the_disk_at_once(self) -> None:
        raw = store.RawFile(self.path)
        self.addCleanup(raw.close)
        for i in range(3):
            raw.append(made_up(repeat=i + 1))
            self.assertEqual(len(store.read_records(self.path)[0]), i + 1)

    def test_a_damaged_line_in_the_middle_is_named(self) -> None:
        self.write(made_up(), made_up(repeat=2))
        lines = self.path.read_text(encoding="utf-8").splitlines(keepends=True)
        self.path.write_text(lines[0] + "abc,def\n" + lines[2], encoding="utf-8")
        with self.assertRaisesRegex(store.StoreError, r"raw\.csv:2: not a line of this file"):
            store.RawFile(self.path)

    def test_other_columns_are_refused(self) -> None:
        self.path.write_text("a,b\n1,2\n", encoding="utf-8")
        with self.assertRaisesRegex(store.StoreError, "its columns differ"):
            store.RawFile(self.path)


class MachineTest(unittest.TestCase):
    LISTING = """\
  gpu: Mali-T628 (ARM Platform, OpenCL 1.2 v1.r12, 4 compute units, 1994 MiB)
  gpu: Mali-T628 (ARM Platform, OpenCL 1.2 v1.r12, 2 compute units, 1994 MiB)
  cpu: pthread-Xeon(R) (Portable Computing Language, OpenCL 3.0 PoCL, 2 compute units, 9 MiB)
  accelerator: Stick (Sticks (tm), OpenCL 1.0, 1 compute units, 3 MiB)
"""

    def test_devices_get_names_that_choose_them(self) -> None:
        devices = machine.parse_devices(self.LISTING)
        self.assertEqual([device.choice for device in devices], ["gpu:0", "gpu:1", "cpu", "Stick"])
        self.assertEqual((devices[2].name, devices[2].platform, devices[2].version),
                         ("pthread-Xeon(R)", "Portable Computing Language",
                          "OpenCL 3.0 PoCL"))
        self.assertEqual(machine.parse_devices("stage: no OpenCL driver is installed\n"), ())

    def test_identity_and_folder(self) -> None:
        devices = machine.parse_devices(self.LISTING)
        board = machine.Machine("Intel(R) Xeon(R) CPU E5 @ 2.60GHz", "x86_64", 2, 24, True, "Linux",
                                "", devices)
        self.assertEqual(board.folder_name, "intel-xeon-e5-2-cores-mali-t628-mali-t628-stick")
        self.assertNotEqual(board.identity, replace(board, devices=()).identity)
        self.assertEqual(board.identity, replace(board, system="Linux 7").identity)

    def test_boards_name_themselves(self) -> None:
        core = "model name\t: ARMv7 Processor rev 3 (v7l)\n"
        for cpuinfo, board, name in (
                ("model name\t: Fast CPU\n", "", "Fast CPU"),
                (f"{core}Hardware\t: ODROID-XU4\n", "", "ODROID-XU4"),
                (f"{core}Hardware\t: BCM2835\nModel\t: Pi 4\n", "", "Pi 4"),
                (core, "Hardkernel Odroid XU4", "Hardkernel Odroid XU4"),
                ("CPU implementer\t: 0x41\n", "Orange Pi 5", "Orange Pi 5"),
                ("", "", platform.machine())):
            self.assertEqual(machine.cpu_name(cpuinfo, board), name)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class SmallThings(unittest.TestCase):
    def test_progress_on_a_terminal_is_one_line(self) -> None:
        stream = Terminal()
        progress = Progress(stream)
        progress.show(3, 12, "cave 10", 125)
        progress.show(4, 12, "cave 20", 60)
        progress.clear()
        self.assertIn("[######------------------] 3/12, about 2 min left; cave 10",
                      stream.getvalue())
        self.assertNotIn("\n", stream.getvalue())

    def test_progress_elsewhere_is_a_line_now_and_then(self) -> None:
        stream = io.StringIO()
        progress = Progress(stream)
        for i in range(50):
            progress.show(i, 50, "cave", 10)
        self.assertEqual(stream.getvalue().count("\n"), 1)

    def test_texts(self) -> None:
        self.assertEqual([duration_text(s) for s in (0.4, 89, 600, 9000)],
                         ["0 s", "89 s", "10 min", "2.5 h"])
        self.assertEqual([number(v) for v in (0, 0.0001, 0.0123, 0.5, 1.234, 56.78, 1234.5, 54321)],
                         ["0", "1.00e-04", "0.0123", "0.500", "1.23", "56.8", "1234", "54 321"])

    def test_a_broken_meter_costs_the_energy_alone(self) -> None:
        meter = GuardedMeter(Broken(), (OSError,))
        meter.start()
        reading = meter.stop()
        self.assertIsNone(reading.joules)
        self.assertIn("no power", str(reading.notes))


if __name__ == "__main__":
    unittest.main()
