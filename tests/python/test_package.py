# SPDX-License-Identifier: GPL-2.0-or-later
"""The contents of the package, and the cost of importing it."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
from pathlib import Path

import pytest
import stagesim as st

FOLDER = Path(st.__file__).parent


def python(code: str) -> str:
    """The output of Python code in a new process."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          check=True).stdout


def test_import_pulls_in_numpy_and_nothing_else_heavy() -> None:
    code = ("import sys, numpy; before = set(sys.modules); import stagesim;"
            "print(*sorted(set(sys.modules) - before))")
    allowed = ("stagesim", "nanobind_backend", "numpy.typing", "numpy._typing")
    small = {"__future__", "atexit", "fnmatch"}
    for name in python(code).split():
        assert name.startswith(allowed) or name in small, name


def test_sweeps_pull_in_what_they_need_when_they_need_it() -> None:
    code = "import sys, stagesim.sweep; print(*sys.modules)"
    assert not {"matplotlib", "pyarrow", "h5py", "pandas", "dask"} & set(python(code).split())


def test_import_is_quick() -> None:
    """The import takes half of the processor time of NumPy's, which itself takes some 0.1 s: on a machine of any speed."""
    code = ("import time; start = time.process_time(); import numpy; middle = time.process_time(); import stagesim;"
            "print((time.process_time() - middle) / (middle - start))")
    assert min(float(python(code)) for _ in range(5)) < 0.5


def test_package_contains_all_files() -> None:
    assert (FOLDER / "py.typed").exists()
    assert "class Simulation" in (FOLDER / "_core.pyi").read_text()
    assert os.access(FOLDER / "bin" / "stage", os.X_OK)
    assert (FOLDER / "reports" / "inference.py").exists()
    plugins = {path.stem for path in (FOLDER / "lib" / "stage-5.0").glob("*.so")}
    assert {"wander", "fasr2", "sink", "what_if"} <= plugins
    assert {"cave.world", "hospital.world", "simple.world", "arena.world"} <= set(st.shipped_worlds())


def test_library_and_program_are_those_of_the_package() -> None:
    maps = python("import stagesim; print(open('/proc/self/maps').read())")
    libraries = {line.split()[-1] for line in maps.splitlines() if "libstage.so" in line}
    own = os.path.realpath(FOLDER / "lib" / f"libstage.so.{st.__version__}")
    assert libraries == {own}


def test_optional_dependencies_are_complete(root: Path) -> None:
    """The optional dependencies of `pip install "stagesim[...]"` are complete."""
    file = root / "python" / "pyproject.toml"
    if not file.exists():
        pytest.skip("there is no python/pyproject.toml")
    extras = pytest.importorskip("tomllib").loads(file.read_text())["project"]["optional-dependencies"]
    assert {"env", "pictures", "live", "foxglove", "sweep", "report"} <= set(extras)
    assert set(extras["live"]) < set(extras["foxglove"])


def test_docstrings() -> None:
    """All public classes and functions have docstrings."""
    for name in st.__all__:
        thing = getattr(st, name)
        assert thing.__doc__, name
        for member, value in vars(thing).items() if inspect.isclass(thing) else ():
            if not member.startswith("_"):
                assert inspect.getdoc(getattr(thing, member)) or not callable(value), (name, member)
