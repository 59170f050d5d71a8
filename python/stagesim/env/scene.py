# SPDX-License-Identifier: GPL-2.0-or-later
"""The worlds of an environment, or some of them, as a task sees them."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..batch import Batch
from ..fleet import Floats
from .arrays import HOST, Array, Arrays, on_host
from .places import Places, scattered
from .randoms import Randoms

if TYPE_CHECKING:
    from ..world import World


class Notes(MutableMapping[str, Array]):
    """A task's own arrays by name. Their first axis is the worlds that the scene shows.

    Values are set whole: `scene.notes["goal"] = goals` copies them. An array that a scene of some worlds gives is a
    copy, so writing into it has no effect. A new name has zeros for all other worlds.
    """

    def __init__(self, n: int, arrays: Arrays, all_of_them: dict[str, Array], rows: Array | None = None,
                 for_host: bool = False) -> None:
        self._n = n
        self._arrays = arrays
        self._all = all_of_them
        self._rows = rows
        self._for_host = for_host

    def __getitem__(self, name: str) -> Array:
        if name not in self._all:
            raise KeyError(f"there is no note {name!r}: set scene.notes[{name!r}] in begin() or prepare()")
        found = self._all[name]
        chosen = found if self._rows is None else found[self._rows]
        return on_host(chosen) if self._for_host else chosen

    def __setitem__(self, name: str, values: Array) -> None:
        if self._for_host:
            values = self._arrays.of(values)
        elif self._arrays.is_numpy:
            values = np.asarray(values)
        if name not in self._all:
            kind = str(values.dtype).rpartition(".")[2]
            self._all[name] = self._arrays.zeros((self._n, *values.shape[1:]), kind)
        kept = self._all[name]
        count = kept.shape[0] if self._rows is None else len(self._rows)
        if tuple(values.shape) not in ((count, *kept.shape[1:]), (1, *kept.shape[1:])):
            raise ValueError(f"found the note {name!r} of shape {tuple(values.shape)}, expected {(count, *kept.shape[1:])}: "
                             "its first axis is the worlds of the scene")
        kept[slice(None) if self._rows is None else self._rows] = values

    def __delitem__(self, name: str) -> None:
        del self._all[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)


class Scene:
    """The worlds of an environment as a task sees them: all, or those in which episodes begin.

    Arrays belong to the library `xp`: NumPy on the host, PyTorch on a card. A task only reads them, sets `notes`, and
    returns new arrays.

    Attributes:
        xp: the namespace of the library, with the functions of the array API standard (array_api_compat).
        arrays: converts values of the host to arrays of the library: `scene.arrays.of(values)`.
        batch: the worlds. The environment steps and resets them.
        world: another world of the same file, in the state after loading: for the map and for cast().
        n: number of worlds that the scene shows; 1 in a single environment.
        robots: number of robots per world.
        rows: the numbers of these worlds in the batch: int64, shape (n,); None: all of them.
        notes: the task's own arrays by name; see Notes.
    """

    def __init__(self, batch: Batch, world: World, ranges: str = "ranger.ranges", arrays: Arrays | None = None) -> None:
        arrays = arrays or Arrays(None, batch.pose)
        self.batch = batch
        self.world = world
        self.arrays = arrays
        self.xp = arrays.xp
        self.n = batch.n
        self.robots = len(batch)
        self.rows: Array | None = None
        self._ranges = ranges
        self._notes: dict[str, Array] = {}
        self.notes = Notes(self.n, arrays, self._notes)
        self._live: dict[str, Array] = {}
        self.sensors: set[str] = set()  #: arrays of sensors that the task has asked for
        self._actions = arrays.zeros((self.n,), "int64")
        self._takes_part = arrays.zeros((self.n, self.robots), "bool")
        self._places = Places(batch, world)
        self._on_card: Scene | None = None  # of a scene for the host

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_live": {}, "xp": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.xp = self.arrays.xp
        for name in self.sensors:  # so that they measure from the first step on
            self.array(name)

    def part(self, rows: Array | None) -> Scene:
        """A scene of some worlds, which writes its notes into those of this scene."""
        if rows is None:
            return self
        made = type(self).__new__(type(self))
        made.__dict__.update(self.__dict__)
        made.rows = rows
        made.n = int(rows.shape[0])
        made.notes = Notes(self.batch.n, self.arrays, self._notes, rows)
        return made

    def for_host(self) -> Scene:
        """This scene with arrays of NumPy, which are copies if the worlds are on a card."""
        if self.arrays.is_numpy:
            return self
        made = type(self).__new__(type(self))
        made.__dict__.update(self.__dict__)
        made.arrays, made.xp = HOST, HOST.xp
        made.rows = None if self.rows is None else on_host(self.rows)
        made.notes = Notes(self.batch.n, self.arrays, self._notes, self.rows, for_host=True)
        made._on_card = self
        return made

    def array(self, name: str) -> Array:
        """An array of the batch, by a name as in Batch.array(): shape (n, robots, ...), live or a copy."""
        if self._on_card is not None:
            return on_host(self._on_card.array(name))
        found = self._live.get(name)
        if found is None:
            found = self._live[name] = self.arrays.live(self.batch.array(name))
            if "." in name:
                self.sensors.add(name)
        return found if self.rows is None else found[self.rows]

    @property
    def pose(self) -> Array:
        """Poses: x, y (metres) and heading (radians), shape (n, robots, 3), live."""
        return self.array("pose")

    @property
    def velocity(self) -> Array:
        """Set speeds: forwards, to the left (m/s) and turning (rad/s), shape (n, robots, 3), live."""
        return self.array("velocity")

    @property
    def stalled(self) -> Array:
        """True if blocked at the last attempt to move: shape (n, robots), live."""
        return self.array("stalled")

    @property
    def ranges(self) -> Array:
        """The array that Task.ranges names, metres: shape (n, robots, samples), live."""
        return self.array(self._ranges)

    @property
    def placed_pose(self) -> Array:
        """Poses of the models that Task.placed names: x, y, heading (metres, radians), new, shape (n, models, 3)."""
        found = self.arrays.given(self.batch.placed_pose)
        return found if self.rows is None else found[self.rows]

    def place(self, poses: Array) -> None:
        """Moves the models that Task.placed names, in begin(): x, y, heading, shape (n, models, 3)."""
        chosen = slice(None) if self.rows is None else on_host(self.rows)
        all_of_them, moved = np.zeros((self.batch.n, len(self.batch.placed), 3)), np.zeros((self.batch.n, 1), bool)
        all_of_them[chosen], moved[chosen] = on_host(poses), True
        self.batch.place(all_of_them, moved)

    @property
    def actions(self) -> Array:
        """Number of actions since the episode began: int64, shape (n,)."""
        if self._on_card is not None:
            return on_host(self._on_card.actions)
        return self._actions if self.rows is None else self._actions[self.rows]

    @property
    def live(self) -> Array:
        """True for robots that still take part in the episode: shape (n, robots)."""
        if self._on_card is not None:
            return on_host(self._on_card.live)
        return self._takes_part if self.rows is None else self._takes_part[self.rows]

    def note_begin(self, rows: Array | None) -> None:
        """Episodes have begun in these worlds; None: in all."""
        chosen = slice(None) if rows is None else rows
        self._actions[chosen] = 0
        self._takes_part[chosen] = True

    def note_action(self, rows: Array | None) -> None:
        """An action has been made in these worlds; None: in all."""
        self._actions[slice(None) if rows is None else rows] += 1

    def note_end(self, has_ended: Array) -> None:
        """The episodes of these robots have ended: shape (n, robots)."""
        self._takes_part &= ~has_ended

    @property
    def metrics(self) -> dict[str, Array]:
        """The world file's metrics since the episode began, by name: new arrays of shape (n,); NaN: no value."""
        found = {name: self.arrays.given(values) for name, values in self.batch.metrics.items()}
        return found if self.rows is None else {name: values[self.rows] for name, values in found.items()}

    @property
    def places(self) -> Floats:
        """Places that the first robot can reach from its pose in the file: x, y, metres, shape (m, 2), of NumPy.

        They form a grid of 0.25 m, have a clearance of 0.3 m and are sorted by the length of the path. If the worlds
        are of several variants, these are the places of the first one.
        """
        return self._places.of_variant(0)

    def numbers(self) -> npt.NDArray[np.int64]:
        """The numbers of these worlds in the batch, on the host: shape (n,)."""
        return np.arange(self.n) if self.rows is None else on_host(self.rows)

    def scatter(self, randoms: Randoms, count: int, gap: float = 0.7, choice: Floats | None = None) -> Floats:
        """Draws random places with a minimum distance from each other in each world, for Task.begin().

        Args:
            randoms: the random numbers of these worlds.
            count: number of places.
            gap: min distance between two of them, metres.
            choice: places to draw from, metres: shape (m, 2), or (n, m, 2) if they differ between worlds. None: all
                that the first robot can reach in the map of each world.

        Returns:
            x, y, metres, of NumPy: shape (n, count, 2).

        Raises:
            StageError: there is not enough space.
        """
        return scattered(self, self._places, randoms, count, gap, choice)
