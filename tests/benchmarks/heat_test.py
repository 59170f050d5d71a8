#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests of temperature and clock in benchmarks/series --board, with folders like sysfs."""

from __future__ import annotations

import math
import tempfile
import unittest
from pathlib import Path
from unittest import mock

from power_testing import MeterTestCase
from series_testing import made_up
from benchkit.heat import Chip, HeatWatch, Look, throttling
from benchkit.series import records as store
from benchkit.series.analysis import Series
from benchkit.series.begun import MOST_ATTEMPTS, Begun
from benchkit.series.measure import Circumstances, Measurer
from benchkit.series.energy import NoMeter
from benchkit.series.report import report_text
from benchkit.series.runs import Backend, Job

FLAGS_FILE = "sys/devices/platform/soc/soc:firmware/get_throttled"


class HeatTest(MeterTestCase):
    """A board with two clusters, two thermal zones (one of them off), and the flags of a
    Raspberry Pi."""

    def setUp(self) -> None:
        super().setUp()
        self.heat(40)
        self.write("sys/class/thermal/thermal_zone1/temp", -273000)
        for cpu, most in ((0, 1_800_000), (4, 2_400_000)):
            self.clock_file(cpu, "cpuinfo_max_freq", most)
            self.clock_file(cpu, "scaling_max_freq", most)
            self.clock_file(cpu, "scaling_cur_freq", most)
        self.write(FLAGS_FILE, 0)
        self.write("sys/class/thermal/cooling_device0/type", "thermal-cpufreq-0")
        self.write("sys/class/thermal/cooling_device0/cur_state", 0)
        self.write("sys/class/thermal/cooling_device1/type", "pwm-fan")
        self.write("sys/class/thermal/cooling_device1/cur_state", 3)
        self.watch = HeatWatch(Chip(self.root), self.clock)

    def heat(self, celsius: float) -> None:
        self.write("sys/class/thermal/thermal_zone0/temp", round(celsius * 1000))

    def clock_file(self, cpu: int, name: str, value: int) -> None:
        self.write(f"sys/devices/system/cpu/cpu{cpu}/cpufreq/{name}", value)

    def run_of(self, seconds: float, *events: tuple[float, object]) -> dict:
        """A run during which events happen at the given times."""
        begun = self.clock.now
        left = list(events)

        def show(now: float) -> None:
            while left and now - begun >= left[0][0]:
                left.pop(0)[1]()  # type: ignore[operator]
        self.clock.world = show
        self.watch.begin()
        self.clock.advance(seconds)
        return self.watch.end()

    def test_a_cool_run(self) -> None:
        self.watch.cool_down()
        found = self.run_of(10, (3, lambda: self.heat(61.5)), (6, lambda: self.heat(55)))
        self.assertEqual(found, {"celsius_before": 40, "celsius_most": 61.5, "celsius_after": 55,
                                 "cooling_seconds": 0, "clock_least": 1, "throttled": ""})

    def test_the_clock_is_that_of_the_fastest_core(self) -> None:
        self.clock_file(0, "scaling_cur_freq", 600_000)
        found = self.run_of(10, (4, lambda: self.clock_file(4, "scaling_cur_freq", 1_200_000)))
        self.assertAlmostEqual(found["clock_least"], 0.5)

    def test_each_way_of_throttling(self) -> None:
        limit = "sys/class/thermal/cooling_device0/cur_state"
        for event, undo, why in (
                (lambda: self.write(FLAGS_FILE, "50005"), lambda: self.write(FLAGS_FILE, "50000"),
                 "low voltage, throttled by firmware"),
                (lambda: self.write(limit, 2), lambda: self.write(limit, 0),
                 "cooling by thermal-cpufreq-0"),
                (lambda: self.clock_file(4, "scaling_max_freq", 1_000_000),
                 lambda: self.clock_file(4, "scaling_max_freq", 2_400_000), "clock limit lowered")):
            with self.subTest(why=why):
                found = self.run_of(10, (4, event), (6, undo))
                self.assertEqual(found["throttled"], why)
                # Flags that were set by earlier events do not affect the next run.
                self.assertEqual(self.run_of(10)["throttled"], "")

    def test_flags_that_fell_between_two_looks_are_remembered(self) -> None:
        found = self.run_of(10, (9.5, lambda: self.write(FLAGS_FILE, "80000")))
        self.assertEqual(found["throttled"], "soft temperature limit")

    def test_a_raspberry_pi_5_has_the_flags_elsewhere(self) -> None:
        (self.root / FLAGS_FILE).unlink()
        self.write("sys/devices/platform/soc@107c000000/soc@107c000000:firmware/get_throttled", "4")
        self.assertEqual(throttling([Chip(self.root).look()]), ["throttled by firmware"])

    def cool(self, celsius_at: object) -> tuple[float, float]:
        """Returns how long the chip is cooled down for this course of temperature, and the last
        temperature."""
        begun = self.clock.now
        self.clock.world = lambda now: self.heat(celsius_at(now - begun))  # type: ignore[operator]
        self.clock.show()
        self.watch.cool_down()
        return self.clock.now - begun, Chip(self.root).celsius()

    def test_cooling_down(self) -> None:
        seconds, celsius = self.cool(lambda t: 80 - t / 5)
        self.assertEqual((seconds, celsius), (150, 50))

    def test_a_chip_that_gets_no_cooler_is_cool(self) -> None:
        seconds, celsius = self.cool(lambda t: max(58.0, 80 - t / 5))
        self.assertEqual(celsius, 58)
        self.assertTrue(110 + 50 <= seconds <= 110 + 70, seconds)

    def test_cooling_is_bounded(self) -> None:
        seconds, _ = self.cool(lambda t: 100 - t / 100)
        self.assertTrue(590 <= seconds <= 600, seconds)

    def test_a_machine_that_tells_nothing(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            self.watch = HeatWatch(Chip(Path(folder)), self.clock)
            self.watch.cool_down()
            found = self.run_of(10)
        self.assertEqual(self.clock.now, 1010)
        self.assertTrue(math.isnan(found["celsius_most"]) and math.isnan(found["clock_least"]))
        self.assertEqual(found["throttled"], "")

    def test_a_run_that_never_ends_is_given_up(self) -> None:
        def measurer() -> Measurer:
            """Makes a Measurer, as after another start of the machine."""
            worlds = mock.Mock(**{"path.side_effect": SystemExit})
            return Measurer(Path("/nowhere/stage"), worlds,
                            Circumstances("c", "p", "m", "s", "short", 1), NoMeter(), self.watch,
                            Begun(self.root))
        first, second = (Job(store.MEASURE, "cave", 10, Backend("host1", ()), repeat, 2.0)
                         for repeat in (1, 2))
        for job in (first, second):
            for attempt in range(MOST_ATTEMPTS):
                self.assertEqual(Begun(self.root).attempts(job.key), attempt)
                with mock.patch.object(Begun, "end"), self.assertRaises(SystemExit):
                    measurer().do(job, None)
        for job in (first, second):  # neither may hide the other
            self.assertRegex(measurer().do(job, None).error, "started 3 times without ever ending")
        self.assertEqual(Begun(self.root).attempts(first.key), MOST_ATTEMPTS)
        (self.root / "begun.json").write_text("\0\0", encoding="utf-8")
        with self.assertRaises(SystemExit):
            measurer().do(first, None)
        self.assertFalse((self.root / "begun.json").exists(), "an end is an end")

    def test_records_and_report(self) -> None:
        measurer = Measurer(Path("/nowhere/stage"), mock.Mock(**{"path.return_value": Path("w")}),
                            Circumstances("c", "p", "m", "s", "short", 1), NoMeter(), self.watch,
                            Begun(self.root))
        job = Job(store.MEASURE, "cave", 10, Backend("host1", ()), 1, 2.0)
        self.write("sys/class/thermal/cooling_device0/cur_state", 1)
        record = measurer.do(job, None)
        self.assertIn("cannot run", record.error)
        self.assertEqual((record.celsius_before, record.throttled),
                         (40, "cooling by thermal-cpufreq-0"))
        path = self.root / "raw.csv"
        raw = store.RawFile(path, board=True)
        raw.append(record)
        raw.close()
        self.assertEqual(store.read_records(path)[0][0].throttled, record.throttled)
        with self.assertRaisesRegex(store.StoreError, "made with --board; give another folder"):
            store.RawFile(path)

        hot = made_up(cooling_seconds=5.0, celsius_most=85.0, throttled="low voltage")
        cool = made_up(cooling_seconds=5.0, celsius_most=60.0, repeat=2)
        text = report_text(Series([hot, cool]), [], {}, "")
        self.assertIn("**The chip was throttled** in 1 of 2 runs", text)
        self.assertIn("| cave | 10 | host, 1 thread | 1 | 85.0 | low voltage |", text)
        text = report_text(Series([cool]), [], {}, "")
        self.assertIn("No sensor reported that the chip was throttled.", text)
        text = report_text(Series([made_up(cooling_seconds=0.0)]), [], {}, "")
        self.assertIn("whether it was throttled is not known", text)
        self.assertNotIn("Heat and clock", report_text(Series([made_up()]), [], {}, ""))


if __name__ == "__main__":
    unittest.main()
