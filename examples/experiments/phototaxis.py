#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Vehicles that drive to a light or flee from it, after Braitenberg (1984).

Two light sensors drive two wheels. With crossed connections, vehicles turn to the light; with straight ones, they turn
away from it. Noise of the sensors hides the light from those far away.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import stagesim as st
from experiment import Axis, Column, Effect, Study, Table, draw_quartiles, main, number_in, sets_of, sweep_of
from stagesim.reports.plots import BLUE, GREY, RED

NEAR = 1.5  #: vehicles have arrived at this distance from the lamp, metres


class Controller:
    """Drives as examples/ctrl/phototaxis.cc does."""

    def __init__(self, world: st.World, enough: float = 4, speed: float = 0.3, gain: float = 2,
                 search: float = 0.5) -> None:
        self.robots = world.fleet()
        self.eyes = self.robots.sensor("lightsensor").intensity
        self.enough, self.speed, self.gain, self.search = enough, speed, gain, search

    def step(self) -> None:
        left, right = self.eyes.T
        light = left + right
        turn = np.where(light > 0, self.gain * (left - right) / np.where(light > 0, light, 1), self.search)
        self.robots.cmd[:, 0] = np.where(light < self.enough, self.speed, 0)
        self.robots.cmd[:, 2] = np.where(light < self.enough, turn, 0)


class Measure:
    """The mean distance from the lamp, and the share of the vehicles that are near it, at the end."""

    def __init__(self, world: st.World) -> None:
        self.robots, self.lamp = world.fleet(), world.model("lamp").pose[:2]

    def step(self) -> None:
        """Called after each step, but all is measured at the end."""

    def result(self) -> dict[str, float]:
        distances = np.hypot(*(self.robots.pose[:, :2] - self.lamp).T)
        return {"distance": float(distances.mean()), "arrived": float((distances < NEAR).mean())}


NOISES = (0, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5)  #: standard deviations, W/m2
GAINS = {2: ("crossed", BLUE), -2: ("straight", RED), 0: ("none", GREY)}


def noise_in(text: str) -> float:
    """The constant deviation in a setting such as "[0.1 0]"."""
    return float(text.strip("[]").split()[0])


def draw(table: Table, figure: Any) -> None:
    """Draws the share of arrived vehicles and the distance over noise, a line for each wiring."""
    panels = figure.subplots(1, 2)
    for gain, (label, color) in GAINS.items():
        sets = [(noise_in(noise), chosen) for (ctrl, noise), chosen in sets_of(table, ["bot.ctrl", "lightsensor.noise"])
                if number_in(ctrl, "gain") == gain]
        for panel, metric in zip(panels, ("arrived", "distance")):
            draw_quartiles(panel, [noise for noise, _ in sets], [table[metric][chosen] for _, chosen in sets],
                           label=label, color=color)
    for panel, label in zip(panels, ("vehicles at the lamp", "mean distance from the lamp (m)")):
        panel.set_xscale("symlog", linthresh=NOISES[1])
        panel.set_xticks(NOISES[::2], [f"{noise:g}" for noise in NOISES[::2]])
        panel.minorticks_off()
        panel.set(xlabel="noise (W/m²)", ylabel=label, ylim=(-0.02, None))
    panels[0].legend(title="connections", loc="center left")


STUDY = Study(
    name="phototaxis",
    sweep=sweep_of("phototaxis", {"bot.ctrl": [f"phototaxis gain={gain}" for gain in GAINS],
                                  "lightsensor.noise": [f"[{noise} 0]" for noise in NOISES]}),
    controller=Controller,
    measure=Measure,
    effect=Effect("arrived", 0.45, {}, {"lamp.on": 0}, seconds=40, tolerance=0),
    axes=[Axis("bot.ctrl", "connections", lambda text: GAINS[int(number_in(text, "gain"))][0]),
          Axis("lightsensor.noise", "noise, W/m2", lambda text: f"{noise_in(text):g}")],
    columns=[Column("arrived", "share at the lamp"), Column("distance", "mean distance from it, m")],
    draw=draw)

if __name__ == "__main__":
    main(STUDY)
