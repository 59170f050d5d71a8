# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads the files and commands of a documentation page, and runs the commands in a separate home
folder.

A block of a page contains commands if its language is sh. Otherwise it is a file, named in the
paragraph before it: "Save this as `NAME`"."""

from __future__ import annotations

import os
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

from build_tree import CMAKE, COMPILER, cache_entry, clean_environment
from patience import PATIENCE

FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"[Ss]ave (?:this|it) as `([\w.]+)`|and this as `([\w.]+)`")
HASH = re.compile(r"^state-hash ([0-9a-f]{16})$", re.MULTILINE)


@dataclass
class Block:
    """A fenced block of a page. `file` is empty if the block is commands."""
    file: str
    text: str


def blocks_of(page: str) -> list[Block]:
    found = []
    end = 0  # end of the last block
    for block in FENCED.finditer(page):
        language, text = block.groups()
        before = " ".join(page[end:block.start()].strip().split("\n\n")[-1].split())  # a paragraph
        end = block.end()
        names = NAMED.findall(before)
        if language == "sh":
            found.append(Block("", text))
        elif len(names) == 1:
            found.append(Block("".join(names[0]), text))
        else:
            raise AssertionError(f"neither commands nor a file: {before}\n```{language}\n{text}")
    return found


class Home:
    """A reader's home folder, in which commands run one after the other in the same shell."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.state = folder / ".state"
        commands = folder / ".commands"  # so that it has the name that the page uses
        commands.mkdir()
        (commands / "c++").symlink_to(COMPILER)
        (commands / "cmake").symlink_to(CMAKE)
        self.variables = clean_environment(HOME=folder, PATH=f"{commands}:{os.environ['PATH']}", CXX=COMPILER,
                                           CMAKE_GENERATOR=cache_entry("CMAKE_GENERATOR"))
        self.variables.pop("DISPLAY", None)
        self.state.write_text(f"cd '{folder}'\n", encoding="utf-8")

    def run(self, commands: str) -> str:
        """Runs commands, all of which must succeed; returns their output."""
        script = (f". '{self.state}'\n{commands}\n"
                  f"{{ export -p; printf 'cd %q\\n' \"$PWD\"; }} > '{self.state}'\n")
        done = subprocess.run(["bash", "-euc", script], env=self.variables, text=True, check=False,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, timeout=PATIENCE)
        if done.returncode != 0:
            raise AssertionError(f"{commands}\nended with {done.returncode}:\n{done.stdout}")
        return done.stdout
