# SPDX-License-Identifier: GPL-2.0-or-later
"""benchmarks/peers measures stagesim's rows, and its checks reject simulators that do not do the work."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

from peers import checks, program, table  # noqa: E402  pylint: disable=wrong-import-position
from peers.driving import Driver  # noqa: E402  pylint: disable=wrong-import-position
from peers.rows import Row, compare_rounds  # noqa: E402  pylint: disable=wrong-import-position
from peers.simulators import Peer, peer_named, stage  # noqa: E402  pylint: disable=wrong-import-position
from peers.simulators.simulation import Facts, Simulation  # noqa: E402  pylint: disable=wrong-import-position
from peers.task import (  # noqa: E402  pylint: disable=wrong-import-position
    GAP, LEG, RADIUS, Schedule, Task, exact_ranges, judge, places)

TASK = Task(envs=2)


def sight_of(simulation: Simulation, task: Task = TASK) -> checks.Sight:
    return checks.look(simulation, task, 0)


def test_places_are_apart() -> None:
    taken = places(np.random.default_rng(1), 50, 4, 1.0)
    found = np.concatenate([taken, places(np.random.default_rng(2), 50, 4, 1.0, taken)], 1)
    distances = np.linalg.norm(found[:, :, None] - found[:, None], axis=-1) + 9 * np.eye(8)
    assert distances.min() >= 2 * RADIUS + GAP
    assert abs(found).max() <= 1 and len(np.unique(found)) == found.size


def test_exact_ranges_are_those_of_circles() -> None:
    """A ray to the centre of another agent, one at a tangent, one past it, and one away from it."""
    task = Task(agents=2, rays=4, reach=0.5)
    poses = np.array([[[0, 0], [0.4, 0]], [[0, 0], [0.4, 0.0999]], [[0, 0], [0.4, 0.1001]], [[0, 0], [0.7, 0]]])
    ranges = exact_ranges(poses, np.zeros((4, 2)), task)
    near = 0.4 - math.sqrt(0.1 ** 2 - 0.0999 ** 2)
    np.testing.assert_allclose(ranges[:, 0, 0], [0.3, near, 0.5, 0.5])
    np.testing.assert_allclose(ranges[:, 0, 1:], 0.5)
    np.testing.assert_allclose(ranges[0, 1], [0.5, 0.5, 0.3, 0.5])
    turned = exact_ranges(poses[:1], np.full((1, 2), math.pi / 2), task)
    np.testing.assert_allclose(turned[0, 0], [0.5, 0.5, 0.5, 0.3])


def test_rewards_are_those_of_the_scenario() -> None:
    """Environment 0 makes progress with a collision; in environment 1, all agents arrive."""
    before, after = np.array([[1.0, 2.0], [0.2, 0.1]]), np.array([[0.9, 2.3], [0.04, 0.04]])
    rewards, dones = judge(before, after, np.array([[False, True], [False, False]]))
    np.testing.assert_allclose(rewards, [[-0.2, -1.2], [0.23, 0.23]])
    assert dones.tolist() == [False, True]


@pytest.mark.parametrize("apart", [False, True])
def test_each_environment_is_reset_once_per_episode(apart: bool) -> None:
    task = Task(envs=7, apart=apart)
    schedule = Schedule(task)
    resets, turns = np.zeros(7), np.zeros(7)
    for step in range(1, task.episode + 1):
        for counts, chosen in ((resets, schedule.ended(step)), (turns, schedule.turning(step))):
            if chosen is not None:
                counts[chosen] += 1
                assert apart or len(chosen) == 7
    assert (resets == 1).all() and (turns == task.episode / LEG).all()


@pytest.mark.parametrize("name, envs, apart", [("stage", 2, False), ("stage-exact", 2, False), ("stage-cells", 24, True),
                                               ("stage", 24, True)])
def test_the_rows_of_stagesim_pass_all_checks(name: str, envs: int, apart: bool) -> None:
    task = replace(TASK, envs=envs, apart=apart)
    sight = sight_of(peer_named(name).open(task, "cpu", 1), task)
    assert checks.faults(sight, task) == []
    assert sight.resets > 0 and sight.episodes * TASK.agents >= checks.FEWEST
    assert sight.error < (0.004 if name == "stage-exact" else 0.012)


def test_a_lidar_without_range_is_rejected() -> None:
    task = replace(TASK, reach=0.0)
    assert any("of the rays hit something" in fault
               for fault in checks.faults(sight_of(peer_named("stage").open(task, "cpu", 1), task), task))


def test_a_lidar_above_all_agents_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    """A published table once had lidars that were mounted above everything that they could detect."""
    world_file = stage.world_file
    monkeypatch.setattr(stage, "world_file",
                        lambda *words: world_file(*words).replace("pose [0 0 -0.2 ", "pose [0 0 0.5 "))
    found = checks.faults(sight_of(peer_named("stage").open(TASK, "cpu", 1)), TASK)
    assert any("0.00% of the rays hit something" in fault for fault in found)


class Changed(Simulation):
    """A simulation whose results are spoiled by a function."""

    def __init__(self, spoil: Callable[[Facts], None]) -> None:
        self._real, self._spoil = peer_named("stage").open(TASK, "cpu", 1), spoil
        self.senses_first = self._real.senses_first

    def reset(self, which: Any) -> None:
        self._real.reset(which)

    def to_goals(self) -> Any:
        return self._real.to_goals()

    def step(self, actions: Any) -> Any:
        return self._real.step(actions)

    def poses(self) -> Any:
        return self._real.poses()

    def facts(self, result: Any) -> Facts:
        facts = self._real.facts(result)
        self._spoil(facts)
        return facts


@pytest.mark.parametrize("name, value, fault", [
    ("rewards", 0.0, "all rewards are equal"),
    ("rewards", math.nan, "not finite"),
    ("collided", False, "no agent touches"),
    ("ranges", 0.2, "hits agree with exact geometry"),
    ("ranges", math.nan, "not finite"),
])
def test_spoiled_results_are_rejected(name: str, value: float, fault: str) -> None:
    def spoil(facts: Facts) -> None:
        getattr(facts, name)[...] = value

    assert any(fault in found for found in checks.faults(sight_of(Changed(spoil)), TASK))


def test_ranges_that_are_wrong_by_a_few_centimetres_are_rejected() -> None:
    def spoil(facts: Facts) -> None:
        facts.ranges[facts.ranges < TASK.reach - 1e-3] -= 0.04

    found = checks.faults(sight_of(Changed(spoil)), TASK)
    assert len(found) == 1 and "ranges differ from exact geometry" in found[0]


def test_agents_that_stand_still_are_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage, "TOP_SPEED", 0.0)
    found = checks.faults(sight_of(peer_named("stage").open(TASK, "cpu", 1)), TASK)
    assert any("agents move" in fault for fault in found)


def test_resets_that_do_nothing_are_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    simulation = peer_named("stage").open(TASK, "cpu", 1)
    look = checks.Look(simulation, TASK)
    monkeypatch.setattr(simulation, "reset", lambda which: None)
    for _ in range(2):
        look.episode()
    sight = look.sight()
    assert any("a reset moves agents by 0 m" in fault for fault in checks.faults(sight, TASK))
    assert "no episode begins again" in checks.faults(replace(sight, resets=0), TASK)


def test_different_scenes_are_rejected() -> None:
    """Stage's lidars with half the range hit less, though they agree with their own geometry."""
    task = replace(TASK, envs=64)
    near = replace(task, reach=0.15)
    sights = [sight_of(peer_named("stage").open(one, "cpu", 1), one) for one in (task, near)]
    assert checks.differences(sights[0], sights[0]) == []
    assert len(checks.differences(*sights)) == 1


def test_the_end_of_a_measurement_is_checked() -> None:
    simulation = peer_named("stage").open(TASK, "cpu", 1)
    steps, seconds, result = Driver(simulation, TASK).measure(0.01)
    assert steps % TASK.episode == 0 and seconds >= 0.01
    facts = simulation.facts(result)
    checks.check_end(facts, TASK)
    facts.rewards[0, 0] = math.inf
    with pytest.raises(checks.CheckError, match="not finite"):
        checks.check_end(facts, TASK)


def test_the_program_measures_and_writes_a_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--peer", "stage", "--peer", "stage-exact", "--envs", "2", "--seconds", "0.01", "--repeats", "2",
             "--scene", "navigation", "--threads", "1", "--meter", "none", "-o", str(tmp_path)]
    assert program.main(words) == 0
    printed = capsys.readouterr().out.splitlines()
    assert len(printed) == 4 and printed[2].startswith("| navigation | 4 | 12 | 2 | stagesim | ")
    figures = json.loads((tmp_path / "peers.json").read_text())
    assert [row["peer"] for row in figures["rows"]] == ["stage", "stage-exact"]
    for row in figures["rows"]:
        assert len(row["agent_steps"]) == 2 and min(row["agent_steps"]) > 0
        np.testing.assert_allclose(np.array(row["ray_rates"]) / row["agent_steps"], 12)
    assert printed[2] in (tmp_path / "peers.md").read_text()


def test_the_program_fails_if_a_check_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--peer", "stage", "--envs", "2", "--seconds", "0.01", "--scene", "navigation", "--reach", "0",
             "--threads", "1", "-o", str(tmp_path)]
    assert program.main(words) == 1
    assert "FAILED: 0.00% of the rays hit something" in capsys.readouterr().out
    assert json.loads((tmp_path / "peers.json").read_text())["rows"][0]["agent_steps"] == []


def test_a_simulator_that_is_not_installed_is_no_result(monkeypatch: pytest.MonkeyPatch,
                                                        capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(program, "PEERS", [Peer("vmas", "VMAS", "with_vmas", ("no_such_module",))])
    assert program.main(["--envs", "2", "--scene", "navigation"]) == 1
    shown = capsys.readouterr()
    assert "not installed: no_such_module" in shown.out and "nothing was measured" in shown.err


def test_ratios_are_those_of_rounds_and_losses_are_shown() -> None:
    rows = [Row("navigation", 4, 12, 2, name, name, "", "cpu", agent_steps=rates, ray_rates=rates, per_processor=rates)
            for name, rates in (("stage", [1.0, 2.0, 3.0]), ("vmas", [4.0, 2.0, 30.0]))]
    compare_rounds(rows)
    assert rows[0].ratios == [] and rows[1].ratios == [0.25, 1.0, 0.1]
    assert table.cells(rows[1])[7] == "0.250"
    assert table.cells(rows[1])[-1] == ""
    rows[1].others = [0.0, 1.4, 0.2]
    assert table.cells(rows[1])[-1] == ("provisional: others used 1.4 processors; 4 agent-steps per processor-second, "
                                        "stagesim 0.250 times as many")
    assert [table.ratio([value]) for value in (123.4, 12.34, 1.234)] == ["123", "12.3", "1.23"]
