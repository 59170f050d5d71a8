# SPDX-License-Identifier: GPL-2.0-or-later
"""The array library that the tasks of an environment compute with: NumPy, or PyTorch on the host or a card."""

from __future__ import annotations

import warnings
from typing import Any

import array_api_compat.numpy as xnp
import numpy as np
import numpy.typing as npt

from ..device_array import DeviceArray
from . import recycled

#: An array of the environment's library: a NumPy array, or a tensor of PyTorch.
Array = Any


class Arrays:
    """A library of arrays, and the memory that new arrays are made in.

    Args:
        name: "numpy" or "torch"; None: PyTorch if the worlds are in the memory of a CUDA device, else NumPy.
        view: an array of the worlds, which says where they are.

    Raises:
        ValueError: there is no such library, or NumPy is asked for with worlds on a card.
        ImportError: PyTorch is needed and is not installed.

    Attributes:
        xp: the namespace of the library, with the functions of the array API standard (array_api_compat).
        is_numpy: True if the library is NumPy.
    """

    def __init__(self, name: str | None, view: Any) -> None:
        on_card = isinstance(view, DeviceArray)
        if name not in (None, "numpy", "torch"):
            raise ValueError(f"found the library {name!r}, expected 'numpy', 'torch' or None")
        if on_card and name == "numpy":
            raise ValueError("found arrays='numpy' for worlds in the memory of a card, expected 'torch' or None")
        self.is_numpy = name == "numpy" or (name is None and not on_card)
        self.xp: Any = xnp if self.is_numpy else _torch_namespace()
        self._device = None if self.is_numpy else self.live(view).device

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickle, (self.is_numpy, None if self._device is None else str(self._device))

    def live(self, view: Any) -> Array:
        """An array of the library in the memory of a live array of a batch."""
        if self.is_numpy:
            return view
        import torch

        if isinstance(view, DeviceArray):
            return torch.from_dlpack(view)
        with warnings.catch_warnings():  # PyTorch warns of arrays that are only to be read
            warnings.simplefilter("ignore", UserWarning)
            return torch.from_numpy(view)

    def of(self, values: npt.ArrayLike, dtype: Any = None) -> Array:
        """Converts values of the host to a new array of the library."""
        array = np.array(values, dtype)
        return array if self.is_numpy else self.xp.asarray(array, device=self._device)

    def given(self, values: Any) -> Array:
        """Converts what a caller gives, which may be an array of the library already."""
        if self.is_numpy:
            return np.asarray(values)
        import torch

        return values.to(self._device) if isinstance(values, torch.Tensor) else self.of(values)

    def zeros(self, shape: tuple[int, ...], dtype: str = "float64") -> Array:
        """A new array of zeros."""
        if self.is_numpy:
            return np.zeros(shape, dtype)
        return self.xp.zeros(shape, dtype=getattr(self.xp, dtype), device=self._device)


HOST = Arrays("numpy", np.zeros(0))  #: arrays of NumPy


def on_host(array: Array) -> npt.NDArray[Any]:
    """The array for NumPy: itself if it is one already."""
    return array if isinstance(array, np.ndarray) else array.cpu().numpy()


def wide(values: Array) -> Array:
    """A copy whose elements are bool, int64 or float64, which become plain Python values by item()."""
    if not isinstance(values, np.ndarray):
        return values.clone()
    kind = values.dtype.kind
    return np.array(values, np.bool_ if kind == "b" else np.int64 if kind in "iu" else np.float64)


def copied(seen: Any) -> Any:
    """A copy of an array, or of arrays by name."""
    if isinstance(seen, dict):
        return {name: copied(values) for name, values in seen.items()}
    if not isinstance(seen, np.ndarray):
        return seen.clone()
    made = recycled.empty(seen.shape, seen.dtype)
    made[...] = seen
    return made


def are_within(values: Array, low: float, high: float) -> bool:
    """True if all values are from `low` to `high`; NaN is not."""
    if isinstance(values, np.ndarray):
        return bool(values.size == 0 or (values.min() >= low and values.max() <= high))
    return bool(((values >= low) & (values <= high)).all())


def put(seen: Any, rows: Any, values: Any) -> None:
    """Writes rows of an array, or of arrays by name."""
    if isinstance(seen, dict):
        for name, array in seen.items():
            put(array, rows, values[name])
    else:
        seen[rows] = values


def namespace_of(array: Array) -> Any:
    """The namespace of the library of an array."""
    return xnp if isinstance(array, np.ndarray) else _torch_namespace()


def _torch_namespace() -> Any:
    try:
        import array_api_compat.torch as xtorch
    except ImportError as error:
        raise ImportError(f"found no PyTorch, which arrays of the library 'torch' need ({error}): pip install torch",
                          name=error.name) from error
    return xtorch


def _unpickle(is_numpy: bool, device: str | None) -> Arrays:
    arrays = Arrays.__new__(Arrays)
    arrays.is_numpy = is_numpy
    arrays.xp = xnp if is_numpy else _torch_namespace()
    if device is None:
        arrays._device = None
    else:
        import torch

        arrays._device = torch.device(device)
    return arrays
