# SPDX-License-Identifier: GPL-2.0-or-later
"""The class World: loads, steps, saves and restores one world."""

from __future__ import annotations

import fnmatch
import math
import os
import weakref
from typing import TYPE_CHECKING, Any, Callable, Iterable, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _checks, _core, _options, _paths, _rays
from ._core import Model, Snapshot
from .errors import GoneError, StageError, WorldError
from .field import Field
from .fleet import Fleet, Floats
from .log import Log, started
from .pictures import Pixels, png_of

if TYPE_CHECKING:  # imported when they are needed
    from .scenes import Scene
    from .scenes.models import Thing


class Contacts(NamedTuple):
    """The places where bodies touch: their outlines are nearer to each other than 0.8 mm."""

    models: npt.NDArray[np.int64]
    """Shape (contacts, 2): `Model.id` of both models. The first one can move."""
    points: Floats
    """Shape (contacts, 2): x and y in metres, halfway between the outlines."""
    normals: Floats
    """Shape (contacts, 2): unit vectors from the first model to the second."""
    gaps: Floats
    """Shape (contacts,): distances of the outlines in metres, usually 0.0004."""


class Column(NamedTuple):
    """A number of a property of which each world of a batch has its own."""

    section: int  # of the world file
    property: str
    element: int  # among the numbers of the property
    model: int  # id
    sensor: int  # number of the sensor of its ranger; otherwise 0


class Recipe(NamedTuple):
    """The arguments that a world was made from; they suffice to make it again in another process."""

    path: str
    text: str | None  # contents of the world file; None: read from `path`
    options: dict[str, Any]  # all options, see _options.complete()
    scene: Scene | None = None  # the scene that `text` was made from
    varied: tuple[str, ...] = ()  # settings after those of the options: values of Batch.vary()
    columns: tuple[Column, ...] = ()  # numbers that differ between worlds of a batch with this recipe

    def plain(self) -> Recipe:
        """The recipe without values of Batch.vary()."""
        return self._replace(varied=(), columns=())


class World:
    """A world that has been loaded from a world file.

    Worlds are independent of each other, and long calls release the GIL, so several threads may each use
    a world of their own at the same time. A call for a world that another thread is using raises
    StageError.

    Worlds can be pickled and deep-copied. The copy has the same state and the same future. Unpickling reads
    the world file again, which must be unchanged. A copy's metrics start anew; fleets and their commands are
    not copied.

    Args:
        file: path of the world file. A plain file name that does not exist in the working folder selects a
            shipped world: see `shipped_worlds()`.
        OPTIONS

    Raises:
        WorldError: the file can't be loaded, or a setting matches nothing in it. The error has the place in
            the file.
        TypeError, ValueError: an argument has a wrong type or is out of range.
    """

    @_options.accepting()
    def __init__(self, file: str | os.PathLike[str], **options: Any) -> None:
        self._load(Recipe(_paths.resolve(file), None, _options.complete(options)))

    @classmethod
    @_options.accepting()
    def from_text(cls, text: str, folder: str | os.PathLike[str] = "", **options: Any) -> World:
        """Loads a world from a string.

        Args:
            text: the contents of a world file.
            folder: the folder that file names in `text` are relative to; by default that of the shipped worlds.

        All other arguments are those of World().
        """
        path = os.path.join(os.fspath(folder) or _paths.WORLDS[0], "<text>")
        return cls._from_recipe(Recipe(path, text, _options.complete(options)))

    @classmethod
    @_options.accepting()
    def of(cls, scene: Scene, **options: Any) -> World:
        """Makes a world from a scene, without files. It equals the world of the files that scene.save() writes.

        Args:
            scene: the scene.

        All other arguments are those of World().
        """
        from .scenes import Scene

        if not isinstance(scene, Scene):
            raise TypeError(f"found {_checks.shown(scene)}, expected a scene: stagesim.scenes.Scene()")
        return cls._from_recipe(Recipe("<scene>", scene.text(), _options.complete(options), scene))

    @classmethod
    @_options.accepting()
    def from_grid(cls, array: npt.ArrayLike, resolution: float, origin: npt.ArrayLike = (0, 0, 0),
                  robots: Iterable[Thing] = (), *, threshold: float = 65, unknown: str = "free",
                  **options: Any) -> World:
        """Makes a world from an array of cells, without files.

        Args:
            array: cells in rows, as in nav_msgs/OccupancyGrid: row 0 is the lowest. Truth values: True is occupied.
                int8: -1 is unknown, 0 to 100 the probability in percent that the cell is occupied.
            resolution: side of a cell, metres.
            origin: x, y and heading of the lower left corner of the array.
            robots: robots and things of stagesim.scenes.
            threshold: cells with at least this percentage are walls.
            unknown: "free", or "occupied": unknown cells are walls.

        All other arguments are those of World().
        """
        from .scenes import GridMap, Scene

        walls = GridMap(array, resolution, origin, threshold, unknown)  # type: ignore[arg-type]
        return cls.of(Scene(walls, tuple(robots)), **options)

    @classmethod
    @_options.accepting()
    def from_map(cls, file: str | os.PathLike[str], robots: Iterable[Thing] = (), *, unknown: str = "free",
                 **options: Any) -> World:
        """Makes a world from a map of ROS's map_server.

        Args:
            file: path of map.yaml, which names a picture: PGM or PNG. See GridMap.from_file().
            robots: robots and things of stagesim.scenes.
            unknown: "free", or "occupied": unknown cells are walls.

        All other arguments are those of World().
        """
        from .scenes import GridMap, Scene

        return cls.of(Scene(GridMap.from_file(file, unknown=unknown), tuple(robots)), **options)

    @classmethod
    def _from_recipe(cls, recipe: Recipe) -> World:
        world = cls.__new__(cls)
        world._load(recipe)
        return world

    def _load(self, recipe: Recipe) -> None:
        options = {**recipe.options, "settings": [*recipe.options["settings"], *recipe.varied]}
        self._core = _core.Simulation(options, recipe.scene.pictures() if recipe.scene else {})
        self._recipe = recipe if recipe.scene else recipe._replace(path=os.path.abspath(recipe.path))
        try:
            if recipe.text is None:
                self._core.load_file(recipe.path)
            else:
                self._core.load_text(recipe.text, recipe.path)
        except WorldError as error:
            if recipe.text is None and "did you mean" not in str(error):
                error = error._with(_paths.advice(recipe.path))
            raise error._about(recipe.path, recipe.path if recipe.text is None else os.path.basename(recipe.path)) from None

    # ---- copies ----

    def __deepcopy__(self, memo: dict[int, Any]) -> World:
        copied = memo[id(self)] = self.fork()
        return copied

    def __copy__(self) -> World:
        return self.fork()

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickle_world, (type(self), self._recipe, self.seed, self.snapshot(), self.state_hash())

    # ---- running ----

    def step(self, n: int = 1) -> int:
        """Makes `n` steps. The quit time of the world file is ignored.

        Ctrl-C raises KeyboardInterrupt between two steps; the world stays valid and can go on.

        Args:
            n: number of steps, 0 or more.

        Returns:
            The number of steps made; less than `n` if a controller asks the world to quit, see `ended`.

        Raises:
            StageError: a controller has thrown an exception. The step is incomplete; the world can go on.
            GoneError: the world was closed, or a controller has deleted it.
        """
        return self._core.step(_checks.steps(n))

    def run(self, seconds: float | None = None) -> int:
        """Makes steps for a duration of simulated time, rounded up to whole steps.

        Args:
            seconds: the duration, 0 or more; None: until the quit time of the world file.

        Returns:
            The number of steps made, as step() does.

        Raises:
            ValueError: `seconds` is None and the world file has no quit time.
            StageError, GoneError: as in step().
        """
        if seconds is None:
            if self.quit_time is None:
                raise ValueError("the world file gives no quit_time: say how long to run")
            seconds = max(0.0, self.quit_time - self.time)
        return self.step(self._steps_in(seconds))

    def _steps_in(self, seconds: float) -> int:
        """The number of steps in a duration of simulated time. Raises ValueError unless it is finite and >= 0."""
        if not 0 <= seconds < float("inf"):
            raise ValueError(f"found {seconds} seconds, expected 0 or more")
        return -(-round(seconds * 1e6) // self._core.interval)

    def reset(self, seed: int | None = None) -> None:
        """Resets the world to its state after loading, with the given seed; None: with the current seed.

        `Model` objects and fleets of models in the world file stay valid, because these models keep their
        ids. The commands of fleets become 0.
        """
        self._core.reset(self.seed if seed is None else _options.checked("seed", seed))

    def close(self) -> None:
        """Frees the world and closes its logs. Arrays of its fleets keep their values; any other use raises GoneError."""
        for log in list(getattr(self, "_logs", ())):
            log.close()
        self._core.close()

    def __enter__(self) -> World:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # ---- state ----

    def snapshot(self, lean: bool = False) -> Snapshot:
        """Returns the current state, for restore().

        Args:
            lean: save about 100 bytes per robot, in a fraction of the time. Readings of rangers that update
                in the next step are left out: after restore() they are NaN until then.

        Raises:
            StageError: a controller has state that it does not save.
        """
        return self._core.take(lean)

    def restore(self, snapshot: Snapshot) -> None:
        """Restores a snapshot of this world, or of another world that was loaded from the same file.

        Raises:
            StageError: the snapshot doesn't fit this world, which stays as it was.
        """
        self._core.restore(snapshot)

    def fork(self) -> World:
        """Returns a new world with the same state and the same future. It shares scenery and OpenCL device."""
        world = type(self).__new__(type(self))
        world._core = self._core.fork()
        world._recipe = self._recipe
        return world

    def state_hash(self) -> str:
        """Returns a hash of all state that determines the world's future, as `stage --state-hash` prints it.

        It has 16 hexadecimal digits. Worlds with the same future have the same hash.
        """
        return f"{self._core.state_hash():016x}"

    @property
    def time(self) -> float:
        """Simulated time, seconds."""
        return self._core.microseconds / 1e6

    @property
    def dt(self) -> float:
        """Duration of a step, seconds of simulated time."""
        return self._core.interval / 1e6

    @property
    def steps(self) -> int:
        """Number of steps since the world was loaded or reset."""
        return self._core.updates

    @property
    def seed(self) -> int:
        """Seed of all random numbers."""
        return self._core.seed

    @property
    def quit_time(self) -> float | None:
        """Quit time of the world file, seconds; None: it has none. Only run() without a duration obeys it."""
        return self._core.quit_time / 1e6 or None

    @property
    def ended(self) -> bool:
        """True if a controller has asked the world to quit. step() makes no more steps until reset()."""
        return self._core.wants_to_quit

    @property
    def metrics(self) -> dict[str, float | None]:
        """Current values of the world file's metrics and of those set by set_metric(), by name.

        A metric without a value yet is None, such as the time to a goal that no robot has reached. reset() and
        restore() start metrics anew.
        """
        return {name: value if math.isfinite(value) else None for name, value in self._core.metrics()}

    def set_metric(self, name: str, value: float | None) -> None:
        """Sets the value of your own metric, until the next reset() or restore(); None: no value."""
        self._core.set_metric(name, math.nan if value is None else value)

    @property
    def device(self) -> str | None:
        """Name of the OpenCL device in use, or None."""
        return self._core.device or None

    # ---- models ----

    def model(self, name: str) -> Model:
        """Returns the model with this full name, such as "r0" or "r0.ranger:0".

        Raises:
            GoneError: there is no such model.
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

    @property
    def fields(self) -> dict[str, Field]:
        """All fields by their names, in the order of creation: see Field."""
        return {model.name: Field(model) for model in self._core.fields()}

    def include(self, file: str) -> None:
        """Reads definitions of macros, for create(). Reading a file again has no effect.

        Args:
            file: a file with definitions, as a world file includes it, such as "robots/turtlebot3_burger.inc".

        Raises:
            StageError: the file can't be read, or has other things than definitions.
        """
        if not isinstance(file, str):
            raise TypeError(f"found {_checks.shown(file)}, expected the name of a file")
        self._core.include(file)

    def create(self, type: str = "model", parent: Model | None = None, **properties: Any) -> Model:
        """Creates a model. After reset() it is gone.

        Args:
            type: the model type, such as "model", "position" or "ranger", or one from a plug-in. Or, without a
                parent, a macro that the world file or include() defines: the model has all that the macro has.
            parent: the model that carries it; None: the ground.
            properties: attributes of Model to set, such as pose=(1, 2, 0), size=(.3, .3, .5).

        Raises:
            StageError: there is no such type, or a property has an invalid value. No model is created.
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
        """Returns a group of robots, in the order of creation, with live arrays of their state and readings.

        Args:
            robots: None: all models that drive and stand on the ground. A pattern such as "r*": all models
                that drive and whose name or type matches. Or an iterable of robots, whose order is kept.

        Raises:
            GoneError: there are no such robots.
        """
        ids, names = self._choose(robots)
        return Fleet(self, self._core.crowd(ids), tuple(ids), names)

    def _choose(self, robots: str | Iterable[Model] | None) -> tuple[list[int], tuple[str, ...]]:
        """The ids and names of the robots that fleet(robots) has."""
        known = {id_: (name, type_, top) for id_, name, type_, top in self._core.robots()}
        if robots is None:
            ids = [id_ for id_, (_, _, top) in known.items() if top]
        elif isinstance(robots, str):
            ids = [id_ for id_, (name, type_, _) in known.items() if is_named(name, type_, robots)]
        else:
            ids = [robot.id for robot in robots]
            for id_ in ids:
                if id_ not in known:
                    raise GoneError(f"the model number {id_} is gone, or doesn't drive")
        if not ids:
            raise GoneError("there are no such robots")
        return ids, tuple(known[id_][0] for id_ in ids)

    # ---- contacts ----

    def contacts(self) -> Contacts:
        """Returns the places where bodies touch at their present poses.

        With contacts of cells there are none.
        """
        ids, numbers = self._core.contacts()
        rows = np.array(numbers, dtype=np.float64).reshape(-1, 5)
        return Contacts(np.array(ids, dtype=np.int64).reshape(-1, 2), rows[:, :2], rows[:, 2:4], rows[:, 4])

    # ---- rays ----

    def cast(self, poses: npt.ArrayLike, bearings: npt.ArrayLike, max_range: float, *,
             z: float | None = None, robots: bool = False, ignore: Model | None = None,
             ray_model: str | None = None, out: Floats | None = None) -> Floats:
        """Casts rays from arbitrary poses, as a ranger would, millions of them in one call.

        All rays are traced as one batch on the world's threads, and on its OpenCL device where that is
        faster. The world is not changed.

        Args:
            poses: x, y (metres) and heading (radians), shape (..., 3).
            bearings: directions of the rays relative to the heading, radians: shape (k,) or a number.
            max_range: maximum range, metres, more than 0; may be infinite.
            z: height of the rays, metres; None: rays hit obstacles at any height.
            robots: True: rays also hit robots (models that drive) and what they carry. False: only the map.
            ignore: a model whose whole tree is transparent to the rays.
            ray_model: "cell" or "exact"; None: the world's.
            out: array for the result: float64, C-contiguous, shape (..., k); None: a new array.

        Returns:
            Ranges in metres, shape (..., k); `max_range` where a ray hits nothing or its pose is not finite.

        Raises:
            ValueError: an argument has a wrong shape or is out of range.
        """
        from_, angles = _rays.poses(poses), _rays.bearings(bearings)
        _rays.check(max_range, ray_model)
        out = _rays.result((*from_.shape[:-1], len(angles)), out)
        count = from_.size // 3
        self._core.cast(from_.reshape(count, 3), angles.tolist(), max_range, z, robots, ignore,
                        ray_model or "", out.reshape(count, len(angles)))
        return out

    # ---- logs ----

    def log(self, file: str | os.PathLike[str], *, every: float = 0, models: str | Iterable[str] | None = None,
            compression: str | None = None, ranges: str = "rep117") -> Log:
        """Starts a log of the world, as `stage --log` writes it: see docs/recording.md.

            with world.log("run.mcap"):
                world.run(60)

        Args:
            file: an MCAP file, which is made, or replaces an earlier log.
            every: simulated time between records, seconds; 0: each update is recorded.
            models: only these robots: a name, or several, or patterns with * and ?. None: all.
            compression: "lz4", "zstd" or "none"; None: "lz4", unless Stage was built without it.
            ranges: values of rays without a hit: "rep117": infinity; "stage": the maximum range.

        Raises:
            StageError: the file can't be written, or no robot has such a name.
            ValueError: an argument has an invalid value.
        """
        log = started([(file, self._core.start_log)], every, models, compression, ranges)
        if not hasattr(self, "_logs"):
            self._logs: weakref.WeakSet[Log] = weakref.WeakSet()
        self._logs.add(log)
        return log

    # ---- pictures ----

    def render(self, width: int = 640, height: int = 480, *, center: tuple[float, float] | None = None,
               scale: float | None = None, data: bool = True) -> Pixels:
        """Renders the world from above.

        Bodies and the areas swept by rangers' rays are drawn from low to high, then the robots, each with a
        nose that shows its heading, and with red edges if it is stalled. Rendering needs neither OpenGL nor
        a display, and the picture is bit-equal on every machine.

        Args:
            width, height: size of the picture, pixels, 1 to 16384.
            center: x and y at the center of the picture, metres; None: the center of all bodies.
            scale: pixels per metre; None: the scale that shows all bodies.
            data: True: draw the scans of rangers that have subscribers.

        Returns:
            Red, green and blue: uint8, shape (height, width, 3), the top row first.

        Raises:
            ValueError: an argument is out of range.
        """
        return rendered(self._core.fit, self._core.render, width, height, center, scale, data)

    def _repr_png_(self) -> bytes | None:
        """The picture that a notebook shows for this world."""
        return png_of(self.render()) if self._core.is_open else None

    def __repr__(self) -> str:
        try:
            return f"<World {self._core.name!r}, {self.time:g} s>"
        except GoneError:
            return "<World, closed>"
        except StageError:
            return "<World, in use by another thread>"


World.__doc__ = _options.documented(World.__doc__)


def _unpickle_world(cls: type[World], recipe: Recipe, seed: int, state: Snapshot, state_hash: str) -> World:
    """Unpickles a world. Raises WorldError if its world file has changed."""
    world = cls._from_recipe(recipe._replace(options={**recipe.options, "seed": seed}))
    misfit = f"found another world file in {recipe.path} than the world was made from, expected the same"
    try:
        world.restore(state)
    except StageError as error:
        raise WorldError(f"{misfit} ({error})") from None
    if world.state_hash() != state_hash:
        raise WorldError(misfit)
    return world


def is_named(name: str, type_: str, pattern: str) -> bool:
    """True if the name or the type of a model is like the pattern."""
    return fnmatch.fnmatchcase(name, pattern) or fnmatch.fnmatchcase(type_, pattern)


def rendered(fit: Callable[[int, int], tuple[float, float, float]], render: Callable[..., None], width: int,
             height: int, center: tuple[float, float] | None, scale: float | None, data: bool) -> Pixels:
    """The common part of World.render() and Batch.render()."""
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
