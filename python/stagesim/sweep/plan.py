# SPDX-License-Identifier: GPL-2.0-or-later
"""The folder of a sweep: its plan, and which of its runs are finished."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import StageError

#: The only one that there has been so far.
FORMAT = 1
RUNS_PER_FOLDER = 1000


class SweepError(StageError):
    """Something that a sweep can't do. Its text says what was found, and what was expected."""


@dataclass(frozen=True)
class Axis:
    """What --set varies: a setting, and its values as texts."""

    name: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """Which runs a sweep has: `sweep.json` in its folder.

    Attributes:
        world: the path of the world file.
        axes: what is varied; the last one varies fastest.
        first, last: run numbers of each set of values: from `first` to before `last`.
        seed: of the experiment, which the seeds of its runs are made from.
        common_seeds: runs of the same number have the same seed in all sets.
        duration: simulated seconds of a run; None: as long as the world file says.
        options: how worlds are run.
        count: how many runs there are.
        text: all of the file.
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
        """That of the sweep in this folder.

        Raises:
            SweepError: there is none, or it is of another version.
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
        """The value of each axis in this run."""
        number = index // (self.last - self.first)
        values = []
        for axis in reversed(self.axes):
            number, place = divmod(number, len(axis.values))
            values.append((axis.name, axis.values[place]))
        return dict(reversed(values))

    def run_of(self, index: int) -> int:
        """The number of this run among those of its set."""
        return self.first + index % (self.last - self.first)


def plan_file(folder: str | os.PathLike[str]) -> Path:
    """Where the plan lies."""
    return Path(folder) / "sweep.json"


def check_place(folder: Path) -> None:
    """Refuses a folder that may hold anything but a sweep, by the rules of `stage sweep -o`.

    Raises:
        SweepError: it is the root folder or a home folder, or it is not empty and has no plan.
    """
    if folder.is_symlink() and not folder.exists():
        found = "a symbolic link that leads nowhere"
    elif not folder.exists():
        return
    elif not folder.is_dir():
        found = "which is no folder"
    elif folder.resolve() in (Path("/"), Path.home().resolve()):
        found = "the root folder or a home folder"
    elif plan_file(folder).exists() or all(is_of_a_sweep(entry) for entry in folder.iterdir()):
        return
    else:
        found = "which holds something else than a sweep"
    raise SweepError(f"found '{folder}', {found}, expected the name of a new folder, or of one that is empty")


def is_of_a_sweep(entry: Path) -> bool:
    """Whether it is one of what a sweep makes before and beside its plan."""
    if entry.name.startswith(("lock.", ".stage-", ".plan-")):
        return True
    return entry.name == "runs" and entry.is_dir() and not any(entry.iterdir())


def record_file(folder: str | os.PathLike[str], index: int) -> Path:
    """Where the record of a run lies, once it is finished."""
    return Path(folder) / "runs" / f"{index // RUNS_PER_FOLDER:03d}" / f"{index:06d}.json"


def finished(folder: str | os.PathLike[str]) -> list[int]:
    """The runs that have a record, in order. An empty file is none: the disk was full."""
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
    """The runs of the plan that have no record, in order."""
    known = set(finished(folder))
    return [index for index in range(plan.count) if index not in known]
