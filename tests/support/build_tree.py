# SPDX-License-Identifier: GPL-2.0-or-later
"""The build under test: its folder, what CMake knows of it, and commands that see no other Stage."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

from patience import PATIENCE

SOURCE_DIR = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).parents[2]).resolve()
BINARY_DIR = Path(os.environ.get("STAGE_BINARY_DIR") or SOURCE_DIR / "build" / "release").resolve()
HAS_WINDOW = (BINARY_DIR / "lib" / "libstagegui.so").exists()
HAS_OPENCL = bool(list(BINARY_DIR.glob("lib/stage-*/stage_cl.so")))
IS_STATIC = (BINARY_DIR / "lib" / "libstage.a").exists()
STATIC_REASON = "libstage is static in this build: it cannot be installed, and loads no plug-ins"
needs_shared_library = unittest.skipIf(IS_STATIC, STATIC_REASON)
SKIPPED = 77  # the exit status of a skipped script, see tests/CMakeLists.txt


def skip_if_static() -> None:
    """Ends a script whose tests all need an installation or plug-ins if this build has none."""
    if IS_STATIC:
        print("skipped:", STATIC_REASON)
        sys.exit(SKIPPED)


def cache_entry(name: str) -> str:
    """Returns the value of a variable in CMake's cache, or an empty string if there is none."""
    text = (BINARY_DIR / "CMakeCache.txt").read_text(encoding="utf-8")
    found = re.search(rf"^{name}:\w+=(.*)$", text, re.MULTILINE)
    return found[1] if found else ""


CMAKE = cache_entry("CMAKE_COMMAND")
COMPILER = cache_entry("CMAKE_CXX_COMPILER")
# A library with a sanitizer only runs in programs that have it too.
SANITIZE = [f"-fsanitize={cache_entry('STAGE_SANITIZE')}"] if cache_entry("STAGE_SANITIZE") else []


def clean_environment(**changes: object) -> dict[str, str]:
    """Returns the environment without variables by which another Stage could be found, and with these changes."""
    hidden = ("CMAKE_PREFIX_PATH", "CPATH", "DESTDIR", "LD_LIBRARY_PATH", "PKG_CONFIG_PATH", "STAGEPATH")
    variables = {name: value for name, value in os.environ.items() if name not in hidden}
    variables.update({name: str(value) for name, value in changes.items()})
    return variables


def run(*command: object, **environment: object) -> str:
    """Returns the output of a command that must succeed."""
    done = subprocess.run([str(word) for word in command], env=clean_environment(**environment), text=True, check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=PATIENCE)
    if done.returncode != 0:
        words = " ".join(str(word) for word in command)
        raise AssertionError(f"{words}\nended with {done.returncode}:\n{done.stdout}")
    return done.stdout
