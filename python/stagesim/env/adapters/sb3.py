# SPDX-License-Identifier: GPL-2.0-or-later
"""A vector environment of Stable-Baselines3 over a StageVectorEnv."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import VectorEnv
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv

from ..arrays import on_host

class Sb3VecEnv(VecEnv):
    """A vector environment of Stable-Baselines3: see to_sb3().

    Attributes:
        env: the StageVectorEnv.
        step_infos: the infos of the last step of `env`, arrays with the world as first axis.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        self.env = env
        self.step_infos: dict[str, Any] = {}
        self._actions: npt.NDArray[Any] | None = None
        self._begun = time.time()
        self._returns = np.zeros(env.num_envs)
        self._lengths = np.zeros(env.num_envs, np.int64)
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> Any:
        """Begins episodes in all worlds, with the seeds that seed() has given, and returns their observations."""
        seen, _ = self.env.reset(seed=self._seeds)
        self._reset_seeds()
        self._reset_options()
        self._returns[:] = 0
        self._lengths[:] = 0
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return _hosted(seen)

    def step_async(self, actions: npt.NDArray[Any]) -> None:
        """Keeps the actions for step_wait()."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, npt.NDArray[np.float32], npt.NDArray[np.bool_], list[dict[str, Any]]]:
        """Applies the actions; returns observations, rewards, ends and infos."""
        seen, *outcome, self.step_infos = self.env.step(self._actions)
        rewards, terminated, truncated = (on_host(array) for array in outcome)
        self._returns += rewards
        self._lengths += 1
        dones = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(dones).tolist():
            infos[i] = self._final_info(i)
            infos[i]["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
        self._returns[dones] = 0
        self._lengths[dones] = 0
        return _hosted(seen), rewards.astype(np.float32), dones, infos

    def _final_info(self, i: int) -> dict[str, Any]:
        """The info of world i, whose episode has ended in this step."""
        values = self.step_infos["final_info"]
        info = {name: _row(values[name], i) for name in values if f"_{name}" in values}
        info["terminal_observation"] = _row(self.step_infos["final_obs"], i)
        info["episode"] = {"r": float(self._returns[i]), "l": int(self._lengths[i]),
                           "t": round(time.time() - self._begun, 6)}
        return info

    def close(self) -> None:
        """Frees the worlds."""
        self.env.close()

    def get_images(self) -> Sequence[npt.NDArray[np.uint8] | None]:
        """A picture of each world if the render mode is "rgb_array"."""
        pictures: Any = self.env.render()
        return [None] * self.num_envs if pictures is None else list(pictures)

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The attribute of the StageVectorEnv, once for each of the worlds."""
        value = getattr(self.env, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Sets an attribute of the StageVectorEnv, for all worlds. Raises ValueError if `indices` are only some."""
        self._check_all(indices)
        setattr(self.env, attr_name, value)

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Calls a method of the StageVectorEnv once, and returns its result once for each world.

        Raises:
            ValueError: `indices` are only some of the worlds.
        """
        if method_name == "render" and self.render_mode == "rgb_array":
            images = self.get_images()
            return [images[i] for i in self._get_indices(indices)]
        self._check_all(indices)
        result = getattr(self.env, method_name)(*method_args, **method_kwargs)
        return [result] * self.num_envs

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """True for Monitor, because infos have the statistics of episodes as after a Monitor."""
        return [wrapper_class is Monitor for _ in self._get_indices(indices)]

    def _check_all(self, indices: Any) -> None:
        given = sorted(self._get_indices(indices))
        if given != list(range(self.num_envs)):
            raise ValueError(f"found the worlds {given}, expected None or all {self.num_envs}: they are one environment")


def _hosted(seen: Any) -> Any:
    """Observations as NumPy arrays."""
    return {name: on_host(values) for name, values in seen.items()} if isinstance(seen, dict) else on_host(seen)


def _row(values: Any, i: int) -> Any:
    """The value of world i: a plain number if it is one, else an array, or arrays by name."""
    if isinstance(values, dict):
        return {name: _row(part, i) for name, part in values.items()}
    value = on_host(values)[i]
    return value.item() if isinstance(value, np.generic) else value
