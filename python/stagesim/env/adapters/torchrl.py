# SPDX-License-Identifier: GPL-2.0-or-later
"""A batched environment of TorchRL over a StageVectorEnv."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Dict, MultiDiscrete
from gymnasium.vector import VectorEnv
from tensordict import TensorDict, TensorDictBase
from torchrl.data import Bounded, Categorical, Composite, TensorSpec, Unbounded
from torchrl.envs import EnvBase


class TorchRLEnv(EnvBase):
    """A batched environment of TorchRL: see to_torchrl().

    Tensordicts have `observation` (num_envs, size), or the names of the observations if they are a dictionary,
    `action` (num_envs, numbers), and `reward`, `done`, `terminated` and `truncated` (num_envs, 1).

    Attributes:
        env: the StageVectorEnv.
        step_infos: the infos of the last step of `env`, arrays with the world as first axis.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any], device: Any = "cpu") -> None:
        super().__init__(device=device, batch_size=torch.Size([env.num_envs]))
        self.env = env
        self.step_infos: dict[str, Any] = {}
        self._seed: int | None = None
        self._takes_numpy = True
        flag = Categorical(2, shape=(env.num_envs, 1), dtype=torch.bool, device=self.device)
        seen = self._spec_of(env.observation_space)
        self.observation_spec = seen if isinstance(seen, Composite) else Composite(observation=seen, shape=self.batch_size)
        self.action_spec = self._spec_of(env.action_space)
        self.reward_spec = Unbounded(shape=(env.num_envs, 1), device=self.device)
        self.done_spec = Composite(done=flag, terminated=flag.clone(), truncated=flag.clone(), shape=self.batch_size)

    def _spec_of(self, space: Any) -> TensorSpec:
        """The specification of a space of all worlds."""
        if isinstance(space, Dict):
            return Composite({name: self._spec_of(part) for name, part in space.items()}, shape=self.batch_size)
        if isinstance(space, MultiDiscrete):
            return Categorical(int(space.nvec.flat[0]), shape=space.shape, dtype=torch.int64, device=self.device)
        low, high = torch.as_tensor(space.low), torch.as_tensor(space.high)
        return Bounded(low, high, shape=space.shape, dtype=low.dtype, device=self.device)

    def _set_seed(self, seed: int | None) -> None:
        self._seed = seed

    def _reset(self, tensordict: TensorDictBase | None = None, **kwargs: Any) -> TensorDictBase:
        """Begins episodes in the worlds of the mask `_reset`, or in all."""
        mask = None if tensordict is None else tensordict.get("_reset", None)
        options = None if mask is None else {"reset_mask": mask.reshape(-1).cpu().numpy()}
        seen, _ = self.env.reset(seed=self._seed if mask is None else None, options=options)
        if mask is None:
            self._seed = None
        return self._dict_of(seen)

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        actions: Any = tensordict["action"].detach()
        given = actions.cpu().numpy() if self._takes_numpy else actions
        seen, rewards, terminated, truncated, self.step_infos = self.env.step(given)
        over, cut = self._column(terminated), self._column(truncated)
        return self._dict_of(seen).update({"reward": self._column(rewards).float(), "done": over | cut, "terminated": over,
                                           "truncated": cut})

    def _dict_of(self, seen: Any) -> TensorDictBase:
        """The tensordict of observations, which share the memory of the environment's if that has the same device."""
        parts = seen if isinstance(seen, dict) else {"observation": seen}
        self._takes_numpy = isinstance(next(iter(parts.values())), np.ndarray)
        tensors = {name: torch.as_tensor(array, device=self.device) for name, array in parts.items()}
        return TensorDict(tensors, batch_size=self.batch_size, device=self.device)

    def _column(self, array: Any) -> torch.Tensor:
        return torch.as_tensor(array, device=self.device)[:, None]

    def close(self, *, raise_if_closed: bool = True) -> None:
        """Frees the worlds."""
        if not self.is_closed:
            self.env.close()
        super().close(raise_if_closed=raise_if_closed)
