#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The commands in README and on all pages work, in their order.

Each `stage ...` runs in a folder that looks like the source tree, with the PATH that the page prescribes, without a
window and only for a moment. `cmake --install` installs into that folder, Python imports the package, and commands
of the tree (tools/..., build/release/...) must exist. Commands that install packages of the system or of PyPI (apt,
pip, git) and those of ROS, which tests/ros tests, are not run. tutorial_test.py and guides_test.py compile the code
of their pages, install_test.py that of README. After tools/setup --tools has installed Python, this runs all of
README's commands in a bare tree:

    tools/dev/fresh bookworm python3 tests/docs/docs_commands_test.py --full
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from build_tree import skip_if_static  # noqa: E402
from patience import PATIENCE  # noqa: E402

skip_if_static()
ROOT = Path(os.environ.get("STAGE_SOURCE_DIR") or Path(__file__).resolve().parents[2]).resolve()
BINARY_DIR = Path(os.environ.get("STAGE_BINARY_DIR") or ROOT / "build" / "release").resolve()
FULL = "--full" in sys.argv
# A sanitizer must be the first library that a program loads, and Python is built without it.
IS_SANITIZED = bool(re.search(r"(?m)^STAGE_SANITIZE:\w+=.", (BINARY_DIR / "CMakeCache.txt").read_text(encoding="utf-8")))
# tutorial_test.py, guides_test.py and tests/ros/test_guide.py run the commands of the tutorial, of the guide to
# controllers and of the paths for ROS.
PAGES = [ROOT / "README.md", *sorted(path for path in (ROOT / "docs").glob("*.md") if path.stem not in ("tutorial", "ros")),
         ROOT / "examples/batch_controller/README.md", ROOT / "examples/drive/README.md", ROOT / "examples/model/README.md"]
EXPORT = "export PATH=$PWD/build/release/bin:$PATH"
# Commands that wait for a user, or need components that are not in every build.
NOT_RUN = ("--live", "--foxglove", "--opencl", "report")
PROGRAMS = r"stage|tools/\w+|build/release/\S+|export|cmake --install|build/venv/bin/python"
LINE = re.compile(rf"^(?: {{4}}|\$ )?((?:[A-Z]+=\S+ )*(?:{PROGRAMS})(?: .*)?)$")
INLINE = re.compile(r"`((?:stage|tools/\w+|export|cmake --install) [^`]+)`")


def commands_of(page: Path) -> list[str]:
    """The commands in order, without comments, text after a semicolon, and commands with placeholders such as WORLD."""
    found = []
    for line in page.read_text(encoding="utf-8").splitlines():
        block = LINE.match(line)
        words = [block[1]] if block else INLINE.findall(line)
        found += [re.split(r"\s+#\s|;", text)[0].strip() for text in words]
    placeholder = re.compile(r"\b[A-Z]/[A-Z]\b|(?<![\w$/])[A-Z]{3,}\b(?!=)|\.\.\.|\.\.$")
    return [text for text in found if not placeholder.search(text.replace("PATH", ""))]


def shortened(words: list[str]) -> list[str]:
    """The command without a window, and with at most a second of simulated time."""
    if FULL:
        return words
    if words[1] == "sweep":
        return words + (["--duration", "1"] if "-o" in words else [])
    if words[1] == "replay":
        return words + ["-g"]
    if words[1] in ("merge", "report", "import", "export", "bag") or {"--explain", "--budget-ms", "--help"} & set(words):
        return words
    keeps_time = any("@" in word or "snapshot" in word for word in words)
    for at, word in enumerate(words[:-1]):
        if word == "--duration" and not keeps_time:
            words[at + 1] = "1"
    return words + ["-g"] + ([] if "--duration" in words or keeps_time else ["--duration", "1"])


class Place:
    """A folder that looks like the source tree; commands write to another place."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("worlds", "tools", "examples", "docs", "tests", "python", "benchmarks"):
            (folder / name).symlink_to(ROOT / name)
        (folder / "build").mkdir()
        (folder / "build" / "release").symlink_to(BINARY_DIR)
        (folder / "build" / "venv").symlink_to(ROOT / "build" / "venv")
        self.path = os.environ["PATH"]

    def run(self, text: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(["bash", "-c", text], cwd=self.folder, text=True, check=False, timeout=PATIENCE,
                              env={**os.environ, "PATH": self.path, "DISPLAY": "", "WAYLAND_DISPLAY": ""},
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)


class DocsCommandsTest(unittest.TestCase):
    def test_commands_are_found(self) -> None:
        readme = commands_of(ROOT / "README.md")
        for text in (EXPORT, "tools/populate hospital 10000 -o big.world", "stage replay run.mcap",
                     "stage merge out -o swarm.csv", "stage worlds/corridor.world",
                     "cmake --install build/release --prefix /opt/stage"):
            self.assertIn(text, readme)
        self.assertIn("PYTHONPATH=build/release/python build/venv/bin/python", commands_of(ROOT / "docs/python.md"))
        self.assertLess(readme.index(EXPORT), readme.index("stage worlds/corridor.world"))
        self.assertGreater(sum(len(commands_of(page)) for page in PAGES), 40)

    def test_commands_work(self) -> None:
        for page in PAGES:
            with self.subTest(page=str(page.relative_to(ROOT))), tempfile.TemporaryDirectory() as folder:
                place = Place(Path(folder).resolve())
                if page != ROOT / "README.md":  # docs/README.md says so for all pages
                    place.path = f"{BINARY_DIR}/bin:{place.path}"
                for text in commands_of(page):
                    self.do(place, text, page)

    def do(self, place: Place, text: str, page: Path) -> None:
        if text == EXPORT:
            place.path = f"{place.folder}/build/release/bin:{place.path}"
            return
        words = shlex.split(text)
        variables = []
        while re.match(r"[A-Z]+=", words[0]):
            variables.append(words.pop(0))
        if words[0].startswith("tools/") or words[0].startswith("build/release/benchmarks/"):
            self.assertTrue((ROOT / words[0]).exists() or words[0].startswith("build/"), f"{page}: {text}")
            trees = words[0] in ("tools/dev/fresh", "tools/dev/cross")  # these commands make their own trees
            if words[0] != "tools/populate" and (not FULL or page.parent != ROOT or trees):
                return
        elif words[0] == "stage" and not any(re.search(r"\.(world|mcap)$|^out$", word) for word in words):
            return  # a mention of an option
        elif words[0] == "export" or "my.world" in words or any(part in word for word in words for part in NOT_RUN):
            return
        elif words[0] == "stage":
            words = shortened(words)
        elif words[0] == "cmake":
            words[-1] = str(place.folder / "installed")
        elif words[0].endswith("python"):
            if IS_SANITIZED or not list((BINARY_DIR / "python" / "stagesim").glob("_core*.so")):
                return
            words += ["-c", "import stagesim; stagesim.World('simple.world').step()"]
        done = place.run(" ".join([*variables, shlex.join(words)]))
        self.assertEqual(done.returncode, 0, f"{page}: {text}\n{shlex.join(words)}\n{done.stdout[-2000:]}")

    def test_budget_prints_what_the_page_shows(self) -> None:
        """The output has the format on the page, whose figures are an example."""
        page = (ROOT / "docs" / "what-if.md").read_text(encoding="utf-8")
        words = ["--budget-ms", "50", "--no-controllers", "worlds/corridor.world"]
        shown = page.split(f"$ stage {' '.join(words)}\n")[1].split("```")[0]
        done = subprocess.run([BINARY_DIR / "bin" / "stage", *words], cwd=ROOT, text=True, check=True, capture_output=True,
                              timeout=PATIENCE)
        def shape(text: str) -> str:
            return re.sub(r"\b(thread|scenario|sample)s?\b", r"\1s", re.sub(r"[\d.]+", "N", text))
        self.assertIn(shape(shown), shape(done.stdout))


if __name__ == "__main__":
    sys.argv = [word for word in sys.argv if word != "--full"]
    unittest.main()
