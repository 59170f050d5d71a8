#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Chain formation, after Nouyan and Dorigo (2006).

Robots that hear no further than a metre connect a nest with a prey: they stand in a row, each within hearing of the
next. Explorers drive along the row and join at its end; the last one leaves now and then, so that the row is rebuilt
elsewhere if it has missed the prey.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import stagesim as st
from experiment import Axis, Column, Effect, Floats, Study, Table, main, sets_of, sweep_of
from stagesim.reports.plots import BLUE, GREEN, ORANGE, RED

Numbers = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

REACH = 1.0  #: of a radio, metres
PREY, HIGHEST = 255, 250  #: numbers in messages
NEAR = 0.3  #: metres from the nest: a robot has come back
MARGIN = 0.9  #: of the reach, where explorers turn back
EXPLORES, IS_MEMBER, RETURNS, DEPARTS, STANDS = range(5)


class Heard:
    """The messages that robots have received in a step. Each is an index; -1 is none."""

    def __init__(self, messages: st.Messages, robots: int) -> None:
        self.robots, self.receiver = robots, messages.receiver
        some = messages.payload if len(messages.receiver) else np.zeros((0, 2), np.uint8)
        self.number, self.is_connected = some[:, 0].astype(int), some[:, 1] > 0
        self.range, self.bearing = messages.range, messages.bearing

    def nearest(self, wanted: Numbers | int) -> Numbers:
        """The nearest message with the number that each robot wants."""
        chosen = np.flatnonzero(self.number == np.broadcast_to(wanted, self.robots)[self.receiver])
        found = np.full(self.robots, -1)
        found[self.receiver[chosen[::-1]]] = chosen[::-1]
        return found

    def extreme(self, sign: int) -> Numbers:
        """The nearest of the messages with the highest (1) or lowest (-1) number."""
        members = self.number <= HIGHEST
        number = np.full(self.robots, -1000)
        np.maximum.at(number, self.receiver[members], sign * self.number[members])
        return self.nearest(sign * number)

    def of(self, values: npt.NDArray[Any], message: Numbers) -> npt.NDArray[Any]:
        """The values of messages; 0 for none."""
        return np.append(values, np.zeros(1, values.dtype))[message]

    def place(self, message: Numbers) -> Floats:
        """The places of senders in the frames of the receivers: shape (2, n)."""
        reach, bearing = self.of(self.range, message), self.of(self.bearing, message)
        return np.array([reach * np.cos(bearing), reach * np.sin(bearing)])


class Controller:
    """Drives as examples/ctrl/chain.cc does, with other random numbers."""

    def __init__(self, world: st.World, join: float = 0.05, leave: float = 0.005, distance: float = 0.7,
                 speed: float = 0.2, turn: float = 2) -> None:
        self.robots = world.fleet()
        self.robots.messages()  # subscribes
        self.join, self.leave, self.distance, self.speed, self.turn = join, leave, distance, speed, turn
        self.number = np.array([PREY if name == "prey" else 0 for name in self.robots.names])
        self.state = np.array([STANDS if name in ("nest", "prey") else EXPLORES for name in self.robots.names])
        self.is_connected = np.zeros(len(self.robots), bool)
        self.random = np.random.default_rng(world.seed)

    def explore(self, who: Flags, heard: Heard, wander: Floats) -> Floats:
        """Lets explorers join; returns the bearings into which the others drive."""
        last = heard.extreme(1)
        number = heard.of(heard.number, last)
        before = heard.nearest(number - 1)
        may_join = who & (last >= 0) & (number < HIGHEST)
        distance = heard.of(heard.range, last)
        is_beyond = (before < 0) & (distance >= self.distance)
        chance = self.random.uniform(size=len(who)) < self.join
        joins = may_join & ((heard.nearest(PREY) >= 0) | (is_beyond & chance))
        self.state[joins], self.number[joins], self.is_connected[joins] = IS_MEMBER, number[joins] + 1, False
        end = heard.place(last)
        along = end - heard.place(before)
        beyond = end + self.distance * along / np.maximum(np.hypot(*along), 1e-9)
        back = np.where(distance > MARGIN * REACH, heard.of(heard.bearing, last), wander)
        return np.where(may_join, np.where(before >= 0, np.arctan2(beyond[1], beyond[0]), back), wander)

    def stay(self, who: Flags, heard: Heard) -> None:
        """Members find out whether they are connected to the prey; some leave."""
        following = heard.nearest(self.number + 1)
        connected = (heard.nearest(PREY) >= 0) | heard.of(heard.is_connected, following)
        self.is_connected[who] = connected[who]
        chance = self.random.uniform(size=len(who)) < self.leave
        leaves = (following < 0) & ~connected & chance | (heard.nearest(self.number - 1) < 0)
        self.state[who & leaves] = RETURNS

    def step(self) -> None:
        heard = Heard(self.robots.messages(), len(self.robots))
        explores, is_member, returns, departs = (self.state == state for state in range(4))
        wander = 0.5 * self.random.uniform(-1, 1, len(self.robots))
        aim = np.where(explores, self.explore(explores, heard, wander), wander)
        self.stay(is_member, heard)
        lowest, nest = heard.extreme(-1), heard.nearest(0)
        aim = np.where(returns & (lowest >= 0), heard.of(heard.bearing, lowest), aim)
        nest_range = np.where(nest >= 0, heard.of(heard.range, nest), np.inf)
        self.state[returns & (lowest >= 0) & (nest_range < NEAR)] = DEPARTS
        self.state[departs & (nest_range >= self.distance)] = EXPLORES
        self.drive(aim)

    def drive(self, aim: Floats) -> None:
        """Drives into directions, seen from the robots, and lets members and the nest tell their numbers."""
        stalled = self.robots.stalled
        stands = (self.state == IS_MEMBER) | (self.state == STANDS)
        forward = np.where(stalled | (np.abs(aim) < 1), self.speed, 0)
        turn = np.where(stalled, self.turn, np.clip(2 * aim, -self.turn, self.turn))
        self.robots.cmd[:, 0] = np.where(stands, 0, forward)
        self.robots.cmd[:, 2] = np.where(stands, 0, turn)
        self.robots.send(np.stack([self.number, self.is_connected], 1)[stands].astype(np.uint8), stands)


class Measure:
    """Whether robots that stand connect the nest with the prey at the end, since when, and how many stand."""

    def __init__(self, world: st.World) -> None:
        self.world, self.robots = world, world.fleet()
        self.nest, self.prey = (self.robots.names.index(name) for name in ("nest", "prey"))
        self.since = np.nan

    def is_connected(self) -> bool:
        """True if chains of distances within the reach of a radio connect the nest with the prey."""
        stands = ~self.robots.velocity[:, [0, 2]].any(1)
        places = self.robots.pose[:, :2]
        near = np.hypot(*(places[:, None] - places).transpose(2, 0, 1)) < REACH
        near &= stands[:, None] & stands
        for _ in range(int(np.ceil(np.log2(len(places))))):
            near = near @ near
        return bool(near[self.nest, self.prey])

    def step(self) -> None:
        if self.world.steps % 10 == 0:
            if not self.is_connected():
                self.since = np.nan
            elif np.isnan(self.since):
                self.since = self.world.time

    def result(self) -> dict[str, float]:
        stands = int((~self.robots.velocity[:, [0, 2]].any(1)).sum()) - 2
        return {"connected": float(np.isfinite(self.since)), "since": self.since, "members": stands}


BOTS, DISTANCES = (2, 4, 8, 16, 32), (2, 3.5, 5, 6.5)


def distance_of(pose: str) -> float:
    """The distance of the prey from the nest for a setting such as "[0.5 0 0 0]"."""
    return float(pose.strip("[]").split()[0]) + 3


def draw(table: Table, figure: Any) -> None:
    """Draws the share of runs that connect nest and prey, and how long it takes, over the number of robots."""
    panels = figure.subplots(1, 2)
    for distance, color in zip(DISTANCES, (GREEN, BLUE, ORANGE, RED)):
        sets = [(bots, chosen) for (pose, bots), chosen in sets_of(table, ["prey.pose", "bots"])
                if distance_of(pose) == distance]
        look = {"marker": "o", "markersize": 4, "color": color, "label": f"{distance:g} m"}
        panels[0].plot([bots for bots, _ in sets], [table["connected"][chosen].mean() for _, chosen in sets], **look)
        ready = [(bots, np.nanmedian(table["since"][chosen])) for bots, chosen in sets if table["connected"][chosen].any()]
        panels[1].plot(*zip(*ready), **look)
    for panel in panels:
        panel.set(xscale="log", xlabel="robots", xticks=BOTS, xticklabels=BOTS)
        panel.minorticks_off()
    panels[0].set(ylabel="runs with a connection", ylim=(-0.03, 1.05))
    panels[1].set(ylabel="seconds until it is there", ylim=(0, None))
    panels[0].legend(title="distance of the prey", loc=(0.02, 0.22))


STUDY = Study(
    name="chain",
    sweep=sweep_of("chain", {"prey.pose": [f"[{distance - 3:g} 0 0 0]" for distance in DISTANCES], "bots": BOTS}),
    controller=Controller,
    measure=Measure,
    effect=Effect("connected", 0.5, {"prey.pose": "[-1 0 0 0]", "bots": 48},
                  {"prey.pose": "[-1 0 0 0]", "bots": 48, "bot.ctrl": "chain join=0"}, seconds=60, tolerance=None),
    axes=[Axis("prey.pose", "distance, m", lambda pose: f"{distance_of(pose):g}"), Axis("bots", "robots")],
    columns=[Column("connected", "runs with a connection, mean", mean=True), Column("since", "there after, s", 0),
             Column("members", "robots in chains", 0)],
    draw=draw)

if __name__ == "__main__":
    main(STUDY)
