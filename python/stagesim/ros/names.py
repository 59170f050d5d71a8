# SPDX-License-Identifier: GPL-2.0-or-later
"""Names of topics, frames and robots, in the scheme of stage_ros2 or stage_ros."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Sequence


@dataclass(frozen=True)
class Scheme:
    """A naming scheme.

    Attributes:
        ground_truth: topic of the true pose.
        separator: separator between name and number, if a robot has several sensors of a kind.
        numbered_robots: True: robots are called robot_0, robot_1, ...; False: as in the world file.
        scan_frame, camera_frame: frames of rangers and cameras, without numbers.
    """

    ground_truth: str
    separator: str
    numbered_robots: bool
    scan_frame: str
    camera_frame: str


SCHEMES = {
    "stage_ros2": Scheme("ground_truth", "", False, "base_scan_link", "camera_link"),
    "stage_ros": Scheme("base_pose_ground_truth", "_", True, "base_laser_link", "camera"),
}


def numbered(scheme: Scheme, base: str, number: int, count: int) -> str:
    """The name of thing `number` of `count` of one kind; without a number if it is the only one."""
    return base if count == 1 else f"{base}{scheme.separator}{number}"


def part_of(name: str, number: int) -> str:
    """The name of sensor `number` of the ranger `name`; the first sensor has the name of the ranger."""
    return name if number == 0 else f"{name}_sensor_{number}"


def prefixes(scheme: Scheme, robots: Sequence[str], always: bool) -> list[str]:
    """Prefixes of each robot's topics and frames. A single robot has an empty one, unless `always`."""
    if len(robots) == 1 and not always:
        return [""]
    if scheme.numbered_robots:
        return [f"robot_{i}" for i in range(len(robots))]
    taken: set[str] = set()
    found = []
    for robot in robots:
        plain = name = ros_name(robot)
        number = 2
        while name in taken:
            name, number = f"{plain}_{number}", number + 1
        taken.add(name)
        found.append(name)
    return found


def ros_name(name: str) -> str:
    """Converts a name to a valid ROS name: letters, digits and underscores, no digit first."""
    plain = re.sub("_+", "_", re.sub("[^A-Za-z0-9_]", "_", name)).strip("_") or "robot"
    return f"_{plain}" if plain[0].isdigit() else plain


def joined(prefix: str, name: str) -> str:
    """Returns prefix/name, or only the name if the prefix is empty."""
    return f"{prefix}/{name}" if prefix else name
