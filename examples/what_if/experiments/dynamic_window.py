# SPDX-License-Identifier: GPL-2.0-or-later
"""A reactive robot: the dynamic window.

D. Fox, W. Burgard, S. Thrun: The dynamic window approach to collision avoidance. IEEE Robotics & Automation Magazine 4 (1),
1997. The names of the terms are those of its equations: among the velocities that can be reached within an interval and are
admissible, v <= sqrt(2 dist a) for both axes, the one with the greatest smoothed sum of heading, dist and velocity is
taken. Obstacles are taken to stand still, as there."""

from __future__ import annotations

import numpy as np
from trips import Command, Floats, Scene, Seen

ALPHA, BETA, GAMMA = 2.0, 0.2, 0.2  # weights of heading, dist and velocity
SPEEDS, TURNS = 7, 15  # that are compared
FAR = 3.0  # m: dist is not greater
PLACES = 48  # on each curve, at which it is compared with obstacles
MARGIN = 0.1  # m, beside obstacles


class DynamicWindow:
    """Decides in each step of the world."""

    period = 1

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def decide(self, seen: Seen) -> Command:
        """The velocity for the next interval."""
        limits, interval = self.scene.limits, self.scene.interval
        v0, w0 = seen.velocity[0], seen.velocity[2]
        v, w = np.meshgrid(np.linspace(max(0.0, v0 - limits.acceleration * interval),
                                       max(0.0, min(limits.speed, v0 + limits.acceleration * interval)), SPEEDS),
                           np.linspace(max(-limits.turn, w0 - limits.turn_acceleration * interval),
                                       min(limits.turn, w0 + limits.turn_acceleration * interval), TURNS), indexing="ij")
        dist = self.dist(seen, v, w)
        admissible = (v <= np.sqrt(2 * dist * limits.acceleration)) & (abs(w) <= np.sqrt(2 * dist * limits.turn_acceleration))
        if not admissible.any():
            return float(v[0, 0]), 0.0
        worth = smoothed(ALPHA * self.heading(seen, v, w) + BETA * dist / FAR + GAMMA * v / limits.speed)
        best = np.where(admissible, worth, -np.inf).argmax()
        return float(v.flat[best]), float(w.flat[best])

    def dist(self, seen: Seen, v: Floats, w: Floats) -> Floats:
        """Metres on each curve before the robot touches something; FAR for turns on the spot, as it is round."""
        way = np.linspace(0, FAR, PLACES)
        turned = np.where(v > 0, w / np.maximum(v, 1e-9), 0.0)[..., None] * way
        places = seen.pose[:2] + along(seen.pose[2], turned, way)
        free = np.full(turned.shape, np.inf)
        for other in seen.others[:, :2]:
            free = np.minimum(free, np.linalg.norm(places - other, axis=-1) - self.scene.other_radius)
        for wall in self.scene.walls:
            free = np.minimum(free, distance_to(np.asarray(wall), places))
        touches = free < self.scene.radius + MARGIN
        first = np.where(touches.any(-1), way[touches.argmax(-1)], FAR)
        return np.where(v > 0, first, FAR)

    def heading(self, seen: Seen, v: Floats, w: Floats) -> Floats:
        """1 if the robot faces the goal after the interval and the way on which it then stops, 0 if it turns its back."""
        limits, interval = self.scene.limits, self.scene.interval
        turned = w * interval + np.sign(w) * w**2 / (2 * limits.turn_acceleration)
        way = v * interval + v**2 / (2 * limits.acceleration)
        to_goal = self.scene.goal - (seen.pose[:2] + along(seen.pose[2], turned, way))
        off = np.arctan2(to_goal[..., 1], to_goal[..., 0]) - seen.pose[2] - turned
        return 1 - abs(np.arctan2(np.sin(off), np.cos(off))) / np.pi


def along(heading: float, turned: Floats, way: Floats) -> Floats:
    """The way over ground on arcs that turn by these angles on this length."""
    half = turned / 2
    chord = way * np.sinc(half / np.pi)
    return np.stack([chord * np.cos(heading + half), chord * np.sin(heading + half)], -1)


def distance_to(wall: Floats, places: Floats) -> Floats:
    """Metres from places to a wall between two points."""
    direction = wall[1] - wall[0]
    share = np.clip(((places - wall[0]) * direction).sum(-1) / (direction**2).sum(), 0, 1)
    return np.linalg.norm(places - wall[0] - share[..., None] * direction, axis=-1)


def smoothed(values: Floats) -> Floats:
    """Means over 3 by 3 neighbours."""
    wide = np.pad(values, 1, mode="edge")
    rows, columns = values.shape
    return sum(wide[i:i + rows, j:j + columns] for i in range(3) for j in range(3)) / 9
