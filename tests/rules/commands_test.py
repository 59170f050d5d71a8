#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Commands that tests need are in packages that tools/setup installs, tests find no other commands, modules that
scripts import are in such packages, and timeouts of tests are long enough for slow machines."""

from __future__ import annotations

import ast
import os
import re
import shutil
import sys
import unittest
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
from installed_commands import TEST_GROUPS, allowed_commands, setup_table  # noqa: E402
from patience import PATIENCE  # noqa: E402

# Commands in tests that tools/setup installs only on request or never, with the reason why that is harmless.
OPTIONAL = {
    "chromium": "tools/setup --browser",
    "chromium-browser": "Ubuntu's name of chromium",
    "google-chrome": "another name of chromium",
    "clang-14": "another name of clang",
    "clang-16": "another name of clang",
    "clang-19": "another name of clang",
    "ffmpeg": "tools/setup --film",
    "file": "tools/setup --packages",
    "lintian": "tools/setup --packages",
    "oclgrind": "Debian 13 has no such package",
    "sbatch": "tools/setup --slurm",
    "slurmctld": "tools/setup --slurm",
    "slurmd": "tools/setup --slurm",
}

# Modules of the system's Python after tools/setup, besides the standard library, and their packages.
MODULES = {"PIL": "python3-pil", "numpy": "python3-numpy", "matplotlib": "python3-matplotlib"}

LIMIT = re.compile(r"(?:\btimeout=|\.result\(|monotonic\(\) \+ |seconds: float = |kTimeLimit = )([\d.]+)")
# Timeouts that tests don't depend on.
SHORT_WAITS = ("close_timeout=", "base_watchdog_timeout=", "seconds: float = 0.0")


def scripts(*folders: str) -> Iterator[tuple[str, ast.Module]]:
    """Yields Python files below the folders: those named *.py, and those with a Python shebang."""
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix not in ("", ".py") or not path.is_file() or "results" in path.parts:
                continue
            with path.open("rb") as file:
                first = file.readline()
            if path.suffix == ".py" or (first.startswith(b"#!") and b"python" in first):
                yield str(path.relative_to(ROOT)), ast.parse(path.read_text(encoding="utf-8"))


def constants(node: ast.AST) -> Iterator[str]:
    for part in ast.walk(node):
        if isinstance(part, ast.Constant) and isinstance(part.value, str):
            yield part.value


def commands_of(tree: ast.Module) -> set[str]:
    """The commands that which() looks for or that run() and Popen() start."""
    found: set[str] = set()
    for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
        name = getattr(call.func, "attr", getattr(call.func, "id", ""))
        if name == "which" and call.args:
            found |= set(constants(call.args[0]))
        elif name == "map" and call.args and getattr(call.args[0], "attr", "") == "which":
            found |= set(constants(call.args[1]))
        elif name in ("run", "Popen", "check_output") and call.args and isinstance(call.args[0], ast.List):
            first = call.args[0].elts[:1]
            found |= {part.value for part in first if isinstance(part, ast.Constant)}
    return {name for name in found if re.fullmatch(r"[a-z][\w.+-]*", name, re.IGNORECASE) and "/" not in name}


def modules_of(tree: ast.Module) -> set[str]:
    """The modules that a script imports, except for optional ones."""
    optional = {id(part) for node in ast.walk(tree) if isinstance(node, ast.Try) for part in ast.walk(node)}
    found: set[str] = set()
    for node in ast.walk(tree):
        if id(node) in optional:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.split(".")[0])
    return found


@unittest.skipUnless(shutil.which("dpkg-query"), "this system has no dpkg")
class CommandsTest(unittest.TestCase):
    def test_groups_are_those_of_the_script(self) -> None:
        script = (ROOT / "tools" / "test").read_text(encoding="utf-8")
        self.assertIn("setup=(--tests --live --ros --sweep)", script)  # live, ros and sweep ask for python alone
        self.assertLessEqual(set(TEST_GROUPS), {group for group, _, _ in setup_table()})

    def test_commands_are_installed_by_the_script(self) -> None:
        allowed = allowed_commands()
        seen = set()
        for file, tree in scripts("tests"):
            for name in commands_of(tree):
                seen.add(name)
                self.assertTrue(name in allowed or name in OPTIONAL,
                                f"{file} looks for the command {name}, which no package of tools/setup has")
        self.assertLessEqual({"xvfb-run", "ps", "c++", "pkg-config"}, seen)

    @unittest.skipUnless("STAGE_BINARY_DIR" in os.environ, "not run by ctest")
    def test_nothing_else_is_found(self) -> None:
        """The PATH is only the folder of these commands, and it is up to date."""
        folder = Path(os.environ["STAGE_BINARY_DIR"]) / "tests" / "commands"
        self.assertEqual(os.environ["PATH"], str(folder))
        self.assertEqual({path.name for path in folder.iterdir()}, set(allowed_commands()),
                         "made before packages were installed; build the target test_commands")


class ModulesTest(unittest.TestCase):
    def test_modules_are_installed_by_the_script(self) -> None:
        """All modules of scripts that the system's Python runs are installed."""
        packages = {package for _, package, _ in setup_table()}
        self.assertLessEqual(set(MODULES.values()), packages)
        local = {path.stem for path in [*ROOT.glob("tests/*/*.py"), *ROOT.glob("tools/*"), *ROOT.glob("tools/dev/*.py")]}
        local |= {"stagesim"} | {path.stem for path in [*ROOT.glob("benchmarks/*"), *ROOT.glob("benchmarks/benchkit/*")]}
        for file, tree in scripts("tests", "tools", "benchmarks"):
            if not (file.endswith("_test.py") or file.startswith("tools/")):
                continue
            for name in modules_of(tree) - set(sys.stdlib_module_names) - local:
                self.assertIn(name, MODULES, f"{file} imports {name}, which no package of tools/setup has")


class LimitsTest(unittest.TestCase):
    def test_waiting_has_no_limit_that_a_slow_machine_meets(self) -> None:
        """Timeouts are PATIENCE, or are multiplied by slowness()."""
        files = [*ROOT.glob("tests/**/*.py"), *ROOT.glob("tests/**/*.cc"), *ROOT.glob("tests/**/*.hh")]
        for path in files:
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                found = LIMIT.search(line)
                if path == Path(__file__) or not found or any(wait in line for wait in SHORT_WAITS):
                    continue
                place = f"{path.relative_to(ROOT)}:{number}"
                self.assertGreaterEqual(float(found[1]), PATIENCE, f"{place}: {line.strip()}")

    def test_limits_of_ctest_are_longer(self) -> None:
        """Timeouts of ctest are longer, so that a test reports its own timeout."""
        text = (ROOT / "tests" / "CMakeLists.txt").read_text(encoding="utf-8")
        limits = [int(limit) for limit in re.findall(r"time_limit (\d+)\)", text)]
        self.assertGreaterEqual(len(limits), 3)
        self.assertGreater(min(limits), PATIENCE)
        self.assertEqual(re.findall(r"TIMEOUT \d+", text), [])


if __name__ == "__main__":
    unittest.main()
