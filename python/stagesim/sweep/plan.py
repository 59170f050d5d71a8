# SPDX-License-Identifier: GPL-2.0-or-later
"""The folder of a sweep: its plan and its finished runs."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import _core
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


def plan_file(folder: str | os.PathLike[str]) -> Path:
    """The path of the plan."""
    return Path(folder) / "sweep.json"


def make_folder(folder: Path) -> None:
    """Makes a folder as `stage sweep -o` does.

    Raises:
        SweepError: it may hold anything but a sweep: it is the root folder or a home folder, or has other files.
    """
    try:
        _core.make_sweep_folder(os.fspath(folder))
    except StageError as error:
        raise SweepError(str(error).removeprefix("-o: ")) from None


def record_file(folder: str | os.PathLike[str], index: int) -> Path:
    """The path of the record of a finished run."""
    return Path(folder) / "runs" / f"{index // RUNS_PER_FOLDER:03d}" / f"{index:06d}.json"


def finished(folder: str | os.PathLike[str]) -> list[int]:
    """The sorted indices of runs with a record; none if the sweep has not begun.

    An empty file, which a full disk leaves, is no record.
    """
    if not Path(folder, "sweep.json").exists():
        return []
    found: list[int] = _core.Sweep(os.fspath(folder)).finished()
    return found


def missing(folder: str | os.PathLike[str], plan: Plan) -> list[int]:
    """The sorted indices of runs of the plan without a record."""
    return sorted(set(range(plan.count)).difference(finished(folder)))
