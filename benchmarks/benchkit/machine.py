# SPDX-License-Identifier: GPL-2.0-or-later
"""Describes what is measured and where: commit, program files, machine and devices."""

from __future__ import annotations

import glob
import hashlib
import os
import platform
import re
import subprocess
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

DEVICE_LINE = re.compile(r"^\s*(gpu|cpu|accelerator): (.+) \(([^()]*(?:\([^()]*\))*[^()]*), "
                         r"(OpenCL [^,]*.*), (\d+) compute units, (\d+) MiB\)\s*$")


@dataclass(frozen=True)
class Device:
    """An OpenCL device, and the DEVICE for `stage --opencl=DEVICE` that selects it."""

    choice: str
    kind: str
    name: str
    platform: str
    version: str
    compute_units: int
    megabytes: int


@dataclass(frozen=True)
class Machine:
    """Facts about the machine that the figures depend on."""

    cpu: str
    architecture: str
    cores: int  # processors that this process may use
    memory_gib: int
    virtual: bool
    system: str
    governor: str  # of the processor's clock; empty if unknown
    devices: tuple[Device, ...]

    @property
    def identity(self) -> str:
        """Equal for machines whose figures may be in one table."""
        names = "".join(f" + {device.name}" for device in self.devices)
        return f"{self.cpu}, {self.cores} cores, {self.memory_gib} GiB{names}"

    @property
    def folder_name(self) -> str:
        """Name of the folder for this machine's results."""
        gpus = [device.name for device in self.devices if device.kind != "cpu"]
        words = " ".join([self.cpu, f"{self.cores} cores", *gpus])
        words = re.sub(r"\((r|tm)\)|\b(cpu|processor)\b|@.*?ghz", " ", words.lower())
        return re.sub(r"[^a-z0-9]+", "-", words).strip("-")

    def as_json(self) -> dict:
        return {"identity": self.identity, **asdict(self)}


def commit() -> str:
    """The measured commit, followed by + if the tree has changes other than results.

    STAGE_COMMIT overrides it, for trees without git.
    """
    def git(*arguments: str) -> str:
        try:
            return subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True,
                                  text=True, check=False).stdout.strip()
        except OSError:
            return ""
    if os.environ.get("STAGE_COMMIT"):
        return os.environ["STAGE_COMMIT"]
    revision = git("rev-parse", "--short=12", "HEAD")
    changed = git("status", "--porcelain", "-uno", "--", ".", ":!benchmarks/results")
    return (revision or "unknown") + ("+" if changed else "")


def program_fingerprint(stage: Path) -> str:
    """Twelve hex digits computed from the program, its library, plug-ins and controllers."""
    files = [stage.resolve()]
    try:
        linked = subprocess.run(["ldd", str(stage)], capture_output=True, text=True,
                                check=False).stdout
    except OSError:
        linked = ""  # without ldd, only the program's own bytes count
    for library in re.findall(r"=> (\S*/libstage\.so\S*)", linked):
        folder = Path(library).resolve().parent
        files += [Path(library).resolve(), *sorted(folder.glob("stage-*/*.so"))]
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def parse_devices(listing: str) -> tuple[Device, ...]:
    """Parses the output of `stage --opencl=list`, whose devices are in order of preference."""
    found = [match for match in map(DEVICE_LINE.match, listing.splitlines()) if match]
    devices = []
    for i, match in enumerate(found):
        kind, name = match[1], match[2]
        # The program accepts a kind or part of a name, and an index among the matches.
        key = kind if kind in ("gpu", "cpu") else name
        if key == kind:
            same = [j for j, other in enumerate(found) if other[1] == kind]
        else:
            same = [j for j, other in enumerate(found)
                    if name.lower() in other[2].lower() or name.lower() in other[3].lower()]
        choice = key if len(same) == 1 else f"{key}:{same.index(i)}"
        devices.append(Device(choice, kind, name, match[3], match[4], int(match[5]),
                              int(match[6])))
    return tuple(devices)


def list_devices(stage: Path) -> tuple[Device, ...]:
    """The OpenCL devices that the program finds; empty without OpenCL."""
    try:
        done = subprocess.run([str(stage), "--opencl=list"], capture_output=True, text=True,
                              check=False, timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return ()
    return parse_devices(done.stdout)


def read_text(path: str) -> str:
    """The content of a file of /proc or /sys; empty if it does not exist."""
    try:
        return Path(path).read_text(encoding="utf-8", errors="replace").strip().strip("\0")
    except OSError:
        return ""


def cpu_name(cpuinfo: str, board: str) -> str:
    """Name of the processor or of the board. The device tree's name of a board says more than
    the name of its core, which is all that ARMv7 reports as its model; aarch64 reports no name."""
    keys = ("Model", "Hardware", "model name")
    named = (re.search(rf"^{key}\s*:\s*(.+)$", cpuinfo, re.MULTILINE) for key in keys)
    return board or next((found[1].strip() for found in named if found), platform.machine())


def this_cpu() -> str:
    """Name of this machine's processor."""
    return cpu_name(read_text("/proc/cpuinfo"), read_text("/proc/device-tree/model"))


def usable_cores() -> int:
    """Number of processors that this process may use; the machine may have more."""
    return len(os.sched_getaffinity(0))


def governors() -> str:
    """Clock governors of the processors, such as performance; clusters may differ."""
    files = glob.glob("/sys/devices/system/cpu/cpu*/cpufreq/scaling_governor")
    return "/".join(sorted({read_text(file) for file in files}))


def this_machine(devices: tuple[Device, ...]) -> Machine:
    cpuinfo = read_text("/proc/cpuinfo")
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return Machine(
        cpu=this_cpu(), architecture=platform.machine(), cores=usable_cores(),
        memory_gib=round(memory / 2 ** 30),
        virtual=re.search(r"^flags.*\bhypervisor\b", cpuinfo, re.MULTILINE) is not None,
        system=f"{platform.system()} {platform.release()}", governor=governors(), devices=devices)


def folder_name(machine: dict) -> str:
    """Name of the folder for results, such as intel-xeon-platinum-2-cores."""
    cpu = re.sub(r"\(.*?\)|processor|cpu|@.*", "", machine.get("cpu", "").lower())
    words = re.findall(r"[a-z0-9]+", cpu)[:3]
    return "-".join([*words, str(machine.get("cores", "")), "cores"])
