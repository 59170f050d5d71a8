# SPDX-License-Identifier: GPL-2.0-or-later
"""Parts of observations that many tasks have in common."""

from __future__ import annotations

import numpy as np

from .. import _core
from . import recycled
from .arrays import Array, namespace_of
from .scene import Scene


def joined(*parts: Array) -> Array:
    """Joins parts of observations along the last axis, as float32.

    Args:
        parts: arrays of shape (n, robots) or (n, robots, k), of one library.
    """
    wide = [part if part.ndim > 2 else part[..., None] for part in parts]
    if isinstance(wide[0], np.ndarray):
        made = recycled.empty((*wide[0].shape[:2], sum(part.shape[2] for part in wide)), np.float32)
        start = 0
        for part in wide:
            made[..., start:start + part.shape[2]] = part
            start += part.shape[2]
        return made
    xp = namespace_of(wide[0])
    return xp.concat([xp.astype(part, xp.float32) for part in wide], axis=2)


def free_space(scene: Scene, reach: float) -> Array:
    """The ranges in units of `reach` (metres), from 0 to 1; without a reading 1: float32, (n, robots, samples)."""
    ranges = scene.ranges
    if isinstance(ranges, np.ndarray):
        made = recycled.empty(ranges.shape, np.float32)
        _core.find_free_space(ranges, reach, made)
        return made
    xp = scene.xp
    near = ranges < reach
    return xp.astype(xp.where(near, ranges * (1 / reach), xp.ones_like(ranges)), xp.float32)


def speeds(scene: Scene, top_speed: tuple[float, float, float]) -> Array:
    """Set speeds forwards and turning in units of `top_speed` (m/s, rad/s): float32, shape (n, robots, 2)."""
    velocity = scene.velocity
    forwards, turning = 1 / (top_speed[0] or 1), 1 / (top_speed[2] or 1)
    if isinstance(velocity, np.ndarray):
        made = recycled.empty((*velocity.shape[:2], 2), np.float32)
        _core.find_speeds(velocity, forwards, turning, made)
        return made
    xp = scene.xp
    return xp.astype(xp.stack([velocity[..., 0] * forwards, velocity[..., 2] * turning], axis=-1), xp.float32)


def towards(scene: Scene, points: Array, far: float) -> Array:
    """Points seen from the robots: distance in units of `far` (0 to 1), cosine and sine of the bearing.

    On the host it has the same bits on all processors.

    Args:
        scene: the worlds.
        points: x, y, metres, shape (n, robots, 2), or broadcastable to it.
        far: distances are clipped to this, metres.

    Returns:
        float32, shape (n, robots, 3).
    """
    pose = scene.pose
    if isinstance(pose, np.ndarray):
        made = recycled.empty(pose.shape, np.float32)
        _core.find_towards(pose, np.broadcast_to(points, (*pose.shape[:2], 2)), far, made)
        return made
    xp = scene.xp
    distance, bearing = seen_from(pose, points)
    near = xp.clip(distance * (1 / far), max=1.0)
    return xp.astype(xp.concat([near[..., None], bearing], axis=-1), xp.float32)


def seen_from(pose: Array, point: Array) -> tuple[Array, Array]:
    """Computes distances and bearings of points, seen from robots.

    Args:
        pose: x, y (metres) and heading (radians) of the robots: shape (..., 3).
        point: x, y of the points, metres: shape (..., 2).

    Returns:
        The distances (metres, shape (...)), and cosine and sine of the bearings relative to the headings:
        shape (..., 2). A point at the robot's position counts as straight ahead.
    """
    xp = namespace_of(pose)
    away_x, away_y = point[..., 0] - pose[..., 0], point[..., 1] - pose[..., 1]
    # A contiguous copy makes NumPy use the same loops, and thus the same rounding, for any number of worlds.
    heading = pose[..., 2] + 0.0
    cosine, sine = xp.cos(heading), xp.sin(heading)
    distance = xp.sqrt(away_x * away_x + away_y * away_y)
    here = distance == 0
    inverse = 1 / xp.where(here, xp.ones_like(distance), distance)
    ahead = xp.where(here, xp.ones_like(distance), away_x * cosine + away_y * sine) * inverse
    return distance, xp.stack([ahead, (away_y * cosine - away_x * sine) * inverse], axis=-1)


def distance_to(pose: Array, point: Array) -> Array:
    """Computes only the distances of seen_from()."""
    if isinstance(pose, np.ndarray) and pose.ndim == 3 and pose.shape[2] == 3 and pose.flags.c_contiguous:
        made = recycled.empty(pose.shape[:2], np.float64)
        _core.find_distances(pose, np.broadcast_to(point, (*made.shape, 2)), made)
        return made
    away_x, away_y = point[..., 0] - pose[..., 0], point[..., 1] - pose[..., 1]
    return namespace_of(pose).sqrt(away_x * away_x + away_y * away_y)


def with_headings(places: Array, headings: Array) -> Array:
    """Poses at places, shape (n, count, 2), with headings in radians, shape (n, count): shape (n, count, 3)."""
    return namespace_of(places).concat([places, headings[..., None]], axis=-1)
