# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks that a simulator does the work that is measured: lidars detect agents, agents move, touch and start again."""

from __future__ import annotations

import math
import statistics
import time
from dataclasses import asdict, dataclass

import numpy as np

from .driving import Driver
from .simulators.simulation import Facts, Simulation
from .task import RADIUS, STEP, TOP_SPEED, Floats, Task, exact_ranges, expected_hits

LOOKED_AT = 64  # environments whose episodes are examined
FEWEST = 64  # episodes of agents to examine, however long they take
EPSILON = 1e-4  # metres; a reading that is shorter than the range by more counts as a hit
HITS = (0.7, 3.5)  # permitted fraction of rays that hit something, in units of that at the starts of episodes
ALIKE = 0.25  # permitted relative difference of that fraction between two simulators, plus three standard errors
SAME_HITS = 0.7  # minimum of Sight.same_hits
ERROR = 0.02  # maximum median difference to exact geometry, metres
PATH = 0.3  # minimum mean path of an agent in an episode, in units of that at top speed


class CheckError(Exception):
    """The work is not done; one line says what was found and what was expected."""


@dataclass
class Sight:
    """Summary of some episodes."""

    episodes: int
    hits: float  # fraction of rays that hit something
    hits_error: float  # standard error of that
    same_hits: float  # rays that hit for both the lidar and exact geometry, per ray that hits for one of them
    error: float  # median difference to exact geometry of the rays that hit in both, metres
    path: float  # mean path of an agent in an episode, metres
    collided: float  # fraction of agent-steps in which an agent touches another one
    finite: bool  # all rewards and readings
    reward_spread: float  # standard deviation of the rewards
    resets: int  # episodes begun again
    jump: float  # mean distance between the end of an episode and the start of the next one, metres
    expected: tuple[float, float]  # permitted range of `hits`

    def as_json(self) -> dict[str, object]:
        """Returns it as a dictionary."""
        return asdict(self)


class Look:
    """Collects facts while episodes run."""

    def __init__(self, simulation: Simulation, task: Task) -> None:
        self._simulation, self._task = simulation, task
        self._driver = Driver(simulation, task)
        self._hits: list[float] = []  # of each environment in each episode
        self._both = self._either = 0
        self._errors: list[Floats] = []
        self._rewards: list[Floats] = []
        self._collided: list[float] = []
        self._jumps: list[float] = []  # of each environment at each reset
        self._path, self._steps = 0.0, 0
        self._finite = True

    def episode(self) -> None:
        """Looks at each step of one episode, and at the resets at its end."""
        hits: Floats = np.zeros(min(self._task.envs, LOOKED_AT))
        for _ in range(self._task.episode):
            hits += self._step()
        self._hits += (hits / self._task.episode).tolist()

    def _step(self) -> Floats:
        ended = self._simulation.poses()
        reset = self._driver.begin()
        before = self._simulation.poses()
        if reset is not None:
            self._jumps += np.linalg.norm((before - ended)[reset, :, :2], axis=2).mean(1).tolist()
        facts = self._simulation.facts(self._driver.act())
        after = self._simulation.poses()
        self._path += float(np.linalg.norm((after - before)[..., :2], axis=2).mean())
        self._steps += 1
        self._finite &= bool(np.isfinite(facts.rewards).all() and np.isfinite(facts.ranges).all())
        self._rewards.append(facts.rewards[:LOOKED_AT])
        self._collided.append(float(facts.collided.mean()))
        return self._compare(before if self._simulation.senses_first else after, facts.ranges)

    def _compare(self, poses: Floats, ranges: Floats) -> Floats:
        """Compares readings with exact geometry; returns the fraction of hits in each environment."""
        poses, ranges = poses[:LOOKED_AT], ranges[:LOOKED_AT]
        exact = exact_ranges(poses[..., :2], poses[..., 2], self._task)
        found, true = (reading < self._task.reach - EPSILON for reading in (ranges, exact))
        both = found & true
        self._both += int(both.sum())
        self._either += int((found | true).sum())
        self._errors.append(np.abs(ranges - exact)[both])
        return found.mean((1, 2))

    def sight(self) -> Sight:
        """Summarizes."""
        expected = expected_hits(self._task)
        errors = np.concatenate(self._errors)
        deviation = statistics.stdev(self._hits) if len(self._hits) > 1 else math.inf
        return Sight(
            len(self._hits), statistics.fmean(self._hits), deviation / math.sqrt(len(self._hits)),
            self._both / max(1, self._either), float(np.median(errors)) if errors.size else math.inf,
            self._path / self._steps * self._task.episode, statistics.fmean(self._collided), self._finite,
            float(np.std(self._rewards)), self._driver.resets, statistics.fmean(self._jumps) if self._jumps else 0.0,
            (HITS[0] * expected, min(1.0, HITS[1] * expected)))


def look(simulation: Simulation, task: Task, most_seconds: float = math.inf) -> Sight:
    """Examines at least FEWEST episodes of agents, and more until LOOKED_AT environments were examined or the time is
    over.

    Two rounds of episodes are made at least, so that each environment is reset.
    """
    watched = Look(simulation, task)
    start, rounds = time.perf_counter(), 0
    while True:
        watched.episode()
        rounds += 1
        episodes, late = rounds * task.envs, time.perf_counter() - start >= most_seconds
        if rounds >= 2 and (episodes >= LOOKED_AT or (late and episodes * task.agents >= FEWEST)):
            return watched.sight()


def faults(sight: Sight, task: Task) -> list[str]:
    """Returns what shows that the work is not done, a line each."""
    fewest, most = sight.expected
    least = PATH * TOP_SPEED * STEP * task.episode
    margin = 3 * sight.hits_error
    conditions = [
        (fewest - margin <= sight.hits <= most + margin and sight.hits > 0,
         f"{sight.hits:.2%} of the rays hit something, expected {fewest:.2%} to {most:.2%}"),
        (sight.same_hits >= SAME_HITS,
         f"hits agree with exact geometry by {sight.same_hits:.0%}, expected at least {SAME_HITS:.0%}"),
        (sight.error <= ERROR, f"ranges differ from exact geometry by {sight.error:.3g} m, expected at most {ERROR} m"),
        (sight.path >= least, f"agents move {sight.path:.3g} m in an episode, expected at least {least:.3g} m"),
        (sight.collided > 0, "no agent touches another one"),
        (sight.finite, "rewards or ranges are not finite"),
        (sight.reward_spread > 1e-6, "all rewards are equal"),
        (sight.resets > 0, "no episode begins again"),
        (sight.jump > RADIUS, f"a reset moves agents by {sight.jump:.3g} m, expected more than {RADIUS} m"),
    ]
    return [text for holds, text in conditions if not holds]


def differences(first: Sight, second: Sight) -> list[str]:
    """Returns what shows that two simulators do not see the same scene."""
    permitted = ALIKE * max(first.hits, second.hits) + 3 * math.hypot(first.hits_error, second.hits_error)
    if abs(first.hits - second.hits) <= permitted:
        return []
    return [f"{first.hits:.2%} and {second.hits:.2%} of the rays hit something, expected a difference of at most "
            f"{permitted:.2%}"]


def check_end(result: Facts, task: Task) -> None:
    """Raises CheckError if the last step of a measurement shows no work."""
    if not (np.isfinite(result.rewards).all() and np.isfinite(result.ranges).all()):
        raise CheckError("rewards or ranges after the measurement are not finite")
    if task.envs >= LOOKED_AT and not (result.ranges < task.reach - EPSILON).any():
        raise CheckError("no ray hits anything after the measurement")

