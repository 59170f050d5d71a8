#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Synchronisation like that of fireflies, after Mirollo and Strogatz (1990) and Christensen, O'Grady and Dorigo (2009).

Robots flash with the same period but at different times. A robot that sees others flash is early the next time. Soon all
flash at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import stagesim as st
from experiment import Axis, Column, Effect, Study, Table, draw_quartiles, main, number_in, sets_of, sweep_of
from stagesim.reports import plots

PERIOD = 4.0  #: of flashes, seconds
AT_ONCE = 0.3  #: longest time between the first and the last of flashes at once, seconds


class Controller:
    """Drives and flashes as examples/ctrl/firefly.cc does."""

    def __init__(self, world: st.World, coupling: float = 0.1, period: float = PERIOD, flash: float = 0.2,
                 speed: float = 0.05, turn: float = 1) -> None:
        self.robots = world.fleet()
        self.seen = self.robots.sensor("lightsensor").intensity
        self.phase = (self.robots.pose[:, 2] + np.pi) / (2 * np.pi)
        self.step_of_phase, self.coupling, self.lit = world.dt / period, coupling, flash / period
        self.speed, self.turn = speed, turn

    def step(self) -> None:
        self.phase += self.step_of_phase
        self.phase += np.where(self.seen[:, 0] > 0, self.coupling * self.phase, 0)
        self.phase[self.phase >= 1] = 0
        self.robots.switch_lights(self.phase < self.lit)
        self.robots.cmd[:, 0] = self.speed
        self.robots.cmd[:, 2] = np.where(self.robots.stalled, self.turn, 0)


class Measure:
    """The order of the last flashes of all robots at the end, 1 if they were at once, and when that was first so."""

    def __init__(self, world: st.World) -> None:
        self.world, self.robots = world, world.fleet()
        self.lit = self.robots.lights()
        self.flashed = np.full(len(self.robots), np.nan)  # times of the last flashes
        self.first = np.nan

    def step(self) -> None:
        lit = self.robots.lights()
        self.flashed[lit & ~self.lit] = self.world.time
        self.lit = lit
        if np.isnan(self.first) and np.ptp(self.flashed) < AT_ONCE:
            self.first = self.world.time

    def result(self) -> dict[str, float]:
        order = abs(np.exp(2j * np.pi * self.flashed / PERIOD).mean())
        return {"order": float(order), "synchronous": self.first, "share": float(np.isfinite(self.first))}


COUPLINGS = (0, 0.03, 0.1, 0.3)
COUNTS = (5, 10, 20, 40)


def draw(table: Table, figure: Any) -> None:
    """Draws the order and the time until synchrony over the number of robots, a line for each coupling."""
    panels = figure.subplots(1, 2)
    for coupling, color in zip(COUPLINGS, (plots.GREY, plots.SKY, plots.BLUE, plots.BLACK)):
        sets = [(number, chosen) for (number, text), chosen in sets_of(table, ["bots", "bot.ctrl"])
                if number_in(text, "coupling") == coupling]
        for panel, metric in zip(panels, ("order", "synchronous")):
            draw_quartiles(panel, [number for number, _ in sets], [table[metric][chosen] for _, chosen in sets],
                           label=f"coupling {coupling}", color=color)
    for panel, label in zip(panels, ("order of the flashes", "time until synchrony (s)")):
        panel.set_xscale("log")
        panel.set_xticks(COUNTS, COUNTS)
        panel.minorticks_off()
        panel.set(xlabel="robots", ylabel=label, ylim=(0, None))
    panels[0].legend()


STUDY = Study(
    name="firefly",
    sweep=sweep_of("firefly", {"bots": COUNTS, "bot.ctrl": [f"firefly coupling={coupling}" for coupling in COUPLINGS]}),
    controller=Controller,
    measure=Measure,
    effect=Effect("order", 0.7, {"bots": 20}, {"bots": 20, "bot.ctrl": "firefly coupling=0"}, seconds=100, tolerance=0),
    axes=[Axis("bots", "robots"), Axis("bot.ctrl", "coupling", lambda text: f"{number_in(text, 'coupling'):g}")],
    columns=[Column("order", "order of the flashes"), Column("share", "mean share of synchronous runs", mean=True),
             Column("synchronous", "synchronous after, s", 0)],
    draw=draw)

if __name__ == "__main__":
    main(STUDY)
