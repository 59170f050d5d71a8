#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Aggregation without computation, after Gauci, Chen, Li, Dodd and Gross (2014).

A robot knows one bit: whether its line of sight meets another robot. It drives backwards on a circle if it sees
nothing, and turns on the spot if it sees something. Sensors with a long range gather all robots; with a short one,
they see too few others.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import stagesim as st
from experiment import Axis, Column, Effect, Study, Table, draw_quartiles, largest_cluster, main, sets_of, sweep_of
from stagesim.reports.plots import BLUE

RADIUS = 0.0355  #: of a robot, metres


class Controller:
    """Drives as examples/ctrl/aggregation.cc does."""

    def __init__(self, world: st.World, clear_left: float = -0.7, clear_right: float = -1, seen_left: float = 1,
                 seen_right: float = -1, speed: float = 0.128, axle: float = 0.052) -> None:
        self.robots = world.fleet()
        self.eye = self.robots.ranger().intensities
        self.left, self.right = speed * np.array([[clear_left, seen_left], [clear_right, seen_right]])
        self.axle = axle

    def step(self) -> None:
        seen = (self.eye[:, 0] > 0).astype(int)
        left, right = self.left[seen], self.right[seen]
        self.robots.cmd[:, 0] = (left + right) / 2
        self.robots.cmd[:, 2] = (right - left) / self.axle


class Measure:
    """Compactness: the second moment at the end, in units of a robot's width squared, and the largest cluster.

    Robots are in the same cluster if there is less than the width of a robot between them.
    """

    def __init__(self, world: st.World) -> None:
        self.world, self.robots = world, world.fleet()
        self.gathered = np.nan

    def cluster(self) -> float:
        """The fraction of robots that are in the largest cluster."""
        return largest_cluster(self.robots.pose[:, :2], 4 * RADIUS) / len(self.robots)

    def step(self) -> None:
        if self.world.steps % 10 == 0 and np.isnan(self.gathered) and self.cluster() == 1:
            self.gathered = self.world.time

    def result(self) -> dict[str, float]:
        places = self.robots.pose[:, :2]
        moment = ((places - places.mean(0)) ** 2).sum() / (4 * RADIUS**2)
        return {"dispersion": float(moment), "cluster": self.cluster(), "gathered": self.gathered}


RANGES = (0.1, 0.25, 0.5, 0.7, 1, 2, 5)  #: of the line of sight, metres


def reach_of(text: str) -> float:
    """The longest range in a setting such as "[0 0.5]"."""
    return float(text.strip("[]").split()[1])


def draw(table: Table, figure: Any) -> None:
    """Draws the dispersion and the largest cluster over the range of the sensor."""
    sets = [(reach_of(values[0]), chosen) for values, chosen in sets_of(table, ["sensor.range"])]
    for panel, metric, label in zip(figure.subplots(1, 2), ("cluster", "dispersion"),
                                    ("robots in the largest cluster", "dispersion (second moment)")):
        draw_quartiles(panel, [reach for reach, _ in sets], [table[metric][chosen] for _, chosen in sets], color=BLUE)
        panel.set(xscale="log", xlabel="range of the line of sight (m)", ylabel=label)
    figure.axes[0].set_ylim(0, 1.05)
    figure.axes[1].set_yscale("log")


STUDY = Study(
    name="aggregation",
    sweep=sweep_of("aggregation", {"sensor.range": [f"[0 {reach}]" for reach in RANGES]}),
    controller=Controller,
    measure=Measure,
    effect=Effect("cluster", 0.7, {"bots": 10}, {"bots": 10, "sensor.range": "[0 0.1]"}, seconds=150, tolerance=0),
    axes=[Axis("sensor.range", "range, m", lambda text: f"{reach_of(text):g}")],
    columns=[Column("cluster", "largest cluster, share of robots"), Column("dispersion", "dispersion", 0),
             Column("gathered", "all in one cluster after, s", 0)],
    draw=draw)

if __name__ == "__main__":
    main(STUDY)
