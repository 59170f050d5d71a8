# SPDX-License-Identifier: GPL-2.0-or-later
"""Reliability: how often plans collide, among those with the same predicted chance of a collision.

Each decision is about another belief. What then happens is drawn from that belief by NumPy: poses, velocities and
behaviours; the plan is carried out in a World, whose other robots are driven by controllers."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import stagesim as st
from tables import FIRST_SEED, binomial_interval, line_of
from trips import HERE, NEAR, Floats, Scene

SCENE = Scene("open.world", (0, 0, 0), (100, 0), ())
PLANS, STEPS, CONFIDENCE = 5, 30, 0.95
KINDS = ("stand", "go on", "go to", "orca")


class Person(NamedTuple):
    """Somebody, as the robot believes."""

    place: Floats
    velocity: Floats
    place_error: float  # m, standard deviation
    speed_error: float  # m/s
    behaviours: list[st.Behaviour]


class Case(NamedTuple):
    """A belief, and plans."""

    velocity: Floats
    place_error: float
    heading_error: float
    people: list[Person]
    plans: Floats


class Outcome(NamedTuple):
    """Predicted and observed collisions of a plan drawn at random, and of the chosen one."""

    risk: float
    collided: bool
    best_risk: float
    best_collided: bool


def case_of(number: int) -> Case:
    """Draws a belief: up to five people near the robot, most of whom come nearer."""
    random = np.random.default_rng([number, 1])
    people: list[Person] = []
    while len(people) < 1 + number % 5:
        angle, distance = random.uniform(-np.pi, np.pi), random.uniform(1.2, 3)
        place = distance * np.array([np.cos(angle), np.sin(angle)])
        if any(np.linalg.norm(place - person.place) < 1 for person in people):
            continue
        velocity = -place / distance * random.uniform(0, 1) + random.normal(0, 0.3, 2)
        kinds = random.choice(len(KINDS), 1 + len(people) % 2, replace=False)
        goal = place + 4 * velocity + random.normal(0, 0.5, 2)
        behaviours = [st.Behaviour(KINDS[kind], random.uniform(0.2, 1), (goal[0], goal[1]), random.uniform(0.3, 1))
                      for kind in kinds]
        people.append(Person(place, velocity, random.uniform(0.05, 0.4), random.uniform(0.05, 0.4), behaviours))
    plans = np.zeros((PLANS, 3))
    plans[:, 0], plans[:, 2] = random.uniform(0, 0.6, PLANS), random.uniform(-1, 1, PLANS)
    return Case(np.array([random.uniform(0, 0.5), 0, 0]), random.uniform(0, 0.1), random.uniform(0, 0.1), people, plans)


def covariance(believed: float, *deviations: float) -> Floats:
    """The covariance of independent errors."""
    return np.diag(believed * np.array(deviations)) ** 2


def predict(case: Case, samples: int, seed: int, believed: float = 1.0) -> st.Decision:
    """The decision of a robot that believes the errors to be `believed` times as large as they are."""
    belief = st.Belief(HERE / SCENE.file, "robot", other_radius=SCENE.other_radius)
    belief.set_robot(SCENE.start, case.velocity, covariance(believed, case.place_error, case.place_error, case.heading_error))
    n = len(case.people)
    poses, velocities = np.zeros((n, 3)), np.zeros((n, 3))
    poses[:, :2], velocities[:, :2] = [p.place for p in case.people], [p.velocity for p in case.people]
    belief.set_others(np.arange(n), poses, velocities,
                      [covariance(believed, p.place_error, p.place_error, 0) for p in case.people],
                      [covariance(believed, p.speed_error, p.speed_error, 0) for p in case.people],
                      [p.behaviours for p in case.people])
    engine = st.ConsequenceEngine(belief, samples=samples, threads=1)
    return engine.choose(case.plans, SCENE.goal, radius=SCENE.radius, horizon=STEPS * SCENE.interval, seed=seed)


def draw_person(name: str, person: Person, robot: Floats, random: np.random.Generator) -> tuple[str, tuple[float, float, float]]:
    """Draws somebody, who does not stand in the robot: a part of a world file, and a velocity at the beginning."""
    weights = np.array([behaviour.weight for behaviour in person.behaviours])
    behaviour = person.behaviours[random.choice(len(weights), p=weights / weights.sum())]
    vx, vy = person.velocity + person.speed_error * random.normal(size=2)
    while True:
        x, y = person.place + person.place_error * random.normal(size=2)
        if np.hypot(x - robot[0], y - robot[1]) >= SCENE.radius + SCENE.other_radius:
            break
    there = f"x={behaviour.goal[0]} y={behaviour.goal[1]} speed={behaviour.speed}"
    control = {"stand": "stage/behaviour kind=0", "go on": f"stage/behaviour kind=1 vx={vx} vy={vy}",
               "go to": f"stage/behaviour kind=2 {there}", "orca": f"stage/orca {there}"}[behaviour.kind]
    text = (f'position( name "{name}" pose [{x} {y} 0 0] size [0.5 0.5 1.7] round 1 drive "omni" localization "gps" mass 70\n'
            f'  velocity_bounds [-10 10 -10 10 0 0 -573 573] ctrl "{control}" )\n')
    return text, ((0, 0, 0) if behaviour.kind == "stand" else (vx, vy, 0))


def carry_out(case: Case, plan: int, seed: int) -> bool:
    """Whether a plan collides in a world drawn from the belief."""
    random = np.random.default_rng([seed, 2])
    deviations = (case.place_error, case.place_error, case.heading_error)
    robot = SCENE.start + random.normal(size=3) * deviations
    speed = case.velocity[0]
    text = (HERE / SCENE.file).read_text().replace('name "robot"', f'name "robot" velocity [{speed} 0 0 0]')
    drawn = [draw_person(f"other{i}", person, robot, random) for i, person in enumerate(case.people)]
    text += "".join(part for part, _ in drawn)
    world = st.World.from_text(text, str(HERE), threads=1)
    mover, others = world.fleet("robot"), world.fleet("other*")
    mover.teleport(robot)
    mover.cmd[0] = case.plans[plan]
    others.cmd[:] = [velocity for _, velocity in drawn]
    for _ in range(STEPS):
        world.step()
        others.cmd[:] = np.nan  # controllers drive after the first step
        near = np.linalg.norm(others.pose[:, :2] - mover.pose[0, :2], axis=1) < SCENE.radius + SCENE.other_radius + NEAR
        if mover.stalled[0] or (near & others.stalled).any():
            return True
    return False


def outcome_of(number: int, samples: int, believed: float = 1.0) -> Outcome:
    """One decision, and what then happened with a plan drawn at random and with the chosen one."""
    case = case_of(number)
    decision = predict(case, samples, number, believed)
    tried = number % PLANS
    return Outcome(float(decision.risk[tried]), carry_out(case, tried, number), float(decision.risk[decision.best]),
                   carry_out(case, decision.best, number))


class Tenth(NamedTuple):
    """Decisions whose predicted chance is in a tenth."""

    count: int
    predicted: float  # mean
    collided: int
    low: int  # least and greatest number of collisions that agree with the prediction
    high: int

    @property
    def agrees(self) -> bool:
        """Whether the observed number does."""
        return self.low <= self.collided <= self.high


def tenths(risks: Floats, collided: Floats) -> list[Tenth]:
    """Compares predictions with what happened. The probability that any of the ten is outside by luck is at most 5 %."""
    place = np.minimum((risks * 10).astype(int), 9)
    found = []
    for i in range(10):
        n = int((place == i).sum())
        predicted = float(risks[place == i].mean()) if n else (i + 0.5) / 10
        low, high = binomial_interval(n, predicted, (1 - CONFIDENCE) / 10)
        found.append(Tenth(n, predicted, int(collided[place == i].sum()), low, high))
    return found


class Reliability:
    """The experiment."""

    title = "Reliability"
    each, samples = 10, 400

    def tasks(self, seeds: int) -> list[int]:
        """Numbers of the first decisions: ten for each seed."""
        first = FIRST_SEED * self.each
        return list(range(first, first + seeds * self.each, self.each))

    def work(self, task: int, _: float) -> list[Outcome]:
        """Ten decisions."""
        return [outcome_of(number, self.samples) for number in range(task, task + self.each)]

    def table(self, results: dict[Any, list[Outcome]], watts: float) -> list[str]:
        """The lines of the table; `watts` is of no use here."""
        all_of = np.array([outcome for _, some in sorted(results.items()) for outcome in some], float)
        lines = [line_of(["predicted chance", "decisions", "mean", "collisions", "expected", "agrees"]), line_of(["---"] * 6)]
        for i, tenth in enumerate(tenths(all_of[:, 0], all_of[:, 1])):
            lines.append(line_of([f"{i / 10:.1f} to {(i + 1) / 10:.1f}", str(tenth.count), f"{tenth.predicted:.3f}",
                                  f"{tenth.collided}", f"{tenth.low} to {tenth.high}", "yes" if tenth.agrees else "no"]))
        chosen = f"Chosen plans: {100 * all_of[:, 2].mean():.1f} % were predicted to collide, {100 * all_of[:, 3].mean():.1f} % did."
        return [*lines, "", chosen]


EXPERIMENT = Reliability()
