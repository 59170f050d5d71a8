# SPDX-License-Identifier: GPL-2.0-or-later
"""What is measured, and on what: the commit, the program's files, the machine and its devices."""

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
    """An OpenCL device, and the DEVICE of `stage --opencl=DEVICE` that means this one alone."""

    choice: str
    kind: str
    name: str
    platform: str
    version: str
    compute_units: int
    megabytes: int


@dataclass(frozen=True)
class Machine:
    """What a reader of the figures has to know about the machine."""

    cpu: str
    architecture: str
    cores: int  # that this process may use
    memory_gib: int
    virtual: bool
    system: str
    governor: str  # of the processor's clock; "" where the system does not say
    devices: tuple[Device, ...]

    @property
    def identity(self) -> str:
        """Equal for machines whose figures may stand in one table."""
        names = "".join(f" + {device.name}" for device in self.devices)
        return f"{self.cpu}, {self.cores} cores, {self.memory_gib} GiB{names}"

    @property
    def folder_name(self) -> str:
        """A name for the folder of this machine's results."""
        gpus = [device.name for device in self.devices if device.kind != "cpu"]
        words = " ".join([self.cpu, f"{self.cores} cores", *gpus])
        words = re.sub(r"\((r|tm)\)|\b(cpu|processor)\b|@.*?ghz", " ", words.lower())
        return re.sub(r"[^a-z0-9]+", "-", words).strip("-")

    def as_json(self) -> dict:
        return {"identity": self.identity, **asdict(self)}


def commit() -> str:
    """The commit that is measured, with a + if the tree has changes (results do not count).

    STAGE_COMMIT overrides it, for trees that git does not know.
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
    """Twelve digits that change with the program, its library, its plug-ins or controllers."""
    files = [stage.resolve()]
    try:
        linked = subprocess.run(["ldd", str(stage)], capture_output=True, text=True,
                                check=False).stdout
    except OSError:
        linked = ""  # no ldd here: the program's own bytes have to do
    for library in re.findall(r"=> (\S*/libstage\.so\S*)", linked):
        folder = Path(library).resolve().parent
        files += [Path(library).resolve(), *sorted(folder.glob("stage-*/*.so"))]
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def parse_devices(listing: str) -> tuple[Device, ...]:
    """The devices in the output of `stage --opencl=list`, which are in the order of choice."""
    found = [match for match in map(DEVICE_LINE.match, listing.splitlines()) if match]
    devices = []
    for i, match in enumerate(found):
        kind, name = match[1], match[2]
        # The program takes a kind, or a part of a name, and an index among those that match.
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
    """The OpenCL devices that the program finds; none where there is no OpenCL."""
    try:
        done = subprocess.run([str(stage), "--opencl=list"], capture_output=True, text=True,
                              check=False, timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return ()
    return parse_devices(done.stdout)


def read_text(path: str) -> str:
    """A file of /proc or /sys; "" where there is none."""
    try:
        return Path(path).read_text(encoding="utf-8", errors="replace").strip().strip("\0")
    except OSError:
        return ""


def cpu_name(cpuinfo: str, board: str) -> str:
    """The processor's name, or that of the board, as the device tree has it: a board's says more
    than its core's, which is all that ARMv7 calls its model, while aarch64 names none at all."""
    keys = ("Model", "Hardware", "model name")
    named = (re.search(rf"^{key}\s*:\s*(.+)$", cpuinfo, re.MULTILINE) for key in keys)
    return board or next((found[1].strip() for found in named if found), platform.machine())


def this_cpu() -> str:
    """The name of this machine's."""
    return cpu_name(read_text("/proc/cpuinfo"), read_text("/proc/device-tree/model"))


def usable_cores() -> int:
    """Those that this process may use, which can be fewer than the machine has."""
    return len(os.sched_getaffinity(0))


def governors() -> str:
    """How the processor chooses its clock, such as performance; clusters may differ."""
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
    """For results: such as intel-xeon-platinum-2-cores."""
    cpu = re.sub(r"\(.*?\)|processor|cpu|@.*", "", machine.get("cpu", "").lower())
    words = re.findall(r"[a-z0-9]+", cpu)[:3]
    return "-".join([*words, str(machine.get("cores", "")), "cores"])
