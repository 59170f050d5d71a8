#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Flocking, after Reynolds (1987), and its transition with noise, after Vicsek and others (1995).

Robots tell their headings to their neighbours by radio. Each turns to their mean heading, away from those too near and
to those farther away. With little noise all soon drive in the same direction; with much noise they do not.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import stagesim as st
from experiment import (Axis, Column, Effect, Floats, Study, Table, draw_quartiles, largest_cluster, main, number_in,
                        sets_of, sweep_of)
from stagesim.reports.plots import BLUE, GREY

REACH = 1.0  #: of a radio, metres


class Controller:
    """Drives as examples/ctrl/flocking.cc does, but for the last bits of trigonometry, and with other random numbers."""

    def __init__(self, world: st.World, align: float = 1, gather: float = 1, near: float = 0.4, noise: float = 0.1,
                 speed: float = 0.1, gain: float = 5) -> None:
        self.robots = world.fleet()
        self.robots.messages()  # subscribes
        self.align, self.gather, self.near, self.noise = align, gather, near, noise
        self.speed, self.gain = speed, gain
        self.random = np.random.default_rng(world.seed)

    def aim(self, heading: Floats) -> Floats:
        """The vectors to which robots turn, in their own frames: shape (2, n)."""
        heard = self.robots.messages()
        others = heard.payload.view(np.float64)[:, 0] - heading[heard.receiver]
        weight = np.minimum(1, (heard.range - self.near) / self.near)
        headings, places = np.zeros((2, 2, len(heading)))
        headings[0] = 1
        for part, function in enumerate((np.cos, np.sin)):
            np.add.at(headings[part], heard.receiver, function(others))
            np.add.at(places[part], heard.receiver, weight * function(heard.bearing))
        count = np.bincount(heard.receiver, minlength=len(heading))
        return self.align / (count + 1) * headings + self.gather / np.maximum(count, 1) * places

    def step(self) -> None:
        heading = self.robots.pose[:, 2].copy()
        aim = self.aim(heading)
        turn = np.arctan2(aim[1], aim[0])
        if self.noise > 0:
            turn += self.noise * self.random.uniform(-np.pi, np.pi, len(turn))
            turn = (turn + np.pi) % (2 * np.pi) - np.pi
        self.robots.cmd[:, 0] = self.speed
        self.robots.cmd[:, 2] = self.gain * turn
        self.robots.send(heading[:, None].view(np.uint8))


class Measure:
    """Vicsek's order parameter, the length of the mean heading, in the second half of the run, and the largest flock."""

    def __init__(self, world: st.World) -> None:
        self.robots = world.fleet()
        self.orders: list[float] = []

    def step(self) -> None:
        self.orders.append(abs(np.exp(1j * self.robots.pose[:, 2]).mean()))

    def result(self) -> dict[str, float]:
        flock = largest_cluster(self.robots.pose[:, :2], REACH) / len(self.robots)
        return {"order": float(np.mean(self.orders[len(self.orders) // 2:])), "flock": flock}


NOISES = (0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.9, 1)


def draw(table: Table, figure: Any) -> None:
    """Draws order and flock over noise, a line with alignment and one without."""
    panels = figure.subplots(1, 2)
    for align, label, color in ((1, "with alignment", BLUE), (0, "without", GREY)):
        sets = [(number_in(text, "noise"), chosen) for (text,), chosen in sets_of(table, ["bot.ctrl"])
                if number_in(text, "align") == align]
        for panel, metric in zip(panels, ("order", "flock")):
            draw_quartiles(panel, [noise for noise, _ in sets], [table[metric][chosen] for _, chosen in sets],
                           label=label, color=color)
    panels[0].set(xlabel="noise", ylabel="order parameter", ylim=(0, 1.05))
    panels[1].set(xlabel="noise", ylabel="robots in the largest flock", ylim=(0, 1.05))
    panels[0].legend()


STUDY = Study(
    name="flocking",
    sweep=sweep_of("flocking", {"bot.ctrl": [f"flocking align={align} noise={noise}"
                                             for align in (1, 0) for noise in NOISES]}),
    controller=Controller,
    measure=Measure,
    effect=Effect("order", 0.5, {"bot.ctrl": "flocking noise=0"}, {"bot.ctrl": "flocking align=0 noise=0"},
                  seconds=20, tolerance=1e-6),
    axes=[Axis("bot.ctrl", "alignment", lambda text: "yes" if number_in(text, "align") else "no"),
          Axis("bot.ctrl", "noise", lambda text: f"{number_in(text, 'noise'):g}")],
    columns=[Column("order", "order parameter"), Column("flock", "largest flock, share of robots")],
    draw=draw)

if __name__ == "__main__":
    main(STUDY)
