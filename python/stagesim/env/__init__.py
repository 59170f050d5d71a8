# SPDX-License-Identifier: GPL-2.0-or-later
"""Environments for reinforcement learning, made from a world file and a task.

Importing this module registers "Stage/NAME-v0" with Gymnasium for each shipped task, such as "Stage/Navigate-v0".
`gymnasium.make("stagesim.env:Stage/Navigate-v0")` imports it.
"""

from __future__ import annotations

try:
    import array_api_compat as _array_api_compat  # noqa: F401
    import gymnasium as _gymnasium
    import pettingzoo as _pettingzoo  # noqa: F401
except ImportError as error:
    raise ImportError(f"stagesim.env needs Gymnasium, PettingZoo and array-api-compat ({error}): "
                      'pip install "stagesim[env]"', name=error.name) from error

from .adapters import to_jax, to_sb3, to_torchrl
from .features import distance_to, free_space, joined, seen_from, speeds, towards, with_headings
from .parallel import StageParallelEnv
from .places import reachable_places
from .randoms import Randoms
from .robots import ArrayStep, StageArrayEnv
from .scene import Scene
from .single import StageEnv
from .statistics import Statistics
from .task import Outcome, Task
from .tasks import TASKS, Cover, Disperse, Forage, Measured, Navigate, Navigate8, Navigate32, Pursue, PushT, Swap
from .vector import StageVectorEnv

#: The name that PettingZoo's environments use.
parallel_env = StageParallelEnv

__all__ = [
    "TASKS", "ArrayStep", "Cover", "Disperse", "Forage", "Measured", "Navigate", "Navigate8", "Navigate32", "Outcome",
    "Pursue", "PushT", "Randoms", "Scene", "StageArrayEnv", "StageEnv", "StageParallelEnv", "StageVectorEnv", "Statistics",
    "Swap", "Task", "distance_to", "free_space", "joined", "parallel_env", "reachable_places", "seen_from", "speeds",
    "to_jax", "to_sb3", "to_torchrl", "towards", "with_headings",
]

for _name in TASKS:
    _gymnasium.register(id=f"Stage/{_name}-v0", entry_point="stagesim.env:StageEnv",
                        vector_entry_point="stagesim.env:StageVectorEnv", kwargs={"task": _name})
