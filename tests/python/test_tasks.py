# SPDX-License-Identifier: GPL-2.0-or-later
"""Shipped tasks with several robots: simple policies do them, random actions don't, and results are what they say."""

from __future__ import annotations

import math
import pickle
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest

pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")
import gymnasium as gym  # noqa: E402
import stagesim as st  # noqa: E402
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
        target, place, error = seen[:, robot, 0:2], seen[:, robot, 2:4], seen[:, robot, 6:8]
        actions[:, robot], taken = _push(-1.5 * place, 1.5 * target, -np.arctan2(error[:, 1], error[:, 0]), taken)
    return actions


def _push(block: Any, wanted: Any, error: Any, taken: Any) -> tuple[Any, Any]:
    """The action of one robot, and the place where it pushes, in the frame of the block.

    Args:
        block, wanted: the block's place relative to the robot, and the target's relative to the block, metres.
        error: heading of the block relative to that of the target, radians.
        taken: where another robot pushes.
    """
    places, normals = (np.tile(contacts()[:, i:i + 2], (len(block), 1, 1)) for i in (0, 2))
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
    move = np.where(np.abs(around)[:, None] < 0.3, 3 * (away + normal * np.clip(3 * beside, 0, 0.3)[:, None]),
                    np.where(far < 0.88, out, circle))
    speed = np.where(gains[each, best] > 0.01, np.clip(0.15 + 1.2 * np.hypot(*wanted.T) + 0.3 * np.abs(error), 0, 1), 0)
    pushes = (beside < 0.12) & (along > -0.03) & (along < 0.04)
    move = np.where(pushes[:, None], 2 * (away + normal * along[:, None]) - normal * speed[:, None], move)
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


@pytest.mark.parametrize("task", ["Cover", "Pursue", "PushT"])
def test_devices_compute_the_same(task: str) -> None:
    made = stage_env.TASKS[task](limit=8)
    try:
        with_device = stage_env.StageArrayEnv(2, task=made, device="opencl", arrays="numpy")
    except (st.StageError, ValueError) as error:
        pytest.skip(str(error))  # there is no device, or CUDA has it as well
    alone = stage_env.StageArrayEnv(2, task=made)
    with_device.reset(1)
    alone.reset(1)
    random = np.random.default_rng(1)
    for _ in range(12):
        actions = random.uniform(-1, 1, (2, len(alone.agents), 2))
        assert with_device.step(actions).rewards.tobytes() == alone.step(actions).rewards.tobytes()
    assert with_device.batch.state_hashes() == alone.batch.state_hashes()


@pytest.mark.parametrize("task", TEAMS)
def test_copies_go_on_in_the_same_way(task: str) -> None:
    env = stage_env.StageArrayEnv(3, task=stage_env.TASKS[task](limit=9))
    env.reset(1)
    random = np.random.default_rng(1)
    actions = random.uniform(-1, 1, (12, 3, len(env.agents), 2))
    for action in actions[:4]:
        env.step(action)
    other = pickle.loads(pickle.dumps(env))
    for action in actions[4:]:
        mine, others = env.step(action), other.step(action)
        assert mine.rewards.tobytes() == others.rewards.tobytes()
        seen = [step.observations if isinstance(step.observations, dict) else {"": step.observations} for step in (mine, others)]
        assert all(seen[0][name].tobytes() == seen[1][name].tobytes() for name in seen[0])


def test_the_eight_robots_of_the_example_take_thirty_lines(root: Path) -> None:
    program = root / "examples" / "learning" / "eight_robots.py"
    if not program.exists():
        pytest.skip("there is no examples/learning")
    code = [line for line in program.read_text().splitlines() if line.strip() and not line.strip().startswith(("#", '"""'))]
    assert len(code) <= 30
    said = subprocess.run([sys.executable, str(program)], capture_output=True, text=True, check=True).stdout
    assert re.fullmatch(r"-?\d\.\d\d reward, \d\.\d% success by chance\n", said), said


# ---- results ------------------------------------------------------------------------------------


def test_a_corridor_needs_two_groups_and_two_sides() -> None:
    with pytest.raises(ValueError, match="found 3 robots, expected an even number"):
        stage_env.StageArrayEnv(1, task="Swap", robots="r[012]")
    with pytest.raises(ValueError, match="found no free place where x is beyond -9 m"):
        stage_env.StageArrayEnv(1, task=stage_env.Swap(line=9))


def test_robots_of_the_second_group_see_the_corridor_as_those_of_the_first_one() -> None:
    env = stage_env.StageArrayEnv(1, task="Swap")
    env.reset(1)
    env.batch.teleport([[[-3.5, 0.4, 0.3], [-4, -0.3, 0], [3.5, -0.4, 0.3 - math.pi], [4, 0.3, 0]]])
    seen = env.step(np.zeros((1, 4, 2))).observations[0]
    assert seen[0, :4] == pytest.approx([-0.7, 0.08, math.cos(0.3), math.sin(0.3)], abs=1e-6)
    assert seen[2, :4] == pytest.approx(seen[0, :4], abs=1e-6) and seen[:, 4].tolist() == [1, 1, -1, -1]


def test_the_evader_obeys_its_actions_only_if_it_learns() -> None:
    for learns in (False, True):
        ends, total = [], 0.0
        for sign in (-1, 1):
            env = stage_env.StageArrayEnv(4, task=stage_env.Pursue(learns=learns))
            env.reset(1)
            actions = np.zeros((4, 4, 2))
            actions[:, 3] = sign
            for _ in range(10):
                step = env.step(actions)
                total += np.abs(step.rewards.sum(1)).max() if learns else np.abs(step.rewards[:, 3]).max()
            ends.append(env.batch.pose.tobytes())
        assert (ends[0] != ends[1]) is learns
        assert total == pytest.approx(0, abs=1e-12)


def test_the_evader_flees_from_near_pursuers() -> None:
    env = stage_env.StageArrayEnv(16, task="Pursue")
    env.reset(1)
    angles = np.arange(16) * math.tau / 16
    poses = np.tile([[0.0, 0.0, 0.0], [3.5, 3.5, 0], [-3.5, 3.5, 0], [0, -0.2, 0]], (16, 1, 1))
    poses[:, 0, :2] = np.stack([0.8 * np.cos(angles), 0.8 * np.sin(angles) - 0.2], 1)
    poses[:, 3, 2] = np.roll(angles, 5)
    env.batch.teleport(poses)
    for _ in range(10):
        step = env.step(np.zeros((16, 4, 2)))
    assert step.info["distance"][:, 0].min() > 1.3


def test_covered_cells_are_those_around_the_ways_of_robots() -> None:
    task = stage_env.Cover()
    env = stage_env.StageArrayEnv(2, task=task)
    env.reset(2)
    notes, random = env._episodes.scene.notes, np.random.default_rng(1)
    rewards, ways = np.zeros(2), [env.batch.pose.copy()]
    first = notes["covered"].copy()
    for _ in range(60):
        step = env.step(np.stack([random.uniform(0, 1, (2, 4)), random.uniform(-1, 1, (2, 4))], -1))
        rewards += (step.rewards + 0.05 * env.batch.stalled).sum(1)
        ways.append(env.batch.pose.copy())
    for world in range(2):
        cells, origin = notes["cells"][world], notes["origin"][world]
        rows, columns = np.nonzero(cells)
        visited = np.floor((np.array(ways)[:, world, :, :2].reshape(-1, 2) - origin) / task.cell)
        squares = ((np.stack([columns, rows], 1)[:, None] - visited) ** 2).sum(-1)
        covered = squares.min(1) <= (task.radius / task.cell) ** 2
        assert ((cells[rows, columns] == 255) == covered).all() and 0.1 < covered.mean() < 0.9
        assert notes["covered"][world] == covered.sum() and notes["count"][world] == len(covered)
        assert rewards[world] == pytest.approx(task.cell**2 * (covered.sum() - first[world]))
        assert step.info["covered"][world, 0] == pytest.approx(covered.mean())


def test_images_of_covered_cells_are_seen_from_the_robot() -> None:
    env = stage_env.StageArrayEnv(1, task="Cover")
    env.reset(3)
    actions = np.tile([1.0, 0.2], (1, 4, 1))
    for _ in range(40):
        seen = env.step(actions).observations["image"][0, ..., 0]
    notes = env._episodes.scene.notes
    cells, origin = notes["cells"][0], notes["origin"][0]
    for robot in range(4):
        x, y, heading = env.batch.pose[0, robot]
        heading = round(heading / math.tau * 64) * math.tau / 64
        column, row = np.floor((np.array([x, y]) - origin) / 0.25)
        for i in range(8):
            for j in range(8):
                ahead, left = 3 * (j - 3.5), 3 * (i - 3.5)
                at = (math.floor(row + ahead * math.sin(heading) + left * math.cos(heading) + 0.500001),
                      math.floor(column + ahead * math.cos(heading) - left * math.sin(heading) + 0.500001))
                assert seen[robot, i, j] == cells[at]
    assert len(np.unique(seen)) == 3


def test_images_can_be_part_of_a_vector() -> None:
    images, vectors = (stage_env.StageArrayEnv(2, task=stage_env.Cover(image=image)) for image in (True, False))
    first, second = images.reset(1), vectors.reset(1)
    assert vectors.single_observation_space.shape == (99,)
    assert second[..., :35].tobytes() == first["state"].tobytes()
    assert 255 * second[..., 35:] == pytest.approx(first["image"].reshape(2, 4, 64))


def clipped(polygon: Any, corners: Any) -> Any:
    """The part of a convex polygon within another one, counter-clockwise (Sutherland and Hodgman, 1974)."""
    for (x, y), (to_x, to_y) in zip(corners, np.roll(corners, -1, 0)):
        sides = [(to_x - x) * (b - y) - (to_y - y) * (a - x) for a, b in polygon]
        kept = []
        for i, (point, side) in enumerate(zip(polygon, sides)):
            before, side_before = polygon[i - 1], sides[i - 1]
            if (side >= 0) != (side_before >= 0):
                kept.append(before + (point - before) * (side_before / (side_before - side)))
            if side >= 0:
                kept.append(point)
        polygon = np.array(kept)
        if not len(polygon):
            break
    return polygon


def area(polygon: Any) -> float:
    if len(polygon) < 3:
        return 0.0
    x, y = np.asarray(polygon).T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)


def rectangles(pose: Any) -> list[Any]:
    """The two parts of the block at a pose."""
    turn = np.array([[math.cos(pose[2])], [math.sin(pose[2])]]).T
    return [_turned(np.array([[left, low], [right, low], [right, high], [left, high]]), turn)[0] + pose[:2]
            for left, low, right, high in worlds.T_PARTS]


def test_the_overlap_of_the_block_with_its_target_is_that_of_polygons() -> None:
    task = stage_env.PushT()
    scene = stage_env.StageArrayEnv(1, task=task)._episodes.scene
    target = np.array(task.target)
    whole = area(worlds.t_corners())
    assert whole == pytest.approx(sum(area(part) for part in rectangles(target))) == pytest.approx(7 / 16)
    poses = target + np.random.default_rng(1).normal(0, [0.1, 0.1, 0.3], (200, 3))
    found = task._overlap(scene, np.vstack([target, [[9, 9, 0]], poses]))
    assert found[:2] == pytest.approx([1, 0], abs=1e-7)
    exact = np.array([sum(area(clipped(one, other)) for one in rectangles(pose) for other in rectangles(target))
                      for pose in poses]) / whole
    assert found[2:] == pytest.approx(exact, abs=1e-7)
    assert exact.min() < 0.6 and exact.max() > 0.9


def test_pushers_observe_the_block_and_are_paid_for_its_overlap() -> None:
    env = stage_env.StageArrayEnv(2, task="PushT")
    env.reset(4)
    scene = env._episodes.scene
    before, first = scene.notes["overlap"].copy(), scene.notes["missing"].copy()
    random, rewards = np.random.default_rng(1), np.zeros((2, 2))
    seen = env.reset(4)
    for _ in range(60):
        step = env.step(push(seen, random))
        rewards += step.rewards
        seen = step.observations
        if step.over.any():
            break
    x, y, heading = env.batch.placed_pose[0, 0]
    turn = np.array([[math.cos(-heading), math.sin(-heading)]] * 2)
    target, places = np.array(env.task.target), env.batch.pose[0, :, :2] - [x, y]
    error = (target[2] - heading + math.pi) % math.tau - math.pi
    seen = seen.astype(float)[0]
    assert 1.5 * seen[:, :2] == pytest.approx(_turned((target[:2] - [x, y])[None], turn)[:, 0], abs=1e-5)
    assert 1.5 * seen[:, 2:4] == pytest.approx(_turned(places, turn)[0], abs=1e-5)
    assert seen[:, 4:6] == pytest.approx(seen[::-1, 2:4], abs=1e-6)
    assert seen[:, 6:8] == pytest.approx(np.array([[math.cos(error), math.sin(error)]] * 2), abs=1e-6)
    assert seen[:, 8:10] == pytest.approx(np.clip(5 * seen[:, :2], -1, 1), abs=1e-6)
    assert seen[:, 10] == pytest.approx(np.clip([error / 0.3] * 2, -1, 1), abs=1e-6)
    gained = 5 * (scene.notes["overlap"] - before) + first - scene.notes["missing"]
    assert rewards == pytest.approx(np.stack([gained, gained], 1)) and np.abs(gained).max() > 0.5
    missing = 5 * step.info["distance"][0, 0] + 2.5 * abs(error)
    assert scene.notes["missing"][0] == pytest.approx(missing)
