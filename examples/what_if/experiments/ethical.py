# SPDX-License-Identifier: GPL-2.0-or-later
"""The ethical robot: it keeps H, who walks towards a hole, from that by getting in the way.

A. F. T. Winfield, C. Blum, W. Liu: Towards an ethical robot: internal models, consequences and ethical action selection.
Towards Autonomous Robotic Systems (TAROS), 2014. H does not see the hole, but evades the robot."""

from __future__ import annotations

from typing import Any

import numpy as np
import stagesim as st
from dynamic_window import DynamicWindow
from robots import Hypotheses, Straight, WhatIf
from tables import Experiment, Row
from trips import NEAR, Command, Floats, Noise, Other, Scene, Seen

HOLE = (0.0, 0.0, 0.4)
SAMPLES, HORIZON, HOLD = 10, 10.0, 0.5
FALL, TOUCH = 1000.0, 100.0  # costs, in metres of the mean distance to the goal
MARGIN = 0.1  # m, around the hole


def scene(seed: int) -> Scene:
    """H comes from the left; the robot begins in front of him, at his side, and would pass by the hole at a distance."""
    random = np.random.default_rng([seed, 2])
    x, y = random.uniform(-4.5, -3.5), random.uniform(-0.3, 0.3)
    h = Other((x, y), (4.0, -0.5 * y), random.uniform(0.3, 0.4), "social force")
    return Scene("open.world", (random.uniform(-2.5, -1.5), random.uniform(-2.2, -1.6), 0), (3.0, -2.0), (h,), hole=HOLE,
                 patience=60)


def plans_of(scene: Scene, seen: Seen) -> Floats:
    """Ways to 6 by 5 places around the hole, and to the goal: turns, straight ways, and stops; shape (p, m, 3)."""
    targets = [np.asarray(scene.goal)]
    targets += [np.array([x, y]) for x in np.linspace(-2, 0.5, 6) for y in np.linspace(-1.2, 1.2, 5)]
    count = round(HORIZON / HOLD)
    plans = np.zeros((len(targets) + 1, count, 3))  # the first one stands
    for plan, target in zip(plans[1:], targets):
        way = target - seen.pose[:2]
        off = np.arctan2(way[1], way[0]) - seen.pose[2]
        off = float(np.arctan2(np.sin(off), np.cos(off)))
        turning = int(abs(off) / (scene.limits.turn * HOLD))  # on the spot; the rest is turned on the way
        driving = min(count - turning, int(np.ceil(np.linalg.norm(way) / (scene.limits.speed * HOLD))))
        plan[:turning, 2] = np.copysign(scene.limits.turn, off)
        plan[turning, 2] = off / HOLD - np.copysign(turning * scene.limits.turn, off)
        plan[turning:turning + driving, 0] = min(scene.limits.speed, np.linalg.norm(way) / (HOLD * max(1, driving)))
    return plans


class Ethical(WhatIf):
    """Chooses by what would happen to H, to itself, and to its own errand, in this order."""

    def decide(self, seen: Seen) -> Command:
        """The beginning of the best plan."""
        self.believe(seen)
        self.seed += 1
        self.plans = plans_of(self.scene, seen)
        self.last = self.engine.choose(self.plans, judge=self.judge, horizon=HORIZON, hold=HOLD, seed=self.seed)
        first = self.plans[self.last.best, 0]
        return float(first[0]), float(first[2])

    def judge(self, futures: Any) -> tuple[Floats, Floats]:
        """Scores of futures, and whether anybody falls or touches the other in them."""
        scene, places = self.scene, futures.poses[..., :2]
        x, y, radius = HOLE
        falls = (np.linalg.norm(places - (x, y), axis=-1) < radius + MARGIN).any((1, 2))
        near = np.linalg.norm(places[:, :, 1] - places[:, :, 0], axis=-1) < scene.radius + scene.other_radius + NEAR
        touches = (futures.stalled[:, :, 0] | futures.stalled[:, :, 1] & near).any(1)
        distance = np.linalg.norm(places[:, :, 0] - scene.goal, axis=-1).mean(1)
        return -distance - FALL * falls - TOUCH * touches, touches | falls


def right(h: Other) -> list[st.Behaviour]:
    """The robot knows where H wants to go, and that he makes way."""
    return [st.Behaviour("social force", 1, h.goal, h.speed)]


def other_rule(h: Other) -> list[st.Behaviour]:
    """H is believed to make way by another rule than his own."""
    return [st.Behaviour("orca", 1, h.goal, h.speed)]


def goes_on(_: Other) -> list[st.Behaviour]:
    """H is believed to make way for nobody."""
    return [st.Behaviour("go on")]


def stands(_: Other) -> list[st.Behaviour]:
    """H is believed to stop."""
    return [st.Behaviour("stand")]


def ethical(noise: Noise, hypotheses: Hypotheses) -> Any:
    """An ethical robot with these hypotheses."""
    return lambda scene, seed: Ethical(scene, noise, hypotheses, seed, SAMPLES if noise.place > 0 else 1)


def noise_of(place: float) -> Noise:
    """Errors of places, with those of velocities and headings that such a tracker has."""
    return Noise(place, place / 2, place)


EXACT, SMALL, LARGE = noise_of(0), noise_of(0.03), noise_of(0.1)
EXPERIMENT = Experiment("The ethical robot", ("robot", "noise, cm"), tuple(
    Row((name, f"{100 * noise.place:g}"), scene, driver, noise) for name, noise, driver in (
        ("straight ahead", EXACT, lambda scene, seed: Straight(scene)),
        ("dynamic window", EXACT, lambda scene, seed: DynamicWindow(scene)),
        ("ethical, right: knows how H walks", EXACT, ethical(EXACT, right)),
        ("ethical, right", SMALL, ethical(SMALL, right)),
        ("ethical, right", LARGE, ethical(LARGE, right)),
        ("ethical, nearly right: H makes way by another rule", SMALL, ethical(SMALL, other_rule)),
        ("ethical, wrong: H goes on", SMALL, ethical(SMALL, goes_on)),
        ("ethical, wrong: H stops", SMALL, ethical(SMALL, stands)))), saves=True)
