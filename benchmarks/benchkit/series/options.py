# SPDX-License-Identifier: GPL-2.0-or-later
"""The command line of benchmarks/series."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import NoReturn

from benchkit.heat import COOL_CELSIUS, MOST_COOLING
from benchkit.machine import ROOT, Device, usable_cores
from benchkit.series.plan import LONG_SECONDS
from benchkit.series.runs import Backend

POPULATIONS = {
    "cave": (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000),
    "hospital": (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000),
}
MOST_ROBOTS = 100_000  # world series of tools/populate
MOST_THREADS = 1024  # of the stage program

DESCRIPTION = """\
Measures how fast the stage program simulates populations of robots, with and without OpenCL, and
how much energy it needs. Writes a report with tables and plots of r_ACC (robots x simulated seconds
/ real seconds), r_EPSS (joules per simulated robot second), break-even points, phases and memory.
"""

EPILOG = """\
backends
  host1         the host with 1 thread, to which all other backends are compared
  hostN         the host with one thread per core
  host:THREADS  the host with THREADS threads
  cl:DEVICE     every step on an OpenCL device (--opencl=DEVICE --opencl-always); `stage
                --opencl=list` lists the devices; cl:gpu and cl:cpu are the first of their kind
  auto          --opencl: the program finds out which steps are faster on the best device

files in the folder
  raw.csv       one line per finished run; lines are only added, never changed
  machine.json  a description of the machine
  report.md     the report; its plots are PNG files in the same folder

resuming
  If a series is interrupted (Ctrl-C, --time-limit, a power cut), the same command continues it. A
  larger --repeats or more populations add runs to the folder. All backends simulate the same world
  for the same time, so their state hashes must be equal; a difference is reported as a failure.

examples
  benchmarks/series                                 everything, in less than 10 minutes with 2 cores
  benchmarks/series --long --worlds cave            figures for publication, overnight
  benchmarks/series --board --long --worlds cave    the same on a board that may overheat
  benchmarks/series --populations 100,1000 --backends host1,cl:gpu --repeats 5 -o /tmp/try
  benchmarks/series --populations cave=10,100 --populations hospital=1000
  benchmarks/series --meter constant:12             a known power, labelled as assumed
  benchmarks/series --report-only -o FOLDER         only the report, from finished runs

exit status
  0    all runs succeeded, all state hashes are equal
  1    a run failed, or state hashes differ; the report has details
  2    invalid options, or the folder can't take these runs
  3    the --time-limit was reached; the same command continues
  130  Ctrl-C; the same command continues
"""


class OneLineParser(argparse.ArgumentParser):
    """Reports an invalid command line in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} (--help explains)\n")


def whole(text: str, least: int, most: int, what: str) -> int:
    number = int(text) if text.isdecimal() else -1
    if not least <= number <= most:
        raise argparse.ArgumentTypeError(f"'{text}' is not {what} from {least} to {most}")
    return number


def positive(what: str):
    """Returns a parser of positive numbers."""
    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not 0 < value < math.inf:
            raise argparse.ArgumentTypeError(f"'{text}' is not {what} above 0")
        return value
    return read


def simulated(text: str) -> float:
    """Rounds to whole steps, which take 0.1 s in these worlds."""
    value = positive("a time in seconds")(text)
    if abs(value * 10 - round(value * 10)) > 1e-6 or value > 1e6:
        raise argparse.ArgumentTypeError(f"'{text}' is not a multiple of 0.1 s (a step) up to 1e6")
    return round(value, 1)


def world_list(text: str) -> list[str]:
    """Parses names of world series, without duplicates."""
    worlds = list(dict.fromkeys(text.split(",")))
    for world in worlds:
        if world not in POPULATIONS:
            raise argparse.ArgumentTypeError(
                f"'{world}' is not one of the worlds {', '.join(POPULATIONS)}")
    return worlds


def population_list(text: str) -> tuple[str, tuple[int, ...]]:
    """Parses [WORLD=]N,N,...: the world ("" for all) and its populations."""
    world, equals, numbers = text.rpartition("=")
    if equals and world not in POPULATIONS:
        raise argparse.ArgumentTypeError(
            f"'{world}' is not one of the worlds {', '.join(POPULATIONS)}")
    found = {whole(number, 1, MOST_ROBOTS, "a number of robots") for number in numbers.split(",")}
    return world, tuple(sorted(found))


def repeat_count(text: str) -> int:
    return whole(text, 1, 1000, "a number of repeats")


def read_command_line(words: list[str] | None = None) -> argparse.Namespace:
    parser = OneLineParser(prog="series", description=DESCRIPTION, epilog=EPILOG,
                           formatter_class=argparse.RawDescriptionHelpFormatter)
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--short", action="store_true",
                      help="runs of one or two seconds, less than 10 minutes in total (default)")
    form.add_argument("--long", action="store_true",
                      help=f"{LONG_SECONDS:g} simulated seconds per run, as in the paper; takes "
                           "hours")
    form.add_argument("--seconds", type=simulated, metavar="S",
                      help="S simulated seconds per run")
    parser.add_argument("--worlds", type=world_list, default=list(POPULATIONS), metavar="LIST",
                        help="worlds of tools/populate (default: cave,hospital)")
    parser.add_argument("--populations", type=population_list, action="append", default=[],
                        metavar="[WORLD=]LIST", help="numbers of robots, for all worlds or for one "
                                                     "(default: 1,2,5,... up to 2000 in the cave "
                                                     "and 10000 in the hospital)")
    parser.add_argument("--backends", metavar="LIST", help="devices that trace the rays, see below "
                                                           "(default: host1,hostN, each OpenCL "
                                                           "device, auto)")
    parser.add_argument("--repeats", type=repeat_count, default=3, metavar="N",
                        help="runs per world, population and backend (default: 3)")
    parser.add_argument("--meter", default="auto", metavar="SPEC",
                        help="energy meter: auto, none, rapl, nvml, constant:WATTS, ... (default: "
                             "auto, the best available)")
    parser.add_argument("--board", action="store_true",
                        help="for boards: let the chip cool down before each run, and record its "
                             "temperature, its clock and whether it was throttled")
    parser.add_argument("--cool", type=positive("a temperature in degrees Celsius"), metavar="C",
                        default=COOL_CELSIUS, help="with --board: start the next run at this "
                                                   "temperature, or when the chip stops cooling "
                                                   f"down, or after {MOST_COOLING / 60:g} minutes "
                                                   f"(default: {COOL_CELSIUS:g})")
    parser.add_argument("--root", type=Path, default=Path("/"), metavar="FOLDER",
                        help="with --board: look for sys/ in FOLDER instead of in / (for tests)")
    parser.add_argument("-o", "--output", type=Path, metavar="FOLDER",
                        help="folder for the results (default: benchmarks/results/MACHINE)")
    parser.add_argument("--mix", action="store_true", help="continue in a folder with runs of "
                                                           "another commit, build or machine; the "
                                                           "report will mention it")
    parser.add_argument("--report-only", action="store_true",
                        help="run nothing, only write the report")
    parser.add_argument("--time-limit", type=positive("a time in minutes"), metavar="MINUTES",
                        help="start no run that is expected to end later than this")
    parser.add_argument("--stage", type=Path, default=ROOT / "build/release/bin/stage",
                        metavar="PROGRAM", help="the program (default: from the release build)")
    options = parser.parse_args(words)
    options.form = "long" if options.long else \
        f"{options.seconds:g} s" if options.seconds else "short"
    options.fixed_seconds = LONG_SECONDS if options.long else options.seconds
    return options


def chosen_worlds(options: argparse.Namespace) -> dict[str, tuple[int, ...]]:
    """The populations of each world; values for one world take precedence over those for all."""
    given = dict(options.populations)
    return {world: given.get(world) or given.get("") or POPULATIONS[world]
            for world in options.worlds}


def backend_named(label: str) -> Backend:
    """Raises ValueError with the reason in one line."""
    kind, _, detail = label.partition(":")
    if label in ("host1", "hostN"):
        threads = 1 if label == "host1" else usable_cores()
        return Backend(label, ("--threads", str(threads)))
    if kind == "host" and detail.isdecimal() and 1 <= int(detail) <= MOST_THREADS:
        return Backend(f"host:{int(detail)}", ("--threads", str(int(detail))))
    if kind == "cl" and detail and detail not in ("list", "auto"):
        return Backend(label, (f"--opencl={detail}", "--opencl-always"))
    if label == "auto":
        return Backend(label, ("--opencl=auto",))
    raise ValueError(f"--backends: '{label}' is none of host1, hostN, host:THREADS "
                     f"(1 to {MOST_THREADS}), cl:DEVICE, auto")


def chosen_backends(given: str | None, devices: tuple[Device, ...]) -> tuple[Backend, ...]:
    """The requested backends, or all that make sense on this machine."""
    if given is not None:
        labels = given.split(",")
    else:
        labels = ["host1"] + (["hostN"] if usable_cores() > 1 else [])
        labels += [f"cl:{device.choice}" for device in devices] + (["auto"] if devices else [])
    return tuple(backend_named(label) for label in dict.fromkeys(labels))
