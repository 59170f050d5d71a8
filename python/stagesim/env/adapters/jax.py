# SPDX-License-Identifier: GPL-2.0-or-later
"""A vector environment with arrays of JAX over a StageVectorEnv."""

from __future__ import annotations

from typing import Any

import jax
import numpy as np
from gymnasium.vector import VectorEnv, VectorWrapper


class JaxVectorEnv(VectorWrapper):
    """A vector environment with arrays of JAX: see to_jax()."""

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        super().__init__(env)
        self._from_dlpack: Any = np.from_dlpack  # of the library of the environment's arrays

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begins episodes as StageVectorEnv.reset() does; returns the observations and an empty info."""
        seen, infos = self.env.reset(seed=seed, options=options)
        return self._observations(seen), infos

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Applies an action in each world; returns observations, rewards, terminations, truncations and infos."""
        given = self._from_dlpack(actions) if isinstance(actions, jax.Array) else actions
        seen, rewards, terminated, truncated, infos = self.env.step(given)
        return (self._observations(seen), jax.dlpack.from_dlpack(rewards), jax.dlpack.from_dlpack(terminated),
                jax.dlpack.from_dlpack(truncated), infos)

    def _observations(self, seen: Any) -> Any:
        if isinstance(seen, dict):
            return {name: self._observations(part) for name, part in seen.items()}
        if not isinstance(seen, np.ndarray):
            import torch

            self._from_dlpack = torch.from_dlpack
        return jax.dlpack.from_dlpack(seen)
