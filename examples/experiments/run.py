#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Makes the sweeps of experiments, and writes tables and figures: NAME.csv, NAME.md and NAME.png.

    python run.py aggregation flocking --runs 30 --jobs 2 --out out

Called again, it makes only missing runs. The same runs give the same tables on every machine.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import experiment
from stagesim.reports.plots import PlotsMissing
from stagesim.sweep import Results, SweepError


def make(name: str, runs: int, jobs: int, out: Path, pictures: Path) -> None:
    """Makes the sweep of an experiment and writes its files."""
    study = experiment.find(name)
    table = experiment.run(study, runs, jobs, out / name)
    Results(out / name).merge(out / f"{name}.csv")
    text = "\n".join(study.lines(table))
    (out / f"{name}.md").write_text(text + "\n", encoding="utf-8")
    print(f"{name}: {runs} runs of each set of values\n\n{text}\n", flush=True)
    study.figure(table, pictures / f"{name}.png")


def main(arguments: list[str] | None = None) -> None:
    """Makes the experiments that are named, or all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    known = experiment.names()
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"any of {', '.join(known)} (default: all)")
    parser.add_argument("--runs", type=int, default=experiment.RUNS, help="of each set of values (default 30)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    parser.add_argument("--out", type=Path, default=Path("out"), help="a folder for the runs and files (default: out)")
    parser.add_argument("--pictures", type=Path, help="a folder for the figures (default: that of the files)")
    options = parser.parse_args(arguments)
    if unknown := [name for name in options.names if name not in known]:
        parser.error(f"found {unknown[0]!r}, expected any of {', '.join(known)}")
    for folder in (options.out, options.pictures or options.out):
        folder.mkdir(parents=True, exist_ok=True)
    for name in options.names or known:
        try:
            make(name, options.runs, options.jobs, options.out, options.pictures or options.out)
        except (PlotsMissing, SweepError) as error:
            sys.exit(f"run.py: {error}")


if __name__ == "__main__":
    main()
