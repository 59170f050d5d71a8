# SPDX-License-Identifier: GPL-2.0-or-later
"""Helpers for tests of the benchmark series: made-up runs, and a replacement for the program."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))

from benchkit.series.runs import Backend  # noqa: E402  pylint: disable=wrong-import-position
from benchkit.series.records import Record  # noqa: E402  pylint: disable=wrong-import-position

FIXTURE = ROOT / "tests/data/series"
RAYS_PER_ROBOT = 200

# Behaves like the stage program as far as the benchmarks use it. Environment variables make it
# fail.
FAKE_STAGE = r'''#!/usr/bin/python3 -IS
import json, os, re, sys
words = sys.argv[1:]
if "--opencl=list" in words:
    print("  gpu: Fake GPU (Fakes, OpenCL 1.2, 4 compute units, 64 MiB)")
    sys.exit(0)
def after(option):
    return words[words.index(option) + 1]
with open(os.environ["FAKE_LOG"], "a") as log:
    log.write(" ".join(words) + " cache=" + os.environ.get("POCL_CACHE_DIR", "") + "\n")
count = len(open(os.environ["FAKE_LOG"]).readlines())
world = next(word for word in words if word.endswith(".world"))
robots = len(re.findall(r"^robot\(", open(world).read(), re.MULTILINE))
seconds = float(after("--duration"))
opencl = [word for word in words if word.startswith("--opencl=")]
if os.environ.get("FAKE_FAIL", "none") in " ".join(words):
    print("stage: the device is on fire", file=sys.stderr)
    sys.exit(1)
if count == int(os.environ.get("FAKE_INTERRUPT", "0")):
    sys.exit(130)
steps = round(seconds * 10)
step = 2e-4 + 1e-6 * robots if opencl else 1e-5 * robots
on_device = steps // 2 if os.environ.get("FAKE_FALL_BACK") else steps
state = "1234abcd"
if opencl and os.environ.get("FAKE_HASH"):
    state = os.environ["FAKE_HASH"]
with open(after("--stats"), "w") as file:
    json.dump({
        "robots": robots, "steps": steps, "simulated_seconds": seconds, "load_seconds": 0.01,
        "wall_seconds": step * steps, "r_acc": robots * seconds / (step * steps),
        "rays": 200 * robots * steps, "potential_hits_per_ray": 0.5, "threads": 1,
        "peak_memory_mb": 10 + robots / 64,
        "phases_ms_per_step": dict.fromkeys(
            ("gather", "prefilter", "trace", "move", "callbacks", "energy"), step * 100),
        "opencl": {"device": "gpu Fake GPU (Fakes)", "steps_on_device": on_device,
                   "compile_seconds": 0.25, "bytes_sent": 1000 * steps,
                   "bytes_fetched": 500 * steps} if opencl else None,
    }, file)
print("state-hash", state)
'''


def made_up(**changes: object) -> Record:
    """A good measured run; r_ACC follows from the wall seconds unless it is given."""
    record = Record(
        commit="abc", program="def", machine="board", system="Linux", date="2026-01-01T00:00:00Z",
        form="short", purpose="measure", world="cave", population=10, backend="host1", repeat=1,
        seed=1, simulated_seconds=10.0, steps=100, wall_seconds=1.0, load_seconds=0.1,
        process_seconds=1.2, meter="none", state_hash="1", rays_per_step=0.0, threads=1,
        peak_memory_mb=20.0, load_average=0.0, potential_hits_per_ray=0.5,
        **{f"{phase}_ms": 1.0 for phase in ("gather", "prefilter", "trace", "move", "callbacks",
                                            "energy")})
    record = replace(record, **changes)  # type: ignore[arg-type]
    derived: dict[str, float] = {}
    if "r_acc" not in changes:
        derived["r_acc"] = record.population * record.simulated_seconds / record.wall_seconds
    if "rays_per_step" not in changes:
        derived["rays_per_step"] = RAYS_PER_ROBOT * record.population
    return replace(record, **derived)  # type: ignore[arg-type]


def failed(**changes: object) -> Record:
    return replace(made_up(**changes), error="no")  # type: ignore[arg-type]


HOST = Backend("host1", ("--threads", "1"))
HOSTS = Backend("hostN", ("--threads", "2"))
DEVICE = Backend("cl:gpu", ("--opencl=gpu", "--opencl-always"))
AUTO = Backend("auto", ("--opencl=auto",))
