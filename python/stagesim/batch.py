# SPDX-License-Identifier: GPL-2.0-or-later
"""Many worlds of the same file."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any, Mapping, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _checks, _core
from ._core import Snapshot
from .fleet import Bools, Crowd, Floats
from .pictures import Pixels
from .world import Recipe, Settings, World, rendered

MOST_WORLDS = 2**31
#: Of all worlds: states, failures, and commands if any were given.
_States = tuple[list[Snapshot], Mapping[int, str], Union[Floats, None]]
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

    Batches can be pickled and deep-copied, as worlds can: the copy's worlds are in the same states, and `cmd`
    is what it was.

    Args:
        file: the world file; a plain name as in World().
        n: how many worlds, 1 or more.
        seeds: one for each world; None: 0 to n - 1.
        threads: that work on them, each on other worlds, 1 to 1024; None: one for each processor that the
            process may use.
        robots: a pattern of names or types, as in World.fleet(); None: all that drive on the ground.
        opencl, ray_model, controllers, settings: as in World().

    Raises:
        WorldError: the file can't be loaded.
        GoneError: there are no robots.
        TypeError, ValueError: an argument is of another type, or out of range.
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
        n = _checks.integer(n, "the number of worlds", 1, MOST_WORLDS)
        ids, names = prototype._choose(robots)
        threads = _core.count_processors() if threads is None else _checks.threads(threads)
        core = _core.Batch(prototype._core, _checks.seeds(range(n) if seeds is None else seeds, n), threads, ids)
        self._take(core, n, names, prototype._recipe, ids)

    def _take(self, core: _core.Batch, n: int, names: tuple[str, ...], recipe: Recipe, ids: list[int]) -> None:
        self._core = core
        self.n = n  #: how many worlds
        self.names = names  #: of each world's robots
        self._recipe = recipe
        self._ids = ids
        self._all = np.arange(n, dtype=np.uint32)
        super().__init__(core.crowd)

    # ---- copies ----

    def _states(self) -> _States:
        cmd = self.cmd.copy() if "cmd" in self._views else None
        return [self.snapshot(i) for i in range(self.n)], self._core.failures(), cmd

    def _put(self, states: _States) -> None:
        snapshots, failures, cmd = states
        for i, snapshot in enumerate(snapshots):
            self.restore(snapshot, i)
        self._core.set_failures(failures)
        if cmd is not None:
            self.cmd[...] = cmd

    def __deepcopy__(self, memo: dict[int, Any]) -> Batch:
        copied = memo[id(self)] = type(self).__new__(type(self))
        copied._take(self._core.another(self.seeds), self.n, self.names, self._recipe, self._ids)
        copied._put(self._states())
        return copied

    def __reduce__(self) -> tuple[Any, ...]:
        return _batch_again, (type(self), self._recipe, self.seeds, self.threads, self._ids, self._states())

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
        failures = self._core.failures()
        return [failures.get(i) for i in range(self.n)]

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

    def step(self, n: int = 1, *, ids: Which = None) -> None:
        """Moves worlds on by `n` steps, as World.step() does.

        Ctrl-C ends it with KeyboardInterrupt, when all are as far as each other; they can go on.

        Args:
            n: how many steps, 0 or more.
            ids: which worlds; None: all. Those that have failed or ended stay where they are.
        """
        if np.ndim(n) > 0:
            raise TypeError("found several numbers of steps, expected one; ids= chooses worlds")
        self._core.step(self._chosen(ids), _checks.steps(n))

    def reset(self, seeds: int | Iterable[int] | None = None, *, ids: Which = None) -> None:
        """Begins anew, as if the file had just been loaded. Commands become 0.

        Without controllers, plug-ins and populations in the file it takes about as long as restore().

        Args:
            seeds: one for each of these worlds, or one for all; None: those that they had.
            ids: which worlds; None: all.
        """
        chosen = self._chosen(ids)
        if seeds is None:
            had = self.seeds
            new = [had[i] for i in chosen.tolist()]
        elif not isinstance(seeds, Iterable) or np.ndim(seeds) == 0:  # type: ignore[arg-type]
            new = [_checks.seed(seeds)] * len(chosen)
        elif isinstance(seeds, np.ndarray) and seeds.dtype == bool:
            raise TypeError("found truth values as seeds, expected whole numbers; ids= chooses worlds")
        else:
            new = _checks.seeds(seeds, len(chosen))
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
            record: names of arrays: "pose", "velocity", "sensed_pose", "estimate", "stalled", "energy",
                "time", "ended"; and "ranges",
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
        if moments is None:
            raise ValueError("found neither commands nor moments, expected one of them")
        moments = _checks.integer(moments, "moments", 0)
        n = _checks.integer(n, "the number of steps", 1)
        live = [self._recorded(name) for name in record]
        made = [np.zeros((moments, *view.shape), view.dtype) for view in live]
        self._core.rollout(moments, n, given, live, made)
        return dict(zip(record, made))

    def _recorded(self, name: str) -> npt.NDArray[Any]:
        if name in ("pose", "velocity", "sensed_pose", "estimate", "stalled", "energy", "time", "ended"):
            view: npt.NDArray[Any] = getattr(self, name)
            return view
        if name in ("ranges", "intensities"):
            view = getattr(self.ranger(0), name)
            return view
        raise ValueError(f"found {name!r}, expected the name of an array")

    def snapshot(self, index: int) -> Snapshot:
        """The state of world number `index`: for restore(), also of a World of the same file."""
        return self._core.take(self._index(index))

    def restore(self, snapshot: Snapshot, ids: Which = None) -> None:
        """Brings worlds to that state; None: all. Those that it doesn't fit have failed."""
        self._core.restore(self._chosen(ids), snapshot)

    def fork(self, index: int) -> World:
        """A World in the state of world number `index`, which goes on alone."""
        world = World.__new__(World)
        world._core = self._core.fork(self._index(index))
        world._recipe = self._recipe
        return world

    def state_hash(self, index: int) -> str:
        """That of world number `index`, see World.state_hash()."""
        return self.state_hashes()[self._index(index)]

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

    def render(self, index: int, width: int = 640, height: int = 480, *, center: tuple[float, float] | None = None,
               scale: float | None = None, data: bool = True) -> Pixels:
        """A picture of world number `index` from above, as it is now: see World.render()."""
        i = self._index(index)
        return rendered(lambda w, h: self._core.fit(i, w, h), lambda *args: self._core.render(i, *args), width, height,
                        center, scale, data)

    def _index(self, index: int) -> int:
        i = _checks.integer(index, "the number of a world", -MOST_WORLDS)
        if not -self.n <= i < self.n:
            raise IndexError(f"found the number of a world {i}, expected {-self.n} to {self.n - 1}")
        return i % self.n

    def _chosen(self, ids: Which) -> npt.NDArray[np.uint32]:
        if ids is None:
            return self._all
        array = np.atleast_1d(np.asarray(ids))
        if array.dtype == bool and array.shape != (self.n,):
            raise IndexError(f"found a mask of shape {array.shape}, expected ({self.n},)")
        if array.size and array.dtype.kind not in "biu":
            raise TypeError(f"found numbers of worlds of the type {array.dtype}, expected whole numbers, or a mask")
        chosen = self._all[array if array.size else array.astype(int)]
        if array.dtype != bool and len(np.unique(chosen)) < len(chosen):
            raise IndexError("found the same world twice")
        return chosen

    def __repr__(self) -> str:
        return f"<Batch of {self.n} worlds of {len(self)} robots>"


def _batch_again(cls: type[Batch], recipe: Recipe, seeds: list[int], threads: int, ids: list[int],
                 states: _States) -> Batch:
    """What a pickled batch becomes."""
    prototype = World._from_recipe(recipe._replace(options={**recipe.options, "threads": 1}), 1)
    batch = cls.__new__(cls)
    names = {id_: name for id_, name, _, _ in prototype._core.robots()}
    batch._take(_core.Batch(prototype._core, seeds, threads, ids), len(seeds),
                tuple(names.get(id_, "") for id_ in ids), recipe, ids)
    batch._put(states)
    return batch
