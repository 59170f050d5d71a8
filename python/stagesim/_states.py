# SPDX-License-Identifier: GPL-2.0-or-later
"""States of the worlds of a batch as rows of an array."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from . import _core, _options

if TYPE_CHECKING:
    from .world import Recipe

States = npt.NDArray[np.uint64]
Numbers = npt.NDArray[np.uint32]


class StateKeys:
    """Hashes of the options and values of the variants of a batch, by which states find their variant."""

    def __init__(self) -> None:
        self._known: list[tuple[Recipe, int]] = []  # by variant

    def of(self, recipes: Sequence[Recipe]) -> States:
        """The hashes of the present variants."""
        del self._known[len(recipes):]
        for i, recipe in enumerate(recipes):
            if i < len(self._known) and self._known[i][0] is recipe:
                continue
            self._known[i:i + 1] = [(recipe, _hash_of(recipe))]
        return np.array([key for _, key in self._known], np.uint64)


def _hash_of(recipe: Recipe) -> int:
    from hashlib import blake2b  # rarely needed

    options = [f"{name}={value!r}" for name, value in recipe.options.items()
               if _options.OPTIONS[name].changes_results and name not in ("seed", "threads")]
    text = "\0".join([*options, *recipe.varied, *map(str, recipe.columns)])
    return int.from_bytes(blake2b(text.encode(), digest_size=8).digest(), "little")


def saved(core: _core.Batch, chosen: Numbers, keys: States) -> States:
    """The states of these worlds."""
    made = np.empty((len(chosen), core.count_state_words(chosen, keys)), np.uint64)
    core.save_states(chosen, keys, made)
    return made


def load(core: _core.Batch, chosen: Numbers, keys: States, state: npt.ArrayLike) -> None:
    """Puts these worlds into states. Raises ValueError for a wrong shape or type."""
    array = np.asarray(state)
    if array.dtype != np.uint64:
        raise ValueError(f"found states of the type {array.dtype}, expected uint64, as from Batch.state()")
    rows = np.atleast_2d(array)
    if rows.ndim != 2 or len(rows) not in (1, len(chosen)):
        raise ValueError(f"found states of shape {array.shape}, expected ({len(chosen)}, words), or one for all worlds")
    several = np.ascontiguousarray(np.broadcast_to(rows, (len(chosen), rows.shape[1])))
    core.load_states(chosen, keys, several)
