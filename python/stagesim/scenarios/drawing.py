# SPDX-License-Identifier: GPL-2.0-or-later
"""Pictures of scenarios with the paths of all people, by matplotlib."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from ..reports.plots import load_pyplot
from ..scenes import Box, Robot
from .recording import Recording
from .scenario import Scenario

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WALL, ROBOT = "#666666", "#000000"
ADVICE = 'pip install "stagesim[report]" installs it'
TAIL = 3.0  # seconds; the latest part of a path is drawn darker


def draw(axes: Axes, scenario: Scenario, run: Recording, time: float | None = None) -> None:
    """Draws walls, and people and the robot with their paths, as seen from above.

    Paths have the colours of streams, and that of the robot is black and thicker; the path of the last three seconds
    is darker. The cross is the goal of the robot.

    Args:
        axes: the axes of matplotlib to draw on.
        scenario: the scenario.
        run: its recording as a single world.
        time: the moment, in seconds since the first pose; None: the last pose.

    Raises:
        ValueError: the recording is one of a batch or of another scenario, or has no such moment.
    """
    robots = [model for model in scenario.scene.models if isinstance(model, Robot)]
    if run.pose.ndim != 3 or run.pose.shape[1] != len(robots):
        raise ValueError(f"found poses of shape {run.pose.shape}, expected (t, {len(robots)}, 3): those of a single world")
    last = len(run.pose) - 1 if time is None else round(time / run.dt)
    if not 0 <= last < len(run.pose):
        raise ValueError(f"found the time {time} s, expected 0 to {(len(run.pose) - 1) * run.dt:g} s")
    for wall in scenario.scene.models:
        if isinstance(wall, Box):
            _draw_wall(axes, wall)
    for i, robot in enumerate(robots):
        is_robot = robot.name == scenario.robot
        _draw_path(axes, run.pose[:last + 1, i], run.dt, ROBOT if is_robot else str(robot.color), is_robot,
                   0.25 if is_robot else float(scenario.radii[-1]))
    if scenario.robot is not None:
        axes.plot(*scenario.goal, "x", color=ROBOT, markersize=6)
    axes.set_aspect("equal")


def _draw_wall(axes: Axes, wall: Box) -> None:
    from matplotlib.patches import Rectangle

    assert wall.pose is not None and wall.size is not None
    (x, y), (length, width) = wall.pose[:2], wall.size[:2]
    axes.add_patch(Rectangle((x - length / 2, y - width / 2), length, width, color=WALL, linewidth=0))


def _draw_path(axes: Axes, path: Any, dt: float, color: str, is_robot: bool, radius: float) -> None:
    """Draws a path, its latest part once more, and the body at its end."""
    from matplotlib.patches import Circle

    tail = path[max(0, len(path) - 1 - round(TAIL / dt)):]
    width = 1.6 if is_robot else 0.8
    axes.plot(path[:, 0], path[:, 1], color=color, linewidth=width, alpha=0.8 if is_robot else 0.25)
    axes.plot(tail[:, 0], tail[:, 1], color=color, linewidth=width, alpha=0.9)
    axes.add_patch(Circle(path[-1, :2], radius, facecolor=color, edgecolor="black", linewidth=0.4, zorder=3))


def save_picture(file: str | os.PathLike[str], scenario: Scenario, run: Recording, time: float | None = None) -> None:
    """Writes a picture of a recording, as draw() makes it, to a file.

    Args:
        file: the file; its ending, such as .png or .svg, is the format.
        scenario, run, time: as for draw().

    Raises:
        ValueError: as for draw(), or the format is unknown.
        stagesim.reports.plots.PlotsMissing: matplotlib is not installed.
        OSError: the file cannot be written.
    """
    pyplot = load_pyplot(advice=ADVICE)
    figure, axes = pyplot.subplots(figsize=(6.4, 4.8), dpi=100, layout="constrained")
    try:
        draw(axes, scenario, run, time)
        seconds = (len(run.pose) - 1) * run.dt if time is None else time
        axes.set(title=f"{scenario.name}, {seconds:g} s", xlabel="x, m", ylabel="y, m")
        figure.savefig(file)
    finally:
        pyplot.close(figure)
