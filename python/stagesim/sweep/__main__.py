# SPDX-License-Identifier: GPL-2.0-or-later
"""The command line `python -m stagesim.sweep merge|report`, called by `stage merge` and `stage report`."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from ..reports.plots import PlotsMissing
from ..errors import StageError
from .merge import merge


def arguments() -> argparse.ArgumentParser:
    """The parser of the command line."""
    parser = argparse.ArgumentParser(prog="python -m stagesim.sweep", allow_abbrev=False,
                                     description="Merges the runs of a sweep into one file, or makes a report.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="merge|report")
    merging = commands.add_parser("merge", help="write all runs to one file", allow_abbrev=False)
    merging.add_argument("folders", type=Path, nargs="+", metavar="FOLDER",
                         help="folder of the sweep, or several that are parts of one sweep")
    merging.add_argument("-o", "--out", type=Path, required=True, metavar="FILE",
                         help="the file: .csv, .parquet (needs pyarrow) or .h5 (needs h5py)")
    merging.add_argument("--timings", action="store_true",
                         help="add columns that differ between repetitions: seconds, r_acc")
    merging.add_argument("--partial", action="store_true", help="merge the finished runs even if others are missing")
    reporting = commands.add_parser("report", help="write a page with figures to FOLDER/report", allow_abbrev=False)
    reporting.add_argument("folder", type=Path, metavar="FOLDER", help="folder of the sweep")
    return parser


def main() -> int:
    """Runs the command; returns the exit status."""
    options = arguments().parse_args()
    try:
        if options.command == "merge":
            merge(options.folders, options.out, timings=options.timings, partial=options.partial)
        else:
            from .report import write_report  # pylint: disable=import-outside-toplevel

            page = write_report(options.folder)
            sys.stdout.buffer.write(os.fsencode(page) + b"\n")  # which need not be UTF-8
        return 0
    except (StageError, PlotsMissing, OSError) as error:
        print(f"stage {options.command}: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
