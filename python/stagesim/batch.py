# SPDX-License-Identifier: GPL-2.0-or-later
"""Many worlds of the same file."""

from __future__ import annotations

import os
from typing import Any, Iterable, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._core import Snapshot
from .fleet import Bools, Crowd, Floats
from .world import Settings, World, checked_seed, checked_steps

#: Which worlds: None for all, numbers, or a mask of shape (n,).
Which = Union[None, int, Sequence[int], npt.NDArray[Any]]


class Batch(Crowd):
    """Many worlds of the same file, which are stepped by one call on several threads.

    Arrays are those of a Fleet with one more axis in front: `pose` is (n, robots, 3), `ranger(0).ranges`
    (n, robots, samples). Whatever the number of worlds and threads, each world is to the last bit what it
    would be alone: `Batch(file, n, seeds=s).state_hash(i)` is that of `World(file, seed=s[i])` after the
    same steps and commands.

    A world in which something goes wrong, such as a controller that throws, has failed: it makes no more
    steps until it is reset or restored, and `failed` says why. The others go on.

    Args:
        file: the world file; a plain name as in World().
        n: how many worlds, 1 or more.
        seeds: one for each world; None: 0 to n - 1.
        threads: that work on them, each on other worlds; None: one for each processor.
        robots: a pattern of names or types, as in World.fleet(); None: all that drive on the ground.
        opencl, ray_model, controllers, settings: as in World().

    Raises:
        WorldError: the file can't be loaded.
        GoneError: there are no robots.
        ValueError: an argument is out of range.
    """

    def __init__(self, file: str | os.PathLike[str], n: int, *, seeds: Iterable[int] | None = None,
                 threads: int | None = None, robots: str | None = None, opencl: bool | str = False,
                 ray_model: str | None = None, controllers: bool = True, settings: Settings = ()) -> None:
        self._begin(World(file, threads=1, opencl=opencl, ray_model=ray_model,
                          controllers=controllers, settings=settings), n, seeds, threads, robots)

    @classmethod
    def of(cls, world: World, n: int, *, seeds: Iterable[int] | None = None,
           threads: int | None = None, robots: str | None = None) -> Batch:
        """Worlds of the file, or the text, that this one was loaded from; as it was when it was loaded."""
        batch = cls.__new__(cls)
        batch._begin(world, n, seeds, threads, robots)
        return batch

    def _begin(self, prototype: World, n: int, seeds: Iterable[int] | None, threads: int | None,
               robots: str | None) -> None:
        if n < 1:
            raise ValueError(f"found {n} worlds, expected 1 or more")
        if threads is None:
            threads = os.cpu_count() or 1
        if not 1 <= threads <= 1024:
            raise ValueError(f"found {threads} threads, expected 1 to 1024")
        self._prototype = prototype
        self.n = n  #: how many worlds
        ids, self.names = prototype._choose(robots)  #: names: of each world's robots
        self._core = _core.Batch(prototype._core, _seeds_for(range(n) if seeds is None else seeds, n),
                                 threads, ids)
        super().__init__(self._core.crowd)

    @property
    def time(self) -> Floats:
        """Simulated, seconds: shape (n,), live."""
        return self._view("time", self._crowd.time)

    @property
    def ended(self) -> Bools:
        """A controller wants the world to quit: it makes no more steps. Shape (n,), live."""
        return self._view("ended", self._crowd.ended)

    @property
    def failed(self) -> list[str | None]:
        """For each world, why it has failed in one line, or None."""
        return [text or None for text in self._core.failures()]

    @property
    def metrics(self) -> dict[str, Floats]:
        """World.metrics of each: a new array of shape (n,) for each name; NaN where there is no value."""
        return {name: np.array(values) for name, values in self._core.metrics()}

    @property
    def ranges(self) -> Floats:
        """`ranger(0).ranges`: metres, shape (n, robots, samples)."""
        return self.ranger(0).ranges

    @property
    def threads(self) -> int:
        """How many work on the worlds."""
        return self._core.threads

    def step(self, ids: Which = None, n: int = 1) -> None:
        """Moves worlds on by `n` steps.

        Ctrl-C ends it with KeyboardInterrupt, when all are as far as each other; they can go on.

        Args:
            ids: which worlds; None: all. Those that have failed or ended stay where they are.
        """
        self._core.step(self._chosen(ids), checked_steps(n))

    def reset(self, ids: Which = None, seeds: int | Iterable[int] | None = None) -> None:
        """Begins anew, as if the file had just been loaded. Commands become 0.

        Args:
            ids: which worlds; None: all.
            seeds: one for each of these worlds, or one for all; None: those that they had.
        """
        chosen = self._chosen(ids)
        if seeds is None:
            seeds = [self.seeds[i] for i in chosen]
        elif isinstance(seeds, (int, np.integer)):
            seeds = [int(seeds)] * len(chosen)
        new = _seeds_for(seeds, len(chosen))
        self._core.reset(chosen, new)

    @property
    def seeds(self) -> list[int]:
        """Of each world's random numbers."""
        return self._core.seeds()

    def rollout(self, commands: npt.ArrayLike | None = None, *, moments: int | None = None, n: int = 1,
                record: Sequence[str] = ("pose",)) -> dict[str, npt.NDArray[Any]]:
        """Many steps without Python in between, from where the worlds are.

        Args:
            commands: what `cmd` is to be for each moment: shape (moments, n, robots, 3), or what can be
                broadcast to it; None: `cmd` stays as it is.
            moments: how often commands are given and arrays recorded; None: commands.shape[0].
            n: steps for each of them, 1 or more.
            record: names of arrays: "pose", "velocity", "stalled", "energy", "time", "ended"; and "ranges",
                "intensities" of ranger 0.

        Returns:
            For each name an array of shape (moments, *shape of the live one): after each moment. Rows of
            worlds that fail or end keep what they had then.
        """
        given = None
        if commands is not None:
            given = np.asarray(commands, np.float64)
            moments = given.shape[0] if moments is None else moments
            given = np.ascontiguousarray(np.broadcast_to(given, (moments, *self.cmd.shape)))
        if moments is None or moments < 0:
            raise ValueError(f"found {moments} moments, expected 0 or more")
        if n < 1:
            raise ValueError(f"found {n} steps, expected 1 or more")
        live = [self._recorded(name) for name in record]
        made = [np.zeros((moments, *view.shape), view.dtype) for view in live]
        self._core.rollout(moments, n, given, live, made)
        return dict(zip(record, made))

    def _recorded(self, name: str) -> npt.NDArray[Any]:
        if name in ("pose", "velocity", "stalled", "energy", "time", "ended"):
            view: npt.NDArray[Any] = getattr(self, name)
            return view
        if name in ("ranges", "intensities"):
            view = getattr(self.ranger(0), name)
            return view
        raise ValueError(f"found {name!r}, expected the name of an array")

    def snapshot(self, index: int) -> Snapshot:
        """The state of world number `index`: for restore(), also of a World of the same file."""
        return self._core.take(self._chosen(index)[0])

    def restore(self, snapshot: Snapshot, ids: Which = None) -> None:
        """Brings worlds to that state; None: all. Those that it doesn't fit have failed."""
        self._core.restore(self._chosen(ids), snapshot)

    def fork(self, index: int) -> World:
        """A World in the state of world number `index`, which goes on alone."""
        world = World.__new__(World)
        world._core = self._core.fork(self._chosen(index)[0])
        return world

    def state_hash(self, index: int) -> str:
        """That of world number `index`, see World.state_hash()."""
        return self.state_hashes()[self._chosen(index)[0]]

    def state_hashes(self) -> list[str]:
        """Those of all worlds."""
        return [f"{number:016x}" for number in self._core.state_hashes()]

    def teleport(self, pose: npt.ArrayLike, which: npt.ArrayLike | None = None) -> None:
        """Puts robots somewhere else, without a test for collisions.

        Args:
            pose: x, y, heading: what can be broadcast to (n, robots, 3).
            which: a mask that can be broadcast to (n, robots): these robots alone; None: all.
        """
        shape = (self.n, len(self))
        mask = np.ascontiguousarray(np.broadcast_to(True if which is None else which, shape), bool)
        poses = np.ascontiguousarray(np.broadcast_to(pose, (*shape, 3)), np.float64)
        if not np.isfinite(poses[mask]).all():
            raise ValueError("found a pose that is not finite")
        self._core.teleport(poses, mask)

    def _chosen(self, ids: Which) -> list[int]:
        if ids is None:
            return list(range(self.n))
        array = np.atleast_1d(np.asarray(ids))
        if array.dtype == bool and array.shape != (self.n,):
            raise IndexError(f"found a mask of shape {array.shape}, expected ({self.n},)")
        chosen: list[int] = np.arange(self.n)[array if array.size else array.astype(int)].tolist()
        if len(set(chosen)) < len(chosen):
            raise IndexError("found the same world twice")
        return chosen

    def __repr__(self) -> str:
        return f"<Batch of {self.n} worlds of {len(self)} robots>"


def _seeds_for(seeds: Iterable[int], n: int) -> list[int]:
    listed = [checked_seed(int(seed)) for seed in seeds]
    if len(listed) != n:
        raise ValueError(f"found {len(listed)} seeds, expected {n}")
    return listed
