# SPDX-License-Identifier: GPL-2.0-or-later
"""Each library learns to navigate as docs/learning_libraries.md says: its blocks, run as they are.

The trainings take some four minutes together, so they are run only with STAGE_LONG_TESTS=1. Another seed than that of
the page is chosen by STAGE_SEED.
"""

from __future__ import annotations

import importlib.util
import os
import re
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from patience import PATIENCE

#: Libraries by the headings of the page: module, and least success. Random actions reach 0.01, and the least of three
#: seeds was 0.1 or more above these.
LEAST = {"Stable-Baselines3": ("stable_baselines3", 0.7), "SuperSuit": ("supersuit", 0.6), "TorchRL": ("torchrl", 0.6),
         "RLlib": ("ray.rllib", 0.7), "skrl": ("skrl", 0.7), "JAX": ("jax", 0.6)}


def sections(page: Path) -> dict[str, str]:
    """The Python code of each section of the page; "" is that before the first heading."""
    parts = re.split(r"^## (.+)\n", page.read_text(), flags=re.M)
    headings = ["", *parts[1::2]]
    return {heading: "\n".join(re.findall(r"```python\n(.*?)```", text, re.S))
            for heading, text in zip(headings, parts[::2])}


def is_there(module: str) -> bool:
    """Tells whether a library is installed, without its import, which some do not undo."""
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:
        return False


def test_the_page_has_a_training_for_each_library(root: Path) -> None:
    assert {heading for heading, code in sections(root / "docs/learning_libraries.md").items() if "success(" in code} == {
        "", *LEAST}


@pytest.mark.parametrize("library", LEAST)
def test_training(library: str, root: Path, tmp_path: Path) -> None:
    module, least = LEAST[library]
    if not is_there(module):
        pytest.skip(f"skipped: {library} is not installed; try tools/setup --learn")
    if os.environ.get("STAGE_LONG_TESTS") != "1":
        pytest.skip("trainings are run with STAGE_LONG_TESTS=1")
    code = sections(root / "docs/learning_libraries.md")
    seed = os.environ.get("STAGE_SEED", "1")
    training = re.sub(r"(seed=|_seed\(|key\()1\b", rf"\g<1>{seed}", code[library])
    assert training != code[library] or seed == "1"
    file = tmp_path / "training.py"
    file.write_text(f"{code['']}\n{training}")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, "-W", "ignore", str(file)], capture_output=True, text=True, cwd=tmp_path,
                          timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    [found] = re.findall(r"^0\.\d+$|^1\.0$", done.stdout, re.M)
    assert float(found) > least, f"{library}: {found}"
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"{library}: success {found} after {seconds:.0f} s of processor time")
