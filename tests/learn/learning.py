# SPDX-License-Identifier: GPL-2.0-or-later
"""Worlds, actions and checks that the tests of all libraries share."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest
from stagesim.env import Navigate, StageVectorEnv

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
