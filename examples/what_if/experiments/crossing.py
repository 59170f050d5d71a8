# SPDX-License-Identifier: GPL-2.0-or-later
"""The crossing: 20 pedestrians cross the robot's way, of whom half look at their telephones and make way for nobody."""

from __future__ import annotations

import numpy as np
import stagesim as st
from dynamic_window import DynamicWindow
from robots import Straight, WhatIf
from tables import Experiment, Row
from trips import Noise, Other, Scene

NOISE = Noise(place=0.05, heading=0.02, speed=0.05)
PEDESTRIANS, HORIZON = 20, 3.0


def scene(seed: int) -> Scene:
    """Two streams of pedestrians, from both sides of the robot's way."""
    random = np.random.default_rng([seed, 2])
    others: list[Other] = []
    while len(others) < PEDESTRIANS:
        side = 1 if len(others) % 2 else -1
        x, y = random.uniform(-3.5, 3.5), side * random.uniform(1, 10)
        if all(np.hypot(x - other.start[0], y - other.start[1]) > 0.8 for other in others):
            kind = "social force" if len(others) % 4 < 2 else "go to"
            others.append(Other((x, y), (x + random.uniform(-1, 1), -side * 14), random.uniform(0.7, 1.3), kind))
    return Scene("open.world", (-5, 0, 0), (5, 0), tuple(others), patience=60)


def right(other: Other) -> list[st.Behaviour]:
    """The robot knows who makes way."""
    return [st.Behaviour(other.kind, 1, other.goal, other.speed)]


def unsure(other: Other) -> list[st.Behaviour]:
    """The robot knows that half of them make way, but not who."""
    return [st.Behaviour("social force", 1, other.goal, other.speed), st.Behaviour("go to", 1, other.goal, other.speed)]


def all_make_way(other: Other) -> list[st.Behaviour]:
    """The robot trusts everybody."""
    return [st.Behaviour("social force", 1, other.goal, other.speed)]


def nobody_moves(_: Other) -> list[st.Behaviour]:
    """The robot takes pedestrians for pillars."""
    return [st.Behaviour("stand")]


def what_if(hypotheses, samples: int):
    """A robot with these hypotheses."""
    return lambda scene, seed: WhatIf(scene, NOISE, hypotheses, seed, samples, HORIZON)


EXPERIMENT = Experiment("A crossing with 20 pedestrians", ("robot",), tuple(Row((name,), scene, driver, NOISE) for name, driver in (
    ("straight ahead", lambda scene, seed: Straight(scene)),
    ("dynamic window", lambda scene, seed: DynamicWindow(scene)),
    ("what-if, right: knows who makes way", what_if(right, 10)),
    ("what-if, unsure: each may make way or not", what_if(unsure, 10)),
    ("what-if, wrong: all make way", what_if(all_make_way, 10)),
    ("what-if, wrong: all stand", what_if(nobody_moves, 10)))))

SAMPLES = Experiment("The crossing with 1, 10 and 100 samples", ("samples",), tuple(
    Row((str(samples),), scene, what_if(unsure, samples), NOISE) for samples in (1, 10, 100)))
