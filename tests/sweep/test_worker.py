# SPDX-License-Identifier: GPL-2.0-or-later
"""Python workers: records equal those of the program, and own metrics."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from stagesim.sweep import Experiment, program, run
from test_run import merged

WORKER = shlex.join([sys.executable, "-m", "stagesim.sweep.worker"])


def stage(*words: object) -> subprocess.CompletedProcess[str]:
    """Runs the program with a Python that finds this package."""
    return subprocess.run([program._paths.PROGRAM, *map(str, words)], capture_output=True, text=True, check=False,
                          env=program.environment([]))


def records(folder: Path) -> list[dict[str, Any]]:
    """The records of all runs without data that are not reproducible."""
    found = [json.loads(file.read_text()) for file in sorted((folder / "runs").glob("*/*.json"))]
    for record in found:
        record.pop("timing", None)
    return found


@pytest.mark.parametrize("options", [
    {}, {"common-seeds": True}, {"duration": 2.05, "ray-model": "exact", "no-controllers": True},
    {"args": "it's \"one\"", "log": True, "log-every": 1, "log-models": "bot1"},
    {"args": "\udcff", "log": True, "log-compression": "none", "log-ranges": "stage"}])
def test_records_are_those_of_the_program_s_worker(world: Path, tmp_path: Path, options: dict[str, Any]) -> None:
    """Records equal those of the program, including seeds, replay commands and logs."""
    words = Experiment(world, {"bots": [2, 3], "world.resolution": [.02, .1], "bot.color": ["red", "it's blue"]},
                       runs=2, seed=2**63, options=options).arguments()
    by_program, by_python = tmp_path / "program", tmp_path / "python"
    for out, worker in ((by_program, []), (by_python, ["--worker", WORKER])):
        done = stage("sweep", *words, *worker, "--jobs", 2, "-o", out)
        assert done.returncode == 0, done.stderr
    assert records(by_program) == records(by_python)
    files = [sorted(file.relative_to(out) for file in out.rglob("*") if file.suffix in (".json", ".mcap"))
             for out in (by_program, by_python)]
    assert files[0] == files[1]
    for out in (by_program, by_python):
        assert stage("merge", out, "-o", f"{out}.csv").returncode == 0
    assert (tmp_path / "program.csv").read_bytes() == (tmp_path / "python.csv").read_bytes()
    for log in by_program.rglob("*.mcap"):
        assert log.read_bytes() == (by_python / log.relative_to(by_program)).read_bytes()


def test_metrics_at_the_end(experiment: Experiment, tmp_path: Path, own_metrics: None) -> None:
    plain = run(experiment, out=tmp_path / "plain", jobs=2).table()
    table = run(replace(experiment, metrics="own_metrics:spread"), out=tmp_path / "out", jobs=2).table()
    assert list(table)[-6:] == ["driven", "swept", "goal", "spread", "nothing", "not_finite"]
    assert (table["spread"] > 0).all()
    assert table["state_hash"].tolist() == plain["state_hash"].tolist()
    import numpy as np

    assert np.isnan(table["nothing"]).all() and np.isnan(table["not_finite"]).all()


def test_metrics_after_each_step(experiment: Experiment, tmp_path: Path, own_metrics: None) -> None:
    plain = run(experiment, out=tmp_path / "plain", jobs=2).table()
    table = run(replace(experiment, metrics="own_metrics:Nearest"), out=tmp_path / "out", jobs=2).table()
    assert (table["steps_seen"] == table["steps"]).all() and (table["nearest"] < 5).all()
    assert table["state_hash"].tolist() == plain["state_hash"].tolist()


def test_metrics_that_fail(experiment: Experiment, tmp_path: Path, own_metrics: None,
                           monkeypatch: pytest.MonkeyPatch) -> None:
    own = replace(experiment, metrics="own_metrics:fails_with_six", set={"bots": [2, 6]}, options={"tries": 2})
    results = run(own, out=tmp_path / "out", jobs=2)
    failed = results.failed
    assert [record["index"] for record in failed] == list(range(5, 10))
    ends = {record.get("signal") or record["lines"][-1] for record in failed}
    assert ends == {"SIGABRT", "found six robots",
                    "TypeError: found 'text' as the metric 'bad', expected a number or None"}
    assert all(record["attempts"] == 2 and record["replay"].startswith("stage -g --seed ") for record in failed)
    table = results.table()
    assert (table["fine"][:5] == 1).all() and set(table["status"][5:]) == {"failed"}
    monkeypatch.setenv("SIX_ARE_FINE", "1")
    again = run(own, out=tmp_path / "out", jobs=2, retry_failed=True)
    assert again.failed == [] and (again.table()["driven"] > 0).all()


def test_the_plan_can_be_resumed_by_the_program(experiment: Experiment, tmp_path: Path, own_metrics: None,
                                                monkeypatch: pytest.MonkeyPatch) -> None:
    """The plan stores the worker. Without the module of its metrics, resuming is an error and fails no run."""
    own, out = replace(experiment, metrics="own_metrics:spread"), tmp_path / "out"
    whole = run(own, out=tmp_path / "whole", jobs=2)
    program.make_plan(own, out)
    done = stage("sweep", "--resume", out)
    assert done.returncode == 1 and "own_metrics" in done.stderr and done.stderr.count("\n") == 1, done.stderr
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))
    assert stage("sweep", "--resume", out).returncode == 0
    assert records(out) == records(whole.folder)


def test_a_worker_started_by_hand_explains_its_use(tmp_path: Path) -> None:
    done = subprocess.run([*shlex.split(WORKER), str(tmp_path)], capture_output=True, text=True, check=False,
                          env=program.environment([]))
    assert done.returncode == 2 and "expected to be started by stage sweep --worker" in done.stderr
