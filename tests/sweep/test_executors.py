# SPDX-License-Identifier: GPL-2.0-or-later
"""Sweeps on executors give the same files with each executor, even if workers are killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from patience import PATIENCE
from stagesim.sweep import Experiment, Results, SweepError, executors, plan, program, run
from test_run import merged


@pytest.fixture
def example(root: Path) -> Path:
    """A program that does a sweep on an engine."""
    return root / "examples" / "sweeps" / "sweep.py"


#: 6 sets of 5 runs of some 50 ms each.
SIZE = ["--runs", "5", "--duration", "60"]


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The result of that program's sweep without killed workers."""
    out = tmp_path_factory.mktemp("expected") / "out"
    file = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).parents[2]) / "examples/sweeps/sweep.py"
    subprocess.run([sys.executable, str(file), str(out), *SIZE], check=True, stdout=subprocess.DEVNULL)
    return (out / "all.csv").read_bytes()


def wait_for_runs(out: Path, least: int) -> None:
    """Waits until at least `least` runs, but not all, are finished."""
    end = time.monotonic() + PATIENCE
    while len(plan.finished(out)) < least:
        assert time.monotonic() < end, "no runs are done"
        time.sleep(0.005)


def killed_later(pid: int, out: Path, least: int) -> threading.Thread:
    """Starts a thread that kills a process when at least `least` runs are finished."""
    def wait_and_kill() -> None:
        wait_for_runs(out, least)
        os.kill(pid, signal.SIGKILL)
    thread = threading.Thread(target=wait_and_kill)
    thread.start()
    return thread


def test_processes_and_threads(slow: Experiment, tmp_path: Path) -> None:
    alone = merged(run(slow, out=tmp_path / "alone", jobs=2))
    told: list[tuple[int, int]] = []
    with ProcessPoolExecutor(2) as pool:
        results = run(slow, pool, out=tmp_path / "pool", jobs=2, progress=lambda *how_far: told.append(how_far))
    assert merged(results) == alone
    assert told[0] == (0, 30) and told[-1] == (30, 30) and len(told) == 9  # tasks have a quarter of the runs per worker
    with ThreadPoolExecutor(2) as pool:
        assert merged(run(slow, pool, out=tmp_path / "threads", jobs=2, chunk=4)) == alone


def test_a_broken_pool_is_replaced(slow: Experiment, tmp_path: Path) -> None:
    out, pools = tmp_path / "out", []

    def make() -> ProcessPoolExecutor:
        pool = ProcessPoolExecutor(2)
        pools.append(pool)
        if len(pools) == 1:
            killed_later(pool.submit(os.getpid).result(), out, 6)
        return pool

    results = run(slow, make, out=out, jobs=2, chunk=3)
    assert len(pools) in (2, 3)  # three if runs of the first pool were still ending when the second one began
    assert merged(results) == merged(run(slow, out=tmp_path / "alone", jobs=2))
    assert not runs_of(out), "a worker that was killed has left runs behind that go on"


def runs_of(out: Path) -> list[str]:
    """The processes that work on the sweep."""
    listed = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True).stdout
    return [line for line in listed.splitlines() if "sweep" in line and line.rstrip().endswith(str(out))]


def test_a_broken_pool_of_the_caller_is_an_error(slow: Experiment, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with ProcessPoolExecutor(2) as pool:
        killer = killed_later(pool.submit(os.getpid).result(), out, 6)
        with pytest.raises(SweepError, match=r"\d+ of 30 runs are missing: \d+, .* with a new executor"):
            run(slow, pool, out=out, jobs=2, chunk=3)
        killer.join()
    assert 6 <= len(Results(out)) < 30
    assert merged(run(slow, out=out, jobs=2)) == merged(run(slow, out=tmp_path / "alone", jobs=2))


class Idle:
    """An executor whose workers do nothing or die."""

    def __init__(self, dies: bool) -> None:
        self.dies, self.most, self.pending, self.submitted = dies, 0, 0, 0

    def submit(self, function: Any, job: program.Job, first: int, last: int) -> Future[str]:
        self.submitted += 1
        self.pending += 1
        self.most = max(self.most, self.pending)
        future: Future[str] = Future()
        threading.Timer(0.001, self.end, [future]).start()
        return future

    def end(self, future: Future[str]) -> None:
        self.pending -= 1
        if self.dies:
            future.set_exception(RuntimeError("the worker is gone"))
        else:
            future.set_result("stage: did nothing")


@pytest.mark.parametrize("dies, said", [(False, "did nothing"), (True, "the worker is gone")])
def test_a_sweep_without_progress_ends_with_an_error(experiment: Experiment, tmp_path: Path, dies: bool,
                                                     said: str) -> None:
    idle = Idle(dies)
    with pytest.raises(SweepError, match=f"20 of 20 runs are missing: 0, 1, 2, 3, 4, ...; .*{said}"):
        run(experiment, idle, out=tmp_path / "out", jobs=2, chunk=1)
    assert idle.submitted == 20 * executors.MAX_IDLE_ROUNDS and idle.most <= 4


def test_a_changed_world_is_an_error(experiment: Experiment, tmp_path: Path) -> None:
    run(experiment, out=tmp_path / "out", jobs=2)
    (tmp_path / "out/runs/000/000003.json").unlink()
    Path(experiment.world).write_text(Path(experiment.world).read_text() + "# changed\n")
    with ThreadPoolExecutor(1) as pool, pytest.raises(SweepError, match="an earlier state of the world file"):
        run(experiment, pool, out=tmp_path / "out")


def test_metrics_in_python(experiment: Experiment, tmp_path: Path, own_metrics: None) -> None:
    own = replace(experiment, set={"bots": [2, 6]}, metrics="own_metrics:Nearest")
    with ProcessPoolExecutor(2) as pool:
        results = run(own, pool, out=tmp_path / "pool", jobs=2, chunk=5)
    assert merged(results) == merged(run(own, out=tmp_path / "alone", jobs=2))


@pytest.fixture
def started() -> Iterator[list[subprocess.Popen[str]]]:
    """A list of processes that are ended after the test."""
    processes: list[subprocess.Popen[str]] = []
    yield processes
    for process in processes:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def test_dask_with_a_worker_killed(example: Path, tmp_path: Path, expected: bytes,
                                   started: list[subprocess.Popen[str]]) -> None:
    """If a worker is killed during a run, the cluster starts another one and the sweep is complete."""
    pytest.importorskip("distributed", reason="skipped: Dask is not installed; try tools/setup --sweep")
    out = tmp_path / "out"
    sweep = subprocess.Popen([sys.executable, str(example), str(out), "--by", "dask", *SIZE], text=True,
                             stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)
    started.append(sweep)
    assert sweep.stdout
    worker = int(sweep.stdout.readline().split()[1])
    wait_for_runs(out, 8)
    os.kill(worker, signal.SIGKILL)
    assert len(plan.finished(out)) < 30
    said, errors = sweep.communicate(timeout=PATIENCE)
    assert sweep.returncode == 0, errors
    assert "30 runs, 0 failed" in said
    assert (out / "all.csv").read_bytes() == expected


def test_mpi_killed_and_resumed(example: Path, tmp_path: Path, expected: bytes,
                                started: list[subprocess.Popen[str]]) -> None:
    """Killing one process during a run ends all of them; the sweep can be resumed."""
    pytest.importorskip("mpi4py", reason="skipped: mpi4py is not installed; try tools/setup --sweep")
    mpiexec = Path(sys.executable).with_name("mpiexec")
    if not mpiexec.exists():
        pytest.skip("skipped: mpiexec is not installed; try tools/setup --sweep")
    out = tmp_path / "out"
    words = [str(mpiexec), "-n", "3", sys.executable, "-m", "mpi4py.futures", str(example), str(out), "--by", "mpi",
             *SIZE]
    sweep = subprocess.Popen(words, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                             start_new_session=True)
    started.append(sweep)
    wait_for_runs(out, 8)
    ranks = subprocess.run(["pgrep", "-f", f"mpi4py.futures {example} {out}"], capture_output=True, text=True,
                           check=True).stdout.split()
    os.kill(int(ranks[-1]), signal.SIGKILL)
    sweep.communicate(timeout=PATIENCE)
    assert sweep.returncode != 0
    done = len(plan.finished(out))
    assert 8 <= done < 30
    again = subprocess.run(words, capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert again.returncode == 0, again.stderr
    assert "30 runs, 0 failed" in again.stdout
    assert (out / "all.csv").read_bytes() == expected
