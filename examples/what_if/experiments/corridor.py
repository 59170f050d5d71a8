# SPDX-License-Identifier: GPL-2.0-or-later
"""The corridor: somebody comes towards the robot, who may make way or not."""

from __future__ import annotations

import numpy as np
import stagesim as st
from dynamic_window import DynamicWindow
from robots import Straight, WhatIf
from tables import Experiment, Row
from trips import Noise, Other, Scene

NOISE = Noise(place=0.05, heading=0.02, speed=0.05)
WALLS = (((-16.0, 1.0), (8.0, 1.0)), ((-16.0, -1.0), (8.0, -1.0)))
SAMPLES, HORIZON = 30, 3.0


def scene(seed: int, kind: str) -> Scene:
    """Both begin at random places of the width, 8 m from each other."""
    random = np.random.default_rng([seed, 2])
    mine, start, goal = random.uniform(-0.5, 0.5, 3)
    other = Other((4, start), (-12, goal), random.uniform(0.4, 0.7), kind)
    return Scene("corridor.world", (-4, mine, 0), (4, 0), (other,), WALLS, patience=60)


def goes_on(_: Other) -> list[st.Behaviour]:
    """Nobody makes way."""
    return [st.Behaviour("go on")]


def makes_way(other: Other) -> list[st.Behaviour]:
    """Everybody makes way."""
    return [st.Behaviour("orca", 1, other.goal, other.speed)]


def unsure(other: Other) -> list[st.Behaviour]:
    """The one is as likely as the other."""
    return goes_on(other) + makes_way(other)


ROBOTS = (
    ("straight ahead", lambda scene, seed: Straight(scene)),
    ("dynamic window", lambda scene, seed: DynamicWindow(scene)),
    ("what-if: the other goes on", lambda scene, seed: WhatIf(scene, NOISE, goes_on, seed, SAMPLES, HORIZON)),
    ("what-if: goes on or makes way", lambda scene, seed: WhatIf(scene, NOISE, unsure, seed, SAMPLES, HORIZON)),
    ("what-if: makes way", lambda scene, seed: WhatIf(scene, NOISE, makes_way, seed, SAMPLES, HORIZON)))
OTHERS = (("goes straight on", lambda seed: scene(seed, "go to")), ("makes way", lambda seed: scene(seed, "orca")))

EXPERIMENT = Experiment("The corridor", ("the other", "robot"), tuple(
    Row((other, robot), of, driver, NOISE) for other, of in OTHERS for robot, driver in ROBOTS))
