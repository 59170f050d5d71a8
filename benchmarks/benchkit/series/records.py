# SPDX-License-Identifier: GPL-2.0-or-later
"""The record of a run: a line of the raw file, which is only appended to."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Callable, Iterable

from benchkit.store import StoreError, Table, line_of, one_line, read_rows

NAN = math.nan

WARM_UP = "warm-up"  # fills caches; in the short form it also predicts the machine's speed
COMPILE = "compile"  # compiles with an empty kernel cache
MEASURE = "measure"


# Identifies a run: purpose, world, population, backend, repeat.
Key = tuple[str, str, int, str, int]


@dataclass(frozen=True)
class Record:
    """One run of the program. Figures that do not exist are NaN, which is an empty field of the
    file."""

    # The run and its machine.
    commit: str
    program: str  # fingerprint of the program's files
    machine: str
    system: str
    date: str  # date and time, UTC
    form: str  # short, long, or the simulated seconds given by the user
    purpose: str  # WARM_UP, COMPILE or MEASURE
    world: str
    population: int
    backend: str
    repeat: int  # from 1
    seed: int
    simulated_seconds: float
    error: str = ""  # the reason why there are no figures
    notes: str = ""
    # Results.
    device: str = ""
    threads: float = NAN
    steps: float = NAN
    wall_seconds: float = NAN  # of the steps only
    load_seconds: float = NAN  # of loading the world, including compilation of kernels
    process_seconds: float = NAN  # from start to end of the program
    r_acc: float = NAN  # simulated robot-seconds per real second
    r_epss: float = NAN  # joules per simulated robot-second
    joules: float = NAN
    watts: float = NAN
    metered_seconds: float = NAN
    meter: str = ""
    scope: str = ""  # scope of the meter: rail, package, GPU, system, assumed
    gather_ms: float = NAN  # phases, in milliseconds per step
    prefilter_ms: float = NAN
    trace_ms: float = NAN
    move_ms: float = NAN
    callbacks_ms: float = NAN
    energy_ms: float = NAN
    rays_per_step: float = NAN
    potential_hits_per_ray: float = NAN
    peak_memory_mb: float = NAN
    compile_seconds: float = NAN
    steps_on_device: float = NAN
    mb_sent_per_step: float = NAN
    mb_fetched_per_step: float = NAN
    load_average: float = NAN  # of the machine, right before the run
    state_hash: str = ""
    # State of the chip during the run, only with --board.
    celsius_before: float = NAN
    celsius_after: float = NAN
    celsius_most: float = NAN
    cooling_seconds: float = NAN  # seconds waited before the run
    clock_least: float = NAN  # mean clock of the fastest core over the samples, relative to its
                              # maximum
    throttled: str = ""  # causes that slowed the chip down

    @property
    def key(self) -> Key:
        return (self.purpose, self.world, self.population, self.backend, self.repeat)

    @property
    def ok(self) -> bool:
        return not self.error

    @property
    def step_seconds(self) -> float:
        return self.wall_seconds / self.steps


PHASES = ("gather", "prefilter", "trace", "move", "callbacks", "energy")
BOARD_COLUMNS = [field.name for field in fields(Record)]
# Files of series without --board have fewer columns; so do older files.
COLUMNS = BOARD_COLUMNS[:BOARD_COLUMNS.index("celsius_before")]
READERS: dict[str, Callable[[str], Any]] = {
    "int": int, "str": str, "float": lambda text: float(text) if text else NAN,
}


def to_row(record: Record) -> dict[str, object]:
    def text(value: object) -> str:
        if isinstance(value, float):
            return "" if math.isnan(value) else f"{value:.9g}"
        return one_line(str(value))
    return {name: text(getattr(record, name)) for name in BOARD_COLUMNS}


def from_row(row: dict[str, str]) -> Record:
    """Raises ValueError if the row is invalid."""
    return Record(**{field.name: READERS[str(field.type)](row[field.name])
                     for field in fields(Record) if field.name in row})


def records_of(path: Path, rows: Iterable[dict[str, str]]) -> list[Record]:
    records = []
    for number, row in enumerate(rows, 2):
        try:
            records.append(from_row(row))
        except ValueError as error:
            raise StoreError(f"{path}:{number}: not a line of this file ({error}); remove the "
                             "line, and its run will be repeated") from None
    return records


def read_records(path: Path) -> tuple[list[Record], int]:
    """Returns the finished runs, and the number of bytes before an incomplete last line."""
    columns = BOARD_COLUMNS if is_of_board(path) else COLUMNS
    rows, ends = read_rows(path, columns)
    return records_of(path, (dict(zip(columns, row)) for row in rows)), ends[-1] if ends else 0


def is_of_board(path: Path) -> bool:
    """True if a file has the columns that --board adds."""
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.readline() == line_of(BOARD_COLUMNS)


class RawFile:
    """The file, locked by this process until it is closed."""

    def __init__(self, path: Path, board: bool = False) -> None:
        if path.exists() and path.stat().st_size and is_of_board(path) != board:
            other = "without --board" if board else "with --board"
            raise StoreError(f"{path}: its runs were made {other}; give another folder with -o")
        self._table = Table(path, BOARD_COLUMNS if board else COLUMNS, jobs=False)
        self.was_cut = self._table.was_cut
        try:
            self.records = records_of(path, self._table.rows)
        except StoreError:
            self.close()
            raise

    def append(self, record: Record) -> None:
        self._table.add([to_row(record)])
        self.records.append(record)

    def close(self) -> None:
        self._table.close()


# Columns that are equal for all runs of a folder, unless --mix allows a difference.
NEVER_MIXED = {"form": "form", "seed": "seed", "meter": "meter"}
MIXED_ON_REQUEST = {"commit": "commit", "program": "build of the program", "machine": "machine"}


def check_same(records: list[Record], now: dict[str, object], mix: bool) -> None:
    """Refuses to add runs of another kind to those of the folder.

    `now` has the columns of the new runs; missing columns are not compared.
    """
    for column, name in {**NEVER_MIXED, **MIXED_ON_REQUEST}.items():
        there = sorted({str(getattr(record, column)) for record in records if record.ok}
                       - ({""} if column == "meter" else set()))
        if column not in now or there in ([], [str(now[column])]):
            continue
        if column in NEVER_MIXED:
            advice = "give another folder with -o"
        elif mix:
            continue
        else:
            advice = "give another folder with -o, or --mix to continue anyway"
        raise StoreError(f"the folder has runs with the {name} {' and '.join(there)}, "
                         f"now it is {now[column]}: {advice}")
