#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Steps a hall with 1000 pedestrians on one core, by social forces and by reciprocal avoidance.

  tools/test -R python_package       # builds what is needed
  PYTHONPATH=build/release/python build/venv/bin/python benchmarks/people.py

Prints a Markdown table with the seconds of processor time that the only thread takes for a simulated second: the median
and the range of all seconds. Fails unless that is less than a second, and people do what they should: they walk at more
than half of their desired speed, reach goals, do not stand for long, and touch others much more rarely than people who
do not evade each other.
"""

from __future__ import annotations

import argparse
import re
import time
from typing import NamedTuple

import numpy as np
import stagesim as st
from stagesim import scenarios

NEAR = 1.0  # metres, the distance at which a goal of the hall is reached
TOUCH = 0.41  # metres between the middles of two people of 0.4 m
STANDING, PATIENCE = 0.5, 10.0  # metres and seconds: who moves less is stuck


class Walk(NamedTuple):
    """A run.

    Attributes:
        places: x and y of all people, at first and after each step: shape (t, n, 2).
        costs: seconds of processor time of the thread for each second.
        dt: seconds of a step.
    """

    places: np.ndarray
    costs: np.ndarray
    dt: float


def walked(text: str, seconds: int) -> Walk:
    """Steps a world for some seconds."""
    world = st.World.from_text(text, threads=1)
    fleet = world.fleet()
    places, costs = [fleet.pose[:, :2].copy()], []
    world.step()
    dt = world.time
    places.append(fleet.pose[:, :2].copy())
    for _ in range(seconds):
        start = time.thread_time()
        for _ in range(round(1 / dt)):
            world.step()
            places.append(fleet.pose[:, :2].copy())
        costs.append(time.thread_time() - start)
    return Walk(np.array(places), np.array(costs), dt)


def goals_of(text: str) -> np.ndarray:
    """The goals in the controllers of a world: shape (n, goals, 2)."""
    lists = [np.array(goals.split(","), float) for goals in re.findall(r"goals=([-0-9.,e]+)", text)]
    return np.array(lists).reshape(len(lists), -1, 2)


def arrivals(places: np.ndarray, goals: np.ndarray) -> np.ndarray:
    """How many goals each person has reached, one after the other."""
    people = np.arange(len(goals))
    count = np.zeros(len(goals), int)
    for now in places:
        count += np.linalg.norm(now - goals[people, count % goals.shape[1]], axis=1) < NEAR
    return count


def contacts(places: np.ndarray) -> float:
    """The share of people who touch another, mean over some moments."""
    shares = []
    for now in places[::20]:
        apart = np.linalg.norm(now[:, None] - now, axis=-1)
        np.fill_diagonal(apart, np.inf)
        shares.append((apart.min(1) < TOUCH).mean())
    return float(np.mean(shares))


def stuck(walk: Walk) -> int:
    """How many people hardly moved during the last seconds."""
    last = walk.places[-round(PATIENCE / walk.dt):]
    return int((np.ptp(last, axis=0).max(1) < STANDING).sum())


class Findings(NamedTuple):
    """Numbers of a run, those of the table."""

    cost: float
    speed: float
    goals: int
    arrived: int
    stuck: int
    contact: float


def found_in(walk: Walk, goals: np.ndarray) -> Findings:
    """The numbers of a run."""
    reached = arrivals(walk.places, goals)
    speed = float(np.linalg.norm(np.diff(walk.places, axis=0), axis=-1).mean()) / walk.dt
    return Findings(float(np.median(walk.costs)), speed, int(reached.sum()), int((reached > 0).sum()), stuck(walk),
                    contacts(walk.places))


def check(found: Findings, made: scenarios.Scenario, blind: float) -> None:
    """Asserts that people did what they should, in real time."""
    people = len(made.people)
    assert found.cost < 1, "found people who are slower than real time"
    assert found.speed > made.speeds.mean() / 2, "found people who hardly walk"
    assert found.arrived > people / 2, "found people who do not reach their goals"
    assert found.stuck < people / 100, "found people who are stuck"
    assert found.contact < blind / 20, "found people who do not evade each other"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--people", type=int, default=1000)
    parser.add_argument("--seconds", type=int, default=60)
    given = parser.parse_args()
    print("| rule | s for a simulated second | range | mean speed, m/s | goals reached | stuck | in contact |")
    print("|---|---|---|---|---|---|---|", flush=True)
    hall = {rule: scenarios.scenario("hall", 1, pedestrians=given.people, rule=rule, robot=False)
            for rule in ("pedestrian", "orca")}
    unaware = hall["pedestrian"].scene.text().replace("repulsion=7", "repulsion=0")
    blind = contacts(walked(unaware, given.seconds).places)
    for rule, made in hall.items():
        text = made.scene.text()
        walk = walked(text, given.seconds)
        found = found_in(walk, goals_of(text))
        print(f"| `stage/{rule}` | {found.cost:.3f} | {walk.costs.min():.3f} to {walk.costs.max():.3f} | {found.speed:.2f} "
              f"| {found.goals} by {found.arrived} people | {found.stuck} | {100 * found.contact:.1f} % |", flush=True)
        check(found, made, blind)
    print(f"| no evasion | | | | | | {100 * blind:.1f} % |")


if __name__ == "__main__":
    main()
