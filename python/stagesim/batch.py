# SPDX-License-Identifier: GPL-2.0-or-later
"""Many worlds of the same file, or of a few files."""

from __future__ import annotations

import os
from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING, Any, Mapping, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _checks, _contacts, _core, _options, _rays, _states
from ._batch_arguments import Numbers, device_choice, moves, variant_numbers
from ._contacts import BatchContacts
from ._core import Snapshot
from ._members import Ids, fitted, placed_of, robots_of
from ._scene_variants import MapLike, SceneVariants, each_map, scene_with
from ._variation import Variation, key_of, recipe_with
from .device_array import checked_tensor, is_on_card, on_host
from .errors import StageError, WorldError
from .fleet import Bools, Crowd, Floats
from .log import Log, started
from .pictures import Pixels
from .world import Column, Recipe, World, rendered

if TYPE_CHECKING:
    from .scenes import Scene

MAX_WORLDS = 2**31
OWN = ("seed", "threads")  # options of World() that a batch has in another form
#: State of a batch: a snapshot per world, the failures by index, and the commands or None.
_States = tuple[list[Snapshot], Mapping[int, str], Union[Floats, None]]
#: Selects worlds: None for all, indices, or a boolean mask of shape (n,).
Which = Union[None, int, Sequence[int], npt.NDArray[Any]]


class Batch(Crowd):
    """Many worlds of one or a few files, which one call steps on several threads, or on a device.

    The arrays are those of a Fleet with an axis for the worlds in front: `pose` is (n, robots, 3),
    `ranger(0).ranges` (n, robots, samples). Each world is bit-equal to the same world alone, for any number
    of worlds and threads: `Batch(file, n, seeds=s).state_hash(i)` equals that of `World(file, seed=s[i])`
    after the same steps and commands.

    An error in a world, such as an exception of a controller, makes that world fail: it makes no more steps
    until it is reset or restored, and `failed` has the reason. The other worlds go on.

    Batches can be pickled and deep-copied, as worlds can. The copy has the same states and the same `cmd`.

    Worlds may be of several variants, which have other settings, or other files: see `variants` and of(). A reset
    may change the variant of a world. The arrays have all robots of all variants, found by their names, and are as
    wide as the widest sensor. For robots that a world lacks, numbers are NaN and truth values False, and commands are
    ignored.

    With `device`, whole steps are made on an OpenCL device: all worlds, from commands to readings, with the same
    bits as on the host. All worlds must be closed, see explain(), and have contacts of cells and models with one
    update interval. The arrays are in the memory of the device. If CUDA has the device, they are DeviceArray objects, which PyTorch, JAX and CuPy use in
    place; otherwise they are arrays of NumPy, which are copied after each call. Arrays of positions, commands,
    stalls, energy and rangers are there; ask for those of rangers before the first step, or after a reset of all
    worlds. All other methods work as without a device. With several variants, or controllers in C++ that are not
    built in, the device steps the worlds that it can step, and the arrays are those of a batch without a device.

    Args:
        file: path of the world file, or the name of a shipped world, as in World().
        n: number of worlds, 1 or more.
        variants: for each variant its values of settings, which are added to those in `settings`; None: one variant.
        variant: number of each world's variant; None: world i is of variant i % len(variants).
        seeds: a seed per world; None: 0 to n - 1.
        threads: number of threads that the worlds are distributed over, 1 to 1024; None: one per available
            processor.
        robots: a pattern of names or types, as in World.fleet(); None: all that drive on the ground.
        placed: a pattern of names or types of models on the ground that are no robots. place() moves them, so that each
            may be elsewhere in each world; None: none.
        device: None: the host makes the steps; "opencl": the best OpenCL device makes them; "opencl:NAME": that
            device, named as after `stage --opencl=`, for example "opencl:gpu".
        options: all others of World().

    Raises:
        WorldError: the file can't be loaded, or the device can't step it.
        StageError: there is no such device.
        GoneError: there are no such robots.
        TypeError, ValueError: an argument has a wrong type or is out of range.
    """

    @_options.accepting(OWN)
    def __init__(self, file: str | os.PathLike[str], n: int, *, variants: Sequence[_options.Settings] | None = None,
                 variant: npt.ArrayLike | None = None, seeds: Iterable[int] | None = None,
                 threads: int | None = None, robots: str | None = None, placed: str | None = None,
                 device: str | None = None, **options: Any) -> None:
        own = _options.complete(options, OWN)
        worlds = [World(file, threads=1, **{**own, "settings": own["settings"] + _options.settings_list(settings)})
                  for settings in ([{}] if variants is None else variants)]
        self._begin(worlds, n, variant, seeds, threads, robots, placed, device)

    @classmethod
    def of(cls, world: World | Scene | Sequence[World | Scene], n: int, *, variant: npt.ArrayLike | None = None,
           seeds: Iterable[int] | None = None, threads: int | None = None, robots: str | None = None,
           placed: str | None = None, device: str | None = None) -> Batch:
        """Makes a batch from a world, as it was after loading, or a scene. Several of these are variants."""
        several = list(world) if isinstance(world, Iterable) else [world]
        worlds = [each if isinstance(each, World) else World.of(each, threads=1) for each in several]
        batch = cls.__new__(cls)
        batch._begin(worlds, n, variant, seeds, threads, robots, placed, device)
        return batch

    def _begin(self, prototypes: list[World], n: int, variant: npt.ArrayLike | None, seeds: Iterable[int] | None,
               threads: int | None, robots: str | None, placed: str | None, device: str | None,
               branch: bool = False) -> None:
        n = _checks.integer(n, "the number of worlds", 1, MAX_WORLDS)
        if not prototypes:
            raise ValueError("found no variants, expected one or more")
        variant = variant_numbers(np.arange(n) % len(prototypes) if variant is None else variant, n, len(prototypes))
        ids, names = robots_of(prototypes, robots)
        things = placed_of(prototypes, placed)
        threads = _core.count_processors() if threads is None else _options.checked("threads", threads)
        core = _core.Batch([prototype._core for prototype in prototypes],
                           _options.seeds(np.arange(n) if seeds is None else seeds, n).tolist(), variant.tolist(),
                           threads, ids,
                           device_choice(device), list(things[1]), branch)
        self._take(core, n, names, [prototype._recipe for prototype in prototypes], ids, things, device,
                   (robots, placed))

    def _take(self, core: _core.Batch, n: int, names: tuple[str, ...], recipes: list[Recipe], ids: Ids,
              things: tuple[Ids, tuple[str, ...]], device: str | None, patterns: tuple[str | None, str | None],
              scenes: SceneVariants | None = None, next_variants: Mapping[int, int] | None = None,
              variation: Variation | None = None) -> None:
        self._core = core
        self._device = device
        self.n = n  #: number of worlds
        self.names = names  #: names of the robots of all variants
        self._recipes = list(recipes)
        self._ids = list(ids)
        self._things, self.placed = list(things[0]), things[1]  #: names of the models that place() moves
        self._patterns = patterns  # of robots and of models that place() moves
        self._scenes = scenes or SceneVariants([key_of(recipe) for recipe in recipes])
        self._variation = variation or Variation(n)
        self._state_keys = _states.StateKeys()
        self._next_variants = dict(next_variants or {})  # of worlds with another map from their next reset on
        self._all = np.arange(n, dtype=np.uint32)
        super().__init__(core.device_crowd or core.crowd)

    # ---- copies ----

    def _states(self) -> _States:
        cmd = np.array(self.cmd) if "cmd" in self._views else None
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
        core = self._core.another(self.seeds)
        _set_values(core, self._core.variants(), self._core.values())
        copied._take(core, self.n, self.names, self._recipes, self._ids,
                     (self._things, self.placed), self._device, self._patterns, self._scenes.copy(),
                     self._next_variants, self._variation.copy())
        copied._put(self._states())
        return copied

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickle_batch, (type(self), self._recipes, self.seeds, self._core.variants(), self.threads, self._ids,
                                 self.names, self._states(), self._device, (self._things, self.placed), self._patterns,
                                 self._scenes, self._next_variants, self._variation, self._core.values())

    @property
    def device(self) -> str | None:
        """Name of the device that makes the steps; None: the host makes them."""
        return self._core.device or None

    @property
    def synchronous(self) -> bool:
        """Whether a call waits for the device: before it, for everything that this process has started on the CUDA
        device, and until its own work is done. Only False can be set on a CUDA device.

        If it is False, calls only start work, in CUDA's default stream, which is that of PyTorch unless you choose
        another one. Operations on the arrays in that stream are in order. Order those in other streams yourself.
        """
        return self._core.device_crowd.waits if self._core.device_crowd else True

    @synchronous.setter
    def synchronous(self, value: bool) -> None:
        if self._core.device_crowd:
            self._core.device_crowd.waits = bool(value)
        elif not value:
            raise StageError("a batch on the host is always synchronous")

    @property
    def time(self) -> Floats:
        """Simulated time of each world, seconds: shape (n,), live."""
        return self._view("time", self._crowd.time)

    @property
    def ended(self) -> Bools:
        """True for worlds that a controller has asked to quit; they make no more steps. Shape (n,), live."""
        return self._view("ended", self._crowd.ended)

    @property
    def failed(self) -> list[str | None]:
        """For each world the reason why it has failed, in one line, or None."""
        failures = self._core.failures()
        return [failures.get(i) for i in range(self.n)]

    def explain(self) -> list[str | None]:
        """Says for each world what keeps it from being stepped fast, or None.

        A world is stepped fast, without an object per model, if it is closed: all its models are of types that
        such steps know, and nobody calls back. The results are equal to the bit.
        """
        return [reason or None for reason in self._core.reasons()]

    @property
    def metrics(self) -> dict[str, Floats]:
        """World.metrics of all worlds: a new array of shape (n,) per name; NaN: no value."""
        return {name: np.array(values) for name, values in self._core.metrics()}

    @property
    def ranges(self) -> Floats:
        """`ranger(0).ranges`: metres, shape (n, robots, samples)."""
        return self.ranger(0).ranges

    @property
    def threads(self) -> int:
        """Number of threads that the worlds are distributed over."""
        return self._core.threads

    def step(self, n: int = 1, *, ids: Which = None) -> None:
        """Makes `n` steps in each of the selected worlds, as World.step() does.

        Ctrl-C raises KeyboardInterrupt when all of them have made the same number of steps; they stay valid.

        Args:
            n: number of steps, 0 or more.
            ids: which worlds; None: all. Worlds that have failed or ended make no steps.
        """
        if np.ndim(n) > 0:
            raise TypeError("found several numbers of steps, expected one; ids= chooses worlds")
        self._core.step(self._chosen(ids), _checks.steps(n))

    def reset(self, seeds: int | Iterable[int] | None = None, *, ids: Which = None,
              variant: npt.ArrayLike | None = None) -> None:
        """Resets worlds to their state after loading. Their commands become 0.

        This is about as fast as restore(), unless a world is not closed, see explain(), and its file has
        controllers, plug-ins or populations.

        Args:
            seeds: one seed per selected world, or one for all; None: their current seeds. An array of integers is
                the fastest way to give many.
            ids: which worlds; None: all. For a batch on a CUDA device, a mask there of shape (n,) as well: if the
                worlds have no populations and no noise, it stays there.
            variant: one variant per selected world, or one for all; None: those that they have.
        """
        if is_on_card(ids):
            flags = checked_tensor(ids, "a mask", "bool", (self.n,))
            stays = seeds is None and variant is None and not self._variation.waits_anywhere()
            if stays and self._reads_cuda() and self._core.reset_on_card(flags):
                return
            ids = on_host(flags)
        chosen = self._chosen(ids)
        new: npt.NDArray[np.uint64] | None = None
        if seeds is None:
            pass
        elif not isinstance(seeds, Iterable) or (isinstance(seeds, np.ndarray) and seeds.ndim == 0):
            new = np.full(len(chosen), _options.checked("seed", seeds), np.uint64)
        elif isinstance(seeds, np.ndarray) and seeds.dtype == bool:
            raise TypeError("found truth values as seeds, expected whole numbers; ids= chooses worlds")
        else:
            new = _options.seeds(seeds, len(chosen))
        given = None if variant is None else variant_numbers(variant, len(chosen), len(self._recipes))
        variants = self._take_next_variants(chosen, given)
        values = None
        if variants is not None and self._core.device_crowd:
            variants, values = self._shared_scene(chosen, variants)
        elif variants is not None:
            values = self._variation.values(chosen, [self._recipes[number] for number in variants.tolist()])
        self._core.reset(chosen, new, variants, values)

    def _take_next_variants(self, chosen: Numbers, given: Numbers | None) -> Numbers | None:
        """The variants of worlds after a reset; None: those that they have, with the same values."""
        if not self._next_variants and self._variation.is_idle():
            return given
        ids = chosen.tolist()
        present = self._core.variants()
        if given is not None:
            following = dict(zip(ids, given.tolist()))
        else:
            following = {i: self._next_variants[i] for i in ids if i in self._next_variants}
        if not self._variation.is_idle():
            following.update(self._varied({i: following.get(i, present[i]) for i in ids
                                           if i in following or self._variation.waits(i)}, present))
            self._variation.note_reset(chosen)
        for i in ids:
            self._next_variants.pop(i, None)
        return np.array([following.get(i, present[i]) for i in ids], np.uint32) if following else None

    def _shared_scene(self, chosen: Numbers, following: Numbers) -> tuple[Numbers, npt.NDArray[Any] | None]:
        """The variants and values of worlds that are reset on a device, where all worlds share a scene.

        It has the columns of all of them. If it must be another one, the worlds that are not reset are carried there.
        """
        present = self._core.variants()
        others = present[:1] if len(chosen) < self.n else []
        recipes = [self._recipes[number] for number in {*following.tolist(), *others}]
        columns = tuple(sorted({column for recipe in recipes for column in recipe.columns}))
        recipe = recipes[0]._replace(columns=columns)
        variant = self._variants_of([recipe], present)[key_of(recipe)]
        variants = np.full(self.n, variant, np.uint32)
        if others and variant != present[0]:
            self._core.carry_to_variants(variants, self._values_in(columns, self._recipes[present[0]].columns))
        values = self._variation.values_in(chosen, self._recipes[variant]) if columns else None
        return variants[:len(chosen)], values

    def _values_in(self, columns: Sequence[Column], before: Sequence[Column]) -> npt.NDArray[Any]:
        """The values of all worlds in other columns than those of before; NaN: that of the file."""
        values = np.full((self.n, len(columns)), np.nan)
        places = [columns.index(column) for column in before]
        for i, own in enumerate(self._core.values()):
            if own:
                values[i, places] = own
        return values

    def _varied(self, before: Mapping[int, int], present: list[int]) -> dict[int, int]:
        """The variants of worlds with their values of vary(), by the variants that they would have without."""
        bases = {i: self._recipes[variant] for i, variant in before.items()}
        recipes = self._variation.recipes(bases)
        try:
            numbers = self._variants_of(recipes.values(), present)
        except WorldError:
            wrong = self._variation.why_not_made(recipes)
            if not wrong:
                raise
            raise WorldError(f"values of vary() can't be in force: {wrong}") from None
        keys = {id(recipe): key_of(recipe) for recipe in {id(each): each for each in recipes.values()}.values()}
        return {i: numbers[keys[id(recipe)]] for i, recipe in recipes.items()}

    def vary(self, name: str, values: npt.ArrayLike | None) -> None:
        """Gives a property another value in each world, from its next reset on: domain randomisation.

        Each world is then equal to one that has been loaded from a file with these values. It keeps them in later
        resets, copies and forks, and with another map or variant, where that has models of these names.

        Any number of closed worlds, see explain(), may have values of their own of mass, friction, floor_friction,
        velocity_bounds, acceleration_bounds, wheel_slip, odom_error, odom_noise, wheelbase, steering_limit and
        steering_rate of robots, and of the noise of rangers. For all other properties, worlds with equal values share a
        scene; a new one takes about a millisecond and 0.8 MB, and a batch may have 1024 different combinations of such
        values. Worlds of one variant on a device differ only in the former.

        Args:
            name: PATTERN.PROPERTY, or PATTERN.PROPERTY[INDEX] for one number of several: "robot*.mass",
                "ranger.noise[0]", "r0.ranger.range", "world.resolution". A pattern is like the whole name of a model,
                part by part between dots. A part may also be a type, or the name of a `define`. Properties are those
                of docs/properties.md, in the units of the world file, or of the scene.
            values: shape (n,), or (n, matches) for each model that the name chooses, in the order of the file, or
                (n, matches, k) for properties with k numbers. None: the values of the file again.

        Raises:
            ValueError: there is no such model or property, or values have another shape, are NaN or out of range.
                Numbers that are valid alone and not together raise WorldError in reset().
            StageError: the property needs several scenes, and the worlds are on a device and of one variant: make the
                batch from two scenes or more then.
        """
        plain = [recipe.plain() for recipe in self._recipes]
        bases = [plain[self._next_variants.get(i, variant)] for i, variant in enumerate(self._core.variants())]
        self._variation.set(name, values, bases, shares_scene=self._core.device_crowd is not None)

    def _check_not_on_device(self, why: str) -> None:
        """Raises StageError if the arrays of the worlds are on a device, which has one scene for all of them."""
        if self._core.device_crowd:
            raise StageError(f"the worlds of this batch are on a device and of one variant, so {why}; make it from two "
                             "scenes or more")

    @property
    def varied(self) -> dict[str, npt.NDArray[Any]]:
        """The values that vary() was given, by name: copies."""
        return {name: varied.given.copy() for name, varied in self._variation.all.items()}

    def set_map(self, ids: Which, map: MapLike | Sequence[MapLike]) -> None:
        """Gives worlds another map, or another scene, from their next reset on.

        The world is then equal to that of the scene alone, with the options of the batch's first world. A map that the
        batch has had is found again by its content, unless 64 others without worlds have been used since.

        Args:
            ids: which worlds; None: all.
            map: an array of cells, whose resolution and origin are those of the world's present map; a GridMap; or a
                whole Scene, which may have other obstacles, and robots at other places or fewer of them. A list, or an
                array with three axes, has one for each world.

        Raises:
            WorldError: the world can't be made.
            ValueError: an array or scene is wrong, or a robot is none of `names`.
            StageError: a sensor has more readings than the array in use. Or the worlds are on a device and of one
                variant: make the batch from two scenes or more then.
        """
        self._check_not_on_device("they keep their map")
        chosen = self._chosen(ids).tolist()
        present = self._core.variants()
        scenes: dict[tuple[int, int], Scene] = {}  # by the map that is given, and the variant until now
        keys = {}
        for i, given in zip(chosen, each_map(map, len(chosen))):
            before = self._next_variants.get(i, present[i])
            keys[i] = id(given), before
            if keys[i] not in scenes:
                scenes[keys[i]] = scene_with(given, self._recipes[before].scene, i)
        recipes = {key: self._recipe_of(scene) for key, scene in scenes.items()}
        numbers = self._variants_of(recipes.values(), present)
        self._next_variants.update({i: numbers[key_of(recipes[key])] for i, key in keys.items()})

    def _recipe_of(self, scene: Scene) -> Recipe:
        """The recipe of a scene, with the options of the first world."""
        first = self._recipes[0]
        options = {**first.options, "threads": 1, "settings": first.options["settings"] if first.scene else []}
        return Recipe("<scene>", scene.text(), options, scene)

    def _variants_of(self, recipes: Iterable[Recipe], present: list[int]) -> dict[str, int]:
        """The numbers of the variants of these recipes by their keys; those that are new are made."""
        once = {key_of(recipe): recipe for recipe in {id(each): each for each in recipes}.values()}
        found = {key: self._scenes.find(key) for key in once}
        numbers = {key: number for key, number in found.items() if number is not None}
        new = [key for key in once if key not in numbers]
        used = {*present, *self._next_variants.values(), *numbers.values()} if new else set()
        places = self._scenes.numbers_for_new(used, len(new)) if new else []
        for key, number, prototype in zip(new, places, self._prototypes_of([once[key] for key in new])):
            self._set_prototype(number, prototype)
            self._scenes.add(key, number)
            numbers[key] = number
        return numbers

    def _prototypes_of(self, recipes: list[Recipe]) -> list[World]:
        """Makes worlds of recipes, on the threads of the batch."""
        if len(recipes) < 2 or self.threads == 1:
            return [World._from_recipe(recipe) for recipe in recipes]
        from concurrent.futures import ThreadPoolExecutor  # rarely needed

        with ThreadPoolExecutor(self.threads) as executor:
            return list(executor.map(World._from_recipe, recipes))

    def _set_prototype(self, number: int, prototype: World) -> None:
        """Gives a variant without worlds, or the next one, another prototype."""
        ids = fitted(robots_of([prototype], self._patterns[0], may_lack=True), self.names)
        things = placed_of([prototype], self._patterns[1], may_lack=True)
        places = fitted(things, self.placed, others=True)
        self._core.set_prototype(number, prototype._core, ids, *_columns_of(prototype._recipe))
        for of_variants, value in ((self._recipes, prototype._recipe), (self._ids, ids), (self._things, places)):
            of_variants[number:number + 1] = [value]

    @property
    def variant(self) -> Numbers:
        """Number of each world's variant: a new array of shape (n,)."""
        return np.array(self._core.variants(), np.uint32)

    @property
    def seeds(self) -> list[int]:
        """Seed of each world's random numbers."""
        return self._core.seeds()

    def rollout(self, commands: npt.ArrayLike | None = None, *, moments: int | None = None, n: int = 1,
                record: Sequence[str] = ("pose",)) -> dict[str, npt.NDArray[Any]]:
        """Makes many steps from the current state and records arrays, without Python code in between.

        Args:
            commands: the value of `cmd` at each moment: shape (moments, n, robots, 3), or broadcastable to
                it; None: `cmd` stays as it is.
            moments: how often commands are set and arrays recorded; None: commands.shape[0].
            n: steps per moment, 1 or more.
            record: names of arrays, as in array(); "ranges" and "intensities" are those of ranger 0.

        Returns:
            For each name an array of shape (moments, *shape of the live array), recorded after each moment, and
            "failed", a mask of shape (moments, n). It is True from the moment on at which a world has failed;
            there, floats are NaN and truth values False, and `Batch.failed` says why. Rows of worlds that
            have ended keep their last values.
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
        live = [self.array("ranger.intensities" if name == "intensities" else name) for name in record]
        if self._core.device_crowd:
            return self._rollout_on_device(given, moments, n, dict(zip(record, live)))
        made: list[npt.NDArray[Any]] = [np.empty((moments, *view.shape), view.dtype) for view in live]
        recorded = np.zeros((moments, self.n), bool)
        self._core.rollout(moments, n, given, live, made, recorded)
        failed = ~recorded
        if failed.any():
            for array in made:
                array[failed] = np.nan if array.dtype.kind == "f" else 0
        return {**dict(zip(record, made)), "failed": failed}

    def _rollout_on_device(self, commands: npt.NDArray[Any] | None, moments: int, n: int,
                           live: Mapping[str, Any]) -> dict[str, npt.NDArray[Any]]:
        made = {name: np.empty((moments, *view.shape), view.dtype) for name, view in live.items()}
        for moment in range(moments):
            if commands is not None:
                self.cmd[...] = commands[moment]
            self.step(n)
            for name, view in live.items():
                made[name][moment] = np.asarray(view)
        return {**made, "failed": np.zeros((moments, self.n), bool)}

    def snapshot(self, index: int) -> Snapshot:
        """Returns the state of world `index`, for restore() of worlds of the same variant, or a World like them."""
        return self._core.take(self._index(index))

    def restore(self, snapshot: Snapshot, ids: Which = None) -> None:
        """Restores a snapshot in worlds; None: in all. Worlds that it doesn't fit fail."""
        self._core.restore(self._chosen(ids), snapshot)

    def contacts(self, most: int = 8, *, ids: Which = None) -> BatchContacts:
        """Returns the places where bodies touch in each world at its present poses, as World.contacts() does.

        With contacts of cells there are none. A flat side at another one has two.

        Args:
            most: max number of contacts of a world, 0 or more; the others are left out.
            ids: which worlds, in this order; None: all.
        """
        return _contacts.found(self._core, self._chosen(ids), _checks.integer(most, "most", 0))

    def cast(self, poses: npt.ArrayLike, bearings: npt.ArrayLike, max_range: float, *, ids: Which = None,
             z: float | None = None, robots: bool = False, ignore: npt.ArrayLike | bool | None = None,
             ray_model: str | None = None, out: Floats | None = None) -> Floats:
        """Casts rays from arbitrary poses in each world, on the threads of the batch, as World.cast() does.

        Rays of the cell model in closed worlds need no objects.

        Args:
            poses: x, y (metres) and heading (radians): shape (worlds, k, 3), or (k, 3) for equal ones in all worlds.
            bearings: directions of the rays relative to the heading, radians: shape (rays,) or a number.
            max_range: maximum range, metres, more than 0; may be infinite.
            ids: which worlds, in the order of `poses`; None: all.
            z: height of the rays, metres; None: rays hit obstacles at any height.
            robots: True: rays also hit robots (models that drive) and what they carry. False: only the map.
            ignore: for each of the k poses the number, in the order of `names`, of a robot whose whole tree is
                transparent to the rays, or -1: shape (k,), or one for all. True: pose i is one of robot i, and k the
                number of robots. None: rays hit all robots.
            ray_model: "cell" or "exact"; None: the world's.
            out: array for the result: float64, C-contiguous, shape (worlds, k, rays); None: a new array.

        Returns:
            Ranges in metres, shape (worlds, k, rays); `max_range` where a ray hits nothing or its pose is not finite.
            NaN: the world doesn't exist.

        Raises:
            ValueError: an argument has a wrong shape or is out of range.
        """
        chosen, angles = self._chosen(ids), _rays.bearings(bearings)
        _rays.check(max_range, ray_model)
        given = _rays.poses(poses)
        if given.ndim not in (2, 3) or given.ndim == 3 and len(given) not in (1, len(chosen)):
            raise ValueError(f"found poses of shape {given.shape}, expected ({len(chosen)}, k, 3) or (k, 3)")
        count = given.shape[-2]
        from_ = np.ascontiguousarray(np.broadcast_to(given, (len(chosen), count, 3)))
        out = _rays.result((len(chosen), count, len(angles)), out)
        passed = _rays.ignored(ignore, count, len(self))
        self._core.cast(chosen, from_, angles.tolist(), max_range, z, robots, passed, ray_model or "", out)
        return out

    def state(self, ids: Which = None) -> npt.NDArray[np.uint64]:
        """Returns the states of worlds as rows of an array, for load(): thousands of forks for planning.

        A row of four robots with twelve rays each is 1.4 KB, and takes less than a microsecond. Rows can be chosen,
        repeated, sent to other processes, and saved with numpy.save(). Worlds with the same history have equal rows;
        state_hash() tells whether states are equal in other cases. `cmd` is not part of a state.

        Args:
            ids: which worlds, in this order; None: all.

        Returns:
            Shape (worlds, words). Treat the words as opaque: load() refuses rows that were changed.

        Raises:
            StageError: a world is not closed, see explain(), or has failed.
        """
        return _states.saved(self._core, self._chosen(ids), self._state_keys.of(self._recipes))

    def load(self, state: npt.ArrayLike, ids: Which = None) -> None:
        """Puts worlds into states from state(): their time, random numbers, readings and variants are those of then.

        They go on as the saved worlds did, to the bit, with the same commands. Random numbers go on as they did in
        the saved world, so forks of one state have the same noise. Seeds and values of vary() for reset() stay as they are.

            batch.load(batch.state(3))                      # all worlds become forks of world 3
            batch.load(states[best[ids]], ids)              # some of them, each from another row

        Args:
            state: a row for each of these worlds, or one for all: shape (worlds, words), (1, words) or (words,). It
                may be from another batch, in another process, if that had a variant with the same world file, options
                and values of vary(). Load only states that you trust.
            ids: which worlds, in the order of the rows; None: all.

        Raises:
            StageError: a row belongs to another scene or was changed, or a world can't take it. Or the worlds are on a
                device and of one variant, and would not have the same sensors in use and the same properties that vary.
                No world is changed.
            ValueError: the shape is wrong.
        """
        chosen, before = self._chosen(ids), np.array(self._core.variants())
        _states.load(self._core, chosen, self._state_keys.of(self._recipes), state)
        after = np.array(self._core.variants())
        has_columns = np.array([bool(recipe.columns) for recipe in self._recipes])
        self._variation.wait(chosen[((after != before) & (has_columns[after] | has_columns[before]))[chosen]])

    def fork(self, index: int) -> World:
        """Returns an independent World in the state of world `index`."""
        i = self._index(index)
        recipe = self._recipes[self._core.variants()[i]]
        if recipe.columns:
            alone = recipe_with(self._core.values_of(i), recipe, self._variation.sections(recipe))
            world = World._from_recipe(alone._replace(options={**alone.options, "seed": self.seeds[i]}))
            world.restore(self.snapshot(i))
            return world
        world = World.__new__(World)
        world._core = self._core.fork(i)
        world._recipe = recipe
        return world

    def state_hash(self, index: int) -> str:
        """Returns the state hash of world `index`, see World.state_hash()."""
        return self.state_hashes()[self._index(index)]

    def state_hashes(self) -> list[str]:
        """Returns the state hashes of all worlds."""
        return [f"{number:016x}" for number in self._core.state_hashes()]

    def teleport(self, pose: npt.ArrayLike, which: npt.ArrayLike | None = None) -> None:
        """Moves robots to other poses, without collision tests.

        Args:
            pose: x, y (metres) and heading (radians), broadcastable to (n, robots, 3).
            which: a mask of the robots to move, broadcastable to (n, robots); None: all.

        For a batch on a CUDA device, both can be tensors there: float64 of shape (n, robots, 3) and bool of shape
        (n, robots). Robots whose pose is not finite stay where they are then.

        Raises:
            ValueError: a pose is not finite, or a shape is wrong.
        """
        shape = (self.n, len(self))
        if is_on_card(pose):
            checked_tensor(pose, "poses", "float64", (*shape, 3))
            checked_tensor(which, "a mask", "bool", shape)
            if self._reads_cuda():
                return self._core.teleport_on_card(pose, which)
            pose, which = on_host(pose), on_host(which)
        self._core.teleport(*moves(pose, which, shape))

    def place(self, pose: npt.ArrayLike, which: npt.ArrayLike | None = None) -> None:
        """Moves the models of `placed` to other places, without collision tests.

        They stay there until they are placed again, their world is reset, or a robot pushes them. A closed world
        stays closed. Models that are large or have many corners prevent that, see explain().

        Args:
            pose: x, y (metres) and heading (radians), broadcastable to (n, len(placed), 3).
            which: a mask of the models to move, broadcastable to (n, len(placed)); None: all.

        Raises:
            ValueError: a pose is not finite, or a shape is wrong.
        """
        self._core.place(self._things, *moves(pose, which, (self.n, len(self.placed))))

    @property
    def placed_pose(self) -> Floats:
        """Where the models of `placed` are: x, y (metres) and heading (radians), a new array (n, len(placed), 3).

        NaN: the world lacks the model.
        """
        poses = np.empty((self.n, len(self.placed), 3))
        self._core.find_places(self._things, poses)
        return poses

    def log(self, file: str | os.PathLike[str], worlds: Which = 0, *, every: float = 0,
            models: str | Iterable[str] | None = None, compression: str | None = None, ranges: str = "rep117") -> Log:
        """Starts logs of some of the worlds, one file for each: see docs/recording.md.

            with batch.log("run-{}.mcap", [0, 7]):      # run-0.mcap and run-7.mcap
                batch.step(600)

        Each file has the messages of the log that World.log() writes of the same world alone. The states stay the same, but
        steps take longer: after each step, an object is made for each logged world.

        Args:
            file: an MCAP file; {} in its name stands for the number of the world. With several worlds it is needed.
            worlds: which worlds; None: all.

        All other arguments and errors are those of World.log(). IndexError: there is no such world.
        """
        chosen, name = self._chosen(worlds).tolist(), str(os.fspath(file))
        if not chosen:
            raise ValueError(f"found the worlds {_checks.shown(worlds)} for a log, expected one or more")
        if len(chosen) > 1 and "{}" not in name:
            raise ValueError(f"found the file {_checks.shown(name)} for logs of {len(chosen)} worlds, expected a name with "
                             "{}, which stands for the number of the world")
        starts = [(name.replace("{}", str(i)), partial(self._core.start_log, i)) for i in chosen]
        return started(starts, every, models, compression, ranges)

    def render(self, index: int, width: int = 640, height: int = 480, *, center: tuple[float, float] | None = None,
               scale: float | None = None, data: bool = True) -> Pixels:
        """Renders world `index` from above: see World.render()."""
        i = self._index(index)
        return rendered(lambda w, h: self._core.fit(i, w, h), lambda *args: self._core.render(i, *args), width, height,
                        center, scale, data)

    def _reads_cuda(self) -> bool:
        return self._core.device_crowd is not None and self._core.device_crowd.reads_cuda

    def _index(self, index: int) -> int:
        i = _checks.integer(index, "the number of a world", -MAX_WORLDS)
        if not -self.n <= i < self.n:
            raise IndexError(f"found the number of a world {i}, expected {-self.n} to {self.n - 1}")
        return i % self.n

    def _chosen(self, ids: Which) -> Numbers:
        if ids is None:
            return self._all
        array = np.atleast_1d(np.asarray(ids))
        if array.dtype == bool and array.shape != (self.n,):
            raise IndexError(f"found a mask of shape {array.shape}, expected ({self.n},)")
        if array.size and array.dtype.kind not in "biu":
            raise TypeError(f"found numbers of worlds of the type {array.dtype}, expected whole numbers, or a mask")
        chosen = self._all[array if array.size else array.astype(int)]
        is_sorted = array.dtype == bool or bool((chosen[1:] > chosen[:-1]).all())  # faster than looking for doubles
        if not is_sorted and len(np.unique(chosen)) < len(chosen):
            raise IndexError("found the same world twice")
        return chosen

    def __repr__(self) -> str:
        return f"<Batch of {self.n} worlds of {len(self)} robots>"


def _columns_of(recipe: Recipe) -> tuple[list[tuple[int, int, int]], list[str]]:
    """Models, sensors and places of the numbers of which each world with a recipe has its own, and their properties."""
    return ([(column.model, column.sensor, column.element) for column in recipe.columns],
            [column.property for column in recipe.columns])


def _set_values(core: _core.Batch, variants: list[int], values: list[list[float]]) -> None:
    """Gives all worlds of a new batch the variants and values of another one."""
    most = max(map(len, values))
    if most > 0:
        padded = np.array([[*own, *[np.nan] * (most - len(own))] for own in values])
        core.reset(np.arange(len(values), dtype=np.uint32), None, np.array(variants, np.uint32), padded)


def _unpickle_batch(cls: type[Batch], recipes: list[Recipe], seeds: list[int], variants: list[int], threads: int,
                    ids: Ids, names: tuple[str, ...], states: _States, device: str | None,
                    things: tuple[Ids, tuple[str, ...]], patterns: tuple[str | None, str | None],
                    scenes: SceneVariants, next_variants: Mapping[int, int], variation: Variation,
                    values: list[list[float]]) -> Batch:
    """Unpickles a batch."""
    prototypes = [World._from_recipe(recipe._replace(options={**recipe.options, "threads": 1}))
                  for recipe in recipes]
    batch = cls.__new__(cls)
    # Worlds that share a scene on a device are made from the first variant.
    made = 1 if device is not None and scenes.count_fixed == 1 else len(recipes)
    core = _core.Batch([prototype._core for prototype in prototypes[:made]], seeds,
                       [0 if made == 1 or recipes[number].columns else number for number in variants], threads,
                       ids[:made], device_choice(device), list(things[1]))
    for number, recipe in enumerate(recipes):
        if recipe.columns:
            core.set_prototype(number, prototypes[number]._core, ids[number], *_columns_of(recipe))
    _set_values(core, variants, values)
    batch._take(core, len(seeds), names, recipes, ids, things, device, patterns, scenes, next_variants, variation)
    batch._put(states)
    return batch
