# SPDX-License-Identifier: GPL-2.0-or-later
"""The script for Slurm on a cluster of this machine, which the test starts and stops.

It needs Debian's slurm-wlm and root. Only the programs of an installed Slurm are used.
"""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from patience import PATIENCE
from stagesim.sweep import Experiment, Results, plan, program, run
from test_run import merged

CONFIG = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/none
CredType=cred/none
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldPort={first_port}
SlurmdPort={second_port}
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SwitchType=switch/none
MpiDefault=none
KillWait=1
MessageTimeout=100
BatchStartTimeout=300
UnkillableStepTimeout=300
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def free_ports(count: int) -> list[int]:
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


@pytest.fixture
def cluster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A Slurm cluster of one node with two processors."""
    if os.geteuid() != 0 or not all(map(shutil.which, ("slurmctld", "slurmd", "sbatch"))):
        pytest.skip("skipped: Slurm is not installed, or this is not root; try tools/setup --slurm")
    folder = tmp_path / "slurm"
    for name in ("state", "spool"):
        (folder / name).mkdir(parents=True)
    host, ports = socket.gethostname().split(".")[0], free_ports(2)
    config = folder / "slurm.conf"
    config.write_text(CONFIG.format(host=host, folder=folder, first_port=ports[0], second_port=ports[1]))
    monkeypatch.setenv("SLURM_CONF", str(config))
    daemons = []
    try:
        for name in ("slurmctld", "slurmd"):
            log = open(folder / f"{name}.txt", "w")  # noqa: SIM115
            daemons.append(subprocess.Popen([name, "-D"], stdout=log, stderr=log))
        wait_for(lambda: "idle" in said("sinfo", "--noheader", "--format=%t"), "the node is not there")
        yield
    finally:
        for daemon in reversed(daemons):
            daemon.terminate()
            daemon.wait(timeout=PATIENCE)


def wait_for(condition: object, complaint: str) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():  # type: ignore[operator]
        # Jobs wait for ever for a node that Slurm has taken out of service.
        assert time.monotonic() < end, "\n".join((complaint, said("sinfo", "--list-reasons"), said("squeue", "--long")))
        time.sleep(0.05)


def said(*words: str) -> str:
    """Runs a program and returns its output."""
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=PATIENCE).stdout.strip()


def test_array_cancelled_and_submitted_again(root: Path, slow: Experiment, tmp_path: Path, cluster: None) -> None:
    out = tmp_path / "out"
    program.make_plan(slow, out)
    words = ["sbatch", "--parsable", "--array=1-3", "--cpus-per-task=1", f"--output={tmp_path}/%A_%a.txt",
             f"--export=ALL,STAGE={program._paths.PROGRAM}", str(root / "examples/sweeps/slurm_array.sh"), str(out)]
    job = said(*words)
    wait_for(lambda: len(plan.finished(out)) >= 3, "no runs are done")
    said("scancel", job)
    wait_for(lambda: not said("squeue", "--noheader"), "tasks don't end")
    done = len(Results(out))
    assert 3 <= done < 30
    assert said(*words)
    wait_for(lambda: not said("squeue", "--noheader"), "tasks don't end")
    outputs = "".join(file.read_text() for file in tmp_path.glob("*.txt"))
    assert len(Results(out)) == 30, outputs
    assert merged(Results(out)) == merged(run(slow, out=tmp_path / "alone", jobs=2))
