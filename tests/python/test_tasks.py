# SPDX-License-Identifier: GPL-2.0-or-later
"""Shipped tasks with several robots: simple policies do them, random actions don't, and results are what they say."""

from __future__ import annotations

from typing import Any, Callable

import numpy as np
import pytest

pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")
import gymnasium as gym  # noqa: E402
from stagesim import env as stage_env  # noqa: E402
from stagesim.env.tasks import worlds  # noqa: E402

Policy = Callable[[Any, np.random.Generator], Any]
TEAMS = ("Navigate8", "Navigate32", "Swap", "Cover", "Pursue", "PushT")
BEARINGS = np.radians(np.linspace(-174.375, 174.375, 32))


def played(task: str | stage_env.Task, policy: Policy | None = None, n: int = 12, seed: int = 5) -> dict[str, Any]:
    """The means of the infos at the ends of n episodes, and "reward", that of all robots together."""
    env = stage_env.StageArrayEnv(n, task=task, threads=2)
    seen, random = env.reset(seed), np.random.default_rng(2)
    total, over, ends = np.zeros(n), np.zeros(n, bool), {}
    while not over.all():
        actions = policy(seen, random) if policy else random.uniform(-1, 1, (n, len(env.agents), 2))
        step = env.step(actions)
        total += np.where(over, 0, step.rewards.sum(1))
        ended = (step.terminated | step.truncated) & ~over[:, None]
        for name, values in step.info.items():
            ends[name] = np.where(ended, values, ends.get(name, np.zeros(values.shape)))
        over |= step.over
        seen = step.observations
    return {"reward": total.mean(), **{name: float(values.mean()) for name, values in ends.items()}}


# ---- policies -----------------------------------------------------------------------------------


def drive(goal: Any, ranges: Any, free: float) -> Any:
    """Drives in a free direction near that of the goal (cosine and sine), and back away from near obstacles."""
    around = np.stack([np.roll(ranges, shift, -1) for shift in range(-2, 3)]).min(0)
    likes = np.cos(BEARINGS - np.arctan2(goal[..., 1:], goal[..., :1])) + 2 * np.minimum(around, free)
    turn = BEARINGS[likes.argmax(-1)]
    blocked = ranges[..., np.abs(BEARINGS) < 1].min(-1) < 0.35
    speed = np.where(blocked, -0.6, np.where(np.abs(turn) < 0.6, 1, 0))
    return np.stack([speed, np.where(blocked, 0, np.clip(2 * turn, -1, 1))], -1)


def navigate(seen: Any, random: np.random.Generator) -> Any:
    return drive(seen[..., 1:3], 4 * seen[..., 5:], 1.5)


def pursue(seen: Any, random: np.random.Generator) -> Any:
    return drive(seen[..., 1:3], 4 * seen[..., 11:], 0.5)


def cover(seen: Any, random: np.random.Generator) -> Any:
    """Each robot drives to the nearest pixel that isn't covered, with noise so that it doesn't hesitate for ever."""
    image = seen["image"][..., 0]
    along = 0.75 * (np.arange(8) - 3.5)
    ahead, left = (axis.reshape(-1) for axis in np.meshgrid(along, along))
    away = np.hypot(ahead, left)
    cost = np.where(image.reshape(*image.shape[:2], -1) == 128, away + 0.6 * (1 - ahead / away), np.inf)
    nearest, nothing = cost.argmin(-1), np.isinf(cost.min(-1))
    goal = np.stack([np.where(nothing, 1, ahead[nearest]), np.where(nothing, 0, left[nearest])], -1)
    actions = drive(goal, 4 * seen["state"][..., 3:], 0.5)
    return np.clip(actions + 0.4 * random.normal(0, 1, actions.shape), -1, 1)


LANE = -0.1  # y at which robots pass the bay of the corridor
BAYS = {2: -0.32, 3: 0.32}  # x of the robots that wait there


def swap(seen: Any, random: np.random.Generator) -> Any:
    """The second group waits in the bay until the first one has passed."""
    way = seen[..., 4, None]
    place, heading = 5 * way * seen[..., :2], way * seen[..., 2:4]
    x, y = place[..., 0], place[..., 1]
    waits = ((np.abs(x) < 0.62) & (y > 0.3))[:, 2:]
    goals = np.zeros_like(place)
    for robot in range(4):
        here, late = x[:, robot], robot % 2
        if robot < 2:
            goes = np.all(waits | (x[:, 2:] < -1), axis=1) | (here > -1.2)
            goal = _first(here, y[:, robot], -1, np.where(goes, 3.4, np.where(here > -1.45 - 0.45 * late, np.minimum(
                here, -1.3 - 0.45 * late), -1.3)))
            goal = np.where((late == 0) | (x[:, 0] > -2)[:, None], goal, [-4.3, -0.5])
            goals[:, robot] = np.where((here > 3.2)[:, None], [4.3, 0.45 - 0.9 * late], goal)
        else:
            goals[:, robot] = _second(robot, x, y)
            goals[:, robot] = np.where((here < -3.2)[:, None], [-4.3, 0.45 - 0.9 * late], goals[:, robot])
    return _to(goals - place, heading)


def _first(x: Any, y: Any, side: int, goal: Any) -> Any:
    """First to the entrance of the corridor, then along it to the x of the goal."""
    outside = (side * x > 3) & (np.abs(y - LANE) > 0.08)
    return np.stack([np.where(outside, side * 3.6, goal), np.full_like(x, LANE)], -1)


def _second(robot: int, x: Any, y: Any) -> Any:
    """Into the bay, and out of it and on when the first group has passed."""
    here, bay = x[:, robot], BAYS[robot]
    is_in = (np.abs(here - bay) < 0.12) | ((np.abs(here) < 0.55) & (y[:, robot] > 0.25))
    into = np.where(is_in[:, None], [bay, 0.45], _first(here, y[:, robot], 1, np.full_like(here, bay)))
    if robot == 3:
        into = np.where((x[:, 2] < 1.8)[:, None], into, [4.3, -0.5])
    out = np.stack([np.where((here > -0.62) & (y[:, robot] > 0.05), here, -3.6), np.full_like(here, LANE)], -1)
    if robot == 3:
        out = np.where((x[:, 2] > -1)[:, None], [bay, 0.45], out)
    return np.where((x[:, :2] > 1).all(1)[:, None], out, into)


def _to(away: Any, heading: Any) -> Any:
    error = np.arctan2(away[..., 1], away[..., 0]) - np.arctan2(heading[..., 1], heading[..., 0])
    error = (error + np.pi) % (2 * np.pi) - np.pi
    far = np.hypot(away[..., 0], away[..., 1])
    speed = np.where(np.abs(error) < 0.4, np.clip(3 * far, 0, 1), 0)
    return np.stack([speed, np.where(far > 0.05, np.clip(2 * error, -1, 1), 0)], -1)


def contacts() -> Any:
    """Points on the outline of the block where robots push, and the directions outwards: x, y, x, y."""
    (left, low, right, top), (near, bottom, far, _) = worlds.T_PARTS
    on_top = [(share * right, top, 0, 1) for share in (-0.85, -0.45, 0, 0.45, 0.85)]
    beside = [(x, y, np.sign(x), 0) for x, y in ((left, (low + top) / 2), (right, (low + top) / 2), (near, 0.57 * bottom),
                                                 (far, 0.57 * bottom), (near, 0.89 * bottom), (far, 0.89 * bottom))]
    return np.array([*on_top, *beside, (0, bottom, 0, -1)])


def push(seen: Any, random: np.random.Generator) -> Any:
    """Each robot drives around the block to the point from which it pushes best, and pushes."""
    seen, actions = seen.astype(float), np.zeros((*seen.shape[:2], 2))
    taken = None
    for robot in range(2):
        block, target, turn, error = (seen[:, robot, i:i + 2] for i in (0, 2, 6, 8))
        actions[:, robot], taken = _push(4 * block, 4 * (target - block), turn, np.arctan2(error[:, 1], error[:, 0]), taken)
    return actions


def _push(block: Any, wanted: Any, turn: Any, error: Any, taken: Any) -> tuple[Any, Any]:
    """The action of one robot, and the place where it pushes, relative to the block."""
    places, normals = (_turned(contacts()[:, i:i + 2], turn) for i in (0, 2))
    arms = places[..., 1] * normals[..., 0] - places[..., 0] * normals[..., 1]
    gains = -(normals * wanted[:, None]).sum(-1) - arms * error[:, None]
    starts = places + 0.17 * normals
    angle = np.arctan2(-block[:, 1], -block[:, 0])
    around = (np.arctan2(starts[..., 1], starts[..., 0]) - angle[:, None] + np.pi) % (2 * np.pi) - np.pi
    scores = gains - 0.05 * np.abs(around)
    if taken is not None:
        scores -= np.where(((places - taken[:, None]) ** 2).sum(-1) < 0.36**2, 9, 0)
    each, best = np.arange(len(block)), scores.argmax(1)
    normal, around = normals[each, best], around[each, best]
    away = block + starts[each, best]
    along, beside = -(away * normal).sum(1), np.abs(away[:, 0] * normal[:, 1] - away[:, 1] * normal[:, 0])
    far = np.hypot(*block.T)[:, None]
    out = -block / far
    circle = np.stack([-out[:, 1], out[:, 0]], -1) * np.sign(around)[:, None] + 3 * (0.95 - far) * out
    move = np.where(np.abs(around)[:, None] < 0.3, 5 * (away + normal * np.clip(3 * beside, 0, 0.3)[:, None]),
                    np.where(far < 0.88, out, circle))
    speed = np.where(gains[each, best] > 0.01, np.clip(0.2 + 1.5 * np.hypot(*wanted.T) + 0.3 * np.abs(error), 0, 1), 0)
    pushes = (beside < 0.12) & (along > -0.03) & (along < 0.04)
    move = np.where(pushes[:, None], 3 * (away + normal * along[:, None]) - normal * speed[:, None], move)
    return move / np.maximum(np.abs(move).max(1), 1)[:, None], places[each, best]


def _turned(points: Any, turn: Any) -> Any:
    """Points of the block's frame in that of the world, for each heading."""
    x, y, (cosine, sine) = points[:, 0], points[:, 1], (turn[:, :1], turn[:, 1:])
    return np.stack([x * cosine - y * sine, x * sine + y * cosine], -1)


# ---- tasks can be done --------------------------------------------------------------------------


@pytest.mark.parametrize(("task", "policy", "value", "least", "most_by_chance"), [
    ("Navigate8", navigate, "is_success", 0.7, 0.1), ("Swap", swap, "is_success", 0.9, 0), ("Cover", cover, "covered", 0.85, 0.4),
    ("Pursue", pursue, "is_success", 0.7, 0.1), ("PushT", push, "is_success", 0.8, 0)])
def test_simple_policies_are_far_better_than_chance(task: str, policy: Policy, value: str, least: float,
                                                    most_by_chance: float) -> None:
    found, by_chance = played(task, policy), played(task)
    assert found[value] >= least
    assert by_chance[value] <= most_by_chance
    assert found["reward"] > by_chance["reward"] + 2


def test_thirty_two_robots_find_their_goals() -> None:
    assert played("Navigate32", navigate, 3)["is_success"] > 0.6


# ---- worlds -------------------------------------------------------------------------------------


@pytest.mark.parametrize("task", TEAMS)
def test_worlds_are_closed_and_known_to_gymnasium(task: str) -> None:
    env = gym.make_vec(f"Stage/{task}-v0", num_envs=2)
    env.reset(seed=1)
    env.step(env.action_space.sample())
    assert set(env._episodes.batch.explain()) == {None}  # type: ignore[attr-defined]
    env.close()
