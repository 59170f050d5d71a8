# SPDX-License-Identifier: GPL-2.0-or-later
"""The experiments in examples/what_if/experiments: robots that decide by what-if, and others."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

MODULES = ("corridor", "crossing", "dynamic_window", "ethical", "pictures", "reliability", "robots", "run", "tables", "trips")
PATIENCE = {"corridor": 3, "crossing": 1, "samples": 0.5, "ethical": 1, "reliability": 0}  # simulated seconds, to keep this short


@pytest.fixture(scope="module")
def code(root: Path) -> Iterator[SimpleNamespace]:
    """The modules of the experiments."""
    folder = root / "examples" / "what_if" / "experiments"
    if not folder.is_dir():
        pytest.skip("there are no examples")
    sys.path.insert(0, str(folder))
    yield SimpleNamespace(**{name: import_module(name) for name in MODULES})
    sys.path.remove(str(folder))
    for name in MODULES:
        del sys.modules[name]


def results_of(found: dict) -> list:
    """All that is the same in each run."""
    return [value.result if hasattr(value, "result") else value for _, value in sorted(found.items())]


@pytest.mark.parametrize("name", PATIENCE)
def test_equal_seeds_have_equal_results(name: str, code: SimpleNamespace) -> None:
    code.reliability.Reliability.each = 2
    seeds = 2
    by_processes = code.run.run([name], seeds, 2, PATIENCE[name])[name]
    experiment = code.run.EXPERIMENTS[name]
    alone = {task: experiment.work(task, PATIENCE[name]) for task in experiment.tasks(seeds)}
    assert results_of(by_processes) == results_of(alone)
    lines = experiment.table(alone, 5)
    assert len({line.count("|") for line in lines if line.startswith("|")}) == 1


def test_every_experiment_is_tested(code: SimpleNamespace) -> None:
    assert list(PATIENCE) == list(code.run.EXPERIMENTS)


def test_the_command_writes_a_table(code: SimpleNamespace, tmp_path: Path) -> None:
    out = tmp_path / "table.md"
    code.run.main(["corridor", "--seeds", "1", "--jobs", "2", "--patience", "1", "--out", str(out)])
    assert "| goes straight on | dynamic window | 0 of 1 (0 to 79 %) | 0 of 1 (0 to 79 %) | none arrives |" in out.read_text()
    with pytest.raises(SystemExit):
        code.run.main(["tunnel"])


def trip(code: SimpleNamespace, driver: str, other: tuple[float, float]) -> tuple:
    """A trip past somebody who stands."""
    person = code.trips.Other(other, other, 0.5, "go to")
    scene = code.trips.Scene("open.world", (0, 0, 0), (4, 0), (person,))
    return code.trips.travel(scene, getattr(code, driver)(scene), code.trips.Noise(), 1)


def test_the_dynamic_window_drives_around_what_stands(code: SimpleNamespace) -> None:
    code.Straight, code.DynamicWindow = code.robots.Straight, code.dynamic_window.DynamicWindow
    assert trip(code, "Straight", (2, 0.1)).collided
    assert trip(code, "Straight", (2, 0.6)).arrived
    around = trip(code, "DynamicWindow", (2, 0.1))
    assert around.arrived and not around.collided
    assert around.seconds > trip(code, "DynamicWindow", (2, 3)).seconds


def test_the_dynamic_window_can_always_stop(code: SimpleNamespace) -> None:
    """Velocities are admissible: the robot could stop on its curve."""
    scene = code.trips.Scene("open.world", (0, 0, 0), (4, 0), ())
    driver = code.dynamic_window.DynamicWindow(scene)
    for distance in np.linspace(0.6, 1.5, 10):
        seen = code.trips.Seen(np.zeros(3), np.array([0.5, 0, 0]), np.array([[distance, 0, 0.]]), np.zeros((1, 3)))
        speed, turn = driver.decide(seen)
        free = driver.dist(seen, np.array([[speed]]), np.array([[turn]]))[0, 0]
        least = 0.5 - scene.limits.acceleration * scene.interval
        assert speed <= max(least, np.sqrt(2 * free * scene.limits.acceleration)) + 1e-12
    straight = driver.dist(seen, np.array([[0.5]]), np.array([[0.0]]))[0, 0]
    assert straight == pytest.approx(1.5 - 0.25 - 0.2 - code.dynamic_window.MARGIN, abs=0.1)


def test_h_is_saved_by_who_knows_how_he_walks(code: SimpleNamespace) -> None:
    rows = {row.names[0]: row for row in code.ethical.EXPERIMENT.rows if row.noise.place < 0.05}
    for name, is_saved in (("straight ahead", False), ("ethical, right: knows how H walks", True), ("ethical, wrong: H stops", False)):
        scene = rows[name].scene(1)
        end = code.trips.travel(scene, rows[name].driver(scene, 1), rows[name].noise, 1)
        assert (not end.fell, end.arrived, end.collided) == (is_saved, is_saved, False), name


def test_the_ethical_robot_prefers_h_to_its_errand(code: SimpleNamespace) -> None:
    """Futures: to the goal; to the goal while H falls; elsewhere; elsewhere, touching H."""
    scene = code.ethical.scene(1)
    robot = code.ethical.Ethical(scene, code.ethical.EXACT, code.ethical.right, 1, 1)
    poses = np.full((4, 2, 2, 3), 5.0)
    poses[:2, :, 0, :2] = scene.goal
    poses[1, 1, 1] = 0
    poses[3, 1, 1] = poses[3, 1, 0] + 0.3
    stalled = np.zeros((4, 2, 2), bool)
    stalled[3, 1, 1] = stalled[0, 1, 1] = True  # H at a wall touches nobody
    scores, bad = robot.judge(SimpleNamespace(poses=poses, stalled=stalled))
    assert bad.tolist() == [False, True, False, True]
    assert scores.argsort().tolist() == [1, 3, 2, 0]


def test_pictures(code: SimpleNamespace, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    scene, noise = code.ethical.scene(1), code.ethical.SMALL
    robot = code.ethical.Ethical(scene, noise, code.ethical.right, 1, 2)
    pyplot = code.pictures.load_pyplot()
    code.pictures.picture(pyplot, tmp_path / "p.png", [(scene, robot, noise, 0.5)], (4, 3), (-5, 5, -3, 2))
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")


def test_intervals(code: SimpleNamespace) -> None:
    assert code.tables.wilson(0, 100) == pytest.approx((0, 0.037), abs=1e-4)
    assert code.tables.wilson(50, 100) == pytest.approx((0.4038, 0.5962), abs=1e-4)
    assert code.tables.binomial_interval(100, 0.5, 0.05) == (40, 60)
    assert code.tables.binomial_interval(10, 0, 0.05) == (0, 0)
    assert code.tables.binomial_interval(0, 0.5, 0.05) == (0, 0)


def test_what_is_certain_happens(code: SimpleNamespace) -> None:
    """Without errors and with one hypothesis, a plan collides if its prediction does."""
    collisions = 0
    for number in range(120):
        case = code.reliability.case_of(number)
        people = [person._replace(place_error=0, speed_error=0, behaviours=person.behaviours[:1]) for person in case.people]
        case = case._replace(people=people, place_error=0, heading_error=0, plans=case.plans[:1])
        predicted = code.reliability.predict(case, 1, number).risk[0]
        assert code.reliability.carry_out(case, 0, number) == predicted, number
        collisions += predicted
    assert 10 < collisions < 60


@pytest.mark.parametrize(("believed", "is_right"), [(1.0, True), (0.0, False)])
def test_predicted_chances_of_collisions_are_those_of_what_happens(believed: float, is_right: bool, code: SimpleNamespace) -> None:
    """If the robot believes that there are no errors, predictions are wrong, and this tells it."""
    decisions, risks, collided = 300, [], []
    for number in range(decisions):
        case = code.reliability.case_of(number)
        case = case._replace(plans=case.plans[:1])
        risks.append(code.reliability.predict(case, 100, number, believed).risk[0])
        collided.append(code.reliability.carry_out(case, 0, number))
    tenths = code.reliability.tenths(np.array(risks), np.array(collided))
    assert all(tenth.agrees for tenth in tenths) == is_right
    assert sum(tenth.count for tenth in tenths) == decisions
