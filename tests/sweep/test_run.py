# SPDX-License-Identifier: GPL-2.0-or-later
"""stagesim.sweep.run() with processes on this machine, its results, and the merged files."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import stagesim as st
from stagesim.sweep import Experiment, Results, SweepError, run


def merged(results: Results) -> bytes:
    """All runs as CSV."""
    file = results.folder / "all.csv"
    results.merge(file)
    return file.read_bytes()


def test_results_are_those_of_the_program(experiment: Experiment, tmp_path: Path) -> None:
    results = run(experiment, out=tmp_path / "out", jobs=2)
    assert len(results) == 20 and results.missing == [] and results.failed == []
    table = results.table()
    assert table["index"].tolist() == list(range(20))
    assert table["bots"].tolist() == [2] * 10 + [6] * 10
    assert table["world.resolution"].tolist() == ([.02] * 5 + [.1] * 5) * 2
    assert (table["steps"] == 50).all() and (table["simulated_seconds"] == 5).all()
    assert (table["driven"] > 0).all()
    for row in (0, 17):
        world = st.World(experiment.world, seed=int(table["seed"][row]), settings={
            "bots": int(table["bots"][row]), "world.resolution": table["world.resolution"][row]})
        world.run()
        assert world.state_hash() == table["state_hash"][row]
        assert world.metrics["driven"] == table["driven"][row]


def test_table_with_timings(experiment: Experiment, tmp_path: Path) -> None:
    results = run(experiment, out=tmp_path / "out", jobs=2)
    table = results.table(timings=True)
    assert (table["timing_wall_seconds"] > 0).all()
    assert set(table) > set(results.table())


def test_a_second_call_resumes_the_sweep(experiment: Experiment, tmp_path: Path) -> None:
    first = run(experiment, out=tmp_path / "out", jobs=2)
    before = merged(first)
    kept, gone = first.folder / "runs/000/000003.json", first.folder / "runs/000/000004.json"
    stamp = kept.stat().st_mtime_ns
    gone.write_bytes(b"")  # an empty record, as a full disk leaves it
    assert Results(first.folder).missing == [4]
    with pytest.raises(SweepError, match="1 of 20 runs are"):
        first.merge(tmp_path / "all.parquet")
    with pytest.raises(SweepError, match="1 of 20 runs are"):
        first.merge(tmp_path / "all.csv")
    again = run(experiment, out=tmp_path / "out", jobs=2)
    assert merged(again) == before and kept.stat().st_mtime_ns == stamp


def test_another_experiment_is_refused(experiment: Experiment, tmp_path: Path, own_metrics: None) -> None:
    run(experiment, out=tmp_path / "out", jobs=2)
    with pytest.raises(SweepError, match="another experiment"):
        run(Experiment(experiment.world, {"bots": [2, 7]}), out=tmp_path / "out")
    with pytest.raises(SweepError, match="another experiment"):
        run(replace(experiment, metrics="own_metrics:spread"), out=tmp_path / "out")


def test_places_that_hold_something_else_are_refused(experiment: Experiment, tmp_path: Path,
                                                     monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "notes.txt").write_text("precious")
    (tmp_path / "dangling").symlink_to("nowhere")
    (tmp_path / "home").mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    for place in ("/", tmp_path / "home", tmp_path / "notes", tmp_path / "dangling", tmp_path / "notes/notes.txt"):
        with pytest.raises(SweepError, match="expected the name of a new folder"):
            run(experiment, out=place)
    assert os.listdir(tmp_path / "home") == [] and os.listdir(tmp_path / "notes") == ["notes.txt"]
    assert not (tmp_path / "nowhere").exists()


def test_common_seeds(experiment: Experiment, tmp_path: Path) -> None:
    paired = Experiment(experiment.world, experiment.set, runs=range(2, 5), common_seeds=True)
    table = run(paired, out=tmp_path / "out", jobs=2).table()
    assert table["run"].tolist() == [2, 3, 4] * 4
    assert len(set(table["seed"].tolist())) == 3


@pytest.mark.parametrize("change, text", [
    ({"world": "there_is_none.world"}, "there_is_none.world"),
    ({"set": {"bots": ["x"]}}, "whole number"),
    ({"set": {"gizmos": [1]}}, "found no population and no model of that name"),
    ({"metrics": "there_is_none:f"}, "there_is_none:f"),
    ({"metrics": "own_metrics"}, "module:name"),
    ({"metrics": "own_metrics:nothing_such"}, "nothing_such"),
    ({"metrics": "own_metrics:NUMBER"}, "expected a function or a class"),
    ({"options": {"no-such-option": 1}}, "no-such-option"),
])
def test_invalid_experiments_are_refused_before_the_first_run(world: Path, tmp_path: Path, own_metrics: None,
                                                              change: dict[str, Any], text: str) -> None:
    with pytest.raises(SweepError) as caught:
        run(Experiment(**{"world": world, **change}), out=tmp_path / "out")
    assert text in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("change", [{"runs": 0}, {"runs": (3, 3)}, {"runs": range(0, 9, 2)}, {"set": {"bots": []}},
                                    {"set": {"world.name": ["a,b"]}}])
def test_invalid_experiments_are_refused(world: Path, change: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="expected"):
        Experiment(**{"world": world, **change}).arguments()


def test_folder_without_a_sweep(tmp_path: Path) -> None:
    with pytest.raises(SweepError, match="expected the plan of a sweep"):
        Results(tmp_path)
    (tmp_path / "sweep.json").write_text("{}")
    with pytest.raises(SweepError, match="found no plan"):
        Results(tmp_path)


def test_progress_is_the_program_s(experiment: Experiment, tmp_path: Path) -> None:
    code = ("import sys; from stagesim.sweep import *;"
            "run(Experiment(sys.argv[1], runs=20), out=sys.argv[2], jobs=1, progress=True)")
    done = subprocess.run([sys.executable, "-c", code, str(experiment.world), str(tmp_path / "out")],
                          capture_output=True, text=True, check=True)
    assert done.stdout == ""


@pytest.mark.parametrize("ending, package", [(".parquet", "pyarrow"), (".h5", "h5py")])
def test_merged_files_do_not_depend_on_the_order(experiment: Experiment, tmp_path: Path, ending: str,
                                                 package: str) -> None:
    pytest.importorskip(package, reason=f"skipped: {package} is not installed; try tools/setup --sweep")
    first = run(experiment, out=tmp_path / "a", jobs=2)
    second = run(experiment, out=tmp_path / "b", jobs=1)
    for name in (tmp_path / f"one{ending}", tmp_path / f"two{ending}"):
        first.merge(name)
    os.utime(first.folder, (0, 0))
    second.merge(tmp_path / f"three{ending}")
    data = [(tmp_path / f"{name}{ending}").read_bytes() for name in ("one", "two", "three")]
    assert data[0] == data[1] == data[2]
    other = tmp_path / f"program{ending}"
    subprocess.run([st._paths.PROGRAM, "merge", str(first.folder), "-o", str(other)], check=True,
                   env={**os.environ, "STAGE_PYTHON": sys.executable})
    assert other.read_bytes() == data[0]
    merged(first)
    assert read_back(tmp_path / f"one{ending}") == read_back(first.folder / "all.csv")


def read_back(file: Path) -> dict[str, list[Any]]:
    """Reads the columns of a merged file, as numbers if possible; None: no value."""
    columns: dict[str, list[Any]]
    if file.suffix == ".parquet":
        import pyarrow.parquet as parquet

        columns = parquet.read_table(file).to_pydict()
    elif file.suffix == ".h5":
        import h5py

        with h5py.File(file) as data:
            columns = {name: [value.decode() if isinstance(value, bytes) else value for value in data[name][:].tolist()]
                       for name in data}
    else:
        with open(file, newline="") as lines:
            names, *rows = csv.reader(lines)
        columns = {name: [row[at] for row in rows] for at, name in enumerate(names)}
    return {name: [plain(value) for value in values] for name, values in columns.items()}


def plain(value: Any) -> Any:
    if value in (None, "", -1):
        return None
    try:
        return None if np.isnan(float(value)) else float(value)
    except ValueError:
        return value


def test_merge_refuses_other_endings(experiment: Experiment, tmp_path: Path) -> None:
    results = run(experiment, out=tmp_path / "out", jobs=2)
    with pytest.raises(SweepError, match=".txt"):
        results.merge(tmp_path / "all.txt")
    mine = tmp_path / "mine.h5"
    mine.write_text("my own")
    with pytest.raises(SweepError, match="is not a merged table"):
        results.merge(mine)
    assert mine.read_text() == "my own"


def test_table_as_data_frame(experiment: Experiment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """table(pandas=True) passes the columns to pandas, which may be replaced by a stand-in."""
    results = run(experiment, out=tmp_path / "out", jobs=2)
    stand_in = ModuleType("pandas")
    stand_in.DataFrame = dict  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pandas", stand_in)
    assert list(results.table(pandas=True)) == list(results.table())
