# SPDX-License-Identifier: GPL-2.0-or-later
"""Writes the world file of a scenario, or a picture: python -m stagesim.scenarios corridor --seed 3 --save FOLDER."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from ..errors import StageError
from ..reports.plots import PlotsMissing
from ..scenes import Robot
from ..world import World
from .catalogue import RULES, names, scenario
from .drawing import save_picture
from .recording import record


def main(words: Sequence[str] | None = None) -> int:
    """Obeys the words of a command line; returns the exit status."""
    parser = argparse.ArgumentParser("python -m stagesim.scenarios", description="Scenarios with pedestrians.")
    parser.add_argument("name", nargs="?", help="name of the scenario")
    parser.add_argument("--list", action="store_true", help="print all names and what happens")
    parser.add_argument("--save", metavar="FOLDER", help="write NAME.world to this folder")
    parser.add_argument("--picture", metavar="FILE", help="run the scenario and write a picture of all paths to this file")
    parser.add_argument("--seconds", type=float, metavar="S", help="how long it runs for a picture (default: its horizon)")
    parser.add_argument("--seed", type=int, default=0, help="seed of places, goals and speeds (default: 0)")
    parser.add_argument("--pedestrians", type=int, metavar="N", help="their number")
    parser.add_argument("--rule", choices=RULES, default="pedestrian", help="how they walk (default: pedestrian)")
    parser.add_argument("--robot", metavar="CTRL", default="stage/orca goals={goals} speed=0.8 radius=0.35",
                        help='controller of the robot, in which {goals} stands for its route; "none": no robot '
                             "(default: %(default)s)")
    given = parser.parse_args(words)
    if given.list:
        print("\n".join(f"{name:12} {line}" for name, line in names().items()))
        return 0
    if given.name is None or given.save is None and given.picture is None:
        parser.error("expected NAME with --save FOLDER or --picture FILE, or --list")
    try:
        made = scenario(given.name, given.seed, pedestrians=given.pedestrians, rule=given.rule,
                        robot=given.robot != "none" and _robot(given.robot))
        if given.save is not None:
            print(made.save(given.save))
        if given.picture is not None:
            seconds = made.horizon if given.seconds is None else given.seconds
            save_picture(given.picture, made, record(World.of(made.scene), seconds))
    except (OSError, PlotsMissing, StageError, TypeError, ValueError) as error:
        print(f"stagesim.scenarios: {error}", file=sys.stderr)
        return 1
    return 0


def _robot(controller: str) -> Robot:
    """An omnidirectional robot with a laser."""
    from ..scenes import Ranger

    laser = Ranger(pose=(0, 0, 0.3, 0), range=(0, 8), fov=6.283, samples=90)
    return Robot(size=(0.5, 0.5, 0.5), round=True, drive="omni", color="cyan4", ctrl=controller, sensors=[laser])


if __name__ == "__main__":
    sys.exit(main())
