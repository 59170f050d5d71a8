# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks the observations that a task returns."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.spaces import Box, Dict, Space
from gymnasium.vector.utils import batch_space

from .arrays import Array, are_within, on_host
from .scene import Scene
from .task import Observations


class Observed:
    """The observations of the robots of many worlds, which must be in the space that the task has promised.

    Args:
        space: the space of a robot's observations: a Box, or a Dict of boxes.
        scene: all worlds.
        task: the name of the task, for messages.

    Raises:
        TypeError: the space is of another kind.
    """

    def __init__(self, space: Space[Any], scene: Scene, task: str) -> None:
        self.space = space  #: the space of a robot
        self._robots = scene.robots
        self._names = scene.batch.names
        self._task = task
        boxes = dict(space.spaces) if isinstance(space, Dict) else {"": space}
        if not boxes or not all(isinstance(box, Box) for box in boxes.values()):
            raise TypeError(f"found the observation space {space}, expected a Box, or a Dict of boxes")
        self._parts = {name: _Part(box, scene) for name, box in boxes.items()}  # type: ignore[arg-type]

    @property
    def is_flat(self) -> bool:
        """True if observations are vectors, which those of a team are joined into."""
        return isinstance(self.space, Box) and len(self.space.shape) == 1

    def of_team(self) -> Space[Any]:
        """The space of all robots of a world together: a longer vector, or boxes with an axis for several robots."""
        if self.is_flat and isinstance(self.space, Box):
            low, high = (np.tile(bound, self._robots) for bound in (self.space.low, self.space.high))
            return Box(low, high, dtype=self.space.dtype)  # type: ignore[arg-type]
        return self.space if self._robots == 1 else batch_space(self.space, self._robots)

    def team(self, seen: Observations) -> Observations:
        """Converts observations of shape (n, robots, ...) to those of teams."""
        if isinstance(seen, dict):
            return {name: values[:, 0] if self._robots == 1 else values for name, values in seen.items()}
        if self.is_flat:
            return seen.reshape((seen.shape[0], -1))
        return seen[:, 0] if self._robots == 1 else seen

    def nothing(self, scene: Scene) -> Observations:
        """Observations of zeros."""
        made = {name: scene.arrays.zeros((scene.n, scene.robots, *part.shape), part.dtype)
                for name, part in self._parts.items()}
        return made if isinstance(self.space, Dict) else made[""]

    def checked(self, seen: Observations, scene: Scene) -> Observations:
        """The observations of the worlds of `scene` with the types of the space, 0 for NaN.

        Raises ValueError or TypeError if they are not in the space.
        """
        if not isinstance(self.space, Dict):
            return self._checked("", seen, scene)
        if not isinstance(seen, dict) or seen.keys() != self._parts.keys():
            found = sorted(seen) if isinstance(seen, dict) else type(seen).__name__
            raise TypeError(f"found observations {found}, expected a dict with {sorted(self._parts)}")
        return {name: self._checked(name, seen[name], scene) for name in self._parts}

    def _checked(self, name: str, seen: Array, scene: Scene) -> Array:
        part = self._parts[name]
        shape = (scene.n, scene.robots, *part.shape)
        if tuple(seen.shape) != shape:
            label = f" {name!r}" if name else ""
            raise ValueError(f"found observations{label} of shape {tuple(seen.shape)} from {self._task}.observe(), expected "
                             f"{shape}")
        made = part.of_type(scene.xp, seen)
        if part.holds(scene.xp, made):
            return made
        if part.is_float:
            made = scene.xp.where(scene.xp.isnan(made), scene.xp.zeros_like(made), made)
        if not part.holds(scene.xp, made):
            raise ValueError(self._wrong(name, part, made, scene))
        return made

    def _wrong(self, name: str, part: _Part, made: Array, scene: Scene) -> str:
        values, low, high = on_host(made), on_host(part.low), on_host(part.high)
        world, robot, *place = np.argwhere((values < low) | (values > high))[0].tolist()
        within = (np.broadcast_to(bound, part.shape)[tuple(place)] for bound in (low, high))
        number = place[0] if len(place) == 1 else tuple(place)
        label = f" of {name!r}" if name else ""
        rows = range(scene.n) if scene.rows is None else on_host(scene.rows).tolist()
        return (f"found {values[(world, robot, *place)]:g} as number {number}{label} of what {self._names[robot]} observes "
                f"in world {rows[world]}, expected {' to '.join(f'{bound:g}' for bound in within)}: scale it, or change "
                f"the bounds of the task {self._task}")


class _Part:
    """One array of observations."""

    def __init__(self, box: Box, scene: Scene) -> None:
        self.shape = box.shape
        self.is_float = box.dtype is not None and box.dtype.kind == "f"
        self.dtype = str(box.dtype)
        flat = len(np.unique(box.low)) <= 1 and len(np.unique(box.high)) <= 1
        self.low = np.array(box.low.flat[0]) if flat and box.low.size else scene.arrays.of(box.low)
        self.high = np.array(box.high.flat[0]) if flat and box.high.size else scene.arrays.of(box.high)
        self._limits = (self.low.item(), self.high.item()) if flat and box.low.size else None

    def of_type(self, xp: Any, seen: Array) -> Array:
        made = xp.astype(seen, getattr(xp, self.dtype), copy=False)
        is_live = made is seen and isinstance(made, np.ndarray) and not made.flags.owndata
        return made.copy() if is_live else made

    def holds(self, xp: Any, values: Array) -> bool:
        """True if all values are within the bounds; NaN is not."""
        if self._limits is None:
            return bool(xp.all((values >= self.low) & (values <= self.high)))
        return are_within(values, *self._limits)
