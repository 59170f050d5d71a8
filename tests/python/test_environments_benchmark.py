# SPDX-License-Identifier: GPL-2.0-or-later
"""benchmarks/environments.py measures the environment layer, and its checks reject environments that do nothing."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium")
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

import environments  # noqa: E402  pylint: disable=wrong-import-position

SHORT = ["--task", "Navigate", "--environments", "64", "--limit", "3", "--threads", "1", "--seconds", "0.02",
         "--repeats", "2"]


def run_of(limit: int = 3, environments_: int = 64) -> environments.Run:
    return environments.Run("Navigate", environments_, limit, options())


def options() -> Any:
    return environments.options_of(SHORT)


def test_the_program_writes_a_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert environments.main([*SHORT, "-o", str(tmp_path)]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert [line.split(" | ")[:3] for line in printed[2:]] == [["| Navigate", "300", "64"], ["| Navigate", "3", "64"]]
    assert printed[-1] in (tmp_path / "environments.md").read_text()
    rows = json.loads((tmp_path / "environments.json").read_text())["rows"]
    for row in rows:
        assert len(row["seconds"]) == 2 and min(row["seconds"] + row["batch_seconds"]) > 0
        assert sum(row["phases"].values()) == pytest.approx(1)
        assert min(row["phases"].values()) >= 0 and row["phases"]["steps"] > 0  # differences may vanish on a busy machine
    assert rows[1]["ended"] >= sum(rows[1]["steps"]) * 64 // 3 * 0.8


def test_each_task_can_be_measured() -> None:
    for task in environments.TASKS:
        row = environments.Run(task, 64, 3, options()).measure(0.01, 1)
        assert row.seconds[0] > 0 and row.ended > 0


def test_a_copy_that_does_something_else_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    repeat = environments.Recorder.repeat

    def careless(recorder: environments.Recorder, other: Any) -> None:
        recorder.calls = [call for call in recorder.calls if call[0] != "teleport"]
        repeat(recorder, other)

    monkeypatch.setattr(environments.Recorder, "repeat", careless)
    with pytest.raises(AssertionError, match="found other states in the copy"):
        run_of().measure(0.01, 1)


def seen(n: int = 64, steps: int = 6, rewards: float = 1.0, moving: bool = True, at_once: bool = False) -> Any:
    """Returns the sums over steps with such results, with episodes of three actions."""
    found = environments.Seen()
    for step in range(steps):
        over = np.arange(n) % 3 == step % 3 if not at_once else np.full(n, step % 3 == 2)
        observations = np.full((n, 2), float(step if moving else 0))
        found.add((observations, np.full(n, rewards), over, np.zeros(n, bool)))
    return found


@pytest.mark.parametrize(("faults", "message"), [
    ({"rewards": 0.0}, "no reward"), ({"rewards": np.nan}, "not finite"), ({"moving": False}, "have not changed"),
    ({"at_once": True}, "64 ends of 64 episodes at once")])
def test_environments_that_do_nothing_are_rejected(faults: dict[str, Any], message: str) -> None:
    env = run_of().env
    seen().check(env, 3)
    with pytest.raises(AssertionError, match=message):
        seen(**faults).check(env, 3)
    with pytest.raises(AssertionError, match="ends of episodes, expected about 384"):
        seen().check(env, 1)


def test_rays_that_see_nothing_are_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    env = run_of().env
    ranges = np.full((64, 1, 32), 4.0)
    monkeypatch.setattr(type(env._episodes.scene), "ranges", property(lambda scene: ranges))
    with pytest.raises(AssertionError, match="found 0.0% of the rays"):
        seen().check(env, 3)
