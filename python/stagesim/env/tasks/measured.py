# SPDX-License-Identifier: GPL-2.0-or-later
"""The task whose rewards are metrics of the world file."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Mapping

from ..arrays import Array
from ..features import free_space, joined, speeds, with_headings
from ..randoms import Randoms
from ..scene import Scene
from ..task import Outcome, Task


@dataclass
class Measured(Task):
    """A team task whose rewards and end are metrics of the world file, computed in C++.

    The metrics may be built-in ones (`docs/properties.md`), such as the area swept, or come from your own
    plug-in. In the default world, robots sweep a room. They start at random places. Reward of each robot: the
    sum over `reward` of the weight times the growth of that metric during the action; a missing value counts
    as 0. All robots are terminated when the metric `end` is at least `end_at`. Observation: speeds and ranges
    as in Navigate. Info: each metric of `reward`, by name.

    Args:
        reward: weights by name of the metric.
        end: name of the metric that terminates the episode; None: it never terminates.
        end_at: value of the metric `end` at which the episode is terminated.
        reach: ranges are clipped to this, metres.
        steps, limit, top_speed: see Task.
    """

    reward: Mapping[str, float] = field(default_factory=lambda: {"covered": 1.0, "collisions": -0.05})
    end: str | None = None
    end_at: float = 0.0
    reach: float = 4.0
    steps: int = 2
    limit: int = 300
    top_speed: tuple[float, float, float] = (0.5, 0.0, 1.5)
    world = "explore.world"

    def prepare(self, scene: Scene) -> None:
        known = scene.metrics
        for name in [*self.reward, *([] if self.end is None else [self.end])]:
            if name not in known:
                raise ValueError(f"found the metric {name!r}, expected one of the world file: "
                                 f"{', '.join(sorted(known)) or 'it has none'}")
        scene.notes["measured"] = scene.arrays.zeros((scene.n, len(self.reward)))

    def size(self, scene: Scene) -> int:
        return 2 + scene.ranges.shape[-1]

    def begin(self, scene: Scene, randoms: Randoms) -> Array | None:
        starts = scene.scatter(randoms, scene.robots)
        return with_headings(starts, randoms.headings(scene.robots))

    def began(self, scene: Scene) -> None:
        scene.notes["measured"] = self._measured(scene, scene.metrics)

    def _measured(self, scene: Scene, known: Mapping[str, Array]) -> Array:
        """Values of the metrics in `reward`, 0 where there is none: shape (n, metrics)."""
        values = scene.xp.stack([known[name] for name in self.reward], axis=-1)
        return scene.xp.where(scene.xp.isfinite(values), values, 0.0)

    def observe(self, scene: Scene) -> Array:
        return joined(speeds(scene, self.top_speed), free_space(scene, self.reach))

    def judge(self, scene: Scene) -> Outcome:
        xp, shape = scene.xp, (scene.n, scene.robots)
        known = scene.metrics
        now = self._measured(scene, known)
        weights = scene.arrays.of(list(self.reward.values()), "float64")
        gained = xp.sum((now - scene.notes["measured"]) * weights, axis=1)
        scene.notes["measured"] = now
        ended = known[self.end] >= self.end_at if self.end is not None else xp.zeros_like(gained, dtype=xp.bool)
        info = {name: xp.broadcast_to(now[:, i, None], shape) for i, name in enumerate(self.reward)}
        return Outcome(xp.broadcast_to(gained[:, None], shape), xp.broadcast_to(ended[:, None], shape), info)
