# SPDX-License-Identifier: GPL-2.0-or-later
"""The results of a sweep."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .merge import merge
from .plan import Plan, missing
from .table import Column, failed_records, read_columns


class Results:
    """The finished runs of a sweep, read from its folder.

    Args:
        folder: the folder of the sweep.

    Raises:
        SweepError: the folder has no sweep.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)  #: the folder of the sweep
        self.plan = Plan.read(folder)  #: the runs of the sweep

    def table(self, *, timings: bool = False, pandas: bool = False) -> Any:
        """Returns all finished runs as columns, sorted by index.

        Args:
            timings: True: also the times, which are not reproducible: `timing_load_seconds`,
                `timing_wall_seconds` and `timing_r_acc` (robots times simulated seconds per real second).
            pandas: True: return a pandas DataFrame; pandas must be installed.

        Returns:
            Arrays of shape (runs,) by name: `index`, `run`, `seed` (int64), each axis (int64, float64 or str,
            by its values), `status`, `state_hash` (str), then as float64 `steps`, `simulated_seconds`, `rays`,
            `robots`, energies (joules) and metrics. Missing values, as in failed runs, are NaN or empty strings.
        """
        columns = {column.name: array_of(column) for column in read_columns([self.folder], self.plan, timings)}
        if not pandas:
            return columns
        import pandas as frames  # pylint: disable=import-outside-toplevel

        return frames.DataFrame(columns)

    def merge(self, file: str | os.PathLike[str], *, timings: bool = False, partial: bool = False) -> None:
        """Writes all runs into one file. Equal runs give equal bytes, in whatever order and where they were done.

        Args:
            file: ends with .csv, .parquet (needs pyarrow) or .h5 (needs h5py).
            timings: as in table().
            partial: True: allow missing runs.

        Raises:
            SweepError: runs or a package are missing, or the ending of the name is another one.
        """
        merge([self.folder], Path(file), timings=timings, partial=partial)

    def report(self) -> Path:
        """Writes a page with pictures into the folder `report`; returns the page's path. Needs matplotlib."""
        from .report import write_report  # pylint: disable=import-outside-toplevel

        return write_report(self.folder)

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Records of runs that failed in all attempts, with keys `index`, `set`, `run`, `lines`, `replay`, ..."""
        return failed_records(self.folder, read_columns([self.folder], self.plan))

    @property
    def missing(self) -> list[int]:
        """Indices of the runs that are not finished."""
        return missing(self.folder, self.plan)

    def __len__(self) -> int:
        return self.plan.count - len(self.missing)

    def __repr__(self) -> str:
        return f"<Results {str(self.folder)!r}: {len(self)} of {self.plan.count} runs>"


def array_of(column: Column) -> npt.NDArray[Any]:
    """Converts a column to an array: str for text, int64 for keys, else float64."""
    if column.kind == "text":
        return np.array(["" if value is None else value for value in column.values], str)
    if column.kind == "key":
        return np.array(column.values, np.int64)
    return np.array([np.nan if value is None else value for value in column.values], np.float64)
