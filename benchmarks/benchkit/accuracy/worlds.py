# SPDX-License-Identifier: GPL-2.0-or-later
"""World files for a setting of the knobs. The scene does not depend on the setting.

A scene consists of robots and their surroundings, generated from a seed. Definitions of sensors and
robots are those of worlds/*.inc with the values of the knobs.
"""

from __future__ import annotations

import functools
import math
import random
import re
import subprocess
from dataclasses import dataclass

from benchkit.machine import ROOT

from .settings import Setting

WORLDS = ROOT / "worlds"
ROOM = 20.0  # metres; inner width of the room with boxes
# Metres. Robots of the dispersal task start in a square of this size without boxes.
START_CORNER = 6.5
# Metres between the starts of scored robots: even the largest cells do not make them touch.
START_PITCH = 1.05
BODY = 0.13  # metres: radius of a swarmer


class WorldError(Exception):
    """The world cannot be written; the text gives the reason in one line."""


def substitute(pattern: str, replacement: str, text: str, where: str) -> str:
    """Replaces all matches; there must be at least one."""
    result, count = re.subn(pattern, replacement, text, flags=re.MULTILINE)
    if count == 0:
        raise WorldError(f"{where}: found nothing that matches '{pattern}', which is where a "
                         "knob's value has to go")
    return result


def definitions(setting: Setting) -> str:
    """Sensors and robots with the values of the knobs."""
    sensors = (WORLDS / "sensors.inc").read_text(encoding="utf-8")
    if setting.samples:
        sensors = substitute(r"samples (180|350)$", f"samples {setting.samples}", sensors,
                             "sensors.inc")
    sensors = substitute(r"(define \w+ ranger\n\()", rf"\1\n  update_interval {setting.interval}",
                         sensors, "sensors.inc")
    return "\n".join([sensors, (WORLDS / "robots.inc").read_text(encoding="utf-8"),
                      (WORLDS / "maps.inc").read_text(encoding="utf-8")])


def header(setting: Setting) -> str:
    # Cells stop robots, because the size of cells is one of the settings.
    lines = [f"resolution {setting.cell:g}", f"interval_sim {setting.step}", "speedup -1",
             'contacts "cells"']
    if setting.ray_model != "cell":
        # The default is not written, so that programs without this property also load the file.
        lines.append(f'ray_model "{setting.ray_model}"')
    return "\n".join(lines) + "\n" + definitions(setting)


# ---- a room with rotated boxes ------------------------------------------------------------------

class Rectangle:
    """A rotated box, seen from above."""

    def __init__(self, x: float, y: float, degrees: float, width: float, depth: float) -> None:
        self.x, self.y, self.degrees, self.width, self.depth = x, y, degrees, width, depth

    def gap(self, x: float, y: float) -> float:
        """Distance from the point to the rectangle; 0 inside."""
        a = math.radians(self.degrees)
        dx, dy = x - self.x, y - self.y
        along = abs(dx * math.cos(a) + dy * math.sin(a)) - self.width / 2
        across = abs(dy * math.cos(a) - dx * math.sin(a)) - self.depth / 2
        return math.hypot(max(along, 0), max(across, 0))

    def text(self, name: str) -> str:
        return (f'model( name "{name}" pose [{self.x:.6f} {self.y:.6f} 0 {self.degrees:.6f}] '
                f"size [{self.width:.6f} {self.depth:.6f} 1] color \"gray50\" )")


def random_boxes(dice: random.Random, count: int) -> list[Rectangle]:
    """Boxes at random places except the start corner of the robots; they may overlap."""
    boxes: list[Rectangle] = []
    while len(boxes) < count:
        box = Rectangle(dice.uniform(-ROOM / 2 + 1, ROOM / 2 - 1),
                        dice.uniform(-ROOM / 2 + 1, ROOM / 2 - 1), dice.uniform(-180, 180),
                        dice.uniform(0.3, 1.5), dice.uniform(0.2, 1.4))
        reach = math.hypot(box.width, box.depth) / 2
        edge = -ROOM / 2 + START_CORNER + reach
        if box.x > edge or box.y > edge:
            boxes.append(box)
    return boxes


def room_walls() -> list[Rectangle]:
    half, thick = ROOM / 2, 0.2
    return [Rectangle(sign * (half + thick / 2), 0, 0, thick, ROOM + 2 * thick)
            for sign in (-1, 1)] + [
                Rectangle(0, sign * (half + thick / 2), 0, ROOM, thick) for sign in (-1, 1)]


def robots_in_room(dice: random.Random, count: int, obstacles: list[Rectangle]
                   ) -> list[tuple[float, float, float]]:
    """Random free poses, some of them close to an obstacle."""
    robots: list[tuple[float, float, float]] = []
    for _ in range(count * 10_000):
        if len(robots) == count:
            return robots
        x, y = (dice.uniform(-ROOM / 2, ROOM / 2) for _ in range(2))
        free = all(box.gap(x, y) > BODY + 0.1 for box in obstacles)
        apart = all(math.hypot(x - u, y - v) > 2 * BODY + 0.1 for u, v, _ in robots)
        if free and apart:
            robots.append((x, y, dice.uniform(-180, 180)))
    raise WorldError(f"no room for {count} robots among the boxes: found it full with "
                     f"{len(robots)}")


def robots_in_corner(dice: random.Random, count: int) -> list[tuple[float, float, float]]:
    """Poses in rows in the free corner, each displaced a little."""
    side = math.ceil(math.sqrt(count))
    if side * START_PITCH > START_CORNER:
        raise WorldError(f"{count} robots do not fit into the starting corner")
    robots = []
    for i in range(count):
        x, y = (-ROOM / 2 + 0.7 + START_PITCH * k + dice.uniform(-0.02, 0.02)
                for k in divmod(i, side))
        robots.append((x, y, dice.uniform(-180, 180)))
    return robots


def boxes_scene(robots: int, seed: int, corner: bool = False) -> str:
    """A room of 20 m by 20 m with 40 rotated boxes and swarmers."""
    dice = random.Random(seed)
    obstacles = random_boxes(dice, 40) + room_walls()
    poses = robots_in_corner(dice, robots) if corner else robots_in_room(dice, robots, obstacles)
    lines = [box.text(f"box{i}") for i, box in enumerate(obstacles)]
    lines += [f'robot( name "r{i}" pose [{x:.6f} {y:.6f} 0 {a:.6f}] )'
              for i, (x, y, a) in enumerate(poses)]
    return "\n".join(lines) + "\n"


# ---- floor plans --------------------------------------------------------------------------------

SIZES = {"cave": (64, 64, "explorer"), "hospital": (540, 220, "swarmer")}


@functools.lru_cache(maxsize=None)
def placed_robots(series: str, robots: int, seed: int) -> str:
    """Lines of robots that are clear of walls and of each other even with cells of 0.5 m."""
    done = subprocess.run([ROOT / "tools/populate", series, str(robots), "--seed", str(seed),
                           "--resolution", "0.5"], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise WorldError(f"tools/populate: {done.stderr.strip()}")
    return "".join(line + "\n" for line in done.stdout.splitlines() if line.startswith("robot("))


def plan_scene(series: str, robots: int, seed: int) -> str:
    """The floor plan of a series of tools/populate, with its robots."""
    width, height, _ = SIZES[series]
    bitmap = WORLDS / "bitmaps" / f"{series}.png"
    return (f'floorplan( name "{series}" size [{width} {height} 0.8] bitmap "{bitmap}" )\n'
            + placed_robots(series, robots, seed))


# ---- whole worlds -------------------------------------------------------------------------------

def scene_world(scene: str, robots: int, seed: int, setting: Setting, controller: str,
                corner: bool = False) -> str:
    """The text of a world file."""
    kind = "swarmer" if scene == "boxes" else SIZES[scene][2]
    body = (boxes_scene(robots, seed, corner) if scene == "boxes"
            else plan_scene(scene, robots, seed))
    return f'{header(setting)}\ndefine robot {kind}( ctrl "{controller}" )\n{body}'


@dataclass(frozen=True)
class Approach:
    """A square robot that drives straight at a long wall; in metres and radians."""

    x: float
    y: float
    heading: float
    wall_x: float  # the middle of the wall
    wall_y: float
    wall_heading: float  # across the wall, away from the robot

    BODY = 0.2  # the side of the robot
    THICKNESS = 0.2

    def gap(self, x: float, y: float, heading: float) -> float:
        """Distance between the wall's face and a robot at this pose; negative if it is inside."""
        along, half = (math.cos(self.wall_heading), math.sin(self.wall_heading)), self.BODY / 2
        c, s = math.cos(heading), math.sin(heading)
        corners = [(x + u * half * c - v * half * s, y + u * half * s + v * half * c)
                   for u in (-1, 1) for v in (-1, 1)]
        return min((self.wall_x - u) * along[0] + (self.wall_y - v) * along[1]
                   for u, v in corners) - self.THICKNESS / 2


def approaches(count: int, seed: int) -> list[Approach]:
    """Approaches in all directions, from random places within a cell, at up to 50 degrees from the
    perpendicular of the wall."""
    dice = random.Random(seed)
    found = []
    for i in range(count):
        x, y = 20 * (i % 10) + dice.random(), 20 * (i // 10) + dice.random()
        heading = dice.uniform(-math.pi, math.pi)
        ahead = dice.uniform(1.5, 2)
        found.append(Approach(x, y, heading, x + ahead * math.cos(heading),
                              y + ahead * math.sin(heading),
                              heading + math.radians(dice.uniform(-50, 50))))
    return found


def contact_world(setting: Setting, wanted: list[Approach]) -> str:
    """Places each robot before its wall. Steps are short, so that the cells decide where it
    stops."""
    lines = [f"resolution {setting.cell:g}", "interval_sim 10", "speedup -1",
             'contacts "cells"']
    for i, a in enumerate(wanted):
        lines.append(f'model( name "wall{i}" size [{Approach.THICKNESS} 8 1] '
                     f"pose [{a.wall_x:.9f} {a.wall_y:.9f} 0 {math.degrees(a.wall_heading):.9f}] )")
        lines.append(f'position( name "r{i}" drive "diff" '
                     f"size [{Approach.BODY} {Approach.BODY} 0.2] "
                     f"pose [{a.x:.9f} {a.y:.9f} 0 {math.degrees(a.heading):.9f}] )")
    return "\n".join(lines) + "\n"


def drive_world(step: int) -> str:
    """A single robot without obstacles that takes commands in every step."""
    return (f"interval_sim {step}\nspeedup -1\n"
            f'position( name "driver" update_interval {step} drive "diff" '
            "size [0.2 0.2 0.2] velocity_bounds [-2 2 0 0 0 0 -180 180] )\n")
