# SPDX-License-Identifier: GPL-2.0-or-later
"""The shipped tasks."""

from __future__ import annotations

from ..task import Task
from .cover import Cover
from .disperse import Disperse
from .forage import Forage
from .measured import Measured
from .navigate import Navigate, Navigate8, Navigate32
from .push_t import PushT
from .pursue import Pursue
from .swap import Swap

#: The shipped tasks by the names that gymnasium.make() knows.
TASKS: dict[str, type[Task]] = {task.__name__: task for task in (
    Navigate, Navigate8, Navigate32, Swap, Cover, Pursue, PushT, Disperse, Forage, Measured)}

__all__ = ["TASKS", "Cover", "Disperse", "Forage", "Measured", "Navigate", "Navigate8", "Navigate32", "Pursue", "PushT",
           "Swap"]
