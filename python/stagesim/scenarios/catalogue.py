# SPDX-License-Identifier: GPL-2.0-or-later
"""The named scenarios."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from .._checks import integer, shown
from ..scenes import Model, Ranger, Robot, Scene
from .layouts import KINDS, Layout, Maker
from .people import RADIUS
from .scenario import Scenario

MOST_PEOPLE = 100_000
RULES = ("pedestrian", "orca")


def names() -> dict[str, str]:
    """Returns a line about each scenario, by its name."""
    return {name: (kind.add.__doc__ or "").strip() for name, kind in KINDS.items()}


def scenario(name: str, seed: int = 0, *, pedestrians: int | None = None, robot: Robot | bool = True,
             rule: str = "pedestrian") -> Scenario:
    """Makes a scenario. Equal arguments make equal scenes on all machines.

    Desired speeds are normally distributed with a mean of 1.34 m/s and a standard deviation of 0.26 m/s (U. Weidmann,
    Transporttechnik der Fussgaenger, ETH Zuerich, 1993), from 0.5 to 2.2 m/s. At first, nobody touches another.

    Args:
        name: one of names().
        seed: of places, goals and speeds.
        pedestrians: their number; None: that of the scenario.
        robot: True: a disc of 0.5 m with two wheels and a laser, without a controller. A Robot of stagesim.scenes is
            taken instead, with the name "robot" and at the start of the scenario; {goals} in its controllers stands for its
            route as stage/orca reads it, {x} and {y} for its goal. False: none.
        rule: "pedestrian", social forces, or "orca", reciprocal avoidance; see docs/controllers.md.

    Returns:
        The scenario.

    Raises:
        ValueError: unknown names, or more pedestrians than there is room for.
    """
    if name not in KINDS:
        raise ValueError(f"found the scenario {shown(name)}, expected one of: {', '.join(KINDS)}")
    if rule not in RULES:
        raise ValueError(f"found the rule {shown(rule)}, expected one of: {', '.join(RULES)}")
    if not isinstance(robot, (bool, Robot)):
        raise TypeError(f"found the robot {shown(robot)}, expected True, False or a Robot of stagesim.scenes")
    kind = KINDS[name]
    seed = integer(seed, "the seed", 0)
    count = kind.people if pedestrians is None else integer(pedestrians, "the number of pedestrians", 0, MOST_PEOPLE)
    layout = kind.layout(count)
    kind.add(Maker(name, seed, layout, robot is not False), count)
    return _assembled(name, seed, layout, _placed(robot, layout), rule)


def _placed(robot: Robot | bool, layout: Layout) -> Robot | None:
    """The robot at its start, with the route in its controllers."""
    if robot is False:
        return None
    if isinstance(robot, bool):
        laser = Ranger(pose=(0, 0, 0.3, 0), range=(0, 8), fov=math.radians(270), samples=90)
        robot = Robot(size=(0.5, 0.5, 0.5), round=True, drive="diff", color="cyan4", sensors=[laser])
    texts = [robot.ctrl] if isinstance(robot.ctrl, str) else list(robot.ctrl or ())
    route = [f"{number:g}" for place in (*layout.via, layout.goal) for number in place]
    marks = {"{goals}": ",".join(route), "{x}": route[-2], "{y}": route[-1]}
    for mark, value in marks.items():
        texts = [text.replace(mark, value) for text in texts]
    return dataclasses.replace(robot, name="robot", pose=layout.start, ctrl=texts or None)


def _assembled(name: str, seed: int, layout: Layout, robot: Robot | None, rule: str) -> Scenario:
    """The scenario of a layout."""
    people = [person.robot(f"p{i}", rule) for i, person in enumerate(layout.people)]
    robots = people if robot is None else [robot, *people]
    scene = Scene(None, [*layout.walls, *robots, *_metrics(robot, layout)], name=name, quit_time=layout.horizon,
                  resolution=0.05)
    size = (math.nan,) * 2 if robot is None else (0.5, 0.5) if robot.size is None else robot.size[:2]
    radius = max(size) / 2 if robot is not None and robot.round else math.hypot(*size) / 2
    stays = [person.goals[-1] if not person.loop else (math.nan, math.nan) for person in layout.people]
    return Scenario(
        name=name, seed=seed, scene=scene, robot=None if robot is None else "robot", start=layout.start,
        via=layout.via, goal=layout.goal, horizon=layout.horizon, radii=np.array([radius, *[RADIUS] * len(people)]),
        people=tuple(str(person.name) for person in people), goals=np.array(stays).reshape(-1, 2),
        speeds=np.array([person.speed for person in layout.people]),
        gate=None if layout.gate is None else np.array(layout.gate))


def _metrics(robot: Robot | None, layout: Layout) -> list[Model]:
    """Metrics of the world file, which sweeps record."""
    if robot is None:
        return []
    return [Model(model="metric", name=name, properties={"kind": name, "model": "robot", **more}) for name, more in (
        ("time_to_goal", {"goal": layout.goal}), ("distance", {}), ("collisions", {}))]
