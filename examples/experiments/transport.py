#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Transport by a swarm, after Chen, Gauci, Li, Kolling and Gross (2015).

Robots push a box to a light. Each one pushes where the box hides the light. It drives around the box where it sees the
light, and now and then if it pushes in vain. A box that one robot cannot move needs several, and more the heavier it is.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import stagesim as st
from experiment import Axis, Column, Effect, Floats, Study, Table, main, sets_of, sweep_of
from stagesim.reports.plots import GREEN, RED

Flags = npt.NDArray[np.bool_]

VICINITY = 0.5  #: metres beyond `distance`: from there on a robot drives around
DETOUR = 50  #: steps that a restless robot drives around
AHEAD = 0.8  #: radians: a robot drives into directions that are nearer to ahead
ARRIVED = 0.75  #: metres, of the middle of the box from the light


class Controller:
    """Drives as examples/ctrl/transport.cc does, with other random numbers."""

    def __init__(self, world: st.World, distance: float = 1.15, speed: float = 0.3, turn: float = 2,
                 restless: float = 0.003) -> None:
        self.robots = world.fleet()
        self.box = self.robots.fiducials(most=1)
        self.light = self.robots.sensor("lightsensor").intensity
        self.distance, self.speed, self.turn, self.restless = distance, speed, turn, restless
        self.random = np.random.default_rng(world.seed)
        self.side = self.random.choice([-1, 1], len(self.robots))
        self.detour = np.zeros(len(self.robots), int)

    def evades(self, reach: Floats) -> Flags:
        """True for robots that drive around the box instead of to it."""
        sees_light, is_near = self.light[:, 0] > 0, reach < self.distance + VICINITY
        evades = is_near & (sees_light | (self.detour > 0))
        tires = is_near & ~evades & self.robots.stalled & (self.random.uniform(size=len(reach)) < self.restless)
        self.detour[is_near] = np.maximum(self.detour[is_near] - 1, 0)
        self.detour[tires] = DETOUR
        self.side[tires] = self.random.choice([-1, 1], tires.sum())
        return evades

    def step(self) -> None:
        reach, bearing = self.box.range[:, 0], self.box.bearing[:, 0]
        inwards = np.clip(2 * (reach - self.distance), -1, 1)
        around = bearing - self.side * (np.pi / 2 - 0.8 * inwards)
        aim = (np.where(self.evades(reach), around, bearing) + np.pi) % (2 * np.pi) - np.pi
        sees = self.box.count > 0
        self.robots.cmd[:, 0] = np.where(sees & (np.abs(aim) < AHEAD), self.speed, 0)
        self.robots.cmd[:, 2] = np.where(sees, np.clip(2 * aim, -self.turn, self.turn), 0)


class Measure:
    """Whether the box has come to the light, after what time, and how far it was moved towards the light."""

    def __init__(self, world: st.World) -> None:
        self.world, self.box = world, world.model("box")
        self.goal = np.array(world.model("goal").pose[:2])
        self.seconds = np.nan
        self.first = self.nearest = self.distance()

    def distance(self) -> float:
        """That of the box from the light."""
        return float(np.hypot(*(self.goal - self.box.pose[:2])))

    def step(self) -> None:
        if self.nearest > ARRIVED:
            self.nearest = min(self.nearest, self.distance())
            if self.nearest <= ARRIVED:
                self.seconds = self.world.time

    def result(self) -> dict[str, float]:
        return {"arrived": float(self.nearest <= ARRIVED), "seconds": self.seconds, "moved": self.first - self.nearest}


BOTS, MASSES = (1, 2, 4, 8, 12), (10, 30)
WITHOUT = "transport distance=0"  #: never drives around the box


def draw(table: Table, figure: Any) -> None:
    """Draws the share of boxes that arrive, and the median of their times, over the number of robots."""
    panels = figure.subplots(1, 2)
    for mass, color in zip(MASSES, (GREEN, RED)):
        for ctrl, line, text in (("transport", "-", f"{mass} kg"), (WITHOUT, ":", f"{mass} kg, never around it")):
            sets = [(bots, chosen) for (found, kilograms, bots), chosen in sets_of(table, ["bot.ctrl", "box.mass", "bots"])
                    if (found, kilograms) == (ctrl, mass)]
            look = {"marker": "o", "markersize": 4, "color": color, "linestyle": line, "label": text}
            panels[0].plot([bots for bots, _ in sets], [table["arrived"][chosen].mean() for _, chosen in sets], **look)
            times = [(bots, np.nanmedian(table["seconds"][chosen])) for bots, chosen in sets if table["arrived"][chosen].any()]
            if ctrl != WITHOUT:
                panels[1].plot(*zip(*times), **look)
    panels[0].set(xlabel="robots", ylabel="boxes that arrive", ylim=(-0.03, 1.05))
    panels[1].set(xlabel="robots", ylabel="seconds, of boxes that arrive", ylim=(0, None))
    panels[0].legend(loc=(0.38, 0.15))


STUDY = Study(
    name="transport",
    sweep=sweep_of("transport", {"bot.ctrl": ["transport", WITHOUT], "box.mass": MASSES, "bots": BOTS}),
    controller=Controller,
    measure=Measure,
    effect=Effect("arrived", 0.5, {"box.mass": 10, "bots": 8}, {"box.mass": 10, "bots": 8, "bot.ctrl": WITHOUT},
                  seconds=70, tolerance=None),
    axes=[Axis("bot.ctrl", "drive around", lambda ctrl: "no" if ctrl == WITHOUT else "yes"),
          Axis("box.mass", "mass of the box, kg"), Axis("bots", "robots")],
    columns=[Column("arrived", "boxes that arrive, mean", mean=True), Column("seconds", "arrive after, s", 0),
             Column("moved", "nearer to the light, m")],
    draw=draw)

if __name__ == "__main__":
    main(STUDY)
