# SPDX-License-Identifier: GPL-2.0-or-later
"""Plug-ins of world files, such as controllers, compiled while tests run."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
import stagesim as st


def compile_plugin(text: str, file: Path, root: Path) -> Path:
    """Compiles the text of a plug-in into the file, with the headers below `root`; returns the file."""
    compiler = shutil.which("c++")
    if not compiler:
        pytest.skip("needs a C++ compiler")
    source = file.with_suffix(".cc")
    source.write_text(text)
    library = Path(st.__file__).parent / "lib" / f"libstage.so.{st.__version__}"
    subprocess.run([str(compiler), "-std=c++17", "-shared", "-fPIC", f"-I{root}/libstage/include",
                    f"-I{root}/libstage", f"-I{root}", "-o", str(file), str(source), str(library)], check=True)
    return file
