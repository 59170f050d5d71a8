# SPDX-License-Identifier: GPL-2.0-or-later
"""Thousands of worlds in a process do not wait for each other."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import stagesim as st

SHIM = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
static long locks;
int pthread_mutex_lock(pthread_mutex_t* mutex) {
  static int (*next)(pthread_mutex_t*);
  if (!next) next = (int (*)(pthread_mutex_t*))dlsym(RTLD_NEXT, "pthread_mutex_lock");
  __atomic_fetch_add(&locks, 1, __ATOMIC_RELAXED);
  return next(mutex);
}
long stage_test_locks(void) { return locks; }
"""

PROGRAM = """
import ctypes, sys
import stagesim as st
count = ctypes.CDLL(None).stage_test_locks
count.restype = ctypes.c_long

def locks_of(make, step):
    made = make()
    step(made, 2)
    before = count()
    step(made, 100)
    return count() - before

def drive(batch, n):
    batch.cmd[..., 0] = .3
    batch.pose, batch.ranges, batch.ended
    for _ in range(n):
        batch.step()

few, many = (locks_of(lambda: st.Batch("arena.world", n, threads=1), drive) for n in (1, 33))
print((many - few) / (32 * 100))
world = locks_of(lambda: st.World("arena.world", threads=1), lambda world, n: world.step(n))
print(world / 100)
"""


@pytest.fixture(scope="module")
def shim(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A preloaded library that counts the locks of mutexes in its process."""
    compiler = shutil.which("cc")
    if not compiler:
        pytest.skip("needs a C compiler")
    if "TSAN_OPTIONS" in os.environ or "ASAN_OPTIONS" in os.environ:
        pytest.skip("sanitizers see locks in this way themselves")
    folder = tmp_path_factory.mktemp("shim")
    (folder / "shim.c").write_text(SHIM)
    subprocess.run([str(compiler), "-shared", "-fPIC", "-o", str(folder / "shim.so"), str(folder / "shim.c"), "-ldl"],
                   check=True)
    return folder / "shim.so"


def test_steps_lock_nothing(shim: Path) -> None:
    """Steps take no lock, because a shared lock would serialize the threads of a batch."""
    preloaded = " ".join(filter(None, [str(shim), os.environ.get("LD_PRELOAD")]))
    run = subprocess.run([sys.executable, "-c", PROGRAM], env={**os.environ, "LD_PRELOAD": preloaded},
                         capture_output=True, text=True, check=True)
    of_batch, of_world = map(float, run.stdout.split())
    assert of_batch < 0.05, "locks for each step of a world in a batch"
    assert of_world < 0.5, "locks for each step of a world"  # the GIL, once per call


ONE_ROBOT = """
resolution 0.1
model( size [4 0.2 1] pose [0 2 0 0] )
position( name "r" size [0.3 0.3 0.3] pose [0 0 0 90] ranger( sensor( range [0 3] fov 90 samples 3 ) ) )
"""


def test_sixteen_thousand_worlds() -> None:
    n = 2**14
    batch = st.Batch.of(st.World.from_text(ONE_ROBOT), n)
    pose, ranges = batch.pose, batch.ranges
    batch.cmd[..., 0] = np.linspace(0.1, 0.4, n)[:, None]
    start = pose.copy()
    batch.step(n=2)
    assert (pose[:, 0, 1] > start[:, 0, 1]).all(), "robots that have not moved"
    assert (ranges[:, 0, 1] < 2).all(), "rays that have not hit the wall"
    batch.reset(range(5, n + 5))
    assert (pose[::2] == start[::2]).all()
    alone = st.World.from_text(ONE_ROBOT, seed=5)
    assert np.isnan(alone.fleet().ranger().ranges).all()  # reading subscribes, as in the batch
    assert batch.state_hash(0) == alone.state_hash()
