# SPDX-License-Identifier: GPL-2.0-or-later
"""Adapters of StageVectorEnv to libraries for learning. Each imports its library when it is first used."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from gymnasium.vector import AutoresetMode, VectorEnv

if TYPE_CHECKING:
    from .jax import JaxVectorEnv
    from .sb3 import Sb3VecEnv
    from .torchrl import TorchRLEnv

AnyVectorEnv = VectorEnv[Any, Any, Any]


def to_sb3(env: AnyVectorEnv) -> Sb3VecEnv:
    """Makes a vector environment of Stable-Baselines3 of a StageVectorEnv.

    It begins episodes as SB3's own environments do: the step that ends an episode returns the first observation of the
    next one. The infos of an ended episode have the values of the task, `terminal_observation`,
    `TimeLimit.truncated`, and the statistics of SB3's Monitor as `episode`; all other infos are empty, and
    `step_infos` has the values of all worlds as arrays. No VecMonitor is needed.

    `get_attr()` gives the attribute of the StageVectorEnv for each world; `env_method()` calls a method of it once, for
    all worlds.

    Args:
        env: a StageVectorEnv with autoreset_mode="SameStep".

    Raises:
        ImportError: Stable-Baselines3 is not installed.
        ValueError: the environment has another autoreset mode.
    """
    return _adapter("sb3", "Stable-Baselines3", "SameStep", env).Sb3VecEnv(env)


def to_torchrl(env: AnyVectorEnv, device: Any = "cpu") -> TorchRLEnv:
    """Makes a batched environment of TorchRL of a StageVectorEnv.

    Its batch size is (num_envs,). TorchRL resets the worlds whose episodes are over. `set_seed(s)` gives world i the
    seed s + i from the next reset of all worlds on.

    Args:
        env: a StageVectorEnv with autoreset_mode="Disabled".
        device: the device of the tensors.

    Raises:
        ImportError: TorchRL is not installed.
        ValueError: the environment has another autoreset mode.
    """
    return _adapter("torchrl", "TorchRL", "Disabled", env).TorchRLEnv(env, device)


def to_jax(env: AnyVectorEnv) -> JaxVectorEnv:
    """Makes a vector environment with arrays of JAX of a StageVectorEnv with any autoreset mode.

    Observations, rewards, terminations and truncations are arrays of JAX, and so may be actions; they are passed by
    DLPack, without a copy where JAX accepts the alignment of their memory. Rewards are float32 unless JAX has been
    told to use 64 bits. Infos stay as they are.

    Args:
        env: a StageVectorEnv.

    Raises:
        ImportError: JAX is not installed.
    """
    return _adapter("jax", "JAX", None, env).JaxVectorEnv(env)


def _adapter(module: str, library: str, mode: str | None, env: AnyVectorEnv) -> Any:
    """Imports the module of an adapter, and checks the autoreset mode of the environment."""
    try:
        found = importlib.import_module(f"{__name__}.{module}")
    except ImportError as error:
        raise ImportError(f'to_{module}() needs {library} ({error}): pip install "stagesim[{module}]"',
                          name=error.name) from error
    given = AutoresetMode(env.metadata["autoreset_mode"]).value
    if mode is not None and given != mode:
        raise ValueError(f'found autoreset_mode="{given}", expected "{mode}", which to_{module}() needs: '
                         f'StageVectorEnv(..., autoreset_mode="{mode}")')
    return found
