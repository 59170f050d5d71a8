# SPDX-License-Identifier: GPL-2.0-or-later
"""The robot that drives straight to its goal, and the one that decides by what-if."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import stagesim as st
from trips import HERE, Command, Floats, Noise, Other, Scene, Seen

Hypotheses = Callable[[Other], list[st.Behaviour]]  #: what the robot believes of somebody


class Straight:
    """Turns to the goal and drives there, whatever is in the way."""

    period = 1

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def decide(self, seen: Seen) -> Command:
        """Drives at full speed if the goal is ahead."""
        way = np.asarray(self.scene.goal) - seen.pose[:2]
        off = np.arctan2(way[1], way[0]) - seen.pose[2]
        off = float(np.arctan2(np.sin(off), np.cos(off)))
        limits = self.scene.limits
        return (limits.speed if abs(off) < 0.5 else 0.0), max(-limits.turn, min(limits.turn, 2 * off))


def plans_of(scene: Scene) -> Floats:
    """Velocities of half a second each: turns and then straight on, and curves to one side and back; shape (p, 5, 3)."""
    fast = scene.limits.speed
    ways: list[list[Command]] = [[(0, 0)]]
    for speed in (fast, fast / 2):
        ways.append([(speed, 0)])
        for turn in (-1.4, -0.9, -0.4, 0.4, 0.9, 1.4):
            ways.append([(speed, turn), (speed, turn), (speed, 0)])
            ways.append([(speed, turn), (speed, turn), (speed, -turn), (speed, -turn), (speed, 0)])
    ways += [[(0, 1.4), (0, 1.4), (fast, 0)], [(0, -1.4), (0, -1.4), (fast, 0)], [(-0.3, 0), (-0.3, 0), (0, 0)]]
    plans = np.zeros((len(ways), 5, 3))
    for plan, way in zip(plans, ways):
        plan[:, [0, 2]] = way + [way[-1]] * (5 - len(way))
    return plans


class WhatIf:
    """Decides twice a second among the plans above, by samples of what it believes."""

    period = 5

    def __init__(self, scene: Scene, noise: Noise, hypotheses: Hypotheses, seed: int, samples: int = 10,
                 horizon: float = 4.0) -> None:
        self.scene, self.noise, self.horizon = scene, noise, horizon
        self.hypotheses = [hypotheses(other) for other in scene.others]
        self.belief = st.Belief(HERE / scene.file, "robot", other_radius=scene.other_radius, room=max(1, len(scene.others)))
        self.engine = st.ConsequenceEngine(self.belief, samples=samples, threads=1)
        self.plans = plans_of(scene)
        self.seed = 1000 * seed  # of the samples of the next decision
        self.last: st.Decision | None = None

    def decide(self, seen: Seen) -> Command:
        """The beginning of the best plan."""
        self.believe(seen)
        self.seed += 1
        try:
            self.last = self.engine.choose(self.plans, self.scene.goal, radius=self.scene.radius, horizon=self.horizon,
                                           hold=0.5, seed=self.seed, tolerance=self.scene.tolerance)
        except st.StageError:  # the pose has errors, so that it may be in a wall
            return 0.0, 0.0
        first = self.plans[self.last.best, 0]
        return float(first[0]), float(first[2])

    def believe(self, seen: Seen) -> None:
        """Tells the belief what was measured."""
        noise = self.noise
        self.belief.set_robot(seen.pose, seen.velocity, np.diag([noise.place, noise.place, noise.heading]) ** 2)
        self.belief.set_others(np.arange(len(seen.others)), seen.others, seen.velocities,
                               np.diag([noise.place, noise.place, 0]) ** 2, np.diag([noise.speed, noise.speed, 0]) ** 2,
                               self.hypotheses)
