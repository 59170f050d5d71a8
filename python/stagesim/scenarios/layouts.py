# SPDX-License-Identifier: GPL-2.0-or-later
"""The layouts of the scenarios: walls, people, and where the robot starts and goes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from ..scenes import Box
from ..scenes.draws import Draws
from .people import Area, Person, Places, desired_speeds, group_sizes

DOOR = 1.2  # m
Posts = tuple[tuple[float, float], tuple[float, float]]


@dataclass
class Layout:
    """A scenario before it becomes a scene. Lengths are in metres.

    Attributes:
        start: x, y and heading of the robot.
        goal: x and y of its goal.
        horizon: seconds.
        walls: the walls.
        people: the people.
        gate: both posts of a door.
        via: places on the way of the robot.
    """

    start: tuple[float, float, float]
    goal: tuple[float, float]
    horizon: float
    walls: list[Box] = field(default_factory=list)
    people: list[Person] = field(default_factory=list)
    gate: Posts | None = None
    via: tuple[tuple[float, float], ...] = ()

    def wall(self, x0: float, y0: float, x1: float, y1: float, thick: float = 0.2) -> None:
        """Adds a wall along one of the axes."""
        size = (abs(x1 - x0) + thick, abs(y1 - y0) + thick, 2.0)
        self.walls.append(Box(pose=((x0 + x1) / 2, (y0 + y1) / 2, 0), size=size, color="gray40"))

    def room(self, area: Area) -> None:
        """Adds four walls."""
        x0, x1, y0, y1 = area
        for wall in ((x0, y0, x1, y0), (x0, y1, x1, y1), (x0, y0, x0, y1), (x1, y0, x1, y1)):
            self.wall(*wall)


class Maker:
    """Draws the people of a layout."""

    def __init__(self, name: str, seed: int, layout: Layout, has_robot: bool) -> None:
        self.layout = layout
        self.draws = Draws(seed)
        self.starts, self.goals = Places(self.draws, name), Places(self.draws, name)
        if has_robot:
            self.starts.take(*layout.start[:2], 1.2)
            self.goals.take(*layout.goal, 1.2)

    def stream(self, n: int, start: Area, end: Area, via: tuple[tuple[float, float], ...] = (), *, stream: int = 0,
               slow: float = 1.0, looks: bool = True, near: float = 0.6, close: bool = False) -> None:
        """Adds people who start in one area and go to the other one, through the places `via`."""
        for speed in desired_speeds(n, self.draws).tolist():
            goals = (*via, self.goals.one(end))
            self.layout.people.append(Person(self.starts.one(start), goals, speed * slow, stream=stream, looks=looks,
                                             near=near, close=close))


def corridor(make: Maker, n: int) -> None:
    """Two streams meet in a corridor of 4 m; the robot goes with one of them."""
    for y in (-2.1, 2.1):
        make.layout.wall(-10, y, 10, y)
    make.stream((n + 1) // 2, (-9, 0, -1.6, 1.6), (10.5, 15, -2.5, 2.5), stream=0)
    make.stream(n // 2, (0, 9, -1.6, 1.6), (-15, -10.5, -2.5, 2.5), stream=1)


def crossing(make: Maker, n: int) -> None:
    """Two streams cross at right angles in an open place; the robot crosses both."""
    make.stream((n + 1) // 2, (-9, -2, -2.5, 2.5), (8, 13, -3, 3), stream=0, looks=False)
    make.stream(n // 2, (-2.5, 2.5, -9, -2.8), (-3, 3, 8, 13), stream=1, looks=False)


def door(make: Maker, n: int) -> None:
    """A crowd goes through a door of 1.2 m; the robot goes with it."""
    _wall_with_door(make.layout, 5)
    make.stream(n, (-7, -1, -3, 3), (3, 9, -4.5, 4.5), ((0.3, 0),), close=True)


def queue(make: Maker, n: int) -> None:
    """People queue between barriers, wait at a counter for 3 s each and leave; the robot crosses the way of the leavers."""
    for y in (-0.4, 0.4):
        make.layout.wall(-1.5 - 0.8 * n, y, -0.6, y, thick=0.1)
    make.layout.wall(1.0, -0.5, 1.0, 0.5)
    for k, speed in enumerate(desired_speeds(n, make.draws).tolist()):
        place = (-0.9 - 0.8 * k, 0.0)
        make.starts.take(*place, 0.7)
        leave = make.goals.one((-1, 3, -10, -5))
        make.layout.people.append(Person(place, ((0.2, 0), leave), speed, wait=_SERVICE, near=0.25, close=True))


def counterflow(make: Maker, n: int) -> None:
    """People come out of a door of 1.2 m; the robot goes in."""
    _wall_with_door(make.layout, 5)
    make.stream(n, (-7, -1.5, -3, 3), (3, 9, -4.5, 4.5), ((0.3, 0),), close=True)


def overtaking(make: Maker, n: int) -> None:
    """People walk ahead of the robot at 60 % of their desired speeds in a corridor of 3 m."""
    for y in (-1.6, 1.6):
        make.layout.wall(-10, y, 12, y)
    make.stream(n, (-7, 2, -1.1, 1.1), (13, 18, -2.5, 2.5), slow=0.6)


def corner(make: Maker, n: int) -> None:
    """People come around a blind corner of a corridor of 3 m; the robot goes the other way."""
    for wall in ((-8, -1.6, 1.6, -1.6), (-8, 1.6, -1.6, 1.6), (1.6, -1.6, 1.6, 8), (-1.6, 1.6, -1.6, 8)):
        make.layout.wall(*wall)
    make.stream(n, (-1.1, 1.1, 2.5, 7.5), (-13, -9, -2, 2), ((0, 0.3),), near=1.0)


def group(make: Maker, n: int) -> None:
    """Groups of two to four walk abreast towards the robot in a corridor of 5 m."""
    for y in (-2.6, 2.6):
        make.layout.wall(-10, y, 10, y)
    x = 0.0
    for number, size in enumerate(group_sizes(n, make.draws)):
        middle = (2 * make.draws.fractions(1)[0] - 1) * (1.9 - 0.4 * (size - 1))
        speeds = desired_speeds(size, make.draws).tolist()
        for k in range(size):
            y = middle + 0.8 * (k - (size - 1) / 2)
            make.layout.people.append(Person((x, y), ((x - 30, y),), speeds[k], group=(size, k + 1), stream=number))
        x += 2.5


def hall(make: Maker, n: int) -> None:
    """People go about between random places of a hall with four square metres for each; the robot crosses it."""
    side = _side_of_hall(n)
    make.layout.room((-side, side, -side, side))
    area = (-side + 1, side - 1, -side + 1, side - 1)
    for speed in desired_speeds(n, make.draws).tolist():
        u = make.draws.fractions(4, 2)
        goals = tuple((area[0] + x * (area[1] - area[0]), area[2] + y * (area[3] - area[2])) for x, y in u.tolist())
        make.layout.people.append(Person(make.starts.one(area), goals, speed, loop=True, near=1.0))


def evacuation(make: Maker, n: int) -> None:
    """People who are everywhere in a room leave it through a door of 1.2 m, and the robot, too."""
    _wall_with_door(make.layout, 5)
    for wall in ((-10, -5, 0, -5), (-10, 5, 0, 5), (-10, -5, -10, 5)):
        make.layout.wall(*wall)
    make.stream(n, (-9.4, -0.6, -4.4, 4.4), (3, 12, -6, 6), ((0.3, 0),), close=True)


def passage(make: Maker, n: int) -> None:
    """People meet in a passage of 1.6 m between two rooms; the robot goes through it."""
    for y in (-0.9, 0.9):
        make.layout.wall(-3, y, 3, y)
        for x in (-3, 3):
            make.layout.wall(x, y, x, math.copysign(5, y))
    make.stream((n + 1) // 2, (-9, -3.8, -2, 2), (4, 10, -4, 4), ((-2.6, 0), (3.2, 0)), stream=0, near=0.8, close=True)
    make.stream(n // 2, (3.8, 9, -2, 2), (-10, -4, -4, 4), ((2.6, 0), (-3.2, 0)), stream=1, near=0.8, close=True)


def _wall_with_door(layout: Layout, far: float) -> None:
    """A wall at x = 0 with a door in the middle."""
    for side in (-1, 1):
        layout.wall(0, side * (DOOR / 2 + 0.1), 0, side * far)
    layout.gate = ((0, DOOR / 2), (0, -DOOR / 2))


def _side_of_hall(n: int) -> float:
    """Half of the side of a hall."""
    return max(6.0, math.sqrt(n))


_SERVICE = 3.0  # s at the counter


@dataclass(frozen=True)
class Kind:
    """How to make a scenario: its function that adds people, how many there are, and the robot's way."""

    add: Callable[[Maker, int], None]
    people: int
    start: tuple[float, float, float]
    goal: tuple[float, float]
    via: tuple[tuple[float, float], ...] = ()
    horizon: float = 60.0

    def layout(self, n: int) -> Layout:
        """The layout without people."""
        start, goal = self.start, self.goal
        if self.add is hall:
            far = _side_of_hall(n) - 1
            start, goal = (-far, -far, math.pi / 4), (far, far)
        return Layout(start, goal, self.horizon, via=self.via)


KINDS = {kind.add.__name__: kind for kind in (
    Kind(corridor, 20, (-9.4, 0, 0), (9, 0)),
    Kind(crossing, 20, (-6, -6, math.pi / 4), (6, 6)),
    Kind(door, 20, (-8, 0, 0), (4, 0), ((0.3, 0),)),
    Kind(queue, 8, (-6, -3.5, 0), (6, -3.5)),
    Kind(counterflow, 12, (5, 0, math.pi), (-6, 0), ((-0.3, 0),)),
    Kind(overtaking, 8, (-9, 0, 0), (10, 0)),
    Kind(corner, 8, (-7, 0, 0), (0, 7), ((0, 0),)),
    Kind(group, 9, (-8, 0, 0), (8, 0)),
    Kind(hall, 40, (0, 0, 0), (0, 0)),
    Kind(evacuation, 40, (-5, 0, 0), (5, 0), ((0.3, 0),), 90.0),
    Kind(passage, 8, (-6, 0, 0), (6, 0), ((-2.6, 0), (3.2, 0))),
)}
