# SPDX-License-Identifier: GPL-2.0-or-later
"""What has come of a sweep."""

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
    """The runs of a sweep that are finished, as its folder has them.

    Args:
        folder: of the sweep.

    Raises:
        SweepError: it has no sweep.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)  #: where all of it is
        self.plan = Plan.read(folder)  #: which runs there are to be

    def table(self, *, timings: bool = False, pandas: bool = False) -> Any:
        """All finished runs, a row for each, in the order of their indices.

        Args:
            timings: also what differs from time to time: `timing_load_seconds`, `timing_wall_seconds` and
                `timing_r_acc`, robots times simulated seconds for each real one.
            pandas: as a DataFrame of pandas, which has to be installed.

        Returns:
            By name, arrays of shape (runs,): `index`, `run`, `seed` (int64), each axis (int64, float64 or str,
            as its values are), `status`, `state_hash` (str), then figures, as float64: `steps`,
            `simulated_seconds`, `rays`, `robots`, energies (joules), metrics. NaN, and an empty text, stand
            where there is no value, as in runs that failed.
        """
        columns = {column.name: array_of(column) for column in read_columns([self.folder], self.plan, timings)}
        if not pandas:
            return columns
        import pandas as frames  # pylint: disable=import-outside-toplevel

        return frames.DataFrame(columns)

    def merge(self, file: str | os.PathLike[str], *, timings: bool = False, partial: bool = False) -> None:
        """Writes all runs into one file. The same runs give the same bytes, whoever did them in whatever order.

        Args:
            file: ends with .csv, .parquet (needs pyarrow) or .h5 (needs h5py).
            timings: as in table().
            partial: some runs may be missing.

        Raises:
            SweepError: runs are missing, the ending is another one, or a package is.
        """
        merge([self.folder], Path(file), timings=timings, partial=partial)

    def report(self) -> Path:
        """Makes a page and pictures of it, in the folder `report`; returns the page's path. Needs matplotlib."""
        from .report import write_report  # pylint: disable=import-outside-toplevel

        return write_report(self.folder)

    @property
    def failed(self) -> list[dict[str, Any]]:
        """The records of runs that failed three times: `index`, `set`, `run`, `lines`, `replay` and the like."""
        return failed_records(self.folder, read_columns([self.folder], self.plan))

    @property
    def missing(self) -> list[int]:
        """The indices of runs that are not finished."""
        return missing(self.folder, self.plan)

    def __len__(self) -> int:
        return self.plan.count - len(self.missing)

    def __repr__(self) -> str:
        return f"<Results {str(self.folder)!r}: {len(self)} of {self.plan.count} runs>"


def array_of(column: Column) -> npt.NDArray[Any]:
    """Texts, whole numbers where all are there, or else float64."""
    if column.kind == "text":
        return np.array(["" if value is None else value for value in column.values], str)
    if column.kind == "key":
        return np.array(column.values, np.int64)
    return np.array([np.nan if value is None else value for value in column.values], np.float64)
