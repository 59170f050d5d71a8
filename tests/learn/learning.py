# SPDX-License-Identifier: GPL-2.0-or-later
"""Worlds, actions and checks that the tests of all libraries share."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, Dict
from stagesim.env import Navigate, Scene, StageVectorEnv, free_space, towards

WORLDS = 5
STEPS = 60


def library(module: str, name: str) -> Any:
    """Imports a module, or skips the tests of the file."""
    try:
        return importlib.import_module(module)
    except ImportError:
        pytest.skip(f"skipped: {name} is not installed; try tools/setup --learn", allow_module_level=True)


def short() -> Navigate:
    """A task whose episodes are short: many reach the goal, and all others are truncated."""
    return Navigate(limit=12, goal_radius=1.5, steps=10)


class Several(Navigate):
    """Short episodes with discrete actions, and with observations that are numbers and a picture."""

    choices = ((0.5, 0, 0), (0, 0, 1.5), (0, 0, -1.5))

    def __init__(self) -> None:
        super().__init__(limit=12, goal_radius=1.5, steps=10)

    def observation_space(self, scene: Scene) -> Dict:
        return Dict({"goal": Box(-1, 1, (3,), np.float32), "picture": Box(0, 255, (4, 8, 1), np.uint8)})

    def observe(self, scene: Scene) -> dict[str, Any]:
        free = free_space(scene, self.reach)
        return {"goal": towards(scene, scene.notes["goal"], self.far),
                "picture": (255 * free).reshape(scene.n, scene.robots, 4, 8, 1).astype(np.uint8)}


def same(found: Any, expected: Any) -> bool:
    """Compares observations, which may be arrays by name."""
    if isinstance(expected, dict):
        return found.keys() == expected.keys() and all(same(found[name], expected[name]) for name in expected)
    return bool(np.array_equal(np.asarray(found), expected)) and np.asarray(found).dtype == expected.dtype


def vector(mode: str, **options: Any) -> StageVectorEnv:
    """Worlds with short episodes."""
    return StageVectorEnv(WORLDS, task=short(), autoreset_mode=mode, **options)


def some_actions(shape: tuple[int, ...] = (WORLDS, 2), steps: int = STEPS) -> list[np.ndarray]:
    """Random actions that mostly drive forwards, the same in each call."""
    random = np.random.default_rng(3)
    actions = [random.uniform(-1, 1, shape).astype(np.float32) for _ in range(steps)]
    for action in actions:
        action[..., 0] = np.abs(action[..., 0])
        action[..., 1] *= 0.3
    return actions


def assert_both_ends(terminated: Any, truncated: Any) -> None:
    """The comparison has seen goals as well as time limits."""
    assert np.sum(np.asarray(terminated)) >= 3 and np.sum(np.asarray(truncated)) >= 3
