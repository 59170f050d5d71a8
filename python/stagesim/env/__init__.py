# SPDX-License-Identifier: GPL-2.0-or-later
"""Environments for reinforcement learning, made from a world file and a task.

Importing this module registers "Stage/Navigate-v0", "Stage/Disperse-v0", "Stage/Forage-v0" and
"Stage/Measured-v0" with Gymnasium.
"""

from __future__ import annotations

try:
    import gymnasium as _gymnasium
    import pettingzoo as _pettingzoo  # noqa: F401
except ImportError as error:
    raise ImportError(f"stagesim.env needs Gymnasium and PettingZoo ({error}): "
                      'pip install "stagesim[env]"', name=error.name) from error

from .parallel import StageParallelEnv
from .places import reachable_places
from .single import StageEnv
from .task import Outcome, Scene, Task, seen_from
from .tasks import TASKS, Disperse, Forage, Measured, Navigate
from .vector import StageVectorEnv

#: The name that PettingZoo's environments use.
parallel_env = StageParallelEnv

__all__ = [
    "TASKS", "Disperse", "Forage", "Measured", "Navigate", "Outcome", "Scene", "StageEnv", "StageParallelEnv",
    "StageVectorEnv", "Task", "parallel_env", "reachable_places", "seen_from",
]

for _name in TASKS:
    _gymnasium.register(id=f"Stage/{_name}-v0", entry_point="stagesim.env:StageEnv",
                        vector_entry_point="stagesim.env:StageVectorEnv", kwargs={"task": _name})
