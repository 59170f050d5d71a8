# SPDX-License-Identifier: GPL-2.0-or-later
"""A program that exits while its threads use worlds exits cleanly: with its own status and without output."""

from __future__ import annotations

import importlib.util
import signal
import subprocess
import sys

import pytest
from patience import PATIENCE

#: Activities during the exit: each is a program that has started its activity when it returns.
BEGUN = {
    "world": "world = st.World('arena.world'); forever(lambda: world.step(100))",
    "world, one step a call": "world = st.World('arena.world'); forever(world.step)",
    "world, one endless call": "world = st.World('arena.world'); forever(lambda: world.step(10**9))",
    "loading": "forever(lambda: st.World('arena.world'))",
    "reset": "world = st.World('arena.world'); forever(world.reset)",
    "snapshot": "world = st.World('arena.world'); forever(lambda: world.restore(world.snapshot()))",
    "fork": "world = st.World('arena.world'); forever(world.fork)",
    "hash": "world = st.World('arena.world'); forever(world.state_hash)",
    "cast": "world = st.World('arena.world'); forever(lambda: world.cast(np.zeros((9, 3)), [0.0], 5.0))",
    "picture": "world = st.World('arena.world'); forever(world.render)",
    "fleet": "world = st.World('arena.world'); cmd = world.fleet().cmd; forever(drive)",
    "batch": "batch = st.Batch('arena.world', n=8, threads=2); forever(lambda: batch.step(n=100))",
    "batch, one endless call": "batch = st.Batch('arena.world', n=8, threads=2); forever(lambda: batch.step(n=10**9))",
    "rollout": "batch = st.Batch('arena.world', n=8); forever(lambda: batch.rollout(np.zeros((50, 8, 5, 3))))",
    "reset of a batch": "batch = st.Batch('arena.world', n=8); forever(batch.reset)",
    "three threads": "worlds = [st.World('arena.world') for _ in range(3)]; [forever(world.step) for world in worlds]",
    "run": "from stagesim.live import Run; Run(st.World('arena.world'), speed=0).start()",
    "server": "from stagesim.live import Server; server = Server(st.World('arena.world'), speed=0).start()",
    "server that nobody holds": "from stagesim.live import Server; Server(st.World('arena.world'), speed=0).start()",
    "paused server": "from stagesim.live import Server; server = Server(st.World('arena.world'), paused=True).start()",
    "server with a controller": "from stagesim.live import Server; "
                                "server = Server(st.World('arena.world'), speed=0, control=lambda world: None).start()",
    "two servers": "from stagesim.live import Server; "
                   "servers = [Server(st.World('arena.world'), speed=0).start() for _ in range(2)]",
    "foxglove": "from stagesim.live import Server; "
                "server = Server(st.World('arena.world'), speed=0, port=None, foxglove=0).start()",
}
#: Ways to exit: the code, the expected status, and the last line of output.
ENDS = {"at its end": ("", 0, ""), "exit": ("sys.exit(3)", 3, ""),
        "exception": ("raise ValueError('mine')", 1, "ValueError: mine"),
        "interrupt": ("signal.raise_signal(signal.SIGINT)", -signal.SIGINT, "KeyboardInterrupt")}

PROGRAM = """
import logging, signal, sys, threading, time
import numpy as np
import stagesim as st

logging.disable()  # of what the world warns about

def forever(work):
    def loop():
        while True:
            work()
    threading.Thread(target=loop, daemon=True).start()

def drive():
    cmd[:, 0] = 0.3
    world.step()

{begun}
time.sleep(0.2)
{end}
"""


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("begun", BEGUN)
def test_program_ends_silently_with_its_own_status(begun: str, end: str) -> None:
    for package, word in (("websockets", "server"), ("foxglove", "foxglove")):
        if word in begun and importlib.util.find_spec(package) is None:
            pytest.skip(f"the package {package} is not installed: tools/setup --live")
    line, status, last = ENDS[end]
    done = subprocess.run([sys.executable, "-c", PROGRAM.format(begun=BEGUN[begun], end=line)], capture_output=True,
                          text=True, check=False, timeout=PATIENCE)
    assert done.returncode == status and done.stdout == "", done
    if last == "":
        assert done.stderr == "", done
    else:  # the traceback of that exception alone
        assert done.stderr.startswith("Traceback (most recent call last):\n"), done
        assert done.stderr.endswith(f"\n{last}\n"), done
        assert done.stderr.count("\nTraceback") == 0 and "nanobind" not in done.stderr, done


def test_program_ends_although_a_controller_never_returns() -> None:
    """The exit waits only for a limited time: the controller outlasts the test."""
    pytest.importorskip("websockets", reason="the package websockets is not installed: tools/setup --live")
    begun = ("from stagesim.live import Server; server = Server(st.World('arena.world'), "
             "control=lambda world: time.sleep(1e6)).start()")
    done = subprocess.run([sys.executable, "-c", PROGRAM.format(begun=begun, end="")], capture_output=True, text=True,
                          check=False, timeout=PATIENCE)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_forked_child_does_not_wait_for_threads_of_its_parent() -> None:
    begun = ("world = st.World('arena.world'); forever(lambda: world.step(10**9)); time.sleep(0.1)\n"
             "import os\n"
             "child = os.fork()\n"
             "began = time.monotonic()\n"
             "import atexit; atexit._run_exitfuncs() if child == 0 else os.waitpid(child, 0)\n"
             "assert time.monotonic() - began < 8\n"
             "os._exit(0) if child == 0 else None")
    command = [sys.executable, "-W", "ignore:This process:DeprecationWarning", "-c", PROGRAM.format(begun=begun, end="")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
