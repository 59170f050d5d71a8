# SPDX-License-Identifier: GPL-2.0-or-later
"""Merges all records of a sweep into one CSV, Parquet or HDF5 file.

Equal records give equal bytes, if the package that writes the file has the same version: rows are sorted by
index, and neither times nor paths are written.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any, Callable, Sequence

import numpy as np

from ..text import printable
from .plan import Plan, SweepError
from .table import Column, merge_csv, read_columns


def merge(folders: Sequence[Path], file: Path, *, timings: bool = False, partial: bool = False) -> None:
    """Writes the file atomically: see Results.merge(). Each folder has a part of the same sweep."""
    if file.suffix == ".csv":
        merge_csv(folders, file, timings, partial)
        return
    if file.suffix not in FORMATS:
        raise SweepError(f"{file}: found the ending {file.suffix!r}, expected .csv, {' or '.join(FORMATS)}")
    begins, write = FORMATS[file.suffix]
    if file.exists() and not beginning(file).startswith(begins):
        raise SweepError(f"{file}: it exists and is not a merged table, expected a new name or an earlier "
                         f"{file.suffix} file")
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
    """The first 8 bytes of a file."""
    with open(file, "rb") as begun:
        return begun.read(8)


def current_umask() -> int:
    """The process's umask, which can only be read by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


def needed(name: str, ending: str) -> Any:
    """Imports a package. Raises SweepError if it is not installed."""
    try:
        return __import__(name, fromlist=["*"])
    except ImportError:
        raise SweepError(f"{ending} files need the Python package {name.split('.')[0]}, which is not there: "
                         'pip install "stagesim[sweep]", or merge into a .csv file') from None


def write_parquet(file: Path, columns: Sequence[Column], plan: Plan) -> None:
    """Writes a Parquet file with nulls for missing values, and with the plan in the schema's metadata."""
    arrow, parquet = needed("pyarrow", ".parquet"), needed("pyarrow.parquet", ".parquet")
    types = {"key": arrow.int64(), "count": arrow.int64(), "figure": arrow.float64(), "text": arrow.string()}
    schema = arrow.schema([(printable(column.name), types[column.kind]) for column in columns],
                          metadata={"stage_sweep": plan.text})
    arrays = [arrow.array([printable(value) if isinstance(value, str) else value for value in column.values],
                          types[column.kind]) for column in columns]
    parquet.write_table(arrow.table(arrays, schema=schema), file, compression="zstd", version="2.6",
                        row_group_size=2**20, store_schema=True)


def write_hdf5(file: Path, columns: Sequence[Column], plan: Plan) -> None:
    r"""Writes an HDF5 file with a dataset per column; missing values are NaN, -1 or an empty string.

    Bytes of names that are not UTF-8 are written as \xff and the like, as in Parquet files: both formats require UTF-8.
    """
    h5py = needed("h5py", ".h5")
    with h5py.File(file, "w", libver=("v110", "v110"), track_order=True) as out:
        out.attrs["stage_sweep"] = plan.text
        for column in columns:
            out.create_dataset(printable(column.name), data=hdf5_array(column, h5py), track_times=False)


def hdf5_array(column: Column, h5py: Any) -> Any:
    """The values of a column, in their type in HDF5 files."""
    if column.kind == "text":
        texts = [printable(value or "").encode() for value in column.values]
        longest = max(map(len, texts), default=0)
        return np.array(texts, h5py.string_dtype("utf-8", max(longest, 1)))
    if column.kind == "figure":
        return np.array([np.nan if value is None else value for value in column.values], np.float64)
    return np.array([-1 if value is None else value for value in column.values], np.int64)


#: File formats by the ending of the name: the first bytes of such files, and the writer.
FORMATS: dict[str, tuple[bytes, Callable[[Path, Sequence[Column], Plan], None]]] = {
    ".parquet": (b"PAR1", write_parquet), ".h5": (b"\x89HDF", write_hdf5)}
