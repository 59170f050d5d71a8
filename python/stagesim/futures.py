# SPDX-License-Identifier: GPL-2.0-or-later
"""Alternative futures of a world: what happens if robots get these commands?"""

from __future__ import annotations

from typing import Any, Iterable, Sequence

import numpy as np
import numpy.typing as npt

from . import _options
from .batch import Batch
from .errors import StageError
from .world import World


class Futures:
    """Predicts what happens in a world if its robots get other commands, as often as wanted.

    Each call of predict() begins at the present state of the world, which it doesn't change. The futures are stepped
    side by side on several threads. If the world is closed, see Batch.explain(), they need no objects, and no rays are
    cast for readings that nobody asks for.

    Controllers of the file run in the futures as well; those in C++ know it from World::IsBranch().

    Args:
        world: the world. It may be changed later; models that were created since it was loaded make steps slower.
        n: number of futures, 1 or more.
        threads, robots, device: as for Batch. On a device, only sensors that run in the world can be recorded.

    Raises:
        WorldError: a copy can't be made, or the device can't step it.
        GoneError: there are no such robots.
        TypeError, ValueError: an argument has a wrong type or is out of range.
    """

    def __init__(self, world: World, n: int, *, threads: int | None = None, robots: str | None = None,
                 device: str | None = None) -> None:
        self._world = world
        self._batch = Batch.__new__(Batch)
        self._batch._begin([world], n, None, None, threads, robots, None, device, branch=True)
        self.n = self._batch.n  #: number of futures
        self.names = self._batch.names  #: names of the robots that get commands

    def predict(self, commands: npt.ArrayLike | None = None, *, moments: int | None = None, n: int = 1,
                record: Sequence[str] = ("pose",), seeds: int | Iterable[int] | None = None) -> dict[str, Any]:
        """Predicts the futures that begin now.

        Args:
            commands: for each future the velocities of its robots at each moment: shape (n, moments, robots, 3), or
                broadcastable to it with moments = commands.shape[-3]; None: robots keep the commands that they have.
            moments: how often commands are given and arrays recorded; None: as many as there are commands.
            n: steps per moment, 1 or more.
            record: names of arrays, as in Fleet.array(), for example "pose", "stalled" and "ranges".
            seeds: one seed per future, or one for all, of the random numbers from now on; None: all futures go on with
                those of the world, so that they have the same noise.

        Returns:
            For each name an array of shape (n, moments, *shape in a fleet), and "failed", a mask of shape (n, moments),
            as from Batch.rollout().

        Raises:
            StageError: the state can't be copied, for example because a controller doesn't declare its state.
            ValueError: a shape is wrong, or there are neither commands nor moments.
        """
        batch = self._batch
        batch.restore(self._world.snapshot())
        for reason in batch._core.failures().values():
            raise StageError(reason)
        if seeds is not None:
            given = [seeds] * self.n if isinstance(seeds, (int, np.integer)) else seeds
            batch._core.reseed(_options.seeds(given, self.n).tolist())
        told = None
        if commands is not None:
            told = np.asarray(commands, np.float64)
            if told.ndim < 3:
                raise ValueError(f"found commands of shape {told.shape}, expected (n, moments, robots, 3)")
            moments = told.shape[-3] if moments is None else moments
            told = np.broadcast_to(told, (self.n, moments, len(batch), 3)).swapaxes(0, 1)
        recorded = batch.rollout(told, moments=moments, n=n, record=record)
        return {name: array.swapaxes(0, 1) for name, array in recorded.items()}

    def explain(self) -> str | None:
        """Says what keeps the futures from being stepped fast, or None. See Batch.explain()."""
        return self._batch.explain()[0]

    @property
    def device(self) -> str | None:
        """Name of the device that makes the steps, or None."""
        return self._batch.device

    def __repr__(self) -> str:
        return f"<{self.n} futures of {self._world!r}>"
