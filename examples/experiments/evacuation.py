#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Evacuation through a door by social forces: the flow over the width, as measured by Seyfried and others (2009).

People walk to a door and on behind it. They evade each other and the walls by the forces of Helbing and Molnar (1995).
The flow through the door grows with its width nearly on a straight line.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import stagesim as st
from experiment import Axis, Column, Effect, Floats, Study, Table, draw_quartiles, main, sets_of, sweep_of
from stagesim.reports.plots import BLUE, GREY

DOOR = 4.1  #: x of the wall with the door, metres
GOALS = np.array([[4.3, 0.0], [12.0, 0.0]])  #: in the door and behind it, metres
FAR = 10  #: repulsion ends at this multiple of its decay
SIGHT = np.cos(np.radians(100))  #: half of a field of view of 200 degrees


def angle(numbers: Floats) -> Floats:
    """Equivalent angles from -pi to pi."""
    return (numbers + np.pi) % (2 * np.pi) - np.pi


class Controller:
    """Walks as the controller stage/pedestrian of the library does, which kernels/row_pedestrian.h has in C++."""

    def __init__(self, world: st.World, speed: float = 1.34, radius: float = 0.2, repulsion: float = 5,
                 reach: float = 0.3, wall: float = 5, wall_reach: float = 0.1, time: float = 0.5, behind: float = 0.5,
                 near: float = 0.6, turn: float = 3) -> None:
        self.world, self.people = world, world.fleet()
        self.eye = self.people.ranger()
        self.ranges, self.bearings = self.eye.ranges, self.eye.bearings
        self.speed, self.radius, self.time, self.behind, self.near, self.turn = speed, radius, time, behind, near, turn
        self.repulsion, self.reach, self.wall, self.wall_reach = repulsion, reach, wall, wall_reach
        self.walk = np.zeros((len(self.people), 2))
        self.goal = np.zeros(len(self.people), int)

    def repel(self, way: Floats, touch: float, strength: float, reach: float, towards: Floats) -> Floats:
        """The sum of forces from things that lie in directions `way`, shape (n, things, 2). Those at NaN have none."""
        distance = np.hypot(way[..., 0], way[..., 1])
        force = strength * np.exp((touch - distance) / reach)
        force = np.where((way * towards[:, None]).sum(2) < SIGHT * distance, self.behind * force, force)
        force = np.where((distance > 0) & (distance <= touch + FAR * reach), force / np.maximum(distance, 1e-12), 0)
        return -(force[..., None] * np.nan_to_num(way)).sum(1)

    def walls(self, places: Floats, heading: Floats) -> Floats:
        """The nearest points that people see and that are no people, seen from them: shape (n, rays, 2); NaN: none."""
        wide = np.pad(self.ranges, ((0, 0), (1, 1)), constant_values=np.inf)
        nearest = (self.ranges < wide[:, :-2]) & (self.ranges <= wide[:, 2:]) & (self.ranges < self.ranges.max())
        direction = self.bearings + heading[:, None]
        seen = self.ranges[..., None] * np.stack([np.cos(direction), np.sin(direction)], 2)
        who, ray = np.nonzero(nearest)
        apart = np.hypot(*(places - (places[who] + seen[who, ray])[:, None]).transpose(2, 0, 1))
        apart[np.arange(len(who)), who] = np.inf
        of_people = (apart < 1.5 * self.radius).any(1)
        nearest[who[of_people], ray[of_people]] = False
        seen[~nearest] = np.nan
        return seen

    def step(self) -> None:
        pose = self.people.sensed_pose
        places, heading = pose[:, :2], pose[:, 2]
        way = GOALS[self.goal] - places
        self.goal[(self.goal == 0) & (np.hypot(*way.T) <= self.near)] = 1
        way = GOALS[self.goal] - places
        towards = way / np.maximum(np.hypot(*way.T), 1e-12)[:, None]
        force = self.repel(places - places[:, None], 2 * self.radius, self.repulsion, self.reach, towards)
        force += self.repel(self.walls(places, heading), self.radius, self.wall, self.wall_reach, towards)
        walk = np.where(self.people.stalled[:, None], 0, self.walk)
        walk += self.world.dt * ((towards * self.speed - walk) / self.time + force)
        walk *= np.minimum(1, 1.3 * self.speed / np.maximum(np.hypot(*walk.T), 1e-12))[:, None]
        self.walk = walk
        direction = angle(np.arctan2(walk[:, 1], walk[:, 0]) - heading)
        self.people.cmd[:, :2] = np.hypot(*walk.T)[:, None] * np.stack([np.cos(direction), np.sin(direction)], 1)
        self.people.cmd[:, 2] = np.clip(2 * direction, -self.turn, self.turn)


class Measure:
    """The flow, which is that of the middle half of the people, and when all are out."""

    def __init__(self, world: st.World) -> None:
        self.world, self.people = world, world.fleet()
        self.times = np.full(len(self.people), np.inf)

    def step(self) -> None:
        leaves = np.isinf(self.times) & (self.people.pose[:, 0] > DOOR)
        self.times[leaves] = self.world.time

    def result(self) -> dict[str, float]:
        n, times = len(self.times), np.sort(self.times)
        first, last = n // 4, 3 * n // 4
        flow = (last - first) / (times[last] - times[first]) if np.isfinite(times[last]) else np.nan
        return {"flow": float(flow), "out": float(np.isfinite(times).mean()),
                "seconds": float(times[-1]) if np.isfinite(times[-1]) else np.nan}


WIDTHS = (0.8, 0.9, 1, 1.1, 1.2, 1.4, 1.6, 1.8)  #: of the door, metres


def width_of(size: str) -> float:
    """The width of the door for a setting such as "[0.2 5 1.5]"."""
    return 6 - float(size.strip("[]").split()[1])


def draw(table: Table, figure: Any) -> None:
    """Draws the flow and the time until all are out over the width of the door, and a line through the flows."""
    sets = [(width_of(size), chosen) for (size,), chosen in sets_of(table, ["post.size"])]
    widths = np.array([width for width, _ in sets])
    panels = figure.subplots(1, 2)
    for panel, metric in zip(panels, ("flow", "seconds")):
        draw_quartiles(panel, widths, [table[metric][chosen] for _, chosen in sets], color=BLUE, label="runs")
    slope, offset = np.polyfit(widths, [np.median(table["flow"][chosen]) for _, chosen in sets], 1)
    text = f"{slope:.2f} per metre beyond {-offset / slope:.2f} m"
    panels[0].plot(widths, slope * widths + offset, "--", color=GREY, label=text)
    panels[0].legend()
    panels[0].set(xlabel="width of the door (m)", ylabel="persons per second", ylim=(0, None))
    panels[1].set(xlabel="width of the door (m)", ylabel="seconds until all are out", ylim=(0, None))


STUDY = Study(
    name="evacuation",
    sweep=sweep_of("evacuation", {"post.size": [f"[0.2 {6 - width:g} 1.5]" for width in WIDTHS]}),
    controller=Controller,
    measure=Measure,
    effect=Effect("flow", 1.6, {"post.size": "[0.2 4.4 1.5]", "bots": 30}, {"post.size": "[0.2 5.1 1.5]", "bots": 30},
                  seconds=28, tolerance=None),
    axes=[Axis("post.size", "width of the door, m", lambda size: f"{width_of(size):g}")],
    columns=[Column("flow", "persons per second"), Column("seconds", "all out after, s", 0)],
    draw=draw,
    built_in="stage/pedestrian")

if __name__ == "__main__":
    main(STUDY)
