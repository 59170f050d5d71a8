# SPDX-License-Identifier: GPL-2.0-or-later
"""Executes a series, from the command line to the report."""

from __future__ import annotations

import argparse
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Callable

from benchkit.heat import Chip, HeatWatch
from benchkit.series import report
from benchkit.series.analysis import Series, differences
from benchkit.series.begun import Begun
from benchkit.series.energy import EnergyError, open_energy_meter, try_meter
from benchkit.machine import (ROOT, Machine, commit, list_devices, program_fingerprint,
                             this_machine)
from benchkit.series.measure import Circumstances, Measurer
from benchkit.series.options import chosen_backends, chosen_worlds, read_command_line
from benchkit.series.plan import History, Plan, remaining
from benchkit.plots import PlotsMissing
from benchkit.series.plots import plot_all
from benchkit.progress import Progress
from benchkit.series.runs import Worlds
from benchkit.series.records import RawFile, Record, check_same, read_records
from benchkit.store import StoreError
from meters.clock import Clock

SEED = 1
RAW_FILE = "raw.csv"
# Consecutive failures after which a backend is considered missing and skipped.
MOST_FAILURES = 3

DONE, FAILED, REFUSED, UNFINISHED, INTERRUPTED = 0, 1, 2, 3, 130


class CampaignError(Exception):
    """The reason in one line why a series cannot begin."""


class Campaign:
    """Executes the runs of a plan, stores their records and reports progress."""

    def __init__(self, plan: Plan, raw: RawFile, do: Callable[..., Record],
                 progress: Progress) -> None:
        self._plan = plan
        self._raw = raw
        self._do = do
        self._progress = progress
        self._failures: Counter[str] = Counter()  # consecutive failures by backend
        self._told: set[tuple] = set()  # differences of hashes

    def run(self, end: float | None) -> bool:
        """Executes runs until all are done or the next one would end after `end`, a value of
        time.monotonic(). Returns True if all are done."""
        history = History(self._raw.records)
        done = sum(record.ok for record in self._raw.records)
        while True:
            left = [(job, seconds) for job, seconds in remaining(self._plan, history)
                    if self._failures[job.backend.label] < MOST_FAILURES]
            if not left:
                return True
            job, seconds = left[0]
            if end is not None and time.monotonic() + seconds > end:
                return False
            self._progress.show(
                done, done + len(left), f"{job.purpose} {job.world} {job.population} "
                f"{job.backend.label} repeat {job.repeat}", sum(took for _, took in left))
            # A generous limit, which only runs that hang exceed.
            record = self._do(job, 120 + 20 * seconds)
            self._raw.append(record)
            history.add(record)
            self._tell(record)
            done += 1

    def _tell(self, record: Record) -> None:
        if record.ok:
            self._failures[record.backend] = 0
            same_point = [r for r in self._raw.records
                          if (r.world, r.population) == (record.world, record.population)]
            for difference in differences(same_point):
                key = (difference.world, difference.population, difference.simulated_seconds)
                if key not in self._told:
                    self._told.add(key)
                    self._progress.say(f"series: STATE HASHES DIFFER: {record.world}, "
                                       f"{record.population} robots: {difference.hashes}")
            return
        self._failures[record.backend] += 1
        self._progress.say(f"series: {record.world} {record.population} {record.backend} failed: "
                           f"{record.error}")
        if self._failures[record.backend] == MOST_FAILURES:
            self._progress.say(f"series: {record.backend} failed {MOST_FAILURES} times in a row; "
                               "it is left out from now on")


def write_report(folder: Path, records: list[Record]) -> int:
    """Writes report and plots of the finished runs; returns the exit status."""
    series = Series(records)
    if not series.measured:
        print("series: nothing has been measured yet, so there is no report", file=sys.stderr)
        return FAILED if series.failures() else DONE
    missing = ""
    try:
        plots = plot_all(series, folder)
    except PlotsMissing as error:
        plots, missing = {}, str(error)
        print(f"series: {missing}", file=sys.stderr)
    path = folder / report.REPORT_FILE
    path.write_text(report.report_text(series, report.read_facts(folder), plots, missing),
                    encoding="utf-8")
    print(path)
    wrong, failed = differences(records), series.failures()
    for difference in wrong:
        print(f"series: STATE HASHES DIFFER: {difference.world}, {difference.population} robots, "
              f"{difference.simulated_seconds:g} s: {difference.hashes}", file=sys.stderr)
    if failed:
        print(f"series: {len(failed)} runs failed; the report lists them", file=sys.stderr)
    return FAILED if wrong or failed else DONE


def default_folder(machine: Machine) -> Path:
    return ROOT / "benchmarks/results" / machine.folder_name


def report_only(options: argparse.Namespace) -> int:
    folder = options.output or default_folder(this_machine(list_devices(options.stage)))
    if not (folder / RAW_FILE).exists():
        raise CampaignError(f"{folder / RAW_FILE} does not exist: no series was run in this folder")
    return write_report(folder, read_records(folder / RAW_FILE)[0])


def run_campaign(options: argparse.Namespace, progress: Progress) -> int:
    """Begins or continues a series; returns the exit status."""
    end = time.monotonic() + 60 * options.time_limit if options.time_limit else None
    if not options.stage.is_file():
        raise CampaignError(f"there is no program {options.stage}: `tools/run worlds/cave.world "
                            "--opencl` builds it, --stage names another")
    devices = list_devices(options.stage)
    machine = this_machine(devices)
    try:
        backends = chosen_backends(options.backends, devices)
    except ValueError as error:
        raise CampaignError(str(error)) from None
    meter = open_energy_meter(options.meter)
    meter_name = try_meter(meter).meter
    plan = Plan(chosen_worlds(options), backends, options.repeats, options.form,
                options.fixed_seconds)
    now = Circumstances(commit(), program_fingerprint(options.stage), machine.identity,
                        machine.system, options.form, SEED)
    folder = options.output or default_folder(machine)
    folder.mkdir(parents=True, exist_ok=True)
    raw = RawFile(folder / RAW_FILE, options.board)
    heat = HeatWatch(Chip(options.root), Clock(), options.cool) if options.board else None
    try:
        check_same(raw.records, {**vars(now), "meter": meter_name}, options.mix)
        report.add_facts(folder, machine.as_json())
        if raw.was_cut:
            progress.say("series: the last line of raw.csv was cut off; its run is repeated")
        with tempfile.TemporaryDirectory(prefix="stage-worlds-") as worlds:
            measurer = Measurer(options.stage, Worlds(Path(worlds), SEED), now, meter, heat,
                                Begun(folder))
            finished = Campaign(plan, raw, measurer.do, progress).run(end)
    except KeyboardInterrupt:
        progress.say(f"series: stopped; the same command continues, {folder} has "
                     f"{len(raw.records)} runs (--report-only reports them)")
        return INTERRUPTED
    finally:
        progress.clear()
        raw.close()
    status = write_report(folder, raw.records)
    if not finished:
        print("series: the time limit was reached; the same command continues", file=sys.stderr)
    return status if status != DONE or finished else UNFINISHED


def interrupt(_signal: int, _frame: object) -> None:
    """Ends the program like Ctrl-C."""
    raise KeyboardInterrupt


def main(words: list[str] | None = None) -> int:
    options = read_command_line(words)
    signal.signal(signal.SIGTERM, interrupt)
    try:
        return report_only(options) if options.report_only else \
            run_campaign(options, Progress())
    except (CampaignError, StoreError, EnergyError) as error:
        print(f"series: {error}", file=sys.stderr)
    except OSError as error:
        print(f"series: {error.filename or ''}: {error.strerror or error}", file=sys.stderr)
    except KeyboardInterrupt:
        return INTERRUPTED
    return REFUSED
