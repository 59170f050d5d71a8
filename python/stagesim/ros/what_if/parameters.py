# SPDX-License-Identifier: GPL-2.0-or-later
"""The parameters of the node that decides: defaults, valid values and descriptions. None changes while it runs."""

from __future__ import annotations

import math
from typing import Any, Callable

from ..names import MAP_FRAME
from ..parameters import Parameter


def _number(default: float, text: str, least: float, most: float = math.inf, above: bool = False) -> Parameter:
    expected = f"a number {'above' if above else 'from'} {least:g}" + (f" to {most:g}" if most < math.inf else " on")
    if isinstance(default, int):
        expected = "a whole" + expected[1:]
    return Parameter(default, text, expected, lambda value: (value > least if above else value >= least) and value <= most
                     and value < math.inf, fixed=True)


def _numbers(default: list[float], text: str, counts: Callable[[int], bool], how_many: str, least: float = -math.inf
             ) -> Parameter:
    return Parameter(default, text, how_many, lambda values: counts(len(values)) and all(
        math.isfinite(value) and value >= least for value in values), fixed=True)


def _text(default: str, text: str, **more: Any) -> Parameter:
    return Parameter(default, text, fixed=True, **more)


PARAMETERS = {
    "world_file": _text("", "the world file with the robot, and the walls that are known for sure"),
    "robot": _text("robot", "name of the robot in it"),
    "rate": _number(10.0, "decisions per second", 0, 1000, above=True),
    "budget": _number(0.6, "share of a period that simulated futures may take; without lockstep", 0, 1, above=True),
    "deadline": _number(0.9, "share of a period after which a decision is late; without lockstep", 0, 1, above=True),
    "horizon": _number(5.0, "simulated seconds to look ahead", 0, 1000, above=True),
    "samples": _number(10, "futures of each plan", 1, 100000),
    "most_samples": _number(0, "more futures, if plans can't be told apart by less; 0: no more", 0, 100000),
    "max_risk": _number(0.1, "plans with a greater chance of a collision are chosen only if all have one", 0, 1),
    "penalty": _number(100.0, "a collision counts as so many metres of the mean distance to the goal", 0),
    "tolerance": _number(0.2, "distance to the goal at which it is reached, metres", 0),
    "robot_radius": _number(0.25, "of the robot, for contacts with others, metres", 0),
    "other_radius": _number(0.25, "of others, metres", 0, above=True),
    "speeds": _numbers([0.0, 0.5], "velocities ahead, m/s", lambda n: 1 <= n <= 100, "1 to 100 finite numbers"),
    "sideways": _numbers([0.0], "velocities to the left of a robot that can do that, m/s", lambda n: 1 <= n <= 100,
                         "1 to 100 finite numbers"),
    "turns": _numbers([-1.0, -0.5, 0.0, 0.5, 1.0], "turn rates, rad/s", lambda n: 1 <= n <= 100, "1 to 100 finite numbers"),
    "hold": _number(1.0, "seconds for each velocity of plans that turn, drive straight on and turn back; 0: only plans with one "
                    "velocity", 0, 100),
    "accelerations": _numbers([], "the greatest ones, m/s2 and rad/s2, of a dynamic window; none: all velocities, always",
                              lambda n: n in (0, 2), "no number or two, 0 or more", 0),
    "window": _number(0.5, "seconds of acceleration of the dynamic window", 0, 100, above=True),
    "delay": _number(0.1, "seconds from the stamp of a measurement to the obedience to a command that answers it", 0, 10),
    "behaviours": _text("go on 3, stand 1", "hypotheses for others, with weights: go on, stand, go to, social force, orca"),
    "others": _text("", "topics of others that must be heard, such as robots, separated by commas"),
    "tracks": _text("", "topics of trackers, whose others come and go, separated by commas"),
    "others_timeout": _number(1.0, "seconds after which others are forgotten, or missed", 0, above=True),
    "localization": Parameter("both", "how the robot knows its place", "both, odom or pose",
                              lambda value: value in ("both", "odom", "pose"), fixed=True),
    "odom_timeout": _number(0.5, "seconds after which the last odometry is too old; with localization pose: the last pose",
                            0, above=True),
    "pose_gap": _number(1.0, "longest time from a pose to the first odometry after it, seconds", 0),
    "pose_errors": _numbers([0.05, 0.05, 0.02], "standard deviations of poses without a covariance: metres and radians",
                            lambda n: n == 3, "three numbers, 0 or more", 0),
    "twist_errors": _numbers([0.05, 0.05, 0.05], "standard deviations of velocities without one: m/s and rad/s",
                             lambda n: n == 3, "three numbers, 0 or more", 0),
    "model_errors": _numbers([0.02, 0.02, 0.01], "standard deviations added to the robot's pose, for the errors of map, delay "
                             "and motion: metres and radians", lambda n: n == 3, "three numbers, 0 or more", 0),
    "map_topic": _text("/map", "topic of the map; empty: the walls are only those of the world file"),
    "map_frame_id": _text(MAP_FRAME, "frame of the map, in which poses, others and goals are"),
    "occupied": _number(65, "percentage from which a cell of the map is occupied", 1, 100),
    "others_clear_cells": Parameter(False, "cells of the map near others are free, for maps that show them as obstacles",
                                    fixed=True),
    "goal": _numbers([], "first goal: x and y, metres; none: the robot waits for goal_pose", lambda n: n in (0, 2),
                     "no number or two"),
    "stamped_cmd_vel": Parameter(False, "messages on cmd_vel are of the type TwistStamped", fixed=True),
    "lockstep": Parameter(False, "answers each step of a simulation that waits for it, without limits of time", fixed=True),
    "seed": _number(1, "of the random numbers", 0, 2**62),
    "threads": _number(0, "threads that simulate; 0: all processors", 0, 1024),
}
