#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests of benchmarks/series as a whole: resuming, rejected arguments, failures, reports, a real run."""

from __future__ import annotations

import contextlib
import csv
import importlib.util
import io
import os
import re
import shutil
import statistics
import sys
import tempfile
import types
import unittest
from pathlib import Path
from unittest import mock

import numpy as np
from PIL import Image

from series_testing import FAKE_STAGE, FIXTURE, ROOT, failed, made_up
from benchkit.series import campaign, energy, report
from benchkit.series.analysis import Series
from benchkit.report import number
from benchkit.series.runs import Worlds
from benchkit.series.records import MEASURE, read_records

STAGE = Path(os.environ.get("STAGE_BINARY_DIR", ROOT / "build/release")) / "bin/stage"
HAS_PLOTS = importlib.util.find_spec("matplotlib") is not None


def series(*words: object, plots: bool = False) -> tuple[int, str, str]:
    """Runs the command in this process; returns exit status, standard output and standard error."""
    out, err = io.StringIO(), io.StringIO()
    draw = contextlib.nullcontext() if plots else \
        mock.patch("benchkit.series.campaign.plot_all", return_value={})
    with draw, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = campaign.main([str(word) for word in words])
        except SystemExit as end:
            status = int(end.code or 0)
    return status, out.getvalue(), err.getvalue()


class SeriesTest(unittest.TestCase):
    """Tests with a replacement for the program that records its calls."""

    @classmethod
    def setUpClass(cls) -> None:
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.worlds = Path(folder.name)

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.results = self.folder / "results"
        self.stage = self.folder / "stage"
        # Use the interpreter of the tests, which has the required modules.
        self.stage.write_text(FAKE_STAGE.replace("/usr/bin/python3", sys.executable),
                              encoding="utf-8")
        self.stage.chmod(0o755)
        self.log = self.folder / "log"
        environment = mock.patch.dict(os.environ, {"FAKE_LOG": str(self.log),
                                                   "STAGE_COMMIT": "abc"})
        environment.start()
        self.addCleanup(environment.stop)
        # All tests share a few worlds, because writing them takes longer than the runs.
        worlds = mock.patch("benchkit.series.campaign.Worlds", lambda _, seed: Worlds(self.worlds, seed))
        worlds.start()
        self.addCleanup(worlds.stop)

    def series(self, *words: object, **options: bool) -> tuple[int, str, str]:
        return series("--stage", self.stage, "--worlds", "cave", "--populations", "1,4",
                      "--backends", "host1,cl:gpu", "--repeats", 2, "--seconds", 2, "--meter",
                      "none", "-o", self.results, *words, **options)

    @property
    def raw(self) -> Path:
        return self.results / "raw.csv"

    def calls(self) -> list[str]:
        return self.log.read_text(encoding="utf-8").splitlines() if self.log.exists() else []

    # ---- normal runs

    def test_does_all_runs_once(self) -> None:
        status, out, _ = self.series()
        self.assertEqual(status, 0)
        self.assertEqual(out.strip(), str(self.results / "report.md"))
        records, _ = read_records(self.raw)
        # A compilation, two warm-ups; two populations, backends and repeats.
        self.assertEqual([r.purpose for r in records],
                         ["compile"] + 2 * ["warm-up"] + 8 * [MEASURE])
        self.assertEqual(len(self.calls()), 11)
        self.assertEqual({r.simulated_seconds for r in records}, {2.0})
        self.series()
        self.assertEqual(len(self.calls()), 11, "a finished series runs nothing")

    def test_compiles_with_an_empty_cache_only_once(self) -> None:
        self.series()
        caches = [call.partition(" cache=")[2] for call in self.calls()]
        self.assertIn("stage-kernels-", caches[0])
        self.assertFalse(Path(caches[0]).exists())
        self.assertEqual(set(caches[1:]), {os.environ.get("POCL_CACHE_DIR", "")})

    def test_more_repeats_add_to_what_is_there(self) -> None:
        self.series()
        before = self.raw.read_bytes()
        self.assertEqual(self.series("--repeats", 3)[0], 0)
        self.assertTrue(self.raw.read_bytes().startswith(before))
        self.assertEqual(len(read_records(self.raw)[0]), 11 + 4)

    def test_report_names_backends_with_few_repeats(self) -> None:
        self.series("--repeats", 1)
        report = self.results / "report.md"
        self.assertIn("Only 1 repeat of each run: the spreads", report.read_text(encoding="utf-8"))
        self.series("--repeats", 3, "--backends", "cl:gpu")
        text = report.read_text(encoding="utf-8")
        self.assertIn("Only 1 repeat of each run of host, 1 thread: its spreads mean little", text)
        self.assertEqual(text.count("Only "), 1)
        self.series("--repeats", 3)
        self.assertNotIn("Only ", report.read_text(encoding="utf-8"))

    # ---- resuming

    def test_goes_on_after_a_cut(self) -> None:
        self.series()
        whole = self.raw.read_bytes()
        lines = whole.splitlines(keepends=True)
        for kept, part in ((6, 20), (4, 0), (0, 30), (11, len(lines[11]) - 1)):
            with self.subTest(kept=kept, part=part):
                self.raw.write_bytes(b"".join(lines[:kept]) + lines[kept][:part])
                self.log.unlink()
                status, _, err = self.series()
                self.assertEqual(status, 0)
                self.assertEqual("was cut off" in err, part > 0)
                self.assertEqual(len(self.calls()), 12 - max(1, kept))
                again = read_records(self.raw)[0]
                self.assertEqual(len(again), 11)
                # Same runs and order as without interruption.
                self.assertEqual([(r.world, r.population, r.backend, r.repeat) for r in again],
                                 [(r.world, r.population, r.backend, r.repeat) for r in
                                  self.records_of(whole)])

    def records_of(self, content: bytes) -> list:
        copy = self.folder / "copy.csv"
        copy.write_bytes(content)
        return read_records(copy)[0]

    def test_ctrl_c_leaves_a_folder_to_go_on_with(self) -> None:
        with mock.patch.dict(os.environ, {"FAKE_INTERRUPT": "6"}):
            status, _, err = self.series()
        self.assertEqual(status, 130)
        self.assertIn("the same command continues", err)
        self.assertEqual(len(read_records(self.raw)[0]), 5)
        self.assertEqual(self.series()[0], 0)
        self.assertEqual(len(self.calls()), 6 + 6)

    def test_time_limit_stops_before_a_run(self) -> None:
        status, _, err = self.series("--time-limit", "0.00001")
        self.assertEqual((status, self.calls()), (3, []))
        self.assertIn("the time limit was reached", err)
        self.assertEqual(self.series("--time-limit", 5)[0], 0)

    def test_one_series_at_a_time(self) -> None:
        self.series()
        raw = campaign.RawFile(self.raw)
        self.addCleanup(raw.close)
        status, _, err = self.series()
        self.assertEqual(status, 2)
        self.assertIn("another series is writing to it", err)

    def test_board_goes_on_in_its_own_folder_and_heat_is_in_it(self) -> None:
        zone = self.folder / "sys/class/thermal/thermal_zone0/temp"
        zone.parent.mkdir(parents=True)
        zone.write_text("43000\n", encoding="utf-8")
        with mock.patch.dict(os.environ, {"FAKE_INTERRUPT": "6"}):
            self.assertEqual(self.series("--board", "--root", self.folder)[0], 130)
        self.raw.write_bytes(self.raw.read_bytes() + b"abc,def")  # as after a power failure
        self.assertEqual(self.series("--board", "--root", self.folder)[0], 0)
        records = read_records(self.raw)[0]
        self.assertEqual((len(records), {r.celsius_most for r in records}), (11, {43.0}))
        self.assertIn("## Heat and clock", (self.results / "report.md").read_text(encoding="utf-8"))
        self.assert_refused("its runs were made with --board; give another folder")

    # ---- rejected arguments

    def assert_refused(self, message: str, *words: object) -> None:
        before = self.raw.read_bytes() if self.raw.exists() else None
        calls = len(self.calls())
        status, out, err = self.series(*words)
        self.assertEqual((status, out), (2, ""))
        self.assertRegex(err, rf"\Aseries: [^\n]*{message}[^\n]*\n\Z")
        self.assertEqual(self.raw.read_bytes() if self.raw.exists() else None, before)
        self.assertEqual(len(self.calls()), calls)

    def test_refuses_to_mix(self) -> None:
        self.series()
        self.assert_refused("form 2 s, now it is 9 s", "--seconds", 9)
        self.assert_refused("form 2 s, now it is 3 s", "--mix", "--seconds", 3)
        with mock.patch.dict(os.environ, {"STAGE_COMMIT": "later"}):
            self.assert_refused("commit abc, now it is later: .*--mix", "--repeats", 3)
        with mock.patch("benchkit.machine.cpu_name", return_value="other"):
            self.assert_refused("machine .*, now it is other, .*--mix", "--repeats", 3)
        self.stage.write_text(FAKE_STAGE + "# another build\n", encoding="utf-8")
        self.assert_refused("build of the program .*--mix", "--repeats", 3)

    def test_refuses_another_meter_even_with_mix(self) -> None:
        self.series()
        power = types.ModuleType("meters")
        power.MeterError = type("MeterError", (Exception,), {})  # type: ignore[attr-defined]
        meter = mock.Mock()
        meter.stop.return_value = energy.NoReading(meter="rapl", scope="package")
        power.open_meter = lambda choice: meter  # type: ignore[attr-defined]
        with mock.patch.dict(sys.modules, {"meters": power}):
            self.assert_refused("meter none, now it is rapl", "--mix", "--meter", "rapl")

    def test_mixes_on_request_and_says_so(self) -> None:
        self.series()
        with mock.patch.dict(os.environ, {"STAGE_COMMIT": "later"}):
            self.assertEqual(self.series("--repeats", 3, "--mix")[0], 0)
        text = (self.results / "report.md").read_text(encoding="utf-8")
        self.assertIn("**Mixed**: the runs differ in commit (abc; later)", text)

    def test_wrong_options_are_refused_in_one_line(self) -> None:
        for words, message in ((("--backends", "host1,gpu"), "'gpu' is none of host1"),
                               (("--backends", "host:0"), "'host:0' is none of"),
                               (("--worlds", "attic"), "'attic' is not one of the worlds"),
                               (("--populations", "0"), "'0' is not a number of robots"),
                               (("--populations", "cave=x"), "'x' is not a number of robots"),
                               (("--populations", "attic=3"), "'attic' is not one of"),
                               (("--repeats", "0"), "'0' is not a number of repeats"),
                               (("--seconds", "0.25"), "not a multiple of 0.1 s"),
                               (("--time-limit", "-1"), "not a time in minutes"),
                               (("--stage", "/nowhere"), "there is no program /nowhere"),
                               (("--report-only",), "no series was run in this folder"),
                               (("--short", "--long"), "not allowed with")):
            with self.subTest(words=words):
                self.assert_refused(message, *words)

    def test_meters_are_optional(self) -> None:
        with mock.patch.dict(sys.modules, {"meters": None}):
            self.assertEqual(energy.try_meter(energy.open_energy_meter("auto")).meter, "none")
            self.assert_refused("energy meters cannot be loaded", "--meter", "rapl")

    # ---- failures

    def test_different_hashes_are_a_failure(self) -> None:
        with mock.patch.dict(os.environ, {"FAKE_HASH": "bad"}):
            status, _, err = self.series()
        self.assertEqual(status, 1)
        self.assertIn("STATE HASHES DIFFER: cave, 4 robots", err)
        text = (self.results / "report.md").read_text(encoding="utf-8")
        self.assertRegex(text, r"\*\*STATE HASHES DIFFER\*\*: cave, 4 robots, 2 simulated seconds: "
                               r"`1234abcd`: host1; `bad`: cl:gpu")
        self.assertIn("in different states", text)
        self.assertEqual(self.series("--report-only")[0], 1)

    def test_failed_runs_are_reported_and_done_again_next_time(self) -> None:
        with mock.patch.dict(os.environ, {"FAKE_FAIL": "--opencl-always"}):
            status, _, err = self.series()
        self.assertEqual(status, 1)
        self.assertIn("the device is on fire", err)
        self.assertIn("cl:gpu failed 3 times in a row; it is left out", err)
        # Three attempts with the device, the rest on the host; no run is repeated.
        self.assertEqual(len(self.calls()), 3 + 5)
        self.assertIn("**Run failed**", (self.results / "report.md").read_text(encoding="utf-8"))
        self.assertEqual(self.series()[0], 0)
        self.assertNotIn("**Run failed**",
                         (self.results / "report.md").read_text(encoding="utf-8"))

    def test_falling_back_to_the_host_is_no_measurement(self) -> None:
        with mock.patch.dict(os.environ, {"FAKE_FALL_BACK": "1"}):
            status, _, err = self.series()
        self.assertEqual(status, 1)
        self.assertIn("10 of 20 steps were made on the device, expected all", err)
        self.assertFalse([r for r in read_records(self.raw)[0] if r.ok and r.backend == "cl:gpu"])


class ReportTest(unittest.TestCase):
    """Tests with recorded runs."""

    @classmethod
    def setUpClass(cls) -> None:
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        for file in FIXTURE.iterdir():
            shutil.copy(file, cls.folder)
        cls.status, _, cls.err = series("--report-only", "-o", cls.folder, plots=True)
        cls.text = (cls.folder / "report.md").read_text(encoding="utf-8")
        with open(FIXTURE / "raw.csv", encoding="utf-8", newline="") as file:
            cls.rows = list(csv.DictReader(file))

    def test_succeeds_and_changes_no_figures(self) -> None:
        self.assertEqual(self.status, 0, self.err)
        for name in ("raw.csv", "machine.json"):
            self.assertEqual((self.folder / name).read_bytes(), (FIXTURE / name).read_bytes())

    def test_states_what_was_measured(self) -> None:
        for column in ("commit", "machine", "system", "program"):
            self.assertIn(self.rows[0][column], self.text)
        self.assertIn("| runs | 40, 2 repeats of each |", self.text)
        self.assertIn("Short form", self.text)
        self.assertIn("| energy meter | constant:12, scope: assumed |", self.text)

    def test_medians_are_those_of_the_raw_file(self) -> None:
        for column, title in (("r_acc", "robot s / real s"), ("r_epss", "J / robot s")):
            found = [float(row[column]) for row in self.rows
                     if (row["purpose"], row["world"], row["population"], row["backend"]) ==
                     ("measure", "hospital", "1000", "cl:cpu")]
            cell = f"{number(statistics.median(found))} ({number(min(found))} to " \
                   f"{number(max(found))})"
            table = self.text[self.text.index(f"hospital, {title}"):]
            line = next(line for line in table.splitlines() if line.startswith("| 1000 |"))
            self.assertEqual(line.split(" | ")[4], cell)

    def test_scope_stands_beside_every_energy(self) -> None:
        # Titles of tables and column headings. Ratios have no unit, so no scope.
        units = re.findall(r"J / robot s[^:|]*(?:: \w+)?", self.text)
        self.assertEqual(len(units), 3)
        for unit in units:
            self.assertIn("assumed", unit)

    def test_paper_is_quoted_and_losses_are_shown(self) -> None:
        self.assertIn("the known figures of", self.text)
        losses = self.text[self.text.index("### Where OpenCL loses"):].split("\n## ")[0]
        self.assertIn("| cave | OpenCL, PoCL on the CPU | host, 1 thread |", losses)

    def test_sections_are_complete(self) -> None:
        self.assertEqual(re.findall(r"^## (\w[\w-]*)", self.text, re.MULTILINE),
                         ["What", "Same", "r_ACC", "r_EPSS", "OpenCL", "Averages", "Break-even",
                          "Phases", "Memory", "Compiling"])
        for table in re.findall(r"(?:^\|.*\n)+", self.text, re.MULTILINE):
            self.assertEqual(len({line.count("|") for line in table.splitlines()}), 1, table)

    @unittest.skipUnless(HAS_PLOTS, "python3-matplotlib is not installed")
    def test_plots_are_there_and_not_blank(self) -> None:
        names = re.findall(r"!\[[^]]+\]\(([^)]+)\)", self.text)
        self.assertEqual(sorted(names), sorted(path.name for path in self.folder.glob("*.png")))
        self.assertEqual(set(names), {
            "r_acc.png", "r_epss.png", "relative-host1.png", "relative-hostN.png",
            "relative-energy-host1.png", "relative-energy-hostN.png", "averages.png",
            "averages-energy.png", "phases.png", "memory.png"})
        for name in names:
            with self.subTest(name=name), Image.open(self.folder / name) as image:
                self.assertEqual(image.width, 800)
                pixels = np.asarray(image.convert("RGB")).reshape(-1, 3)
                # Bright colours are data; black is used for frames and text.
                vivid = (pixels.max(axis=1).astype(int) - pixels.min(axis=1)) > 60
                self.assertGreater(vivid.sum(), 500)
                self.assertGreater((pixels < 60).all(axis=1).sum(), 500)

    def test_without_matplotlib_there_is_a_report_all_the_same(self) -> None:
        with tempfile.TemporaryDirectory() as name, \
                mock.patch.dict(sys.modules, {"matplotlib": None}):
            shutil.copy(FIXTURE / "raw.csv", name)
            status, _, err = series("--report-only", "-o", name, plots=True)
            text = (Path(name) / "report.md").read_text(encoding="utf-8")
        self.assertEqual(status, 0)
        for place in (err, text):
            self.assertIn("matplotlib is missing; `tools/setup --tests` installs it", place)
        self.assertNotIn(".png", text)

    def test_without_a_meter_it_says_so(self) -> None:
        text = report.report_text(Series([made_up(), made_up(repeat=2)]), [], {}, "")
        self.assertIn("no meter on this machine", text)
        self.assertNotIn("J / robot s", text)

    def test_lost_facts_and_failures_do_not_stop_it(self) -> None:
        text = report.report_text(Series([made_up(), failed(repeat=2)]), [], {}, "no plots: why")
        self.assertIn("| machine | board |", text)
        self.assertIn("**Run failed**: measure, cave, 10 robots, host1, repeat 2: no", text)
        self.assertIn("> no plots: why", text)


@unittest.skipUnless(STAGE.is_file(), f"{STAGE} is not built")
class RealRun(unittest.TestCase):
    def test_a_tiny_series(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            status, _, err = series(
                "--stage", STAGE, "--worlds", "cave", "--populations", "1,3", "--backends", "host1",
                "--repeats", 1, "--seconds", 1, "--meter", "none", "-o", name)
            self.assertEqual(status, 0, err)
            measured = [r for r in read_records(Path(name) / "raw.csv")[0] if r.purpose == MEASURE]
        self.assertEqual([(r.population, r.steps, r.threads) for r in measured],
                         [(1, 10, 1), (3, 10, 1)])
        for record in measured:
            self.assertAlmostEqual(record.r_acc, record.population * 1.0 / record.wall_seconds,
                                   delta=record.r_acc * 1e-6)
            self.assertEqual(record.rays_per_step, 196 * record.population)
            self.assertGreater(record.trace_ms, 0)
            self.assertGreater(record.process_seconds, record.wall_seconds)
            self.assertRegex(record.state_hash, r"^[0-9a-f]{16}$")


if __name__ == "__main__":
    unittest.main()
