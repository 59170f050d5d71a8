# SPDX-License-Identifier: GPL-2.0-or-later
"""Executes a job: runs the program with the energy meter and makes the record."""

from __future__ import annotations

import math
import os
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

from benchkit.heat import HeatWatch
from benchkit.series.begun import BEGUN_FILE, MOST_ATTEMPTS, Begun
from benchkit.series.energy import Meter, NoMeter, Reading, notes_text
from benchkit.programs import Outcome, RunError, run_stage
from benchkit.series.runs import NO_KERNEL_CACHE, Job, Worlds, check_outcome, figures_of
from benchkit.series.records import COMPILE, MEASURE, NAN, Record
from benchkit.store import one_line


@dataclass(frozen=True)
class Circumstances:
    """Common facts of all runs of a series; the names are columns of a record."""

    commit: str
    program: str
    machine: str
    system: str
    form: str
    seed: int


@dataclass(frozen=True)
class Measurer:
    """Runs the program and returns records; the store keeps them."""

    stage: Path
    worlds: Worlds
    circumstances: Circumstances
    meter: Meter
    heat: HeatWatch | None = None  # both only with --board
    begun: Begun | None = None

    def do(self, job: Job, time_limit: float | None) -> Record:
        """Returns the record of a run; after a failure, its `error` is the reason."""
        if self.heat is None or self.begun is None:
            return self._do(job, time_limit)
        if self.begun.attempts(job.key) >= MOST_ATTEMPTS:
            return Record(**self._known(job), error=f"started {MOST_ATTEMPTS} times without ever "
                                                    "ending: did the machine restart? Delete "
                                                    f"{BEGUN_FILE} to try again")
        self.begun.begin(job.key)
        try:
            self.heat.cool_down()
            self.heat.begin()
            try:
                record = self._do(job, time_limit)
            finally:
                heat = self.heat.end()
        finally:
            self.begun.end(job.key)
        return replace(record, **heat)  # type: ignore[arg-type]

    def _known(self, job: Job) -> dict:
        """Columns of a record that are known before the run."""
        load_average = round(os.getloadavg()[0], 2)
        return {
            **vars(self.circumstances), "date": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
            "purpose": job.purpose, "world": job.world, "population": job.population,
            "backend": job.backend.label, "repeat": job.repeat, "load_average": load_average,
            "simulated_seconds": job.simulated_seconds,
        }

    def _do(self, job: Job, time_limit: float | None) -> Record:
        known = self._known(job)
        try:
            world = self.worlds.path(job.world, job.population)
            if job.purpose == COMPILE:
                outcome, reading = self._run_without_cache(job, world, time_limit)
            else:
                outcome, reading = self._run(job, world, time_limit, {})
            check_outcome(job, outcome)
            figures = {**figures_of(outcome), **energy_figures(job, reading)}
        except RunError as error:
            return Record(**known, error=one_line(str(error)) or "failed")
        if reading.meter != "none":
            figures["notes"] = "; ".join(filter(None, [figures["notes"], notes_text(reading)]))
        return Record(**known, **figures)

    def _run(self, job: Job, world: Path, time_limit: float | None,
             environment: dict[str, str]) -> tuple[Outcome, Reading]:
        meter = self.meter if job.purpose == MEASURE else NoMeter()
        meter.start()
        reading: Reading
        try:
            outcome = run_stage(self.stage, world, job.simulated_seconds,
                                list(job.backend.options), environment, time_limit)
        finally:
            reading = meter.stop()
        return outcome, reading

    def _run_without_cache(self, job: Job, world: Path, time_limit: float | None
                           ) -> tuple[Outcome, Reading]:
        with tempfile.TemporaryDirectory(prefix="stage-kernels-") as folder:
            environment = {name: value.format(folder) for name, value in NO_KERNEL_CACHE.items()}
            return self._run(job, world, time_limit, environment)


def energy_figures(job: Job, reading: Reading) -> dict:
    """Columns of a record that come from the meter."""
    if job.purpose != MEASURE:
        return {}
    if reading.meter == "none":
        return {"meter": "none"}
    figures = {
        "meter": reading.meter, "scope": reading.scope or "", "joules": NAN, "watts": NAN,
        "metered_seconds": reading.seconds or NAN, "r_epss": NAN,
    }
    if reading.joules is not None and math.isfinite(reading.joules):
        figures["joules"] = reading.joules
        figures["r_epss"] = reading.joules / (job.population * job.simulated_seconds)
    if reading.watts is not None and math.isfinite(reading.watts):
        figures["watts"] = reading.watts
    return figures
