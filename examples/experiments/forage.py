#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Foraging with trails, after Beekman, Sumpter and Ratnieks (2001) and Fujisawa and others (2014).

Robots look for food and carry it to their nest. On the way home they deposit a substance that evaporates, and others
follow it to the food. Trails help large swarms and not small ones, in which they vanish before anybody follows them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import stagesim as st
from experiment import Axis, Column, Effect, Floats, Study, Table, draw_quartiles, main, sets_of, sweep_of
from stagesim.reports.plots import BLUE, GREY

WEAK = 0.02  #: weaker trails do not count
NEST, FOOD = np.array([0.0, 0.0]), np.array([3.0, 0.0])  #: their middles, metres
NEST_RADIUS, FOOD_SIDE = 0.3, 0.6  #: metres


class Controller:
    """Drives as examples/ctrl/forage.cc does, with other random numbers."""

    def __init__(self, world: st.World, x: float = 0, y: float = 0, radius: float = 0.3, speed: float = 0.2,
                 turn: float = 2, noise: float = 0.2) -> None:
        self.world, self.robots = world, world.fleet()
        self.smell = self.robots.sensor("groundsensor", 0).value
        self.taste = self.robots.sensor("groundsensor", 1).value
        self.trail = world.fields["pheromone"]
        noses = [model for model in world.models if model.type == "groundsensor" and model.deposit_rate]
        self.amount = noses[0].deposit_rate * world.dt if noses else 0
        for nose in noses:
            nose.deposit_rate = 0
        self.nest, self.radius, self.speed, self.turn, self.noise = np.array([x, y]), radius, speed, turn, noise
        self.has_food = np.zeros(len(self.robots), bool)
        self.random = np.random.default_rng(world.seed)

    def search(self, home: Floats, random: Floats) -> Floats:
        """How robots without food turn, from -1 to 1. `home` has the bearings of the nest."""
        left, right = self.smell[:, 0], self.smell[:, 1]
        total = left + right
        follow = (1 - self.noise) * (left - right) / np.maximum(total, WEAK) + self.noise * random
        away = np.where(home < 0, 1, -1)
        return np.where(total < WEAK, self.noise * random, np.where(np.abs(home) < np.pi / 2, away, follow))

    def step(self) -> None:
        pose = self.robots.estimate
        way = self.nest - pose[:, :2]
        is_home = np.hypot(*way.T) < self.radius
        self.has_food = ~is_home & (self.has_food | (self.taste[:, 0] > 0))
        self.trail.deposit(self.robots.pose[self.has_food], self.amount)
        home = (np.arctan2(way[:, 1], way[:, 0]) - pose[:, 2] + np.pi) % (2 * np.pi) - np.pi
        random = self.random.uniform(-1, 1, len(home))
        turn = np.where(self.has_food, home + self.noise * random, self.search(home, random))
        turn[self.robots.stalled] = 1  # all evade to the same side
        self.robots.cmd[:, 0] = self.speed
        self.robots.cmd[:, 2] = self.turn * np.clip(turn, -1, 1)


class Measure:
    """How often a robot came to the nest from the food: in all, and for each robot and ten minutes."""

    def __init__(self, world: st.World) -> None:
        self.world, self.robots = world, world.fleet()
        self.has_food = np.zeros(len(self.robots), bool)
        self.loads = 0

    def step(self) -> None:
        places = self.robots.pose[:, :2]
        is_home = np.hypot(*(places - NEST).T) < NEST_RADIUS
        self.loads += int((self.has_food & is_home).sum())
        self.has_food = ~is_home & (self.has_food | (np.abs(places - FOOD) < FOOD_SIDE / 2).all(1))

    def result(self) -> dict[str, float]:
        return {"loads": self.loads, "each": 600 * self.loads / (self.world.time * len(self.robots))}


BOTS = (5, 10, 20, 40, 80)


def draw(table: Table, figure: Any) -> None:
    """Draws the loads, of all robots and of each, over the number of robots, with and without trails."""
    panels = figure.subplots(1, 2)
    for has_trails, label, color in ((True, "with trails", BLUE), (False, "without", GREY)):
        sets = [(bots, chosen) for (rate, bots), chosen in sets_of(table, ["nose.deposit_rate", "bots"])
                if (rate > 0) == has_trails]
        for panel, metric in zip(panels, ("loads", "each")):
            draw_quartiles(panel, [bots for bots, _ in sets], [table[metric][chosen] for _, chosen in sets],
                           label=label, color=color)
    for panel, text in zip(panels, ("loads of food in ten minutes", "loads of each robot in ten minutes")):
        panel.set(xscale="log", xlabel="robots", ylabel=text, xticks=BOTS, xticklabels=BOTS)
        panel.minorticks_off()
    panels[0].legend()


STUDY = Study(
    name="forage",
    sweep=sweep_of("forage", {"nose.deposit_rate": [0.03, 0], "bots": BOTS}),
    controller=Controller,
    measure=Measure,
    effect=Effect("loads", 27, {"bots": 40}, {"bots": 40, "nose.deposit_rate": 0}, seconds=250, tolerance=None),
    axes=[Axis("nose.deposit_rate", "trails", lambda rate: "yes" if rate else "no"), Axis("bots", "robots")],
    columns=[Column("loads", "loads in ten minutes", 0), Column("each", "of each robot")],
    draw=draw)

if __name__ == "__main__":
    main(STUDY)
