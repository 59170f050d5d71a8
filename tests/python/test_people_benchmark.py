# SPDX-License-Identifier: GPL-2.0-or-later
"""benchmarks/people.py measures people, and its checks reject people who do not do what they should."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

import people  # noqa: E402  pylint: disable=wrong-import-position
from stagesim import scenarios  # noqa: E402  pylint: disable=wrong-import-position


@pytest.fixture(name="hall")
def _hall() -> scenarios.Scenario:
    return scenarios.scenario("hall", 1, pedestrians=60, rule="orca", robot=False)


def findings(text: str) -> people.Findings:
    return people.found_in(people.walked(text, 30), people.goals_of(text))


def test_the_program_prints_a_table(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["people.py", "--people", "60", "--seconds", "30"])
    people.main()
    assert [line.split(" | ")[0] for line in capsys.readouterr().out.splitlines()[2:]] == [
        "| `stage/pedestrian`", "| `stage/orca`", "| no evasion"]


def test_people_who_do_not_do_what_they_should_are_rejected(hall: scenarios.Scenario) -> None:
    text = hall.scene.text()
    good = findings(text)
    people.check(good, hall, 0.5)
    with pytest.raises(AssertionError, match="found people who hardly walk"):
        people.check(findings(text.replace(" speed=", " speed=0.1 turn=")), hall, 0.5)
    for wrong, message in (({"cost": 1.1}, "slower than real time"), ({"arrived": 20}, "do not reach their goals"),
                           ({"stuck": 2}, "are stuck"), ({"contact": 0.03}, "do not evade each other")):
        with pytest.raises(AssertionError, match=message):
            people.check(good._replace(**wrong), hall, 0.5)


def test_goals_contacts_and_the_stuck_are_counted() -> None:
    goals = people.goals_of('a( ctrl "stage/orca goals=1,2,3,-4 loop=1" ) b( ctrl "stage/orca goals=0,0,5,5" )')
    assert goals.tolist() == [[[1, 2], [3, -4]], [[0, 0], [5, 5]]]
    places = np.array([[[1, 2.5], [3, 3]], [[2, 0], [3, 3]], [[3, -3.5], [3, 3]], [[1, 2], [3, 3]]])
    assert people.arrivals(places, goals).tolist() == [3, 0]
    assert people.stuck(people.Walk(places, np.ones(1), 0.1)) == 1
    assert people.contacts(np.array([[[0, 0], [0.4, 0], [2, 0], [2.5, 0]]])) == 0.5
