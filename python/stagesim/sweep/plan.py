# SPDX-License-Identifier: GPL-2.0-or-later
"""The folder of a sweep: its plan and its finished runs."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import StageError

#: Version of sweep.json; there is only one so far.
FORMAT = 1
RUNS_PER_FOLDER = 1000


class SweepError(StageError):
    """An error of a sweep. The message says what was found and what was expected."""


@dataclass(frozen=True)
class Axis:
    """A setting that is varied by --set, and its values as strings."""

    name: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """The runs of a sweep, as in `sweep.json` in its folder.

    Attributes:
        world: path of the world file.
        axes: the settings that are varied; the last one varies fastest.
        first, last: each set of values has the run numbers in [first, last).
        seed: seed of the experiment, from which the seeds of the runs are derived.
        common_seeds: True: runs with the same number have the same seed in all sets.
        duration: simulated seconds of a run; None: the quit time of the world file.
        options: options of the worlds.
        count: total number of runs.
        text: the contents of the file.
    """

    world: str
    axes: tuple[Axis, ...]
    first: int
    last: int
    seed: int
    common_seeds: bool
    duration: float | None
    options: dict[str, Any]
    count: int
    text: str

    @classmethod
    def read(cls, folder: str | os.PathLike[str]) -> Plan:
        """Reads the plan of the sweep in a folder.

        Raises:
            SweepError: there is no plan, or it has another version.
        """
        file = plan_file(folder)
        try:
            text = file.read_text(encoding="utf-8")
            known = json.loads(text)
            if known["format"] != FORMAT:
                raise SweepError(f"{file}: found format {known['format']}, expected {FORMAT}: the sweep was "
                                 "begun by another version of stage")
            axes = tuple(Axis(axis["name"], tuple(axis["values"])) for axis in known["axes"])
            first, last = known["runs"]
            return cls(known["world"], axes, first, last, known["seed"], known["common_seeds"],
                       known["duration"], known["options"], known["count"], text)
        except OSError as error:
            raise SweepError(f"{file}: {error.strerror}, expected the plan of a sweep; "
                             "`stage sweep -o FOLDER` makes one") from None
        except (ValueError, KeyError, TypeError) as error:
            raise SweepError(f"{file}: found no plan of a sweep ({error})") from None

    def values_of(self, index: int) -> dict[str, str]:
        """The value of each axis in run `index`."""
        number = index // (self.last - self.first)
        values = []
        for axis in reversed(self.axes):
            number, place = divmod(number, len(axis.values))
            values.append((axis.name, axis.values[place]))
        return dict(reversed(values))

    def run_of(self, index: int) -> int:
        """The run number of run `index` within its set of values."""
        return self.first + index % (self.last - self.first)


def plan_file(folder: str | os.PathLike[str]) -> Path:
    """The path of the plan."""
    return Path(folder) / "sweep.json"


def check_place(folder: Path) -> None:
    """Refuses a folder that may hold anything but a sweep, by the rules of `stage sweep -o`.

    Raises:
        SweepError: it is the root folder or a home folder, it is no folder, or it holds other files.
    """
    if folder.is_symlink() and not folder.exists():
        found = "a symbolic link that leads nowhere"
    elif not folder.exists():
        return
    elif not folder.is_dir():
        found = "which is not a folder"
    elif folder.resolve() in (Path("/"), Path.home().resolve()):
        found = "the root folder or a home folder"
    elif plan_file(folder).exists() or all(is_of_a_sweep(entry) for entry in folder.iterdir()):
        return
    else:
        found = "which is not a sweep folder"
    raise SweepError(f"found '{folder}', {found}, expected the name of a new folder, or of one that is empty")


def is_of_a_sweep(entry: Path) -> bool:
    """True for files that a sweep creates beside its plan or before it."""
    if entry.name.startswith(("lock.", ".stage-", ".plan-")):
        return True
    return entry.name == "runs" and entry.is_dir() and not any(entry.iterdir())


def record_file(folder: str | os.PathLike[str], index: int) -> Path:
    """The path of the record of a finished run."""
    return Path(folder) / "runs" / f"{index // RUNS_PER_FOLDER:03d}" / f"{index:06d}.json"


def finished(folder: str | os.PathLike[str]) -> list[int]:
    """The sorted indices of runs with a record. An empty file, which a full disk leaves, is no record."""
    found = []
    runs = Path(folder) / "runs"
    for part in os.scandir(runs) if runs.is_dir() else ():
        if not part.name.isdecimal():
            continue
        for entry in os.scandir(part.path):
            stem, ending = os.path.splitext(entry.name)
            if ending == ".json" and stem.isdecimal() and entry.stat().st_size > 0:
                found.append(int(stem))
    return sorted(found)


def missing(folder: str | os.PathLike[str], plan: Plan) -> list[int]:
    """The sorted indices of runs of the plan without a record."""
    known = set(finished(folder))
    return [index for index in range(plan.count) if index not in known]
