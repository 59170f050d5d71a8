# SPDX-License-Identifier: GPL-2.0-or-later
"""A sweep on processes of this machine, on Dask, or on MPI.

    python sweep.py out --by processes
    python sweep.py out --by dask
    mpiexec -n 3 python -m mpi4py.futures sweep.py out --by mpi

After an interruption, the same command continues the sweep, also with another engine. `--jobs` is the
number of workers. The result is out/all.csv, with the same bytes every time.
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from stagesim.sweep import Experiment, run

WORLD = Path(__file__).resolve().parent / "room.world"


def executor_of(engine: str, jobs: int, stack: ExitStack) -> Any:
    """Return an executor for the engine; None selects the workers of `stage sweep`."""
    if engine == "processes":
        # A factory, because a pool that has lost a worker cannot be used again.
        return lambda: ProcessPoolExecutor(jobs)
    if engine == "dask":
        from dask.distributed import Client, LocalCluster

        cluster = stack.enter_context(LocalCluster(n_workers=jobs, threads_per_worker=1, dashboard_address=None))
        client = stack.enter_context(Client(cluster))
        print("workers:", *client.run(os.getpid).values(), flush=True)
        return stack.enter_context(client.get_executor())
    if engine == "mpi":
        from mpi4py.futures import MPIPoolExecutor

        return stack.enter_context(MPIPoolExecutor())
    return None


def main() -> None:
    """Run what is not finished yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, help="the folder of the sweep")
    parser.add_argument("--by", choices=("program", "processes", "dask", "mpi"), default="program", help="the engine")
    parser.add_argument("--jobs", type=int, default=2, help="workers (default 2)")
    parser.add_argument("--runs", type=int, default=20, help="of each set of values (default 20)")
    parser.add_argument("--duration", type=float, help="simulated seconds of a run (default: the world's)")
    options = parser.parse_args()
    experiment = Experiment(WORLD, {"bots": [2, 4, 8], "world.resolution": [.02, .1]}, runs=options.runs,
                            common_seeds=True, duration=options.duration)
    with ExitStack() as stack:
        executor = executor_of(options.by, options.jobs, stack)
        results = run(experiment, executor, out=options.out, jobs=options.jobs, chunk=2 if executor else None)
    results.merge(options.out / "all.csv")
    print(f"{len(results)} runs, {len(results.failed)} failed: {options.out / 'all.csv'}")


if __name__ == "__main__":
    main()
