#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Creates the folder that is the PATH of all tests, with the commands of a bare system after tools/setup.

    installed_commands.py FOLDER

FOLDER gets a link to each command of Debian's minimal installation (essential and required packages, and apt), of
the packages that tools/test installs, and of their dependencies. Recommended packages are left out, because
tools/setup does not install them. Packages that tools/setup only installs on request, such as a browser, contribute
their own commands and those of their direct dependencies.

Other commands of this machine are not in FOLDER, so a test that needs one fails here and not only on a newly
installed machine. On systems without dpkg, FOLDER is not created.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: The groups of tools/setup that tools/test installs; tests/rules/commands_test.py checks them.
TEST_GROUPS = ("base", "opencl", "gui", "tests", "python")
FOLDERS = [Path(name) for name in ("/usr/local/bin", "/usr/bin", "/bin", "/usr/sbin", "/sbin", "/usr/local/sbin")]


def setup_table() -> list[tuple[str, str, list[str]]]:
    """The rows of tools/setup: group, package, and the probes that show that the package is installed."""
    text = (ROOT / "tools" / "setup").read_text(encoding="utf-8")
    rows = re.search(r"^readonly packages='\n(.*?)^'$", text, re.MULTILINE | re.DOTALL)
    assert rows is not None
    cells = [[cell.strip() for cell in line.split("|")] for line in rows[1].splitlines()]
    return [(group, package, probes.split()) for group, package, probes, *_ in cells]


class Installed:
    """The packages that are installed on this machine."""

    def __init__(self) -> None:
        fields = "${Package}\t${Essential}\t${Priority}\t${Pre-Depends}, ${Depends}\t${Provides}\t${db:Status-Status}\n"
        lines = subprocess.run(["dpkg-query", "-W", "-f", fields], capture_output=True, text=True,
                               check=True).stdout.splitlines()
        self.needs: dict[str, list[list[str]]] = {}
        self.smallest: list[str] = ["apt"]
        self._providers: dict[str, list[str]] = {}
        for line in lines:
            name, essential, priority, depends, provides, status = line.split("\t")
            if status != "installed":
                continue
            self.needs.setdefault(name, []).extend(
                [[self._name(choice) for choice in need.split("|")] for need in depends.split(",") if need.strip()])
            if essential == "yes" or priority == "required":
                self.smallest.append(name)
            for virtual in provides.split(","):
                self._providers.setdefault(self._name(virtual), []).append(name)

    @staticmethod
    def _name(text: str) -> str:
        """The name of a package without version and architecture."""
        return re.split(r"[\s(:]", text.strip(), maxsplit=1)[0]

    def _found(self, name: str) -> str | None:
        if name in self.needs:
            return name
        return next(iter(self._providers.get(name, [])), None)

    def needed(self, package: str) -> list[str]:
        """The direct dependencies of a package; of alternatives, the first one that is installed."""
        chosen = ([choice for name in choices if (choice := self._found(name))][:1] for choices in self.needs[package])
        return [choice for choices in chosen for choice in choices]

    def closure(self, names: list[str]) -> set[str]:
        """These packages and all their dependencies, as far as they are installed."""
        found: set[str] = set()
        waiting = [package for name in names if (package := self._found(name))]
        while waiting:
            package = waiting.pop()
            if package not in found:
                found.add(package)
                waiting += self.needed(package)
        return found

    def with_needed(self, names: list[str]) -> set[str]:
        """These packages and their direct dependencies."""
        found = {package for name in names if (package := self._found(name))}
        return found.union(*map(self.needed, found))

    @staticmethod
    def files(packages: set[str]) -> set[str]:
        """The commands of these packages, in folders with symbolic links resolved."""
        listed = subprocess.run(["dpkg-query", "-L", *sorted(packages)], capture_output=True, text=True,
                                check=False).stdout.splitlines()
        commands = [name for name in listed if "bin/" in name or "/alternatives/" in name]
        return {os.path.join(os.path.realpath(os.path.dirname(name)), os.path.basename(name)) for name in commands}


def allowed_commands() -> dict[str, Path]:
    """The commands of a bare system after tools/setup, as paths by name."""
    installed = Installed()
    table = setup_table()
    for_tests = [package for group, package, _ in table if group in TEST_GROUPS]
    on_request = [package for group, package, _ in table if group not in TEST_GROUPS]
    files = installed.files(installed.closure(installed.smallest + for_tests) | installed.with_needed(on_request))
    found: dict[str, Path] = {}
    for folder in FOLDERS:
        for path in sorted(folder.iterdir()) if folder.is_dir() else []:
            real = os.path.join(os.path.realpath(folder), path.name)
            # A link through /etc/alternatives belongs to no package, but its target does.
            if real in files or os.path.realpath(path) in files:
                found.setdefault(path.name, path)
    # If a probe finds a command, tools/setup installs nothing, so the command is allowed wherever it is from.
    for _, _, probes in table:
        for probe in probes:
            path = shutil.which(probe) if "/" not in probe else None
            if path:
                found.setdefault(probe, Path(path))
    return found


def main() -> None:
    folder = Path(sys.argv[1])
    if not shutil.which("dpkg-query"):
        return
    commands = allowed_commands()
    folder.mkdir(parents=True, exist_ok=True)
    for path in folder.iterdir():
        if path.name not in commands or not path.is_symlink() or os.readlink(path) != str(commands[path.name]):
            path.unlink()
    for name, path in commands.items():
        if not (folder / name).is_symlink():
            (folder / name).symlink_to(path)


if __name__ == "__main__":
    main()
