# SPDX-License-Identifier: GPL-2.0-or-later
"""Sweeps of worlds with names that are not UTF-8 keep all bytes of the names."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from stagesim.sweep import Experiment, Plan, program, run
from test_worker import WORKER, records, stage

LATIN = os.fsdecode(b"Stra\xdfe")  #: such a name as a Python string


@pytest.fixture
def odd(tmp_path: Path) -> Path:
    """A world file with that name, which contains a robot and a metric with that name."""
    (tmp_path / LATIN).mkdir()
    file = tmp_path / LATIN / f"{LATIN}.world"
    name = os.fsencode(LATIN)
    file.write_bytes(b'quit_time 1\nposition( name "%s" alwayson 1 )\nmetric( kind "distance" name "%s" )\n' % (name, name))
    return file


@pytest.fixture
def swept(odd: Path) -> Experiment:
    """An experiment of two values with two runs each."""
    return Experiment(odd, {f"{LATIN}.mass": [1, 2]}, runs=2, options={"args": LATIN})


def test_records_of_both_workers_have_the_same_names(swept: Experiment, tmp_path: Path) -> None:
    """Records of the program's workers and of Python workers have the same names."""
    words = swept.arguments()
    for out, worker in ((tmp_path / "program", []), (tmp_path / "python", ["--worker", WORKER])):
        done = stage("sweep", *words, *worker, "-o", out)
        assert done.returncode == 0, done.stderr
        plan = Plan.read(out)
        assert (plan.world, plan.axes[0].name, plan.options["args"]) == (str(swept.world), f"{LATIN}.mass", LATIN)
    by_program, by_python = records(tmp_path / "program"), records(tmp_path / "python")
    assert by_program == by_python
    assert [record["set"] for record in by_python] == [{f"{LATIN}.mass": value} for value in "1122"]
    assert list(by_python[0]["metrics"]) == [LATIN]


def test_replay_commands_work(swept: Experiment, tmp_path: Path) -> None:
    results = run(swept, out=tmp_path / "out", jobs=1)
    for record in records(results.folder):
        command = record["replay"].replace("stage ", f"'{program._paths.PROGRAM}' ", 1)
        done = subprocess.run(["sh", "-c", command], capture_output=True, check=True)
        assert done.stdout.split()[-1].decode() == record["state_hash"]


def test_tables_keep_the_names(swept: Experiment, tmp_path: Path) -> None:
    """CSV files and arrays keep the bytes; Parquet and HDF5, which need UTF-8, have printable names."""
    results = run(swept, out=tmp_path / LATIN / "out", jobs=1)
    table = results.table()
    assert table[f"{LATIN}.mass"].tolist() == [1, 1, 2, 2] and LATIN in table
    results.merge(tmp_path / "all.csv")
    assert b",Stra\xdfe.mass," in (tmp_path / "all.csv").read_bytes()
    parquet = pytest.importorskip("pyarrow.parquet", reason="skipped: pyarrow is not installed; try tools/setup --sweep")
    results.merge(tmp_path / "all.parquet")
    assert r"Stra\xdfe.mass" in parquet.read_table(tmp_path / "all.parquet").column_names
    h5py = pytest.importorskip("h5py", reason="skipped: h5py is not installed; try tools/setup --sweep")
    results.merge(tmp_path / "all.h5")
    with h5py.File(tmp_path / "all.h5") as file:
        assert r"Stra\xdfe.mass" in file


def test_odd_names_work_as_values_of_an_axis(odd: Path, tmp_path: Path) -> None:
    """Names with such bytes work as values of an axis, in every kind of table and in the report."""
    results = run(Experiment(odd, {f"{LATIN}.say": [LATIN, "plain"]}, runs=2), out=tmp_path / "out", jobs=1)
    assert results.table()[f"{LATIN}.say"].tolist() == [LATIN, LATIN, "plain", "plain"]
    for ending, package in ((".parquet", "pyarrow"), (".h5", "h5py")):
        pytest.importorskip(package, reason=f"skipped: {package} is not installed; try tools/setup --sweep")
        results.merge(tmp_path / f"all{ending}")
    pytest.importorskip("matplotlib", reason="skipped: matplotlib is not installed; try tools/setup --sweep")
    page = results.report().read_text(encoding="utf-8")
    assert r"Stra\xdfe.say" in page and r"Stra\xdfe.world" in page


def test_errors_name_the_file(odd: Path, tmp_path: Path) -> None:
    """An error of a Python worker names the file."""
    odd.write_bytes(odd.read_bytes() + b"nonsense(\n")
    done = subprocess.run([program._paths.PROGRAM, "sweep", odd, "--worker", WORKER, "-o", tmp_path / "out"],
                          capture_output=True, check=False, env=program.environment([]))
    assert done.returncode == 1
    assert done.stderr.count(b"\n") == 1 and b"Traceback" not in done.stderr
