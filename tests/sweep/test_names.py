# SPDX-License-Identifier: GPL-2.0-or-later
"""Sweeps of worlds whose names are not UTF-8: what is in the plan comes through all of it as the same bytes."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from stagesim.sweep import Experiment, Plan, program, run
from test_worker import WORKER, records, stage

LATIN = os.fsdecode(b"Stra\xdfe")  #: as Python holds such a name


@pytest.fixture
def odd(tmp_path: Path) -> Path:
    """A world file with that name, with a robot and a metric of that name."""
    (tmp_path / LATIN).mkdir()
    file = tmp_path / LATIN / f"{LATIN}.world"
    name = os.fsencode(LATIN)
    file.write_bytes(b'quit_time 1\nposition( name "%s" alwayson 1 )\nmetric( kind "distance" name "%s" )\n' % (name, name))
    return file


@pytest.fixture
def swept(odd: Path) -> Experiment:
    """Two values, two runs each."""
    return Experiment(odd, {f"{LATIN}.mass": [1, 2]}, runs=2, options={"args": LATIN})


def test_names_come_through(swept: Experiment, tmp_path: Path) -> None:
    """By the program's workers, by those in Python, and back out of the records of both."""
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


def test_tables_have_the_names(swept: Experiment, tmp_path: Path) -> None:
    """CSV and arrays the names themselves; Parquet and HDF5, which are UTF-8, what people read."""
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


def test_values_of_texts(odd: Path, tmp_path: Path) -> None:
    """As an axis of texts, in every kind of table and in the report."""
    results = run(Experiment(odd, {f"{LATIN}.say": [LATIN, "plain"]}, runs=2), out=tmp_path / "out", jobs=1)
    assert results.table()[f"{LATIN}.say"].tolist() == [LATIN, LATIN, "plain", "plain"]
    for ending, package in ((".parquet", "pyarrow"), (".h5", "h5py")):
        pytest.importorskip(package, reason=f"skipped: {package} is not installed; try tools/setup --sweep")
        results.merge(tmp_path / f"all{ending}")
    pytest.importorskip("matplotlib", reason="skipped: matplotlib is not installed; try tools/setup --sweep")
    page = results.report().read_text(encoding="utf-8")
    assert r"Stra\xdfe.say" in page and r"Stra\xdfe.world" in page


def test_failures_are_told(odd: Path, tmp_path: Path) -> None:
    """A reply of a worker in Python that names the file."""
    odd.write_bytes(odd.read_bytes() + b"nonsense(\n")
    done = subprocess.run([program._paths.PROGRAM, "sweep", odd, "--worker", WORKER, "-o", tmp_path / "out"],
                          capture_output=True, check=False, env=program.environment([]))
    assert done.returncode == 1
    assert done.stderr.count(b"\n") == 1 and b"Traceback" not in done.stderr
