# SPDX-License-Identifier: GPL-2.0-or-later
"""Contacts of robots in simulated runs and in closed forms: gaps to walls, slides along a wall, and pushes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import stagesim as st

RADIUS = 0.2  # m, of round robots; half the width of square ones and of boxes
SKIN = 4e-4  # m, distance of outlines in contact

SLIDE_SPEED = 0.5  # m/s
SLIDE_HEADING = math.pi / 6  # rad, between robot and wall at the start

PUSH_SPEED = 0.1  # m/s
NEEDLE_MASS = 1e6  # kg, so that the box does not hinder the robot that pushes it
# Greatest torque of the floor on a square divided by the greatest force: the mean distance of its points from the
# centre, here for a width of 0.4 m.
SQUARE_ARM = 2 * RADIUS * (math.sqrt(2) + math.asinh(1)) / 6


@dataclass(frozen=True)
class Setting:
    """The settings that the accuracy of contacts may depend on."""

    contacts: str = "outlines"
    cell: float = 0.02  # m
    step: int = 10  # ms

    def world(self, models: str) -> st.World:
        """Returns a world of `models`, which are text of a world file."""
        return st.World.from_text(f'contacts "{self.contacts}"\nresolution {self.cell}\n'
                                  f"interval_sim {self.step}\n{models}", threads=1)


# ---- gaps ----

GAP_SPEEDS = (0.02, 0.6, 1.5)  # m/s
GAP_HEADINGS = 48
GAP_SECONDS = 26  # until the slowest robot has arrived


@dataclass(frozen=True)
class Approach:
    """A robot that drives head-on into a wall of its own."""

    index: int
    speed: float  # m/s
    shape: str
    heading: float  # degrees

    @property
    def way(self) -> float:
        """Distance from the wall at the start in metres, different for each robot."""
        return 0.3 + 0.2 * (self.index * 0.6180339887 % 1)

    def models(self, x: float, y: float) -> str:
        ahead = RADIUS + self.way + 0.1
        angle = math.radians(self.heading)
        wall_x, wall_y = x + ahead * math.cos(angle), y + ahead * math.sin(angle)
        return (f"model( pose [{wall_x:.12f} {wall_y:.12f} 0 {self.heading}] size [0.2 2 1] )\n"
                f"position( {self.shape} size [{2 * RADIUS} {2 * RADIUS} 0.4] pose [{x} {y} 0 {self.heading}] "
                "velocity_bounds [-2 2 -1 1 -1 1 -90 90] alwayson 1 )\n")


def approaches() -> list[Approach]:
    """One for each speed, shape and heading."""
    kinds = [(speed, shape, 360.0 * i / GAP_HEADINGS)
             for speed in GAP_SPEEDS for shape in ("round 1", "round 0") for i in range(GAP_HEADINGS)]
    return [Approach(index, *kind) for index, kind in enumerate(kinds)]


def gaps(setting: Setting) -> np.ndarray:
    """Returns the gaps in metres that all approaches() leave to their walls; negative where outlines overlap."""
    robots = approaches()
    places = np.array([(7.0123 * (i % 17), 7.0123 * (i // 17)) for i in range(len(robots))])
    world = setting.world("".join(robot.models(x, y) for robot, (x, y) in zip(robots, places.tolist())))
    fleet = world.fleet()
    fleet.cmd[:, 0] = [robot.speed for robot in robots]
    world.step(round(1000 * GAP_SECONDS / setting.step))
    driven = np.hypot(*(fleet.pose[:, :2] - places).T)
    return np.array([robot.way for robot in robots]) - driven


# ---- slides ----

@dataclass(frozen=True)
class Slide:
    """The motion of a round robot that drives into a wall with a heading of 30 degrees: since it began, an entry
    per step."""

    times: np.ndarray  # s
    ways: np.ndarray  # m, along the wall
    headings: np.ndarray  # rad, relative to the wall


def slide(setting: Setting, friction: float, seconds: float, gap: float = 0.0) -> Slide:
    """Simulates a slide of a robot that is `gap` metres from being in contact at the start."""
    world = setting.world(
        f'model( name "wall" pose [0 {RADIUS + SKIN + gap + 0.5:.6f} 0 0] size [20 1 1] friction {friction} )\n'
        f'position( name "robot" pose [0 0 0 {math.degrees(SLIDE_HEADING)}] size [{2 * RADIUS} {2 * RADIUS} 0.4] '
        f"round 1 friction {friction} update_interval {setting.step} alwayson 1 )\n")
    fleet = world.fleet()
    fleet.cmd[:, 0] = SLIDE_SPEED
    world.step()  # takes the command
    start = fleet.pose[0].copy()
    rows = [(0.0, 0.0, float(start[2]))]
    for number in range(1, round(1000 * seconds / setting.step) + 1):
        world.step()
        rows.append((number * setting.step / 1000, float(fleet.pose[0, 0] - start[0]), float(fleet.pose[0, 2])))
    return Slide(*np.array(rows).T)


def slide_in_theory(times: np.ndarray, friction: float, gap: float = 0.0) -> Slide:
    """Returns the closed form of slide(), for a robot whose wheels hold it by an ellipsoidal limit surface.

    At the heading a, the wall takes the part n = v sin(a) of the robot's velocity v. Friction m takes the part m n of
    the rest, and turns the robot at the rate m n / r. So tan(a / 2) grows as exp(m v t / r). The robot slides until
    tan(a) = 1 / (2 m). From then on its edge rolls on the wall with v cos(a) / 2, until it faces the wall.
    """
    begin, v, r, m = SLIDE_HEADING, SLIDE_SPEED, RADIUS, friction
    arrival = gap / (v * math.sin(begin))
    free = v * math.cos(begin) * np.minimum(times, arrival)
    after = np.maximum(times - arrival, 0.0)
    if friction == 0.0:
        return Slide(times, free + v * math.cos(begin) * after, np.full_like(times, begin))
    rolls = r / (m * v) * math.log(math.tan(math.atan(1 / (2 * m)) / 2) / math.tan(begin / 2))
    slid = 2 * np.arctan(math.tan(begin / 2) * np.exp(m * v * np.minimum(after, rolls) / r))
    ways = r / m * np.log(np.sin(slid) / math.sin(begin)) - r * (slid - begin)
    log = np.log(np.tan(math.pi / 4 + slid / 2)) + v * np.maximum(after - rolls, 0.0) / (2 * r)
    rolled = 2 * np.arctan(np.exp(log)) - math.pi / 2
    return Slide(times, free + ways + r * (rolled - slid), rolled)


# ---- pushes ----

@dataclass(frozen=True)
class Push:
    """The motion of a square box that a point pushes along x, which sticks to the box beside its centre: an entry per
    step. The box begins at 0."""

    advances: np.ndarray  # m, of the point
    x: np.ndarray  # m
    y: np.ndarray  # m
    turns: np.ndarray  # rad


def push(setting: Setting, offset: float, way: float) -> Push:
    """Simulates a push over `way` metres by the tip of a robot shaped as a needle, `offset` metres to the left of the
    box's centre."""
    start = -RADIUS - SKIN - 0.15
    world = setting.world(
        f'model( name "box" size [{2 * RADIUS} {2 * RADIUS} 0.4] mass 5 friction 20 pushable 1 )\n'
        f'position( name "needle" pose [{start:.6f} {offset} 0 0] size [0.3 0.06 0.4] mass {NEEDLE_MASS:.0f} '
        f"friction 20 update_interval {setting.step} alwayson 1\n"
        "block( points 3 point[0] [1 1] point[1] [0 2] point[2] [0 0] z [0 1] ) )\n")
    fleet, box = world.fleet(), world.model("box")
    fleet.cmd[:, 0] = PUSH_SPEED
    rows = [(0.0, 0.0, 0.0, 0.0)]
    while rows[-1][0] < way - 1e-9:
        world.step()
        rows.append((float(fleet.pose[0, 0]) - start, box.pose[0], box.pose[1], box.pose[2]))
    return Push(*np.array(rows).T)


def push_in_theory(advances: np.ndarray, offset: float) -> Push:
    """Returns the closed form after Lynch and Mason, "Stable pushing: mechanics, controllability, and planning", 1996.

    The contact is at the distance d from the centre, in the direction p from it. A point that sticks and advances
    along x by s turns the box at the rate dp/ds = -d sin(p) / (c^2 + d^2), where c is SQUARE_ARM. So tan(p / 2) falls
    exponentially.
    """
    distance, start = math.hypot(RADIUS, offset), math.atan2(offset, -RADIUS)
    rate = distance / (SQUARE_ARM ** 2 + distance ** 2)
    p = 2 * np.arctan(math.tan(start / 2) * np.exp(-rate * advances))
    return Push(advances, advances - RADIUS - distance * np.cos(p), offset - distance * np.sin(p), p - start)
