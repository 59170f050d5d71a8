# SPDX-License-Identifier: GPL-2.0-or-later
"""The code of docs/learning.md, the notebook and the programs in examples/learning work.

Without PyTorch, only the parts that need none are tested.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st

pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")
from stagesim.env import TASKS  # noqa: E402
from snippets import executed

HAS_TORCH = importlib.util.find_spec("torch") is not None
NEEDS_TORCH = re.compile(r"^(?:import ppo|.*\bppo\.|policy\b)", re.MULTILINE)


@pytest.fixture
def learning(root: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the examples, whose modules can be imported."""
    folder = root / "examples" / "learning"
    if not folder.exists():
        pytest.skip("there is no examples/learning")
    monkeypatch.syspath_prepend(str(folder))
    return folder


@pytest.fixture
def ppo(learning: Path) -> Any:
    """The module of the example; skips the test without PyTorch."""
    if not HAS_TORCH:
        pytest.skip("there is no PyTorch, which ppo.py needs")
    import ppo

    return ppo


# ---- the page and the notebook ------------------------------------------------------------------


def test_page_prints_what_it_shows(root: Path, learning: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each block of Python, executed in order, prints the output that follows it."""
    blocks = re.findall(r"```python\n(.*?)```\n(?:\n```\n(.*?)```)?", (root / "docs" / "learning.md").read_text(), re.S)
    assert len(blocks) > 6
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for code, expected in blocks:
        if HAS_TORCH or not NEEDS_TORCH.search(code):
            assert executed(code, names) == expected, code
    for picture in sorted(tmp_path.glob("*.png")):
        kept = root / "docs" / "pictures" / picture.name
        if os.environ.get("STAGE_NEW_PICTURES"):
            kept.write_bytes(picture.read_bytes())
        assert kept.read_bytes()[:26] == picture.read_bytes()[:26], "a picture of another size"


def test_task_of_the_page_is_short(root: Path) -> None:
    (task,) = re.findall(r"^class Hold.*?(?=^env = )", (root / "docs" / "learning.md").read_text(), re.M | re.S)
    assert len([line for line in task.splitlines() if line.strip()]) <= 30


def cells(learning: Path) -> list[str]:
    """The code cells of the notebook."""
    notebook = json.loads((learning / "first_steps.ipynb").read_text())
    return ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]


def test_notebook(learning: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All code cells work in order; without PyTorch, those before the first one that needs it."""
    display = types.ModuleType("IPython.display")
    display.Image = lambda path: Path(path).read_bytes()  # type: ignore[attr-defined]
    shell = types.ModuleType("IPython")
    shell.get_ipython, shell.version_info = lambda: None, (8, 24)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", shell)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "eight.world").write_text((learning / "eight.world").read_text())
    names: dict[str, Any] = {}
    run = 0
    for code in cells(learning):
        if NEEDS_TORCH.search(code) and not HAS_TORCH:
            break
        if "matplotlib" in code:
            pytest.importorskip("matplotlib").use("Agg")
        executed(code, names)
        run += 1
    assert run >= 4
    assert (tmp_path / "picture.png").stat().st_size > 1000


def test_notebook_has_its_pictures(learning: Path) -> None:
    notebook = json.loads((learning / "first_steps.ipynb").read_text())
    outputs = [output for cell in notebook["cells"] for output in cell.get("outputs", [])]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 3
    assert not [output for output in outputs if output["output_type"] == "error"]


def test_robots_of_the_world_see_each_other(learning: Path) -> None:
    fleet = st.World(str(learning / "eight.world")).fleet()
    assert len(fleet) == 8


# ---- learning -----------------------------------------------------------------------------------


def test_worlds_can_stay_on_the_host(ppo: Any) -> None:
    """With a policy on a card, worlds on the host get actions as arrays of NumPy."""
    env = ppo.make(ppo.parsed(["--device", "cuda", "--worlds", "cpu"]), 2)
    assert env.batch.device is None and env.reset(1).shape[:2] == (2, 1)
    actions = ppo.as_given(ppo.torch.full((2, 2), 3.0), env)
    assert isinstance(actions, np.ndarray) and actions.tolist() == [[[1, 1]], [[1, 1]]]


def test_success_improves(ppo: Any, capsys: pytest.CaptureFixture[str]) -> None:
    """A short training has finite losses, and its policy succeeds more often than the first one."""
    options = ppo.parsed(["--envs", "64", "--steps", "50000", "--report", "5"])
    first, _ = ppo.train(ppo.parsed(["--envs", "64", "--steps", "0"]))
    policy, curve = ppo.train(options)
    assert np.isfinite([line["loss"] for line in curve]).all()
    assert curve[-1]["steps"] >= 50000 > curve[-2]["steps"]
    before, after = (ppo.evaluate(which, ppo.make(options, 50), seed=9)["is_success"] for which in (first, policy))
    assert after > before + 0.2
    said = capsys.readouterr().out.splitlines()[-1]
    assert re.search(r"score [\d.]+  [\de.+]+ steps/s \([\de.+]+ in rollouts\)  [\d.]+ s, at most \d+ s left  "
                     r"setup \d+ %, simulation \d+ %, environment \d+ %, policy \d+ %, update \d+ %, evaluation 0 %$", said)


@pytest.mark.parametrize("task", sorted(TASKS))
def test_every_shipped_task_is_taken(ppo: Any, task: str) -> None:
    """An update with a few worlds has a finite loss."""
    _, curve = ppo.train(ppo.parsed(["--task", task, "--envs", "2", "--steps", "64"]))
    assert np.isfinite(curve[0]["loss"])


def test_tensors_of_the_environment_are_taken(ppo: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """With an environment of tensors, as on a card, the policy gets as good."""
    from functools import partial

    import torch

    monkeypatch.setattr(ppo, "StageArrayEnv", partial(ppo.StageArrayEnv, arrays="torch"))
    options = ppo.parsed(["--envs", "64", "--steps", "50000"])
    policy, curve = ppo.train(options)
    env = ppo.make(options, 50)
    assert isinstance(env.reset(1), torch.Tensor) and ppo.evaluate(policy, env, seed=9)["is_success"] > 0.4


@pytest.mark.skipif(not os.environ.get("STAGE_TRAIN"), reason="takes a minute: set STAGE_TRAIN")
@pytest.mark.parametrize("arguments", [["--envs", "128"], ["--envs", "64", "--world", "eight.world"]])
def test_policies_succeed(ppo: Any, learning: Path, arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """One robot, and eight robots that share a policy, succeed in nine of ten fresh episodes."""
    monkeypatch.chdir(learning)
    found = ppo.main([*arguments, "--until", "0.92", "--seed", "6"])
    assert found["is_success"] > 0.88  # 0.92 less three standard errors


def test_training_repeats(ppo: Any) -> None:
    """Two trainings with the same seed give the same policy, another seed another one."""
    found = []
    for seed in ("3", "3", "4"):
        policy, _ = ppo.train(ppo.parsed(["--envs", "8", "--steps", "1000", "--seed", seed]))
        found.append(policy.actor[0].weight.detach().numpy().tobytes())
    assert found[0] == found[1] != found[2]


def test_policy_is_saved_and_loaded(ppo: Any, tmp_path: Path) -> None:
    import torch

    policy = ppo.Policy(7, 3, 16)
    policy.save(tmp_path / "policy.pt")
    loaded = ppo.Policy.load(tmp_path / "policy.pt")
    seen = torch.rand(5, 7)
    assert torch.equal(policy.actor(seen), loaded.actor(seen)) and torch.equal(policy.critic(seen), loaded.critic(seen))


def test_advantages_are_those_of_their_definition(ppo: Any) -> None:
    """They are sums of discounted errors up to the end of an episode."""
    import torch

    random = np.random.default_rng(1)
    options = ppo.parsed(["--length", "12"])
    rollout = ppo.Rollout(3, ppo.Policy(2, 1), options)
    reward, value = random.normal(size=(2, 12, 3))
    goes_on, last = random.random((12, 3)) < 0.8, random.normal(size=3)
    for name, values in (("reward", reward), ("value", value), ("goes_on", goes_on)):
        getattr(rollout, name)[...] = torch.from_numpy(values)
    rollout._advantages(torch.from_numpy(last).float())
    following = np.concatenate([value[1:], last[None]])
    error = reward + options.discount * following * goes_on - value
    for row in range(3):
        for i in range(12):
            weight, expected = 1.0, 0.0
            for k in range(i, 12):
                expected += weight * error[k, row]
                weight *= options.discount * options.smoothing * goes_on[k, row]
            assert float(rollout.advantage[i, row]) == pytest.approx(expected, abs=1e-4)


def test_rows_of_waiting_robots_are_left_out(ppo: Any) -> None:
    """A rollout of several robots is learned from without the rows that took no part, whatever they hold."""
    import torch
    from stagesim.env import Navigate, StageArrayEnv

    options = ppo.parsed(["--length", "200", "--epochs", "1"])
    changed = []
    for garbage in (0.0, 1e6):
        torch.manual_seed(0)
        policy = ppo.Policy(37, 2)
        env = StageArrayEnv(4, "arena.world", Navigate(limit=150, goal_radius=2.0))
        rollout = ppo.Rollout(20, policy, options)
        rollout.fill(env, policy, torch.from_numpy(env.reset(1)).view(20, -1), ppo.Clock(env, False))
        waits = ~rollout.took_part
        assert 0.05 < waits.float().mean() < 0.95
        for name in ("advantage", "value", "seen"):
            getattr(rollout, name)[waits] += garbage
        ppo.improve(policy, torch.optim.Adam(policy.parameters(), 1e-3), rollout)
        changed.append(policy.actor[0].weight.detach().numpy().tobytes())
    assert changed[0] == changed[1]


@pytest.mark.parametrize(("world", "radius"), [("arena.world", 1.5), ("navigate.world", 3.0)])
def test_evaluation_counts_one_episode_of_each_robot(ppo: Any, world: str, radius: float) -> None:
    """Its means are those of a loop over single worlds, where later episodes end before the last first one, too."""
    import torch
    from stagesim.env import Navigate, StageArrayEnv

    torch.manual_seed(2)
    policy, task = ppo.Policy(37, 2), Navigate(limit=60, goal_radius=radius)
    found = ppo.evaluate(policy, StageArrayEnv(12, world, task), seed=20)
    assert 0 < found["is_success"] < 1
    alone = [ppo.evaluate(policy, StageArrayEnv(1, world, task), seed=20 + i) for i in range(12)]
    for name, mean in found.items():
        assert mean == pytest.approx(np.mean([single[name] for single in alone]), abs=1e-3)


def test_return_of_an_episode_that_was_cut_off_is_estimated(ppo: Any) -> None:
    """Where the limit of actions ends an episode, the reward has the value of what the robot saw last."""
    import torch
    from stagesim.env import Navigate, Outcome, StageArrayEnv

    class Nothing(Navigate):
        def judge(self, scene: Any) -> Outcome:
            none = scene.xp.zeros_like(scene.pose[..., 0])
            return Outcome(none, none > 0)

    policy, env = ppo.Policy(37, 2), StageArrayEnv(3, task=Nothing(limit=4))
    with torch.no_grad():
        policy.critic[-1].weight.zero_()
        policy.critic[-1].bias.fill_(2.0)
    rollout = ppo.Rollout(3, policy, ppo.parsed(["--length", "9", "--discount", "0.5"]))
    rollout.fill(env, policy, torch.from_numpy(env.reset(1)).view(3, -1), ppo.Clock(env, False))
    expected = np.repeat([0, 0, 0, 1, 0, 0, 0, 1, 0], 3).reshape(9, 3)
    assert np.array_equal(rollout.reward.numpy(), expected) and np.array_equal(rollout.goes_on.numpy(), 1 - expected)


def test_main_writes_files_and_evaluates(ppo: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    policy, curve = tmp_path / "policy.pt", tmp_path / "curve.csv"
    ppo.main(["--world", "arena.world", "--envs", "4", "--steps", "3000", "--save", str(policy), "--curve", str(curve)])
    lines = curve.read_text().splitlines()
    assert lines[0] == "seconds,steps,score,test,loss" and len(lines) == 6
    found = ppo.main(["--world", "arena.world", "--steps", "0", "--load", str(policy)])
    assert f"is_success {found['is_success']:.3f}" in capsys.readouterr().out.splitlines()[-1]


def test_curves_go_on_where_they_were_stopped(ppo: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    import curves

    monkeypatch.setitem(curves.RUNS, "navigate", ["--envs", "8", "--steps", "256"])
    curves.main([str(tmp_path), "--seeds", "1"])
    first = (tmp_path / "navigate-1.csv").stat().st_mtime_ns
    curves.main([str(tmp_path), "--seeds", "2"])
    assert (tmp_path / "navigate-1.csv").stat().st_mtime_ns == first
    assert [row["seed"] for row in curves.read(tmp_path / "summary.csv")] == ["1", "2"]
    assert (tmp_path / "curves.png").read_bytes().startswith(b"\x89PNG")
