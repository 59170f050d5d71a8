# SPDX-License-Identifier: GPL-2.0-or-later
"""A world: models, a clock, and the steps that move them on."""

from __future__ import annotations

import fnmatch
import math
import os
from typing import Any, Callable, Iterable, Mapping, NamedTuple, Union

import numpy as np
import numpy.typing as npt

from . import _checks, _core, _paths
from ._core import Model, Snapshot
from .errors import GoneError, StageError, WorldError
from .fleet import Fleet, Floats
from .pictures import Pixels, png_of

#: Values in place of those of a world file: texts "NAME=VALUE", or a mapping of names to values.
Settings = Union[Iterable[str], Mapping[str, Any]]


def setting_text(value: Any) -> str:
    """A value as world files have it: tuples in brackets, truth as 1 or 0."""
    if isinstance(value, (bool, np.bool_)):
        return str(int(value))
    if isinstance(value, (list, tuple, np.ndarray)):
        return f"[{' '.join(map(setting_text, value))}]"
    return str(value)


def settings_list(settings: Settings) -> list[str]:
    """As texts "NAME=VALUE"; TypeError for a single text."""
    if isinstance(settings, str):
        raise TypeError(f"found the text {settings!r} as settings, expected a list of texts or a mapping")
    if isinstance(settings, Mapping):
        return [f"{name}={setting_text(value)}" for name, value in settings.items()]
    texts = list(settings)
    for text in texts:
        if not isinstance(text, str):
            raise TypeError(f"found {text!r} as a setting, expected a text such as 'robots=10'")
    return texts


class Recipe(NamedTuple):
    """What a world was made from: enough to make it again, in another process too."""

    path: str
    text: str | None  # None: that of the file
    options: dict[str, Any]  # arguments of World(), but for the seed


class World:
    """A world that has been loaded from a world file.

    Worlds share nothing: several threads may each work with one at the same time, since long calls
    release the GIL, and they go on as they would alone. A call for a world that another thread is
    working with raises StageError.

    Worlds can be pickled and deep-copied: the copy is in the same state and goes on alike. The process that
    unpickles one reads the world file again, which has to be there and the same. Metrics begin anew in a
    copy, and commands of fleets stay with the fleets.

    Args:
        file: the world file. A plain name that is not in the working folder is one of the shipped
            worlds: see `shipped_worlds()`.
        seed: of all random numbers, 0 to 2**64 - 1. The same seed gives the same run, to the last bit.
        threads: that work on a step, 1 to 1024; None: what the world file says, or else one for each
            processor that the process may use, in steps that are faster with them. They don't change
            results.
        opencl: True: use an OpenCL device where that is faster, if there is one. A text chooses the
            device, as `stage --opencl=` does. Results are the same.
        opencl_always: use it for every step, even where it is slower: for measurements.
        ray_model: "cell" or "exact", whatever the file says: changes what ranges go to.
        controllers: False leaves controllers and plug-ins of the file out, so that it runs no code.
        settings: in place of what the file says, as `stage --set` has them: texts such as "robots=10" or
            "world.resolution=0.05", or a mapping such as {"robots": 10, "world.resolution": 0.05}.

    Raises:
        WorldError: the file can't be loaded, or a setting fits nothing in it; it carries the place in the
            file.
        TypeError, ValueError: an argument is of another type, or out of range.
    """

    def __init__(self, file: str | os.PathLike[str], *, seed: int = 1, threads: int | None = None,
                 opencl: bool | str = False, opencl_always: bool = False,
                 ray_model: str | None = None, controllers: bool = True, settings: Settings = ()) -> None:
        options = {"threads": threads, "opencl": opencl, "opencl_always": opencl_always, "ray_model": ray_model,
                   "controllers": controllers, "settings": settings_list(settings)}
        self._load(Recipe(_paths.resolve(file), None, options), seed)

    @classmethod
    def from_text(cls, text: str, folder: str | os.PathLike[str] = "", *, seed: int = 1,
                  threads: int | None = None, opencl: bool | str = False,
                  opencl_always: bool = False, ray_model: str | None = None,
                  controllers: bool = True, settings: Settings = ()) -> World:
        """A world from the text of a world file.

        Args:
            text: what would stand in the file.
            folder: what names of files in it are relative to; the shipped worlds' own by default.

        The others are those of World().
        """
        options = {"threads": threads, "opencl": opencl, "opencl_always": opencl_always, "ray_model": ray_model,
                   "controllers": controllers, "settings": settings_list(settings)}
        path = os.path.join(os.fspath(folder) or _paths.WORLDS[0], "<text>")
        return cls._from_recipe(Recipe(path, text, options), seed)

    @classmethod
    def _from_recipe(cls, recipe: Recipe, seed: int) -> World:
        world = cls.__new__(cls)
        world._load(recipe, seed)
        return world

    def _load(self, recipe: Recipe, seed: int) -> None:
        self._core = self._make(seed, **recipe.options)
        self._recipe = recipe._replace(path=os.path.abspath(recipe.path))
        try:
            if recipe.text is None:
                self._core.load_file(recipe.path)
            else:
                self._core.load_text(recipe.text, recipe.path)
        except WorldError as error:
            raise error._about(recipe.path, recipe.path if recipe.text is None else "<text>") from None

    @staticmethod
    def _make(seed: int, threads: int | None, opencl: bool | str, opencl_always: bool,
              ray_model: str | None, controllers: bool, settings: list[str]) -> _core.Simulation:
        if ray_model not in (None, "cell", "exact"):
            raise ValueError(f"found the ray model {ray_model!r}, expected 'cell' or 'exact'")
        return _core.Simulation(
            seed=_checks.seed(seed), threads=0 if threads is None else _checks.threads(threads),
            opencl=bool(opencl) or opencl_always,
            opencl_always=opencl_always, device=opencl if isinstance(opencl, str) else "",
            ray_model=ray_model or "", controllers=controllers, settings=settings)

    # ---- copies ----

    def __deepcopy__(self, memo: dict[int, Any]) -> World:
        copied = memo[id(self)] = self.fork()
        return copied

    def __copy__(self) -> World:
        return self.fork()

    def __reduce__(self) -> tuple[Any, ...]:
        return _world_again, (type(self), self._recipe, self.seed, self.snapshot(), self.state_hash())

    # ---- running ----

    def step(self, n: int = 1) -> int:
        """Moves the world on by `n` steps, whatever quit time its file gives.

        Ctrl-C ends it between two steps with KeyboardInterrupt: the world is as after so many steps, and
        can go on.

        Returns:
            How many steps were made: fewer than `n` if a controller wants the world to quit, see `ended`.

        Raises:
            StageError: a controller has thrown something. The step is given up, the world can go on.
            GoneError: the world was closed, or a controller has deleted it.
        """
        return self._core.step(_checks.steps(n))

    def run(self, seconds: float | None = None) -> int:
        """Moves the world on by so many seconds of simulated time, rounded up to whole steps.

        Args:
            seconds: 0 or more; None: until the quit time of the world file.

        Returns and raises what step() does; ValueError if there is no quit time.
        """
        if seconds is None:
            if self.quit_time is None:
                raise ValueError("the world file gives no quit_time: say how long to run")
            seconds = max(0.0, self.quit_time - self.time)
        return self.step(self._steps_in(seconds))

    def _steps_in(self, seconds: float) -> int:
        """How many steps so many seconds of simulated time take; ValueError if there can't be so many."""
        if not 0 <= seconds < float("inf"):
            raise ValueError(f"found {seconds} seconds, expected 0 or more")
        return -(-round(seconds * 1e6) // self._core.interval)

    def reset(self, seed: int | None = None) -> None:
        """Begins anew, as if the file had just been loaded with that seed; None: with the same one.

        Models of the file keep their numbers, so `Model` objects and fleets of them stay good. Commands of
        fleets become 0.
        """
        self._core.reset(self.seed if seed is None else _checks.seed(seed))

    def close(self) -> None:
        """Frees the world. Arrays of its fleets keep what they have; all else raises GoneError."""
        self._core.close()

    def __enter__(self) -> World:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # ---- state ----

    def snapshot(self, lean: bool = False) -> Snapshot:
        """The state now, to go back to.

        Args:
            lean: in a hundred bytes for each robot, and in a fraction of the time; leaves out readings of
                rangers that are due in the next step anyway: they read NaN until then.

        Raises:
            StageError: a controller remembers something that it does not tell.
        """
        return self._core.take(lean)

    def restore(self, snapshot: Snapshot) -> None:
        """Goes back to a snapshot of this world, or of another one that was loaded from the same file.

        Raises:
            StageError: it doesn't fit; the world stays as it was.
        """
        self._core.restore(snapshot)

    def fork(self) -> World:
        """Another world in the same state, which goes on alike. It shares scenery and device with this."""
        world = type(self).__new__(type(self))
        world._core = self._core.fork()
        world._recipe = self._recipe
        return world

    def state_hash(self) -> str:
        """A number of all that decides the future of the world, as `stage --state-hash` prints it.

        16 hexadecimal digits. Worlds that will go on alike have the same.
        """
        return f"{self._core.state_hash():016x}"

    @property
    def time(self) -> float:
        """Simulated, seconds."""
        return self._core.microseconds / 1e6

    @property
    def dt(self) -> float:
        """The length of a step, seconds of simulated time."""
        return self._core.interval / 1e6

    @property
    def steps(self) -> int:
        """How many steps there were since the beginning."""
        return self._core.updates

    @property
    def seed(self) -> int:
        """Of all random numbers."""
        return self._core.seed

    @property
    def quit_time(self) -> float | None:
        """Seconds: when the world file says that a run ends. Only run() without a time minds it."""
        return self._core.quit_time / 1e6 or None

    @property
    def ended(self) -> bool:
        """A controller wants the world to quit. step() makes no step then; reset() begins anew."""
        return self._core.wants_to_quit

    @property
    def metrics(self) -> dict[str, float | None]:
        """What the metrics of the world file come to so far, and what set_metric() was told, by name.

        None: there is nothing to tell yet, such as the time to a goal that nobody has reached. They begin
        anew with reset() and restore().
        """
        return {name: value if math.isfinite(value) else None for name, value in self._core.metrics()}

    def set_metric(self, name: str, value: float | None) -> None:
        """A metric of your own, until the next reset() or restore(); None: there is no value."""
        self._core.set_metric(name, math.nan if value is None else value)

    @property
    def device(self) -> str | None:
        """The OpenCL device in use, or None."""
        return self._core.device or None

    # ---- models ----

    def model(self, name: str) -> Model:
        """The model of that full name, such as "r0" or "r0.ranger:0".

        Raises:
            GoneError: there is none.
        """
        if not isinstance(name, str):
            raise TypeError(f"found {name!r} as the name of a model, expected a text")
        found = self._core.find(name)
        if found is None:
            raise GoneError(f"there is no model called {name!r}")
        return found

    @property
    def models(self) -> list[Model]:
        """All models, in the order of creation."""
        return self._core.models()

    def create(self, type: str = "model", parent: Model | None = None, **properties: Any) -> Model:
        """Makes a model.

        Args:
            type: such as "model", "position", "ranger", or one that a plug-in brings.
            parent: what it stands on; None: the ground.
            properties: attributes of Model to be set, such as pose=(1, 2, 0), size=(.3, .3, .5).

        Raises:
            StageError: there is no such type, or a property is refused; then nothing is made.
        """
        if not isinstance(type, str):
            raise TypeError(f"found {type!r} as the type of a model, expected a text")
        made = self._core.create(type, parent)
        try:
            for name, value in properties.items():
                setattr(made, name, value)
        except BaseException:
            made.delete()
            raise
        return made

    def fleet(self, robots: str | Iterable[Model] | None = None) -> Fleet:
        """Robots, in the order of creation, with live arrays of what they do and sense.

        Args:
            robots: None: all models that drive and stand on the ground. A pattern such as "r*": those of
                all that drive whose name or type matches it. Or the robots themselves, in any order.

        Raises:
            GoneError: there are none.
        """
        ids, names = self._choose(robots)
        return Fleet(self, self._core.crowd(ids), tuple(ids), names)

    def _choose(self, robots: str | Iterable[Model] | None) -> tuple[list[int], tuple[str, ...]]:
        """The numbers and names of the robots that fleet() would take."""
        known = {id_: (name, type_, top) for id_, name, type_, top in self._core.robots()}
        if robots is None:
            ids = [id_ for id_, (_, _, top) in known.items() if top]
        elif isinstance(robots, str):
            ids = [id_ for id_, (name, type_, _) in known.items()
                   if fnmatch.fnmatchcase(name, robots) or fnmatch.fnmatchcase(type_, robots)]
        else:
            ids = [robot.id for robot in robots]
            for id_ in ids:
                if id_ not in known:
                    raise GoneError(f"the model number {id_} is gone, or doesn't drive")
        if not ids:
            raise GoneError("there are no such robots")
        return ids, tuple(known[id_][0] for id_ in ids)

    # ---- rays ----

    def cast(self, poses: npt.ArrayLike, bearings: npt.ArrayLike, max_range: float, *,
             z: float | None = None, robots: bool = False, ignore: Model | None = None,
             ray_model: str | None = None, out: Floats | None = None) -> Floats:
        """Casts rays from anywhere, millions in one call: what a ranger would read there.

        They are walked as one batch, on the threads of the world, and on its OpenCL device where that is
        faster. The world stays as it is.

        Args:
            poses: x, y (metres) and heading (radians): shape (..., 3).
            bearings: of the rays, relative to the heading, radians: shape (k,) or a number.
            max_range: metres, more than 0; may be infinite.
            z: height of the rays, metres; None: they meet what is at any height.
            robots: whether they meet robots, that is models that drive, and all that stands on them;
                False: only the rest, the map.
            ignore: a model that rays go through, with all that belongs to its tree.
            ray_model: "cell" or "exact"; None: the world's.
            out: where to put the ranges, float64, C-contiguous, of the right shape; None: a new array.

        Returns:
            Metres, shape (..., k): max_range where nothing is hit, or where a pose is not finite.

        Raises:
            ValueError: an argument has another shape, or is out of range.
        """
        from_ = np.ascontiguousarray(poses, np.float64)
        if from_.ndim == 0 or from_.shape[-1] != 3:
            raise ValueError(f"found poses of shape {from_.shape}, expected (..., 3)")
        angles = np.atleast_1d(np.asarray(bearings, np.float64))
        if angles.ndim != 1:
            raise ValueError(f"found bearings of shape {angles.shape}, expected (k,)")
        if not max_range > 0:
            raise ValueError(f"found the range {max_range}, expected more than 0")
        if ray_model not in (None, "cell", "exact"):
            raise ValueError(f"found the ray model {ray_model!r}, expected 'cell' or 'exact'")
        shape = (*from_.shape[:-1], len(angles))
        if out is None:
            out = np.empty(shape)
        elif out.shape != shape or out.dtype != np.float64 or not out.flags.c_contiguous:
            raise ValueError(f"found an array to be filled of shape {out.shape}, {out.dtype}; "
                             f"expected {shape}, float64, contiguous")
        count = from_.size // 3
        self._core.cast(from_.reshape(count, 3), angles.tolist(), max_range, z, robots, ignore,
                        ray_model or "", out.reshape(count, len(angles)))
        return out

    # ---- pictures ----

    def render(self, width: int = 640, height: int = 480, *, center: tuple[float, float] | None = None,
               scale: float | None = None, data: bool = True) -> Pixels:
        """A picture of the world from above, as it is now.

        Bodies in their colours and what the rays of rangers have swept, the higher above the lower; over
        that the robots, each with a line towards its front, and with red edges if it is stalled. It is
        drawn without OpenGL and a display, and has the same bits on every machine.

        Args:
            width, height: pixels, 1 to 16384.
            center: x and y of the middle, metres; None: of all bodies.
            scale: pixels per metre; None: as many as let all bodies be seen.
            data: whether scans are drawn. Only rangers that somebody reads have any.

        Returns:
            Red, green and blue: uint8 of shape (height, width, 3), the top row first.

        Raises:
            ValueError: an argument is out of range.
        """
        return rendered(self._core.fit, self._core.render, width, height, center, scale, data)

    def _repr_png_(self) -> bytes | None:
        """What a notebook shows of it."""
        return png_of(self.render()) if self._core.is_open else None

    def __repr__(self) -> str:
        try:
            return f"<World {self._core.name!r}, {self.time:g} s>"
        except GoneError:
            return "<World, closed>"
        except StageError:
            return "<World, in use by another thread>"


def _world_again(cls: type[World], recipe: Recipe, seed: int, state: Snapshot, state_hash: str) -> World:
    """What a pickled world becomes. WorldError if its file is another one now."""
    world = cls._from_recipe(recipe, seed)
    misfit = f"found another world file in {recipe.path} than the world was made from, expected the same"
    try:
        world.restore(state)
    except StageError as error:
        raise WorldError(f"{misfit} ({error})") from None
    if world.state_hash() != state_hash:
        raise WorldError(misfit)
    return world


def rendered(fit: Callable[[int, int], tuple[float, float, float]], render: Callable[..., None], width: int,
             height: int, center: tuple[float, float] | None, scale: float | None, data: bool) -> Pixels:
    """What World.render() and Batch.render() have in common."""
    width, height = _checks.integer(width, "width", 1, 16384), _checks.integer(height, "height", 1, 16384)
    if center is None or scale is None:
        x, y, fitted = fit(width, height)
        center = (x, y) if center is None else center
        scale = fitted if scale is None else scale
    if not (np.isfinite([*center, scale]).all() and scale > 0):
        raise ValueError(f"found the center {center} and the scale {scale}, expected finite numbers, "
                         "the latter more than 0")
    pixels = np.empty((height, width, 3), np.uint8)
    render(*center, scale, data, pixels)
    return pixels
