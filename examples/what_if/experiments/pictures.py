#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Draws what robots consider at a moment: a future of each plan, in the colour of its risk. Needs matplotlib.

    python pictures.py docs/pictures

writes what_if_corridor.png and what_if_ethical.png into this folder."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import corridor
import ethical
import numpy as np
from robots import WhatIf
from stagesim.reports.plots import GREY, load_pyplot
from trips import Noise, Scene, Trial


def moment(scene: Scene, robot: WhatIf, noise: Noise, seconds: float) -> Trial:
    """Drives until this time, when the robot has just decided."""
    trial = Trial(scene, noise, 1)
    for step in range(round(seconds / scene.interval) + 1):
        if step % robot.period == 0:
            command = robot.decide(trial.measure())
        if step < round(seconds / scene.interval):
            trial.step(command)
    return trial


def draw(axes: Any, pyplot: Any, trial: Trial, robot: WhatIf) -> None:
    """Draws the place, everybody, and the futures, the riskiest first and the chosen one last."""
    scene, decision = trial.scene, robot.last
    colours = pyplot.get_cmap("RdYlBu_r")
    for plan in sorted(np.argsort(-decision.risk, kind="stable"), key=lambda plan: plan == decision.best):
        is_best, colour = plan == decision.best, colours(decision.risk[plan])
        future = decision.future(int(plan), len(scene.others))
        for who, style in enumerate(["-"] + [":"] * len(scene.others)):
            axes.plot(*future[:, who, :2].T, style, color=colour, linewidth=3 if is_best else 1.2, zorder=2 + is_best)
        if is_best:
            axes.plot(*future[:, 0, :2].T, "-", color="black", linewidth=0.8, zorder=4)
    for wall in scene.walls:
        axes.plot(*np.transpose(wall), color="black", linewidth=2)
    discs = [(trial.robot.pose[0, :2], scene.radius, "#0072B2")]
    discs += [(place, scene.other_radius, GREY) for place in trial.places()]
    if scene.hole is not None:
        discs.append((scene.hole[:2], scene.hole[2], "black"))
    for place, radius, colour in discs:
        axes.add_patch(pyplot.Circle(place, radius, color=colour, zorder=5))
    axes.plot(*scene.goal, "*", color="#009E73", markersize=12)
    axes.set_aspect("equal")
    axes.set_axis_off()


def picture(pyplot: Any, out: Path, moments: list[tuple[Scene, WhatIf, Noise, float]], size: tuple[float, float],
            frame: tuple[float, float, float, float]) -> None:
    """Writes a picture of moments above each other; `frame` is least and greatest x and y."""
    figure, all_axes = pyplot.subplots(len(moments), figsize=size, layout="constrained", squeeze=False)
    for axes, (scene, robot, noise, seconds) in zip(all_axes[:, 0], moments):
        draw(axes, pyplot, moment(scene, robot, noise, seconds), robot)
        axes.set_xlim(frame[:2])
        axes.set_ylim(frame[2:])
    shades = pyplot.cm.ScalarMappable(cmap="RdYlBu_r", norm=pyplot.Normalize(0, 1))
    figure.colorbar(shades, ax=list(all_axes[:, 0]), label="risk", shrink=0.8)
    figure.savefig(out, dpi=80)
    pyplot.close(figure)


def main(arguments: list[str] | None = None) -> None:
    """Writes both pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where the pictures are written")
    folder = parser.parse_args(arguments).folder
    pyplot = load_pyplot(advice="pip install matplotlib")
    scene, noise = corridor.scene(3, "go to"), corridor.NOISE
    hypotheses = (corridor.goes_on, corridor.unsure, corridor.makes_way)
    picture(pyplot, folder / "what_if_corridor.png",
            [(scene, WhatIf(scene, noise, each, 1, 100, corridor.HORIZON), noise, 5.0) for each in hypotheses], (9, 6),
            (-4.2, 4.2, -1.1, 1.1))
    scene, noise = ethical.scene(3), ethical.SMALL
    picture(pyplot, folder / "what_if_ethical.png",
            [(scene, ethical.Ethical(scene, noise, each, 1, 30), noise, 2.0) for each in (ethical.right, ethical.stands)], (9, 9),
            (-4.8, 4.4, -2.6, 1.6))


if __name__ == "__main__":
    main()
