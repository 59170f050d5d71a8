# SPDX-License-Identifier: GPL-2.0-or-later
"""Arrays in the memory of a CUDA device."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core

CUDA = 2  # a type of devices of DLPack


class DeviceArray:
    """A live array of a batch in the memory of a CUDA device, for libraries that know DLPack.

    `torch.from_dlpack(batch.pose)` is a tensor in the same memory; so are `jax.dlpack.from_dlpack(...)` and
    `cupy.from_dlpack(...)`. Make such a tensor once: each call of the batch that changes its worlds updates the
    array in place. When the call returns, the array is complete, so any stream may read it. A call waits until
    everything that this process has started on the CUDA device is done, so work may be under way that reads arrays
    or writes `cmd`. All arrays but `cmd` are only to be read.

    `numpy()` and `numpy.asarray(array)` return a copy.
    """

    __slots__ = ("_core",)

    def __init__(self, core: _core.DeviceArray) -> None:
        self._core = core

    @property
    def shape(self) -> tuple[int, ...]:
        """The lengths of the axes."""
        return self._core.shape

    @property
    def ndim(self) -> int:
        """The number of axes."""
        return len(self.shape)

    @property
    def dtype(self) -> np.dtype[Any]:
        """The type of the elements: float64 or bool."""
        return np.dtype(self._core.dtype)

    def __len__(self) -> int:
        return self.shape[0]

    def __dlpack__(self, **arguments: Any) -> Any:
        return self._core.dlpack(**arguments)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self._core.dlpack_device()

    def numpy(self) -> npt.NDArray[Any]:
        """Returns a copy in the memory of the host."""
        return self._core.numpy()

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        if copy is False:
            raise ValueError("an array on a device can't be used by NumPy without a copy")
        made = self.numpy()
        return made if dtype is None else made.astype(dtype, copy=False)

    def __setitem__(self, index: Any, values: npt.ArrayLike) -> None:
        """Writes the whole array, which must be `cmd`: `batch.cmd[...] = values`."""
        if index is not Ellipsis and index != slice(None):
            raise TypeError("found an index, expected [...]: NumPy can only write the whole of an array on a device")
        self._core.write(np.ascontiguousarray(np.broadcast_to(values, self.shape), np.float64))

    def __repr__(self) -> str:
        return f"<DeviceArray of shape {self.shape}, {self.dtype}>"


def is_on_card(data: Any) -> bool:
    """True for a tensor in the memory of a CUDA device."""
    return hasattr(data, "__dlpack_device__") and data.__dlpack_device__()[0] == CUDA


def checked_tensor(data: Any, name: str, dtype: str, shape: tuple[int, ...]) -> Any:
    """Returns a tensor on the card that has this type and shape. Raises ValueError if it hasn't."""
    found = str(data.dtype).rpartition(".")[2], tuple(data.shape)
    if not is_on_card(data) or found != (dtype, shape):
        raise ValueError(f"found {name} of the type {found[0]} and the shape {found[1]}, expected a tensor on the card of "
                         f"the type {dtype} and the shape {shape}")
    return data


def on_host(data: Any) -> npt.NDArray[Any]:
    """Returns a copy of a tensor on the card for NumPy."""
    return np.asarray(data.cpu() if hasattr(data, "cpu") else data.get())


def wrapped(view: Any) -> Any:
    """The array for users: a DeviceArray, or the array of NumPy itself."""
    return DeviceArray(view) if isinstance(view, _core.DeviceArray) else view
