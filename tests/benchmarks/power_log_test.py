#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests of energy from loggers' files and from an assumed power, and of the program tools/power."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path
from typing import Callable

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from patience import PATIENCE, slowness
from power_testing import EPOCH, ROOT, MeterTestCase
from meters import MeterError, open_meter
from meters.csv_log import Log, parse_log

POWER = ROOT / "tools" / "power"
FIXTURE = ROOT / "tests/data/power/shunt.csv"


class LogTest(MeterTestCase):
    """Tests of integration, and of the format of logs."""

    def log(self, text: str, name: str = "log.csv") -> Path:
        path = self.root / name
        path.write_text(text, encoding="utf-8")
        return path

    def lines(self, watts: Callable[[float], float], begin: float, end: float,
              step: float = 0.01) -> str:
        """A log of a supply of 5 V."""
        count = round((end - begin) / step)
        times = [begin + index * step for index in range(count + 1)]
        return "".join(f"{t:.4f},5.0,{watts(t) / 5:.9f}\n" for t in times)

    def assert_refused(self, text: str, pattern: str, begin: float = 10, end: float = 12,
                       **options: float) -> None:
        """Expects an error with the file, the line, and what was found there."""
        path = self.log(text)
        with self.assertRaisesRegex(MeterError, f"^{path}:{pattern}"):
            Log(path, **options).integrate(begin, end)

    def test_a_sine_against_its_closed_form(self) -> None:
        mean, swing, omega = 8.0, 3.0, 2 * math.pi * 1.7
        path = self.log(self.lines(lambda t: mean + swing * math.sin(omega * t), 0, 30))

        def area(t: float) -> float:
            return mean * t - swing / omega * math.cos(omega * t)
        # The trapezoidal rule's error is at most h² / 12 times the largest curvature times the length.
        for begin, end in ((3.0, 23.0), (3.00417, 22.99981), (5.0021, 5.0043), (5.001, 5.017)):
            most = 0.01**2 / 12 * swing * omega**2 * (end - begin + 0.02) + 1e-7
            joules, samples = Log(path).integrate(begin, end)
            self.assertLess(abs(joules - (area(end) - area(begin))), most)
            self.assertAlmostEqual(samples, (end - begin) / 0.01, delta=1.01)

    def test_a_ramp_is_exact_with_both_ends_between_lines(self) -> None:
        path = self.log(self.lines(lambda t: 2 * t, 0, 20, step=0.5))
        for begin, end in ((3.0, 8.0), (3.1, 8.3), (3.1, 3.2), (0.0, 20.0)):
            joules, _ = Log(path).integrate(begin, end)
            self.assertAlmostEqual(joules, end**2 - begin**2, places=6)

    def test_ways_to_write_the_same(self) -> None:
        for text in ("9,5,2\n10,5,2\n11,5,2\n12,5,2\n13,5,2\n",
                     "Seconds;U;I\n9;5;2\n10;5;2\n11;5;2\n12;5;2\n",
                     "# logger 7\n\nt v i\n10 5 2\n11 5 2\n11 5 2\n12 5 2\n",
                     "\ufefftime\tvolts\tamps\tcelsius\n10\t5\t2\t\n11\t5\t2\t40\n12\t5\t2\n",
                     "amps, time, volts\r\n2, 10, 5\r\n2, 11, 5\r\n2, 12, 5\r\n"):
            joules, samples = Log(self.log(text)).integrate(10, 12)
            self.assertAlmostEqual(joules, 20, msg=text)
            self.assertIn(samples, (3, 4), text)

    def test_a_log_that_does_not_cover_the_interval(self) -> None:
        rows = "10.5,5,2\n11,5,2\n11.5,5,2\n"
        self.assert_refused(rows, "1: the log begins 0.500 s after the run", 10, 11)
        self.assert_refused(rows, "3: the log ends 0.500 s before the run", 10.5, 12)
        # A line without a newline may be incomplete: "2" of "25".
        self.assert_refused(rows + "12,5,2", "3: the log ends 0.500 s", 10.5, 12)
        path = self.log("time,volts,amps\n")
        with self.assertRaisesRegex(MeterError, f"^{path}: found no line"):
            Log(path).integrate(1, 2)

    def test_gaps(self) -> None:
        rows = "1,5,2\n10,5,2\n11,5,2\n12.1,5,2\n20,5,2\n"
        self.assert_refused(rows, "4: found a gap of 1.100 s, expected at most 1 s")
        self.assertAlmostEqual(Log(self.log(rows)).integrate(10, 11)[0], 10)  # no sample within the
                                                                              # interval

    def test_values_that_are_none(self) -> None:
        for bad in ("nan,2", "5,nan", "inf,2", "5,-", "5,"):
            rows = f"10,5,2\n11,{bad}\n12,5,2\n"
            self.assert_refused(rows, "2: found '.*', expected (volts|amps)$")
        self.assert_refused("10,5,2\nsoon,5,2\n12,5,2\n", "2: found 'soon', expected a time")
        self.assert_refused("10,5,2\nnan,5,2\n12,5,2\n", "2: found 'nan', expected a time")
        self.assert_refused("10,5,2\n11,5\n12,5,2\n", "2: found 2 columns, expected time, volts")
        self.assert_refused("0;1,5;2\n10,5;5;2\n", "2: found '10,5', expected a time")
        # Invalid values outside the interval do not matter.
        rows = "8,nan,2\n9,5,-\n10,5,2\n11,5,2\n12,5,2\n13,-,2\n"
        self.assertAlmostEqual(Log(self.log(rows)).integrate(10, 12)[0], 20)

    def test_impossible_power(self) -> None:
        self.assert_refused("10,5,2\n11,5,-2\n12,5,2\n", "2: found -10 W, expected none below 0")
        self.assert_refused("10,5,2\n11,5,2e6\n12,5,2\n", r"2: found 1e\+07 W, expected at most")

    def test_time_running_backwards(self) -> None:
        self.assert_refused("10,5,2\n11,5,2\n10.9,5,2\n12,5,2\n",
                            "3: found time running backwards by 0.1 s")
        self.assert_refused("5,5,2\n4,5,2\n10,5,2\n12,5,2\n", "2: found time running backwards")

    def test_the_drop_across_a_shunt(self) -> None:
        log = Log(FIXTURE, offset=EPOCH, shunt=0.05)
        watts = [5.02 * 0.82, 5.02 * 0.82, 5 * 1.2, 5 * 1.2, 4.98 * 1.6]
        joules, samples = log.integrate(EPOCH, EPOCH + 1)
        self.assertAlmostEqual(joules, sum((a + b) / 8 for a, b in zip(watts, watts[1:])), places=5)
        self.assertEqual(samples, 5)
        with self.assertRaisesRegex(MeterError, r"shunt.csv:3: .*drop, expected time, volts, amps"):
            Log(FIXTURE).integrate(0, 1)
        self.assert_refused("time,volts,amps\n10,5,2\n", "1: .*amps, expected time, volts, drop",
                            shunt=0.05)

    def test_specs(self) -> None:
        self.assertEqual(parse_log("a.csv"), Log(Path("a.csv")))
        self.assertEqual(parse_log("a@b.csv"), Log(Path("a@b.csv")))
        self.assertEqual(parse_log("d/a.csv@17.5?shunt=0.05"), Log(Path("d/a.csv"), 17.5, 0.05))
        for spec, pattern in (("csv:a?shunt=0", "found shunt=0, expected ohms"),
                              ("csv:a?shunt=x", "found shunt=x, expected ohms"),
                              ("csv:a@nan", "found '@nan', expected the seconds"),
                              ("csv:@5", "found no file"),
                              ("csv:", "found nothing behind the colon"),
                              ("csv", "expected auto, none"),
                              ("csv:/none/such", "/none/such can't be read: No such file"),
                              ("csv:/", "can't be read: Is a directory")):
            with self.assertRaisesRegex(MeterError, pattern):
                open_meter(spec, clock=self.clock)


class CsvMeterTest(MeterTestCase):
    """Tests with a logger that writes during the run."""

    def setUp(self) -> None:
        super().setUp()
        self.path = self.root / "log.csv"
        self.path.write_text("time,volts,amps\n", encoding="utf-8")
        self.written = 0
        self.late = 0.0
        self.clock.world = self.log

    def log(self, now: float) -> None:
        """Writes 10 lines per second, with 12 V and a current that grows by 1 A every 10 s."""
        with self.path.open("a", encoding="utf-8") as file:
            while 1000 + self.written / 10 <= now - self.late:
                time_passed = self.written / 10
                file.write(f"{EPOCH + time_passed:.3f},12,{time_passed / 10}\n")
                self.written += 1

    def test_covers_the_run_only(self) -> None:
        meter = open_meter(f"csv:{self.path}", clock=self.clock)
        self.clock.advance(10)
        meter.start()
        self.clock.advance(20)
        reading = meter.stop()
        self.assertAlmostEqual(reading.joules, 0.6 * (30**2 - 10**2), places=3)
        self.assertAlmostEqual(reading.seconds, 20)
        self.assertEqual((reading.scope, reading.method, reading.samples),
                         ("system", "sampled", 201))

    def test_waits_for_a_logger_that_writes_late_but_not_for_ever(self) -> None:
        self.clock.advance(20)
        for self.late, figure in ((2.0, True), (9.0, False)):
            meter = open_meter(f"csv:{self.path}", clock=self.clock)
            with meter.measuring() as measurement:
                self.clock.advance(4.95)
            if figure:
                self.assertGreater(measurement.reading.joules, 0)
            else:
                self.assert_no_figure(measurement.reading, "log.csv:.*the log ends")
            self.assertAlmostEqual(measurement.reading.seconds, 4.95)

    def test_a_clock_that_is_set_in_mid_run(self) -> None:
        meter = open_meter(f"csv:{self.path}", clock=self.clock)
        meter.start()
        self.clock.advance(5)
        self.clock.set_by = -0.2
        self.assert_no_figure(meter.stop(), "the clock was set by -0.200 s during the run")

    def test_a_log_that_vanishes(self) -> None:
        meter = open_meter(f"csv:{self.path}", clock=self.clock)
        meter.start()
        self.clock.world = lambda now: None
        self.path.unlink()
        self.assert_no_figure(meter.stop(), f"{self.path} can't be read: No such file")


class FixedTest(MeterTestCase):
    """Tests of meters that measure nothing."""

    def test_constant(self) -> None:
        meter = open_meter("constant:12.5", clock=self.clock)
        meter.start()
        self.clock.advance(8)
        reading = meter.stop()
        self.assertEqual((reading.joules, reading.seconds, reading.watts), (100, 8, 12.5))
        self.assertEqual((reading.scope, reading.method, meter.scope), ("assumed",) * 3)
        self.assertRegex(reading.notes[0], "assumed, not measured")
        for text in ("0", "-1", "nan", "inf", "1e9", "x"):
            with self.assertRaisesRegex(MeterError, f"found '{text}', expected watts"):
                open_meter(f"constant:{text}")

    def test_none(self) -> None:
        meter = open_meter("none", clock=self.clock)
        meter.start()
        self.clock.advance(8)
        reading = meter.stop()
        self.assert_no_figure(reading, "no meter was asked for")
        self.assertEqual(reading.seconds, 8)

    def test_specs_that_are_none(self) -> None:
        for spec in ("", "wattmeter", "none:5", "auto:5", "RAPL", "constant", "rapl:"):
            with self.assertRaisesRegex(MeterError, "expected (auto, none, rapl|watts)"):
                open_meter(spec, self.root)


class ProgramTest(MeterTestCase):
    """Tests of tools/power."""

    def power(self, *arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run([str(word) for word in (POWER, *arguments)], capture_output=True,
                              text=True, check=False, timeout=PATIENCE)

    def assert_error(self, done: subprocess.CompletedProcess[str], status: int,
                     pattern: str) -> None:
        """Expects one line of error and no other output."""
        self.assertEqual(done.returncode, status, done)
        self.assertRegex(done.stderr, f"^power( list)?: .*{pattern}.*\n$")
        self.assertEqual(done.stdout, "")

    def test_list_of_nothing(self) -> None:
        done = self.power("list", "--root", self.root)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("No meter is usable here", done.stdout)
        for word in ("be root", "csv:FILE", "constant:WATTS"):
            self.assertIn(word, done.stdout)
        self.assertNotIn("SPEC", done.stdout)

    def test_list_of_something(self) -> None:
        self.chip(0, "power_meter", power1_average=61_300_000,
                  power1_average_interval=60_000)  # long enough for a busy machine
        path = self.zone("0", "package-0")
        path.unlink()
        path.mkdir()
        done = self.power("list", "--root", self.root, "--for", 0.05)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertRegex(done.stdout, r"(?m)^hwmon:power_meter/power1 +system +61\.3 .* usable$")
        self.assertRegex(done.stdout, r"(?m)^rapl:package-0 +package +- .* can't be read: Is a d")
        self.assertNotIn("No meter is usable", done.stdout)

    def test_measure_passes_on_output_and_status(self) -> None:
        path = self.root / "energy.json"
        done = self.power("measure", "--meter", "constant:50", "--json", path, "--",
                          "sh", "-c", "sleep 0.1; echo out; echo err >&2; exit 7", "--", "-x")
        self.assertEqual((done.returncode, done.stdout), (7, "out\n"))
        self.assertTrue(done.stderr.startswith("err\n"))
        for pattern in ("joules +[0-9]", "watts +50 ", "seconds +[0-9]", "scope +assumed",
                        "meter +constant:50", "note +assumed, not measured"):
            self.assertRegex(done.stderr, pattern)
        result = json.loads(path.read_text(encoding="utf-8"))
        self.assertAlmostEqual(result["joules"], 50 * result["seconds"])
        self.assertGreaterEqual(result["to"] - result["from"], 0.1)
        self.assertEqual((result["status"], result["scope"], result["method"]),
                         (7, "assumed", "assumed"))
        self.assertEqual([file.name for file in self.root.iterdir()], ["energy.json"])

    def test_measure_without_a_figure_still_runs_the_command(self) -> None:
        done = self.power("measure", "--meter", "none", "--", "echo", "done")
        self.assertEqual((done.returncode, done.stdout), (0, "done\n"))
        self.assertRegex(done.stderr, "joules +none\n")
        self.assertRegex(done.stderr, "note +no meter was asked for: no figure\n")

    def test_measure_without_a_place_for_its_result(self) -> None:
        for status, command in ((1, ""), (3, "; exit 3")):
            file = self.root / "r.json"
            done = self.power("measure", "--meter", "constant:5", "--json", file, "--",
                              "sh", "-c", f"mkdir {file}{command}")
            self.assertEqual(done.returncode, status)
            self.assertRegex(done.stderr, f"power: cannot write {file}: Is a directory\n$")
            file.rmdir()

    def test_what_may_not_be_written_is_found_before_the_command_runs(self) -> None:
        notes = self.root / "notes"
        notes.write_text("precious", encoding="utf-8")
        for file, reason in ((self.root, "Is a directory"), (notes, "holds something else")):
            done = self.power("measure", "--meter", "constant:5", "--json", file, "--",
                              "touch", self.root / "ran")
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, f"^power: cannot write {file}: .*{reason}\n$")
        self.assertEqual(notes.read_text(encoding="utf-8"), "precious")
        self.assertFalse((self.root / "ran").exists())

    def test_measure_of_a_command_that_is_ended(self) -> None:
        with subprocess.Popen([POWER, "measure", "--meter", "constant:50", "--", "sh", "-c",
                               "echo; exec sleep 60"], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True) as process:
            process.stdout.readline()
            process.send_signal(signal.SIGTERM)
            began = time.monotonic()
            _, errors = process.communicate(timeout=PATIENCE)
        self.assertLess(time.monotonic() - began, 20 * slowness())
        self.assertEqual(process.returncode, 128 + signal.SIGTERM)
        self.assertRegex(errors, r"joules +[0-9.]+\n")

    def test_integrate(self) -> None:
        log = f"csv:{FIXTURE}@{EPOCH}?shunt=0.05"
        done = self.power("integrate", log, "--from", EPOCH, "--to", EPOCH + 0.25)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertRegex(done.stdout, "joules +1.0291\n")
        done = self.power("integrate", log, "--from", EPOCH, "--to", EPOCH + 9)
        self.assert_error(done, 1, "shunt.csv:10: the log ends 7.500 s before the run")
        done = self.power("integrate", "rapl", "--from", 1, "--to", 2)
        self.assert_error(done, 1, "expected csv:FILE")
        done = self.power("integrate", log, "--from", 2, "--to", 2)
        self.assert_error(done, 1, "found an interval from 2.0 to 2.0")

    def test_errors(self) -> None:
        constant = ("measure", "--meter", "constant:5")
        for status, pattern, arguments in (
                (2, "required: TASK", ()),
                (2, "found no command", constant),
                (2, "found no command", (*constant, "--")),
                (2, "unrecognized arguments: true", (*constant, "true")),
                (2, "only 'measure' takes", ("list", "--", "true")),
                (2, "'x' is not a number of seconds", ("list", "--for", "x")),
                (1, "meter 'ohm': expected auto", ("measure", "--meter", "ohm", "--", "true")),
                (1, "meter 'auto': found none", ("measure", "--root", self.root, "--", "true")),
                (1, "cannot run '/none': No such file", (*constant, "--", "/none")),
                (1, "cannot write /none/x: no such folder",
                 (*constant, "--json", "/none/x", "--", "true"))):
            self.assert_error(self.power(*arguments), status, pattern)

    def test_help_teaches(self) -> None:
        text = self.power("--help").stdout
        for word in ("rapl", "nvml", "ina231", "hwmon:", "csv:FILE", "constant:WATTS", "auto",
                     "scopes", "examples:", "Exit status", "power.md"):
            self.assertIn(word, text)


if __name__ == "__main__":
    unittest.main()
