# SPDX-License-Identifier: GPL-2.0-or-later
"""All records of a sweep as one file: CSV, Parquet, HDF5.

The same records give the same bytes, with the same version of the package that writes them: rows are in the
order of their indices, and nothing is written that tells of time or place.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any, Callable, Sequence

import numpy as np

from .plan import Plan, SweepError
from .table import Column, merge_csv, read_columns


def merge(folders: Sequence[Path], file: Path, *, timings: bool = False, partial: bool = False) -> None:
    """Writes the file, whole or not at all: see Results.merge(). Each folder has a part of the same sweep."""
    if file.suffix == ".csv":
        merge_csv(folders, file, timings, partial)
        return
    if file.suffix not in FORMATS:
        raise SweepError(f"{file}: found the ending {file.suffix!r}, expected .csv, {' or '.join(FORMATS)}")
    begins, write = FORMATS[file.suffix]
    if file.exists() and not beginning(file).startswith(begins):
        raise SweepError(f"{file}: it holds something else, expected a new name or an earlier {file.suffix} file")
    plan = Plan.read(folders[0])
    columns = read_columns(folders, plan, timings, partial)
    handle, name = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}.")
    os.close(handle)
    try:
        write(Path(name), columns, plan)
        os.chmod(name, 0o666 & ~current_umask())
        os.replace(name, file)
    except BaseException:
        os.unlink(name)
        raise


def beginning(file: Path) -> bytes:
    """A few bytes."""
    with open(file, "rb") as begun:
        return begun.read(8)


def current_umask() -> int:
    """Which rights new files don't get; the system only tells by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


def needed(name: str, ending: str) -> Any:
    """The package of that name; SweepError if it is not installed."""
    try:
        return __import__(name, fromlist=["*"])
    except ImportError:
        raise SweepError(f"{ending} files need the Python package {name.split('.')[0]}, which is not there: "
                         'pip install "stagesim[sweep]", or merge into a .csv file') from None


def write_parquet(file: Path, columns: Sequence[Column], plan: Plan) -> None:
    """With nulls where there is no value; the plan is in the schema's metadata."""
    arrow, parquet = needed("pyarrow", ".parquet"), needed("pyarrow.parquet", ".parquet")
    types = {"key": arrow.int64(), "count": arrow.int64(), "figure": arrow.float64(), "text": arrow.string()}
    schema = arrow.schema([(column.name, types[column.kind]) for column in columns],
                          metadata={"stage_sweep": plan.text})
    arrays = [arrow.array(column.values, types[column.kind]) for column in columns]
    parquet.write_table(arrow.table(arrays, schema=schema), file, compression="zstd", version="2.6",
                        row_group_size=2**20, store_schema=True)


def write_hdf5(file: Path, columns: Sequence[Column], plan: Plan) -> None:
    """A dataset for each column, in their order; NaN, -1 and an empty text where there is no value."""
    h5py = needed("h5py", ".h5")
    with h5py.File(file, "w", libver=("v110", "v110"), track_order=True) as out:
        out.attrs["stage_sweep"] = plan.text
        for column in columns:
            out.create_dataset(column.name, data=hdf5_array(column, h5py), track_times=False)


def hdf5_array(column: Column, h5py: Any) -> Any:
    """Its values in the type that they have in the file."""
    if column.kind == "text":
        texts = [(value or "").encode() for value in column.values]
        longest = max(map(len, texts), default=0)
        return np.array(texts, h5py.string_dtype("utf-8", max(longest, 1)))
    if column.kind == "figure":
        return np.array([np.nan if value is None else value for value in column.values], np.float64)
    return np.array([-1 if value is None else value for value in column.values], np.int64)


#: By the ending of a file's name: how such files begin, and who writes them.
FORMATS: dict[str, tuple[bytes, Callable[[Path, Sequence[Column], Plan], None]]] = {
    ".parquet": (b"PAR1", write_parquet), ".h5": (b"\x89HDF", write_hdf5)}
