# SPDX-License-Identifier: GPL-2.0-or-later
"""Beliefs and decisions about them from Python. What samples are is tested in tests/whatif/belief_test.cc."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st
from beliefs import GOAL, PLANS, ROBOT

def crowd(belief: st.Belief, n: int = 5) -> None:
    """Surrounds the robot by others whose places and behaviours are uncertain."""
    angles = np.arange(n)
    places = np.stack([2 * np.cos(angles), 2 * np.sin(angles), 0 * angles], 1)
    goals = [[st.Behaviour("orca", goal=(-x, -y)), st.Behaviour("stand", 0.5)] for x, y, _ in places]
    belief.set_robot((0, 0, 0.1), (0.2, 0, 0), np.diag([0.05, 0.05, 0.02]) ** 2)
    belief.set_others(angles, places, -0.3 * places, np.diag([0.1, 0.1, 0]) ** 2, behaviours=goals)


def test_somebody_in_the_way_is_avoided(robot_file: str) -> None:
    belief = st.Belief(robot_file, "r")
    engine = st.ConsequenceEngine(belief, samples=1, threads=1)
    assert engine.device is None
    assert engine.choose(PLANS, GOAL, radius=0.2).best == 1
    belief.set_others([7], [[1.2, 0, 0]])
    decision = engine.choose(PLANS, GOAL, radius=0.2)
    assert decision.best in (2, 3)
    assert decision.risk.tolist() == [0, 1, 0, 0]
    assert decision.future(2, 1).shape == (50, 2, 3)
    assert decision.future(2)[0, 0] == pytest.approx([0.05, 0, 0.05])
    belief.set_others([], np.zeros((0, 3)))
    assert engine.choose(PLANS, GOAL, radius=0.2).best == 1


def test_worlds_may_be_texts_or_scenes(robot_file: str) -> None:
    from stagesim.scenes import GridMap, Robot, Scene

    def choose(belief: st.Belief) -> st.Decision:
        return st.ConsequenceEngine(belief, samples=1, threads=1).choose(PLANS, GOAL, radius=0.2)

    of_file, of_text = choose(st.Belief(robot_file, "r")), choose(st.Belief.from_text(ROBOT, "r"))
    assert (of_file.scores == of_text.scores).all() and of_text.risk.tolist() == [0, 0, 0, 0]
    cells = np.zeros((40, 40), bool)
    cells[:, 30] = True
    walls = GridMap(cells, 0.1, (-2, -2, 0))
    robot = Robot(name="r", size=(0.4, 0.4, 0.4), round=True, drive="diff", localization="gps")
    assert choose(st.Belief(Scene(walls, [robot], resolution=0.05), "r")).risk.tolist() == [0, 1, 1, 1]
    with pytest.raises(TypeError, match="expected a world file or a scene"):
        st.Belief(3, "r")  # type: ignore[arg-type]
    with pytest.raises(st.StageError, match='"<scene>" has no position model "s"'):
        st.Belief(Scene(walls, [robot]), "s")


def test_sequences_of_velocities_are_held(robot_file: str) -> None:
    engine = st.ConsequenceEngine(st.Belief(robot_file, "r"), samples=1, threads=1)
    plan = [[[0, 0, 0], [0.2, 0, 0], [0, 0, 0]]]
    moved = engine.choose(plan, GOAL, radius=0.2, hold=1, horizon=4).future(0)[:, 0, 0]
    assert moved[9] == pytest.approx(0) and moved[19] == pytest.approx(0.2) and moved[-1] == pytest.approx(0.2)


def test_distributions_are_those_of_the_samples(robot_file: str) -> None:
    belief = st.Belief(robot_file, "r")
    crowd(belief)
    decision = st.ConsequenceEngine(belief, samples=40).choose(PLANS, GOAL, radius=0.2)
    assert decision.samples == 40 and decision.scores.shape == (4, 40) and decision.reason == "horizon"
    assert decision.mean == pytest.approx(decision.scores.mean(1))
    assert (decision.worst == decision.scores.min(1)).all()
    assert decision.quantile(0.5) == pytest.approx(np.median(decision.scores, 1))
    assert (decision.risk == decision.collided.mean(1)).all() and 0 < decision.risk[1] <= 1
    low, high = decision.risk_interval.T
    assert ((low <= decision.risk) & (decision.risk <= high)).all()
    assert decision.best == decision.mean.argmax()
    worst = st.ConsequenceEngine(belief, samples=40, prefer="worst").choose(PLANS, GOAL, radius=0.2)
    assert worst.best == decision.worst.argmax()
    low_ones = st.ConsequenceEngine(belief, samples=40, prefer=0.2).choose(PLANS, GOAL, radius=0.2)
    assert low_ones.best == decision.quantile(0.2).argmax()


def test_budgets_end_decisions_which_are_replayed_exactly(robot_file: str) -> None:
    belief = st.Belief(robot_file, "r")
    crowd(belief)
    engine = st.ConsequenceEngine(belief, samples=4, most_samples=64, threads=2)
    for budget in ({"steps": 300}, {"steps": 2000}, {"seconds": 0.002}, {"joules": 0.01, "watts": 5.0}, {}):
        decision = engine.choose(PLANS, GOAL, radius=0.2, **budget)  # type: ignore[arg-type]
        again = engine.replay(decision)
        assert np.array_equal(again.scores, decision.scores, equal_nan=True)
        assert (again.best, again.reason, again.steps) == (decision.best, decision.reason, decision.steps)
        assert decision.steps <= budget.get("steps", 1e9)


def test_grids_are_obstacles(robot_file: str) -> None:
    belief = st.Belief(robot_file, "r", grid=(60, 80), resolution=0.1, origin=(-2, -3, 0))
    engine = st.ConsequenceEngine(belief, samples=1)
    percent = np.full((60, 80), -1)
    percent[25:, 35:37] = 80
    belief.set_grid(percent)
    assert engine.choose(PLANS, GOAL, radius=0.2).risk[1] == 1
    belief.set_grid(percent, threshold=90)
    assert engine.choose(PLANS, GOAL, radius=0.2).best == 1
    belief.set_grid(np.ones((60, 80), bool))
    with pytest.raises(st.StageError, match="in an obstacle"):
        engine.choose(PLANS, GOAL, radius=0.2)


def test_decisions_are_the_same_on_devices(robot_file: str) -> None:
    belief = st.Belief(robot_file, "r")
    crowd(belief)
    try:
        device = st.ConsequenceEngine(belief, samples=6, device="opencl")
    except st.StageError as error:
        if "OpenCL" not in str(error):
            raise
        pytest.skip(str(error))
    assert device.device
    host = st.ConsequenceEngine(belief, samples=6).choose(PLANS, GOAL, radius=0.2)
    assert np.array_equal(device.choose(PLANS, GOAL, radius=0.2).scores, host.scores)


@pytest.mark.parametrize(("change", "message"), [
    (lambda b: b.set_robot((np.nan, 0, 0)), "not finite"), (lambda b: b.set_robot((0, 0)), "shape"),
    (lambda b: b.set_robot((0, 0, 0), pose_covariance=-np.eye(3)), "positive semidefinite"),
    (lambda b: b.set_others([1, 1], np.zeros((2, 3))), "twice"), (lambda b: b.set_others([-1], [[0, 0, 0]]), "ids"),
    (lambda b: b.set_others([1.5], [[0, 0, 0]]), "ids"), (lambda b: b.set_others([1], np.zeros((2, 3))), "shape"),
    (lambda b: b.set_others([1], [[0, 0, 0]], behaviours=[[st.Behaviour("fly")]]), "'fly'"),
    (lambda b: b.set_others([1], [[0, 0, 0]], behaviours=[]), "behaviours of 0 others"),
    (lambda b: b.set_others([1], [[0, 0, 0]], behaviours=[[st.Behaviour("stand", 0)]]), "weight"),
    (lambda b: b.set_grid(np.zeros((2, 2), bool)), "cells"), (lambda b: b.set_delay(-1), "delay"),
    (lambda b: st.ConsequenceEngine(b, samples=0), "samples"), (lambda b: st.ConsequenceEngine(b, prefer=2), "prefer"),
    (lambda b: st.ConsequenceEngine(b, prefer="best"), "prefer"),
    (lambda b: st.ConsequenceEngine(b).choose([[0, 0]], GOAL, radius=0.2), "plans of shape"),
    (lambda b: st.ConsequenceEngine(b).choose(PLANS, GOAL, radius=-1), "negative"),
    (lambda b: st.ConsequenceEngine(b).choose([[0, 1, 0]], GOAL, radius=0.2), "sideways"),
    (lambda b: st.ConsequenceEngine(b).choose(np.zeros((0, 3)), GOAL, radius=0.2), "no plans")])
def test_mistakes_are_told(change: Any, message: str, robot_file: str) -> None:
    with pytest.raises((ValueError, st.StageError), match=message):
        change(st.Belief(robot_file, "r"))


def test_a_belief_needs_its_robot(robot_file: str) -> None:
    with pytest.raises(st.StageError, match="no position model"):
        st.Belief(robot_file, "s")
    with pytest.raises(st.StageError, match="radius"):
        st.Belief(robot_file, "r", other_radius=-1)


def test_threads_use_a_belief_one_at_a_time(robot_file: str) -> None:
    belief = st.Belief(robot_file, "r")
    engine = st.ConsequenceEngine(belief, samples=2, threads=2)
    errors: list[BaseException] = []

    def work(seed: int) -> None:
        try:
            for i in range(10):
                crowd(belief, 1 + (seed + i) % 9)
                decision = engine.choose(PLANS, GOAL, radius=0.2, horizon=1.0)
                assert np.isfinite(decision.scores).all()
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
