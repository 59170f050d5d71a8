#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests of energy meters: RAPL, the common behaviour of meters that read sensors, and the choice of a meter."""

from __future__ import annotations

import errno
import shutil
import threading
import unittest
from pathlib import Path
from unittest import mock

from power_testing import FalseClock, FalseNvml, MeterTestCase
from meters import MeterError, list_meters, open_meter
from meters.clock import Clock, Repeater

PACKAGE_RANGE = 262143.32885  # joules; counter range of a real processor


class RaplTest(MeterTestCase):
    """Tests of counters that wrap."""

    def run_package(self, watts: float, seconds: float, start: float,
                    wrap: float = PACKAGE_RANGE) -> object:
        """Measures a package of constant power, whose counter begins at `start` joules."""
        path = self.zone("0", "package-0", start, wrap)
        begin = self.clock.now

        def world(now: float) -> None:
            path.write_text(str(round((start + watts * (now - begin)) % wrap * 1e6)))
        self.clock.world = world
        meter = open_meter("rapl", self.root, clock=self.clock)
        meter.start()
        self.clock.advance(seconds)
        return meter.stop()

    def test_counts_what_was_used_between_start_and_stop(self) -> None:
        reading = self.run_package(watts=40, seconds=10, start=1234.5)
        self.assertAlmostEqual(reading.joules, 400, places=3)
        self.assertAlmostEqual(reading.seconds, 10)
        self.assertAlmostEqual(reading.watts, 40, places=3)
        self.assertEqual((reading.scope, reading.meter, reading.method, reading.notes),
                         ("package", "rapl", "counter", []))
        self.assertEqual(reading.samples, 12)  # one per second, plus one at each end

    def test_one_wrap(self) -> None:
        reading = self.run_package(watts=100, seconds=60, start=PACKAGE_RANGE - 3000)
        self.assertAlmostEqual(reading.joules, 6000, places=3)

    def test_several_wraps_in_a_long_run(self) -> None:
        reading = self.run_package(watts=450, seconds=2000, start=200_000)
        self.assertGreater(reading.joules / PACKAGE_RANGE, 3)
        self.assertAlmostEqual(reading.joules, 900_000, places=2)

    def test_a_small_range_is_sampled_often_enough(self) -> None:
        reading = self.run_package(watts=1900, seconds=20, start=0, wrap=1000)
        self.assertAlmostEqual(reading.joules, 38_000, places=2)
        self.assertLessEqual(self.clock.periods[0], 0.25)

    def test_wraps_that_may_have_been_missed_give_no_figure(self) -> None:
        path = self.zone("0", "package-0", 0, 1000)
        meter = open_meter("rapl", self.root, clock=self.clock)
        meter.start()
        self.clock.stall(20)
        path.write_text("500000000")
        self.assert_no_figure(meter.stop(), "could not be sampled for 20.0 s.*wrapped more than")

    def test_a_reset_gives_no_figure_and_no_huge_number(self) -> None:
        path = self.zone("0", "package-0", 150_000)
        meter = open_meter("rapl", self.root, clock=self.clock)
        meter.start()
        self.clock.advance(3)
        path.write_text("5000000")
        self.clock.advance(3)
        self.assert_no_figure(meter.stop(), "package-0 went back from 150000 J to 5 J within 1 s")

    def test_a_jump_forwards_gives_no_figure(self) -> None:
        path = self.zone("0", "package-0", 5)
        meter = open_meter("rapl", self.root, clock=self.clock)
        meter.start()
        self.clock.advance(3)
        path.write_text("150000000000")
        self.assert_no_figure(meter.stop(), "package-0 jumped by 149995 J within")

    def test_a_value_beyond_the_range_gives_no_figure(self) -> None:
        for text in ("300000000000", "-5"):
            path = self.zone("0", "package-0", 5)
            meter = open_meter("rapl", self.root, clock=self.clock)
            meter.start()
            path.write_text(text)
            self.assert_no_figure(meter.stop(), "out of its range")

    def test_packages_are_added_but_neither_their_parts_nor_others(self) -> None:
        zones = {"0": "package-0", "0:0": "core", "0:1": "dram", "1": "package-1", "1:0": "core",
                 "1:1": "dram", "2": "psys"}
        paths = [self.zone(number, name) for number, name in zones.items()]
        paths.append(self.zone("0", "package-0", kind="intel-rapl-mmio"))

        def world(now: float) -> None:
            for index, path in enumerate(paths):
                path.write_text(str(round(10**index * (now - 1000) * 1e3)))
        self.clock.world = world
        want = {"rapl": 10.01, "rapl:package-1": 10, "rapl:core": 100.1, "rapl:dram": 1001,
                "rapl:psys": 10_000}
        scopes = {"rapl": "package", "rapl:package-1": "package", "rapl:core": "rail",
                  "rapl:dram": "rail", "rapl:psys": "system"}
        for spec, joules in want.items():
            meter = open_meter(spec, self.root, clock=self.clock)
            with meter.measuring() as measurement:
                self.clock.advance(10)
            self.assertAlmostEqual(measurement.reading.joules, joules, places=3, msg=spec)
            self.assertEqual(measurement.reading.scope, scopes[spec])
        self.assertEqual([info.spec for info in list_meters(self.root, clock=self.clock)],
                         ["rapl", "rapl:package-0", "rapl:package-1", "rapl:psys", "rapl:core",
                          "rapl:dram"])

    def test_a_zone_within_one_of_the_same_name_is_not_added(self) -> None:
        self.zone("0", "package-0")
        self.zone("0:0", "core")
        inner = self.zone("0:0:0", "core")
        outer = self.root / "sys/class/powercap/intel-rapl:0:0/energy_uj"
        meter = open_meter("rapl:core", self.root, clock=self.clock)
        meter.start()
        self.clock.advance(0.9)
        inner.write_text("2000000")
        outer.write_text("5000000")
        self.assertAlmostEqual(meter.stop().joules, 5)

    def test_a_zone_that_vanishes(self) -> None:
        path = self.zone("0", "package-0")
        meter = open_meter("rapl", self.root, clock=self.clock)
        meter.start()
        self.clock.advance(2.5)
        path.unlink()
        self.clock.advance(10)
        reading = meter.stop()
        self.assert_no_figure(reading, "^RAPL package-0 vanished after 3.0 s: no figure$")
        self.assertAlmostEqual(reading.seconds, 12.5)

    def test_a_second_package_that_does_not_move_spoils_the_sum(self) -> None:
        path = self.zone("0", "package-0")
        self.zone("1", "package-1")
        meter = open_meter("rapl", self.root, clock=self.clock)
        meter.start()
        self.clock.advance(3.5)
        path.write_text("30000000")
        self.assert_no_figure(meter.stop(), "package-1 did not move in 3.5 s")

    def test_misreads_are_bridged_but_not_at_the_ends(self) -> None:
        path = self.zone("0", "package-0")
        meter = open_meter("rapl", self.root, clock=self.clock)
        for bad_at, figure in ((0, False), (2, True), (4, False)):
            def world(now: float) -> None:
                elapsed = now - begin
                path.write_text("soon" if elapsed == bad_at else str(round(elapsed * 7e6)))
            begin = self.clock.now
            self.clock.world = world
            meter.start()
            self.clock.advance(4)
            reading = meter.stop()
            if figure:
                self.assertAlmostEqual(reading.joules, 28, places=3)
                self.assertEqual(reading.notes, ["1 of 6 samples failed and were bridged"])
            else:
                self.assert_no_figure(reading, r"found 'soon', expected a whole number \(at the")

    def test_states(self) -> None:
        path = self.zone("0", "package-0")
        self.assertEqual(list_meters(self.root, clock=self.clock)[0].state, "usable")
        path.unlink()
        path.mkdir()  # can't be read, even by root
        state = list_meters(self.root, clock=self.clock)[0].state
        self.assertEqual(state, f"{path} can't be read: Is a directory")
        with self.assertRaisesRegex(MeterError, "^meter 'rapl': .*energy_uj can't be read"):
            open_meter("rapl", self.root, clock=self.clock)

    def test_permission_denied(self) -> None:
        path = self.zone("0", "package-0")
        meter = open_meter("rapl", self.root, clock=self.clock)
        denied = PermissionError(errno.EACCES, "Permission denied", str(path))
        with mock.patch("meters.rapl.read_whole_number", side_effect=denied):
            meter.start()
            self.assert_no_figure(meter.stop(), f"^needs root: {path} can't be read")
            self.assertEqual(meter.state(), f"needs root: {path} can't be read")

    def test_wrong_specs_say_what_there_is(self) -> None:
        with self.assertRaisesRegex(MeterError, "found no zone in .*powercap, expected"):
            open_meter("rapl", self.root)
        self.zone("0", "package-0")
        with self.assertRaisesRegex(MeterError, "expected one of rapl, rapl:package-0$"):
            open_meter("rapl:gpu", self.root)
        self.zone("0", "package-0", wrap=0)
        with self.assertRaisesRegex(MeterError, "max_energy_range_uj: found 0, expected at least"):
            open_meter("rapl", self.root)


class RunTest(MeterTestCase):
    """Tests that apply to every meter with sensors."""

    def test_a_meter_can_be_used_again_and_forgets(self) -> None:
        path = self.zone("0", "package-0")
        self.clock.world = lambda now: path.write_text(str(round((now - 1000) * 5e6)))
        meter = open_meter("rapl", self.root, clock=self.clock)
        for seconds in (2, 8):
            meter.start()
            self.clock.advance(seconds)
            self.assertAlmostEqual(meter.stop().joules, seconds * 5)
            self.clock.advance(100)

    def test_a_second_start_begins_anew(self) -> None:
        path = self.zone("0", "package-0")
        self.clock.world = lambda now: path.write_text(str(round((now - 1000) * 5e6)))
        meter = open_meter("rapl", self.root, clock=self.clock)
        meter.start()
        self.clock.advance(10)
        meter.start()
        self.clock.advance(1)
        self.assertAlmostEqual(meter.stop().joules, 5)
        self.assertEqual(self.clock.running, [])

    def test_stop_without_start(self) -> None:
        self.zone("0", "package-0")
        self.assert_no_figure(open_meter("rapl", self.root).stop(), "without start")

    def test_a_machine_that_slept_gives_no_figure(self) -> None:
        meter = open_meter("constant:5", clock=self.clock)
        meter.start()
        self.clock.advance(3)
        self.clock.slept += 60
        self.assert_no_figure(meter.stop(), "suspended for 60.0 s")

    def test_a_slow_read_is_noted(self) -> None:
        path = self.zone("0", "package-0")
        meter = open_meter("rapl", self.root, clock=self.clock)
        reads = iter(((0.2, 0), (0.5, 10_000_000), (0.6, 20_000_000)))

        def slow(_: Path) -> int:
            seconds, value = next(reads)
            self.clock.now += seconds
            return value
        with mock.patch("meters.rapl.read_whole_number", side_effect=slow):
            meter.start()
            self.clock.advance(1.2)
            reading = meter.stop()
        self.assertAlmostEqual(reading.joules, 20)
        self.assertAlmostEqual(reading.seconds, 1.9)  # from the middle of the first read to that of the last
        self.assertIn("reading the source took 0.60 s", reading.notes[-1])
        self.assertTrue(path.exists())

    def test_a_run_that_fails_is_still_measured_and_keeps_its_error(self) -> None:
        meter = open_meter("constant:5", clock=self.clock)
        with self.assertRaises(KeyError), meter.measuring() as measurement:
            self.clock.advance(2)
            raise KeyError("the run's own")
        self.assertAlmostEqual(measurement.reading.joules, 10)


class ThreadTest(MeterTestCase):
    """Tests with real threads and the real clock."""

    def setUp(self) -> None:
        super().setUp()
        self.threads = threading.active_count()

    def tearDown(self) -> None:
        self.assertEqual(threading.active_count(), self.threads)
        super().tearDown()

    def test_sampling_of_power(self) -> None:
        # Slow averages, so that a busy machine does not matter.
        self.chip(0, "ina219", power1_average=2_500_000, power1_average_interval=60_000)
        meter = open_meter("hwmon", self.root)
        with meter.measuring() as measurement:
            self.assertEqual(threading.active_count(), self.threads + 1)
            Clock().sleep(0.15)
        reading = measurement.reading
        self.assertGreaterEqual(reading.samples, 3)  # one at each end, and one at 0.1 s
        self.assertGreaterEqual(reading.seconds, 0.15)
        self.assertAlmostEqual(reading.joules, 2.5 * reading.seconds)

    def test_the_thread_ends_when_the_run_or_the_sensor_fails(self) -> None:
        path = self.zone("0", "package-0")
        meter = open_meter("rapl", self.root)
        with self.assertRaises(KeyError), meter.measuring():
            path.unlink()
            raise KeyError

    def test_a_read_that_hangs_does_not_hold_up_the_run(self) -> None:
        self.zone("0", "package-0")
        for hangs_at in (1, 2):
            meter = open_meter("rapl", self.root)
            go_on, reads = threading.Event(), []

            def hang(_: Path) -> int:
                reads.append(0)
                if len(reads) == hangs_at:
                    go_on.wait(10)
                return 0
            quick = lambda self, period, action: Repeater(period, action, hang_seconds=0.05)
            with (mock.patch("meters.rapl.read_whole_number", side_effect=hang),
                  mock.patch.object(Clock, "repeat", quick)):
                with meter.measuring() as measurement:
                    if hangs_at == 1:
                        go_on.set()  # too late, because the run has begun
                        Clock().sleep(0.02)
                self.assert_no_figure(measurement.reading, "rapl was not read within")
                go_on.set()
                for thread in threading.enumerate():
                    if thread.name == "energy meter":
                        thread.join()


class AutoTest(MeterTestCase):
    """Tests of the choice of a meter."""

    def test_the_widest_scope_that_is_usable(self) -> None:
        nvml = FalseNvml(("Old", None, 60.0))

        def chosen() -> str:
            return open_meter("auto", self.root, clock=FalseClock(), nvml=nvml).name
        with self.assertRaisesRegex(MeterError, "^meter 'auto': found none that is usable; "):
            open_meter("auto", self.root)
        self.chip(0, "ina219", power1_input=5)
        self.assertEqual(open_meter("auto", self.root).name, "hwmon:ina219/power1")
        self.assertEqual(chosen(), "nvml")
        package = self.zone("0", "package-0")
        self.zone("0:0", "core")
        self.zone("1", "psys")
        self.assertEqual(chosen(), "rapl")
        self.chip(1, "power_meter", power1_average=5)
        self.assertEqual(chosen(), "hwmon:power_meter/power1")
        shutil.rmtree(self.root / "sys/class/hwmon/hwmon1")
        package.unlink()
        self.assertEqual(chosen(), "nvml")


if __name__ == "__main__":
    unittest.main()
