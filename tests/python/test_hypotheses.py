# SPDX-License-Identifier: GPL-2.0-or-later
"""Hypotheses and judges that are Python functions, and kinds of others. The rest is in tests/whatif/hypotheses_test.cc."""

from __future__ import annotations

import gc
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stagesim as st
from beliefs import GOAL, PLANS, ROBOT

def chase(moments: st.Moments) -> np.ndarray:
    """Goes to the robot with 0.6 m/s."""
    own = moments.poses[np.arange(len(moments.own)), moments.own, :2]
    way = moments.poses[:, 0, :2] - own
    return 0.6 * way / np.linalg.norm(way, axis=1, keepdims=True)


def goal_judge(goal: tuple[float, float], radius: float) -> Any:
    """Returns a judge of whole futures that scores as choose() does with a goal."""
    def judge(seen: st.Sightings) -> tuple[np.ndarray, np.ndarray]:
        robot, others = seen.poses[:, :, 0, :2], seen.poses[:, :, 1:, :2]
        away = np.linalg.norm(np.asarray(goal) - robot, axis=2)
        near = np.linalg.norm(others - robot[:, :, None], axis=3) < radius + seen.radii + 0.02
        touches = seen.stalled[:, :, 0] | (seen.stalled[:, :, 1:] & near).any(2)
        ends = touches | (away < 0.2)
        before = np.cumsum(ends, 1) - ends == 0
        collided = (touches & before).any(1)
        return -(away * before).sum(1) / away.shape[1] - 100 * collided, collided
    return judge


def crowd(belief: st.Belief, function: Any = chase) -> None:
    angles = np.arange(5)
    places = np.stack([2 * np.cos(angles), 2 * np.sin(angles), 0 * angles], 1)
    hypotheses = [[st.Behaviour("function", function=function), st.Behaviour("orca", goal=(-x, -y)),
                   st.Behaviour("controller", controller=f"stage/goal x={y:.2f} y={x:.2f}")] for x, y, _ in places]
    belief.set_robot((0, 0, 0.1), (0.2, 0, 0), np.diag([0.05, 0.05, 0.02]) ** 2)
    belief.set_others(angles, places, -0.3 * places, np.diag([0.1, 0.1, 0]) ** 2, behaviours=hypotheses)


def test_a_function_moves_others(robot_file: str) -> None:
    belief = st.Belief(robot_file, "r")
    moments: list[st.Moments] = []

    def drift(given: st.Moments) -> list[tuple[float, float, float]]:
        moments.append(given)
        return [(0.1 * number, 0.2, 0.5) for number in given.ids]

    belief.set_others([4, 2], [[-3, 0, 1], [-3, 3, 0]], behaviours=[[st.Behaviour("function", function=drift)]] * 2)
    decision = st.ConsequenceEngine(belief, samples=1).choose(PLANS, GOAL, radius=0.2, horizon=1)
    first, second = decision.future(1, 2)[-1, 1:]
    assert first == pytest.approx([-3 + 0.2, 3 + 0.2, 0.5], abs=1e-2)  # it turns while it moves
    assert second == pytest.approx([-3 + 0.4, 0.2, 1.5], abs=1e-2)
    assert len(moments) == 10
    assert moments[3].times == pytest.approx([0.3] * 8)
    assert moments[0].poses.shape == (8, 3, 3)
    assert moments[0].own.tolist() == [1, 2] * 4 and moments[0].ids.tolist() == [2, 4] * 4
    assert moments[0].plans.tolist() == [0, 0, 1, 1, 2, 2, 3, 3] and moments[0].samples.tolist() == [0] * 8


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("device", [None, "opencl"])
def test_a_judge_scores_as_the_compiled_one_does(robot_file: str, threads: int, device: str | None) -> None:
    belief = st.Belief(robot_file, "r")
    crowd(belief)
    try:
        engine = st.ConsequenceEngine(belief, samples=8, most_samples=32, threads=threads, device=device)
    except st.StageError as error:
        if device:
            pytest.skip(str(error))
        raise
    wanted = engine.choose(PLANS, GOAL, radius=0.2)
    found = engine.choose(PLANS, judge=goal_judge(GOAL, 0.2))
    assert found.scores == pytest.approx(wanted.scores, rel=1e-12, nan_ok=True)
    assert (found.collided == wanted.collided).all() and wanted.collided.any() and not wanted.collided.all()
    assert (found.best, found.samples, found.reason) == (wanted.best, wanted.samples, wanted.reason)
    again = engine.replay(found)
    assert np.array_equal(again.scores, found.scores, equal_nan=True)


def test_scores_without_collisions_have_no_risk(robot_file: str) -> None:
    engine = st.ConsequenceEngine(st.Belief(robot_file, "r"), samples=3)
    decision = engine.choose(PLANS, judge=lambda seen: seen.poses[:, -1, 0, 1] + seen.samples)
    assert decision.best == 2 and not decision.risk.any()
    assert decision.scores[0].tolist() == [0, 1, 2]


def boom(_: Any) -> None:
    raise RuntimeError("boom")


@pytest.mark.parametrize("function, error, message", [
    (boom, RuntimeError, "boom"),
    (lambda moments: moments.ids, ValueError, "velocities of shape"),
    (lambda moments: moments.poses[:, 0] * np.nan, st.StageError, "not finite"),
])
def test_mistakes_of_functions_are_told(robot_file: str, function: Any, error: type[Exception], message: str) -> None:
    belief = st.Belief(robot_file, "r")
    crowd(belief, function)
    engine = st.ConsequenceEngine(belief, samples=8)
    with pytest.raises(error, match=message):
        engine.choose(PLANS, GOAL, radius=0.2)
    crowd(belief)
    assert engine.choose(PLANS, GOAL, radius=0.2).samples == 8


@pytest.mark.parametrize("judge, error, message", [
    (boom, RuntimeError, "boom"),
    (lambda seen: [1, 2], ValueError, "scores of shape"),
    (lambda seen: seen.poses[:, 0, 0, 0] * np.nan, ValueError, "finite"),
])
def test_mistakes_of_judges_are_told(robot_file: str, judge: Any, error: type[Exception], message: str) -> None:
    engine = st.ConsequenceEngine(st.Belief(robot_file, "r"), samples=2)
    with pytest.raises(error, match=message):
        engine.choose(PLANS, judge=judge)
    assert engine.choose(PLANS, GOAL, radius=0.2).best == 1


def test_functions_cannot_use_the_belief_that_they_decide_about(robot_file: str) -> None:
    belief = st.Belief(robot_file, "r")
    engine = st.ConsequenceEngine(belief, samples=2)

    def meddle(seen: st.Sightings) -> None:
        belief.set_robot((1, 0, 0))

    with pytest.raises(st.StageError, match="between decisions"):
        engine.choose(PLANS, judge=meddle)
    with pytest.raises(st.StageError, match="between decisions"):
        engine.choose(PLANS, judge=lambda seen: engine.choose(PLANS, GOAL, radius=0.2))
    belief.set_robot((1, 0, 0))


def test_functions_are_forgotten_with_their_hypotheses(robot_file: str) -> None:
    class Chase:
        def __call__(self, moments: st.Moments) -> np.ndarray:
            return chase(moments)

    belief, function = st.Belief(robot_file, "r"), Chase()
    crowd(belief, function)
    st.ConsequenceEngine(belief, samples=2).choose(PLANS, GOAL, radius=0.2)
    alive = weakref.ref(function)
    del function
    assert alive() is not None
    belief.set_others([], np.zeros((0, 3)))
    gc.collect()
    assert alive() is None


def test_kinds_have_their_sizes(robot_file: str) -> None:
    belief = st.Belief(robot_file, "r", kinds=[st.OtherKind(0.25), st.OtherKind(0.6)])
    engine = st.ConsequenceEngine(belief, samples=1)
    risks = []
    for kind in (0, 1):
        belief.set_others([1], [[1, 0.6, 0]], kinds=[kind])
        risks.append(engine.choose([[0.5, 0, 0]], GOAL, radius=0.2).risk[0])
    assert risks == [0, 1]
    with pytest.raises(ValueError, match="kinds"):
        belief.set_others([1], [[1, 0.6, 0]], kinds=[2])


def test_hypotheses_that_do_not_fit_are_told(robot_file: str) -> None:
    belief = st.Belief(robot_file, "r")
    for behaviour, error in [(st.Behaviour("controller", controller="stage/none"), st.StageError),
                             (st.Behaviour("controller"), st.StageError), (st.Behaviour("function"), ValueError),
                             (st.Behaviour("think"), ValueError)]:
        with pytest.raises(error):
            belief.set_others([1], [[1, 0, 0]], behaviours=[[behaviour]])
    with pytest.raises(ValueError, match="expected one"):
        st.ConsequenceEngine(belief).choose(PLANS)
    with pytest.raises(ValueError, match="radius"):
        st.ConsequenceEngine(belief).choose(PLANS, GOAL)


@pytest.mark.parametrize("behaviours, message", [
    ([[st.Behaviour("orca")]], "without a goal"),
    ([[st.Behaviour("orca", (-2, 0))]], "a weight"),  # type: ignore[arg-type]
    ([st.Behaviour("stand")], "sequence"),
    ([["stand"]], "Behaviour"),
])
def test_behaviours_of_a_wrong_form_are_told(robot_file: str, behaviours: Any, message: str) -> None:
    belief = st.Belief(robot_file, "r")
    with pytest.raises(ValueError, match=message):
        belief.set_others([1], [[1, 0, 0]], behaviours=behaviours)
    with pytest.raises(ValueError, match="without a grid"):
        belief.set_grid(np.zeros((3, 3), bool))


def test_futures_show_nobody_who_is_not_tracked(robot_file: str) -> None:
    belief = st.Belief(robot_file, "r")
    engine = st.ConsequenceEngine(belief, samples=1)
    with pytest.raises(ValueError, match="others"):
        engine.choose(PLANS, GOAL, radius=0.2).future(0, 1)
    belief.set_others([1], [[-3, 0, 0]])
    assert engine.choose(PLANS, GOAL, radius=0.2).future(0, 1).shape == (50, 2, 3)


def test_a_map_file_is_a_grid(robot_file: str, tmp_path: Path) -> None:
    cells = np.full((40, 60), 254, np.uint8)
    cells[:, 40] = 0
    (tmp_path / "map.pgm").write_bytes(b"P5 60 40 255\n" + cells.tobytes())
    path = tmp_path / "map.yaml"
    path.write_text("image: map.pgm\nresolution: 0.1\norigin: [-2, -2, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n")
    belief = st.Belief(robot_file, "r", grid=path)
    assert belief.grid == (40, 60)
    engine = st.ConsequenceEngine(belief, samples=1)
    assert engine.choose([[0.5, 0, 0]], GOAL, radius=0.2).risk[0] == 1
    belief.set_grid(np.zeros((40, 60), bool))
    assert engine.choose([[0.5, 0, 0]], GOAL, radius=0.2).risk[0] == 0
